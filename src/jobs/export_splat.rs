//! Gaussians as a file for other programs, in the format of its name's ending, and the loss: reported, and measured by
//! drawing both.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::{JobError, Scene, export};
use crate::io::splat_format::SplatFormat;
use crate::io::{self, Opened, atomic};
use crate::math::format;
use crate::math::stats::psnr_of;
use crate::measure::studies::views::spread;
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, HomeView};

/// Number of views that are compared.
const VIEWS: usize = 4;
/// Longer side of a compared view, px.
const SIDE_PX: u32 = 480;

/// Cameras and settings to draw the written file with.
#[derive(Clone, Debug, Default)]
pub(crate) struct LossViews {
    /// Cameras of the scene's photos; if there are none, the Gaussians are viewed from all sides.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) settings: RenderSettings,
}

impl LossViews {
    /// Views from all sides.
    pub(crate) fn of_cloud(cloud: &GaussianCloud) -> Self {
        Self { cameras: Vec::new(), settings: RenderSettings::of_mode(cloud.render_mode) }
    }

    /// The scene's own views.
    pub(crate) fn of(scene: &Scene) -> Self {
        Self { cameras: scene.views(), settings: scene.settings.clone() }
    }
}

/// Result of an export.
#[derive(Clone, Debug, Serialize)]
pub struct ExportedSplat {
    pub(crate) path: PathBuf,
    pub(crate) gaussians: usize,
    pub(crate) sh_degree: u8,
    /// Size of the file, or of all of them.
    pub(crate) bytes: u64,
    /// Values that the format rounds; `None` if all numbers are floats.
    pub(crate) rounded: Option<&'static str>,
    /// Values that the format cannot hold.
    pub(crate) left_out: Vec<String>,
    /// Origin of the positions in the file, for scenes far from zero: to be added to them again, in the scene's axes.
    pub(crate) shift: Option<[f64; 3]>,
    /// True if the Gaussians were turned upright, as the format cannot store the up axis of the scene's file.
    pub(crate) turned_upright: bool,
    /// Differences if both are drawn; `None` if that was not asked for.
    pub(crate) drawn: Option<DrawnLoss>,
}

/// Difference between the drawings of two clouds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DrawnLoss {
    pub(crate) views: usize,
    /// PSNR over the pixels of all views, in dB; `None` if the pictures are equal.
    pub(crate) psnr: Option<f64>,
    /// PSNR of the view that differs most, in dB.
    pub(crate) worst_psnr: Option<f64>,
}

impl ExportedSplat {
    /// Returns the report in words, one line per topic.
    pub(crate) fn lines(&self) -> Vec<String> {
        let Self { path, gaussians, sh_degree, bytes, rounded, left_out, shift, turned_upright, drawn } = self;
        let size = format::bytes(*bytes);
        let mut lines = vec![format!(
            "{}: {} Gaussians, SH degree {sh_degree}, {size}",
            path.display(),
            format::count(*gaussians as u64)
        )];
        lines.extend(rounded.map(|what| format!("rounded: {what}")));
        if !left_out.is_empty() {
            lines.push(format!("not stored: {}", left_out.join("; ")));
        }
        lines.extend(shift.map(shift_line));
        if *turned_upright {
            lines.push("turned: upwards is -y in the file, as its format cannot say what is".into());
        }
        lines.extend(drawn.map(|drawn| drawn.line()));
        lines
    }
}

/// Describes the origin of the positions in words.
pub(crate) fn shift_line([x, y, z]: [f64; 3]) -> String {
    format!(
        "shifted: places are relative to ({x}, {y}, {z}), as other viewers hold single precision and would see steps so \
         far from zero; add that to put them back"
    )
}

impl ExportedSplat {
    /// Reports the values that the format rounds and leaves out, and the loss.
    pub(crate) fn tell_loss(&self, observer: &mut dyn Observer) {
        self.lines().into_iter().skip(1).for_each(|line| observer.note(Severity::Info, line));
    }
}

impl DrawnLoss {
    /// Returns the loss in words.
    pub(crate) fn line(&self) -> String {
        let views = format::things(self.views, "view");
        match (self.psnr, self.worst_psnr) {
            (Some(psnr), Some(worst)) => {
                let [psnr, worst] = [psnr, worst].map(format::decibel);
                format!("drawn from {views}: {psnr} PSNR to what was exported, {worst} in the worst")
            }
            _ => format!("drawn from {views}: no loss"),
        }
    }
}

/// Refuses a file before any work is done, as [`export::check`] does, unless its name asks for a format.
pub(crate) fn check(path: &Path, reads: &[&Path]) -> Result<SplatFormat, JobError> {
    export::check(path, &[], reads)?;
    let Some(format) = format_of(path) else {
        return Err(JobError::Output(format!("'{}' must end in one of {}", path.display(), SplatFormat::endings())));
    };
    Ok(format)
}

/// Returns the format of a name; devices and pipes may have any name, and get a `.ply`.
fn format_of(path: &Path) -> Option<SplatFormat> {
    SplatFormat::of(path).or_else(|| atomic::is_stream(path).then_some(SplatFormat::Ply))
}

/// Writes the Gaussians, and compares drawings of them and of the file from some of `views`, if given.
///
/// # Errors
/// If the name has no known format, the file cannot be written, or cannot be read back.
pub(crate) fn run(
    cloud: &Arc<GaussianCloud>,
    path: &Path,
    views: Option<&LossViews>,
    observer: &mut dyn Observer,
) -> Result<ExportedSplat, JobError> {
    let format = check(path, &[])?;
    export::make_parent(path)?;
    write(cloud, format, path, observer)?;
    // A pipe cannot be read back.
    let views = views.filter(|_| !atomic::is_stream(path));
    let prepared = format.prepared(cloud);
    Ok(ExportedSplat {
        path: path.into(),
        gaussians: cloud.len(),
        sh_degree: cloud.sh_degree,
        bytes: format.bytes(path),
        rounded: format.rounding(),
        left_out: format.left_out(&prepared),
        shift: format.shift(&prepared).map(|shift| shift.to_array()),
        turned_upright: matches!(prepared, Cow::Owned(_)),
        drawn: views.map(|views| drawn(&prepared, path, views, observer)).transpose()?,
    })
}

/// Writes the Gaussians, and reports progress.
pub(crate) fn write(
    cloud: &GaussianCloud,
    format: SplatFormat,
    path: &Path,
    observer: &mut dyn Observer,
) -> Result<(), JobError> {
    let mut ticker = Ticker::new("Writing Gaussians", cloud.len());
    let mut stopped = None;
    let written = format.write(path, cloud, &mut |done| {
        ticker.tick(done, observer).map_err(|e| {
            stopped = Some(e);
            std::io::Error::other(e)
        })
    });
    match stopped {
        Some(e) => Err(e.into()),
        None => Ok(written?),
    }
}

/// Compares drawings of the file and of the Gaussians.
fn drawn(
    cloud: &GaussianCloud,
    path: &Path,
    views: &LossViews,
    observer: &mut dyn Observer,
) -> Result<DrawnLoss, JobError> {
    let Opened::Cloud(mut written) = io::open(path)? else {
        return Err(JobError::Output(format!("{} was written, but is no splat when it is read", path.display())));
    };
    // A format that cannot store the shift has positions near zero.
    if written.origin == DVec3::ZERO {
        written.origin = SplatFormat::of(path).and_then(|format| format.shift(cloud)).unwrap_or_default();
    }
    let cameras: Vec<Camera> = match views.cameras.as_slice() {
        [] => HomeView::new(&[], Some(cloud)).around([SIDE_PX, SIDE_PX * 3 / 4], VIEWS),
        all => spread(all, VIEWS).iter().map(|camera| camera.limited_to(SIDE_PX)).collect(),
    };
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Measuring the loss", cameras.len());
    let mut errors = Vec::new();
    for (k, camera) in cameras.iter().enumerate() {
        ticker.tick(k, observer)?;
        let mut draw = |cloud: &GaussianCloud| renderer.render(cloud, Features::NONE, camera, &views.settings);
        let (a, b) = (draw(cloud)?, draw(&written)?);
        // As on a screen.
        let squared = |(a, b): (&f32, &f32)| f64::from(a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)).powi(2);
        let planes = a.color.iter().zip(&b.color);
        let sum: f64 = planes.flat_map(|(a, b)| a.iter().zip(b)).map(squared).sum();
        errors.push(sum / (3 * a.alpha.len().max(1)) as f64);
    }
    ticker.tick(cameras.len(), observer)?;
    let psnr = |error: f64| Some(psnr_of(error)).filter(|db| db.is_finite());
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    Ok(DrawnLoss { views: cameras.len(), psnr: psnr(mean), worst_psnr: psnr(worst) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;
    use crate::scene::{ExtraProperty, SplatRenderMode};

    fn cloud() -> Arc<GaussianCloud> {
        let positions: Vec<[f32; 3]> =
            (0..3000_u16).map(|i| [0.37, 0.71, 0.13].map(|step| (f32::from(i) * step).fract() * 2.0 - 1.0)).collect();
        let n = positions.len();
        let mut cloud = GaussianCloud::isotropic(positions, -3.0, 1.0);
        cloud.sh_degree = 1;
        cloud.sh = (0..4 * n).map(|i| [(i % 7) as f32 / 10.0, 0.2, (i % 5) as f32 / -10.0]).collect();
        cloud.extras = vec![ExtraProperty { name: "fmlgs_identity".into(), values: vec![1.0; n] }];
        Arc::new(cloud)
    }

    #[test]
    fn every_format_tells_what_it_lost() {
        let folder = tempfile::tempdir().expect("folder");
        let cloud = cloud();
        let mut sizes = Vec::new();
        for (name, least, extras) in [
            ("a.ply", f64::INFINITY, true),
            ("a.GLB", 100.0, true),
            ("a.gltf", 100.0, true),
            ("a.compressed.ply", 35.0, false),
            ("a.spz", 35.0, false),
            ("a.sog", 35.0, false),
            ("sog/meta.json", 35.0, false),
            ("a.splat", 15.0, false),
        ] {
            let path = folder.path().join(name);
            let done = run(&cloud, &path, Some(&LossViews::default()), &mut Silent).expect(name);
            let drawn = done.drawn.expect("measured");
            assert_eq!((drawn.views, done.gaussians), (VIEWS, 3000));
            assert!(drawn.psnr.unwrap_or(f64::INFINITY) >= least, "{name}: {drawn:?}");
            assert!(drawn.worst_psnr <= drawn.psnr, "{drawn:?}");
            assert_eq!(done.left_out.iter().any(|what| what == "objects and parts"), !extras, "{name}");
            assert!(name != "a.ply" || drawn.line().contains("no loss"), "{}", drawn.line());
            assert!(drawn.psnr.is_some() || done.rounded.is_none(), "{name} is rounded");
            sizes.push((done.bytes, name));
        }
        assert!(sizes.iter().all(|(bytes, _)| *bytes > 4_000), "{sizes:?}");
        let splat = run(&cloud, &folder.path().join("b.splat"), None, &mut Silent).expect("written");
        assert!(splat.drawn.is_none() && splat.lines().concat().contains("view-dependent color"));
        let surfels = GaussianCloud { render_mode: SplatRenderMode::Surfels, ..(*cloud).clone() };
        let other = ExtraProperty { name: "confidence".into(), values: vec![1.0; 3000] };
        let others = GaussianCloud { extras: vec![other], ..(*cloud).clone() };
        assert_eq!(SplatFormat::Spz.left_out(&others), ["the properties confidence"], "control: another program's");
        assert!(SplatFormat::Spz.left_out(&surfels).concat().contains("surfels"));
        let far = GaussianCloud { origin: glam::DVec3::new(1e6, 0.0, 0.0), ..(*cloud).clone() };
        for (name, kept) in [("far.ply", true), ("far.sog", true), ("far.compressed.ply", true), ("far.splat", false)] {
            let path = folder.path().join(name);
            let done = run(&Arc::new(far.clone()), &path, Some(&LossViews::default()), &mut Silent).expect(name);
            assert_eq!(done.shift, Some([1e6, 0.0, 0.0]), "{name}");
            assert!(done.lines().iter().any(|line| line.contains("(1000000, 0, 0)")), "{:?}", done.lines());
            assert_eq!(done.left_out.concat().contains("where zero is"), !kept, "{name}");
            let Ok(Opened::Cloud(back)) = io::open(&path) else { panic!("{name}") };
            assert_eq!(back.origin.x, if kept { 1e6 } else { 0.0 }, "{name}");
            assert!(done.drawn.is_some_and(|drawn| drawn.psnr.is_none_or(|db| db > 15.0)), "{name}: {:?}", done.drawn);
        }
        assert!(SplatFormat::Glb.shift(&far).is_none(), "nodes say it");
    }

    #[test]
    fn names_that_ask_for_no_format_are_refused_and_what_is_canceled_leaves_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["a.obj", "other.json", "ply", "a.ksplat"] {
            let e = check(&folder.path().join(name), &[]).expect_err(name).to_string();
            assert!(e.contains(".compressed.ply") && e.contains("meta.json"), "{e}");
        }
        for name in ["a.ply", "a.compressed.ply", "a.spz", "a.sog", "meta.json", "a.splat", "a.glb", "a.gltf"] {
            let e = run(&cloud(), &folder.path().join(name), None, &mut StopsAfter::new(0)).expect_err(name);
            assert!(e.is_cancelled(), "{name}: {e}");
        }
        let e = run(&Arc::default(), &folder.path().join("a.spz"), None, &mut Silent).expect_err("empty");
        assert!(e.to_string().contains("no Gaussians"), "{e}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("list").count(), 0);
    }
}
