//! Sparse points, as structure from motion would find them.

use glam::{DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use super::options::SynthOptions;
use super::view::SynthView;
use crate::scene::{Camera, SparsePoint};

/// Samples `count` points on surfaces that the photo shows, in its colors, with noise of `point_noise_px` pixels in
/// every direction. Empty if the photo shows no surface.
pub(crate) fn sample(
    view: &SynthView,
    camera: &Camera,
    index: usize,
    count: usize,
    options: &SynthOptions,
) -> Vec<SparsePoint> {
    let mut rng = Pcg32::seed_from_u64(options.seed.wrapping_mul(0x9e37_79b9).wrapping_add(index as u64));
    let width = camera.width_px as usize;
    let seen: Vec<usize> = (0..view.depth.len()).filter(|&i| view.depth[i] > 0.0).collect();
    if seen.is_empty() {
        return Vec::new();
    }
    let point = |_| {
        let pixel = seen[rng.random_range(0..seen.len())];
        let depth = f64::from(view.depth[pixel]);
        let noise = DVec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
        let at = DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let on_surface = camera.center + camera.ray(at) * depth;
        let sigma = options.point_noise_px * depth / camera.focal_px.y;
        SparsePoint { position: on_surface + noise * sigma, rgb: view.rgb[pixel] }
    };
    (0..count).map(point).collect()
}

/// Draws a normally distributed number (Box and Muller).
fn normal(rng: &mut Pcg32) -> f64 {
    let u = 1.0 - rng.random::<f64>();
    let v = rng.random::<f64>();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
