//! What a scene needs and what is left out, each with its reason and what it saves.

use serde::{Deserialize, Serialize};

use super::{Dataset, GaussianCloud};
use crate::math::{Real, sh};

/// What the machine offers, as far as a plan depends on it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Memory that programs may still use, in bytes.
    pub free_memory_bytes: u64,
    /// Most Gaussians that training may use of it.
    pub max_gaussians: usize,
    /// Processor cores.
    pub cores: usize,
    /// Name of the graphics adapter if it is a real one; `None` where there is none or it is
    /// emulated in software.
    pub gpu: Option<String>,
}

/// One decision about a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanLine {
    /// What is decided: "Colour", "Feature buffers", ...
    pub subject: String,
    /// The decision.
    pub choice: String,
    /// Why.
    pub reason: String,
    /// What it saves, with units; empty where it saves nothing.
    pub saving: String,
}

/// The decisions for a scene, computed from its data and the machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScenePlan {
    /// Highest spherical-harmonics degree worth drawing.
    pub sh_degree: u8,
    /// Most Gaussians that training may use on this machine.
    pub max_gaussians: usize,
    /// The decisions, for people.
    pub lines: Vec<PlanLine>,
}

/// Extra channels per Gaussian once a scene has semantics.
const FEATURE_CHANNELS: u64 = 6;
/// Half a step of an 8-bit picture: smaller changes cannot be seen.
const NOISE_FLOOR: f64 = 0.5 / 255.0;

impl ScenePlan {
    /// The plan for posed photos, a cloud, or both. Training pictures are limited to
    /// `max_side_px`, training colours to degree `sh_degree`.
    pub fn of(
        dataset: Option<&Dataset>,
        cloud: Option<&GaussianCloud>,
        machine: &Machine,
        max_side_px: u32,
        sh_degree: u8,
    ) -> Self {
        let kept = cloud.map_or(sh_degree, visible_degree);
        let max_gaussians = machine.max_gaussians;
        let mut lines = Vec::new();
        match cloud {
            Some(c) => lines.push(color_line(c, kept)),
            None => lines.push(line(
                "Colour",
                format!("SH degree {sh_degree}, opened in steps"),
                "Early training has no use for view-dependent colour",
                format!(
                    "{} of {} coefficients at the start",
                    sh::coefficients(sh_degree) - 1,
                    sh::coefficients(sh_degree)
                ),
            )),
        }
        let gaussians = cloud.map_or(0, GaussianCloud::len) as u64;
        lines.push(line(
            "Feature buffers",
            "off".into(),
            "The scene has no semantics",
            if gaussians > 0 {
                format!("{} of features", bytes(gaussians * FEATURE_CHANNELS * 4))
            } else {
                format!("{} bytes per Gaussian", FEATURE_CHANNELS * 4)
            },
        ));
        lines.push(line(
            "Depth",
            "when asked".into(),
            "Only the depth view and picking a pivot need it",
            "two buffers per picture".into(),
        ));
        if let Some(d) = dataset {
            lines.extend(photo_line(d, max_side_px));
            lines.push(line(
                "Gaussians",
                format!("at most {}", count(max_gaussians as u64)),
                format!("What fits into the {} of free memory", bytes(machine.free_memory_bytes)),
                String::new(),
            ));
        }
        lines.push(match &machine.gpu {
            Some(name) => line("Backend", format!("GPU, {name}"), "A real adapter is present", String::new()),
            None => line(
                "Backend",
                format!("CPU, {} cores", machine.cores),
                "No GPU: the only adapter is emulated or missing",
                String::new(),
            ),
        });
        lines.push(line(
            "Redraw",
            "on change".into(),
            "A still scene needs no new picture",
            "all drawing while nothing moves".into(),
        ));
        Self { sh_degree: kept, max_gaussians, lines }
    }
}

fn line(subject: &str, choice: String, reason: impl Into<String>, saving: String) -> PlanLine {
    PlanLine { subject: subject.into(), choice, reason: reason.into(), saving }
}

/// The lowest degree from which on no band can change any pixel by half an 8-bit step.
///
/// A band of degree `l` adds at most `|c| sqrt((2l + 1) / 4 pi)` to a colour, `c` its coefficients
/// of one channel (Cauchy-Schwarz and the addition theorem). Blending weights sum to at most 1, so
/// the largest such bound over the Gaussians bounds the change of every pixel.
pub fn visible_degree<R: Real>(cloud: &GaussianCloud<R>) -> u8 {
    let stride = cloud.sh_stride();
    let mut bound = [0.0_f64; 4];
    for gaussian in cloud.sh.chunks_exact(stride.max(1)) {
        for degree in 1..=cloud.sh_degree {
            let band = &gaussian[sh::coefficients(degree - 1)..sh::coefficients(degree)];
            let reach = (f64::from(2 * degree + 1) / (4.0 * std::f64::consts::PI)).sqrt();
            for channel in 0..3 {
                let energy: f64 = band.iter().map(|c| c[channel].f64().powi(2)).sum();
                let b = &mut bound[usize::from(degree)];
                *b = b.max(energy.sqrt() * reach);
            }
        }
    }
    let mut left_out = 0.0;
    (1..=cloud.sh_degree)
        .rev()
        .find(|&d| {
            left_out += bound[usize::from(d)];
            left_out >= NOISE_FLOOR
        })
        .unwrap_or(0)
}

fn color_line(cloud: &GaussianCloud, kept: u8) -> PlanLine {
    let dropped = sh::coefficients(cloud.sh_degree) - sh::coefficients(kept);
    if dropped == 0 {
        return line("Colour", format!("SH degree {kept}"), "Every band can be seen", String::new());
    }
    line(
        "Colour",
        format!("SH degree {kept} of {}", cloud.sh_degree),
        "The higher bands change no pixel by half an 8-bit step",
        bytes((cloud.len() * dropped * 12) as u64),
    )
}

fn photo_line(dataset: &Dataset, max_side_px: u32) -> Option<PlanLine> {
    let camera = &dataset.photos.first()?.camera;
    let small = camera.limited_to(max_side_px);
    let size = |w: u32, h: u32| u64::from(w) * u64::from(h) * 3;
    let (w, h) = (small.width_px, small.height_px);
    if (w, h) == (camera.width_px, camera.height_px) {
        return Some(line("Photos", format!("{w} x {h} px"), "Their full size", String::new()));
    }
    let saved: u64 = dataset
        .photos
        .iter()
        .map(|p| {
            let s = p.camera.limited_to(max_side_px);
            size(p.camera.width_px, p.camera.height_px).saturating_sub(size(s.width_px, s.height_px))
        })
        .sum();
    Some(line(
        "Photos",
        format!("{w} x {h} px"),
        format!("Limited to {max_side_px} px; the files have {} x {}", camera.width_px, camera.height_px),
        bytes(saved),
    ))
}

/// A number of bytes for people, in decimal units.
pub fn bytes(n: u64) -> String {
    match n {
        0..1_000 => format!("{n} B"),
        1_000..1_000_000 => format!("{:.0} kB", n as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.0} MB", n as f64 / 1e6),
        _ => format!("{:.1} GB", n as f64 / 1e9),
    }
}

/// A whole number with thousands separators.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Photo};
    use glam::DVec3;

    fn cloud(band_two: f32) -> GaussianCloud {
        let mut sh = vec![[0.0; 3]; 16];
        sh[1] = [0.2; 3];
        sh[5] = [band_two; 3];
        GaussianCloud {
            positions: vec![[0.0; 3]],
            log_scales: vec![[0.0; 3]],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]],
            opacity_logits: vec![0.0],
            sh_degree: 3,
            sh,
            ..GaussianCloud::default()
        }
    }

    #[test]
    fn bands_under_the_noise_floor_are_dropped_and_others_kept() {
        assert_eq!(visible_degree(&cloud(1e-4)), 1);
        assert_eq!(visible_degree(&cloud(0.05)), 2);
    }

    #[test]
    fn dropped_bands_change_no_colour_by_half_a_step() {
        let c = cloud(2.5e-3);
        let kept = visible_degree(&c);
        assert_eq!(kept, 1);
        for i in 0..500 {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 500.0;
            let phi = f64::from(i) * 2.4;
            let r = (1.0 - z * z).sqrt();
            let b = sh::basis(3, [r * phi.cos(), r * phi.sin(), z]);
            let change: f64 = (sh::coefficients(kept)..16).map(|k| b[k] * f64::from(c.sh[k][0])).sum();
            assert!(change.abs() < NOISE_FLOOR, "{change}");
        }
    }

    #[test]
    fn every_line_says_why() {
        let machine = Machine { free_memory_bytes: 8_000_000_000, max_gaussians: 1_234_567, cores: 2, gpu: None };
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 1000, 800).expect("valid");
        let photo =
            Photo { name: "a".into(), path: "a".into(), camera, distortion: None, test_split: false, background: None };
        let dataset = Dataset { photos: vec![photo], ..Dataset::default() };
        let plan = ScenePlan::of(Some(&dataset), Some(&cloud(0.0)), &machine, 500, 3);
        assert!(plan.lines.iter().all(|l| !l.reason.is_empty() && !l.choice.is_empty()));
        let photos = plan.lines.iter().find(|l| l.subject == "Photos").expect("a line on photos");
        assert_eq!((photos.choice.as_str(), photos.saving.as_str()), ("500 x 400 px", "2 MB"));
        let limit = plan.lines.iter().find(|l| l.subject == "Gaussians").expect("a line on the limit");
        assert_eq!(limit.choice, "at most 1,234,567");
    }

    #[test]
    fn numbers_are_readable() {
        assert_eq!(count(1_234_567), "1,234,567");
        assert_eq!(count(999), "999");
        assert_eq!(bytes(1_900), "2 kB");
        assert_eq!(bytes(3_200_000_000), "3.2 GB");
    }
}
