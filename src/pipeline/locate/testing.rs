//! A small made-up scene in which tests locate photos.

use std::sync::Arc;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud};

/// Colored Gaussians of many sizes over a bumpy floor.
pub(crate) fn scene(seed: u64) -> Arc<GaussianCloud> {
    floor(seed, 2500, 0.2, [-2.2, -3.0])
}

/// The same of many more and smaller ones, near the floor: there is something to see from near, too.
pub(crate) fn fine_scene(seed: u64) -> Arc<GaussianCloud> {
    floor(seed, 15_000, 0.05, [-3.2, -4.0])
}

/// Gaussians of two sizes (logarithms) over a floor, a third of them above it by twice `lift` at most.
fn floor(seed: u64, n: usize, lift: f32, [large, small]: [f32; 2]) -> Arc<GaussianCloud> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut v = |scale: f32| rng.random_range(-scale..scale);
    let positions: Vec<[f32; 3]> = (0..n)
        .map(|i| {
            let (x, y) = (v(1.8), v(1.8));
            let hill = 0.5 * (x * 1.9 + seed as f32).sin() * (y * 1.4).cos();
            [x, y, hill + if i % 3 == 0 { lift + v(lift) } else { 0.0 }]
        })
        .collect();
    Arc::new(GaussianCloud {
        log_scales: (0..n).map(|i| [0; 3].map(|_| v(0.6) + if i % 4 == 0 { large } else { small })).collect(),
        quaternions: (0..n).map(|_| [0; 4].map(|_| v(1.0))).collect(),
        opacity_logits: (0..n).map(|_| 2.5 + v(1.0)).collect(),
        sh_degree: 0,
        sh: (0..n).map(|_| [v(1.6), v(1.6), v(1.6)]).collect(),
        positions,
        ..GaussianCloud::default()
    })
}

/// A camera of a ring about the scene.
pub(crate) fn at(turn: f64, height: f64, distance: f64) -> Camera {
    let eye = DVec3::new(distance * turn.cos(), distance * turn.sin(), height);
    Camera::look_at(eye, DVec3::new(0.1, 0.0, 0.0), DVec3::Z, 0.75, 320, 240).expect("valid")
}

pub(crate) fn settings() -> RenderSettings {
    RenderSettings { background: [0.2, 0.25, 0.3], ..RenderSettings::default() }
}
