//! Comparison of single-precision results with the f64 oracle: values whose pixels stay clear of
//! every cut-off (interior) are held tightly, those near one (boundary) statistically. Splatting
//! has hard cut-offs, and a splat that falls on the other side of one by rounding is no fault.

use fmlgs::math::{Real, stats};
use fmlgs::render::cpu::project::{CameraView, compensation, geometry};
use fmlgs::render::{ALPHA_MAX, ALPHA_MIN, RenderSettings, TRANSMITTANCE_MIN};
use fmlgs::scene::{Camera, GaussianCloud};

/// Bounds of the difference between results.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// A value mismatches if it differs by more than `absolute * rms + relative * |value|`.
    pub absolute: f64,
    pub relative: f64,
    /// Largest share of mismatches.
    pub mismatches: f64,
    /// Smallest cosine between the two vectors.
    pub cosine: f64,
    /// Largest |sum of differences| over the sum of magnitudes.
    pub bias: f64,
}

/// For values clear of every cut-off.
pub const INTERIOR: Bounds =
    Bounds { absolute: 1e-3, relative: 2e-3, mismatches: 1e-3, cosine: 1.0 - 1e-6, bias: 2e-4 };
/// For values near one.
pub const BOUNDARY: Bounds = Bounds { absolute: 2e-2, relative: 2e-2, mismatches: 0.1, cosine: 0.999, bias: 1e-2 };

/// Returns an error with the deviation unless `ours` agrees with `oracle` at the places where `chosen`.
pub fn agree(name: &str, ours: &[f32], oracle: &[f64], chosen: &[bool], bounds: Bounds) -> Result<(), String> {
    if ours.len() != oracle.len() || ours.len() != chosen.len() {
        return Err(format!("{name}: {} values, oracle {}, mask {}", ours.len(), oracle.len(), chosen.len()));
    }
    let pairs: Vec<(f64, f64)> = (0..ours.len()).filter(|&i| chosen[i]).map(|i| (ours[i].f64(), oracle[i])).collect();
    if pairs.is_empty() {
        return Err(format!("{name}: nothing was compared"));
    }
    if let Some((a, _)) = pairs.iter().find(|(a, _)| !a.is_finite()) {
        return Err(format!("{name}: {a}"));
    }
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|&(a, b)| f(a, b)).sum::<f64>();
    let n = pairs.len() as f64;
    let rms = (sum(&|_, b| b * b) / n).sqrt();
    let allowed = |b: f64| bounds.absolute * rms + bounds.relative * b.abs();
    let mismatches = sum(&|a, b| f64::from(u8::from((a - b).abs() > allowed(b)))) / n;
    let norms = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    let cosine = if norms > 0.0 { sum(&|a, b| a * b) / norms } else { 1.0 };
    let magnitude = sum(&|_, b| b.abs());
    let bias = if magnitude > 0.0 { sum(&|a, b| a - b).abs() / magnitude } else { sum(&|a, _| a.abs()) };
    if mismatches > bounds.mismatches || cosine < bounds.cosine || bias > bounds.bias {
        let worst = stats::worst(pairs.iter().map(|(a, b)| (a - b).abs()));
        return Err(format!(
            "{name}: {} values, mismatches {mismatches:.2e}, 1 - cosine {:.2e}, bias {bias:.2e}, worst {worst:.2e}, rms {rms:.2e}",
            pairs.len(),
            1.0 - cosine
        ));
    }
    Ok(())
}

/// Pixels and Gaussians that lie near a cut-off.
pub struct Bands {
    pub pixels: Vec<bool>,
    pub gaussians: Vec<bool>,
}

/// Finds them by evaluating every Gaussian at every pixel. `alpha` and transmittance within
/// `margin` of a cut-off (relative), or of the median's one half, make a pixel boundary; a
/// Gaussian is boundary if it is drawn in such a pixel.
pub fn bands(cloud: &GaussianCloud<f64>, camera: &Camera, settings: &RenderSettings, margin: f64) -> Bands {
    let view = CameraView::<f64>::new(camera, cloud.origin, settings);
    let [w, h] = [camera.width_px as usize, camera.height_px as usize];
    let mut splats = Vec::new();
    for i in 0..cloud.len() {
        let gaussian = cloud.gaussian(i);
        let Some(g) = geometry(&gaussian, &view) else { continue };
        let opacity = gaussian.opacity_logit.sigmoid() * if settings.antialias { compensation(&g) } else { 1.0 };
        let mean: [f64; 2] = std::array::from_fn(|a| view.focal[a] * g.local[a] / g.local[2] + view.principal[a]);
        let det = g.determinants[1];
        let conic = [g.covariance[2] / det, -g.covariance[1] / det, g.covariance[0] / det];
        splats.push((g.local[2], i, opacity, mean, conic));
    }
    splats.sort_by(|a, b| a.0.total_cmp(&b.0));
    let near = |value: f64, cut: f64| (value / cut - 1.0).abs() < margin;
    let mut out = Bands { pixels: vec![false; w * h], gaussians: vec![false; cloud.len()] };
    for p in 0..w * h {
        let center = [(p % w) as f64 + 0.5, (p / w) as f64 + 0.5];
        let mut left = 1.0;
        let mut drawn = Vec::new();
        for &(_, i, opacity, mean, [a, b, c]) in &splats {
            let d = [center[0] - mean[0], center[1] - mean[1]];
            let q = a * d[0] * d[0] + 2.0 * b * d[0] * d[1] + c * d[1] * d[1];
            let alpha = (opacity * (-0.5 * q).exp()).min(ALPHA_MAX);
            if near(alpha, ALPHA_MIN) || near(alpha, ALPHA_MAX) && alpha < ALPHA_MAX {
                out.pixels[p] = true;
                drawn.push(i);
                continue;
            }
            if alpha < ALPHA_MIN {
                continue;
            }
            let next = left * (1.0 - alpha);
            drawn.push(i);
            if near(next, TRANSMITTANCE_MIN) || near(next, 0.5) {
                out.pixels[p] = true;
            }
            if next < TRANSMITTANCE_MIN {
                break;
            }
            left = next;
        }
        if out.pixels[p] {
            drawn.iter().for_each(|&i| out.gaussians[i] = true);
        }
    }
    out
}

/// Checks `ours` in both bands. There must be an interior; a scene need not come near any cut-off.
pub fn agree_in_bands(name: &str, ours: &[f32], oracle: &[f64], boundary: &[bool]) -> Result<(), String> {
    let interior: Vec<bool> = boundary.iter().map(|b| !b).collect();
    agree(&format!("{name} (interior)"), ours, oracle, &interior, INTERIOR)?;
    if !boundary.contains(&true) {
        return Ok(());
    }
    agree(&format!("{name} (boundary)"), ours, oracle, boundary, BOUNDARY)
}

/// `each` repeated for every value of a Gaussian or pixel.
pub fn spread(each: &[bool], values: usize) -> Vec<bool> {
    each.iter().flat_map(|&b| std::iter::repeat_n(b, values)).collect()
}
