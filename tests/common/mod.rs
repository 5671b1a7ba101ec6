//! Shared inputs of several integration tests: made-up scenes, cameras, and the paths of real inputs.
#![allow(dead_code, clippy::expect_used)]

use std::path::PathBuf;
use std::process::Command;

use fmlgs::math::Real;
use fmlgs::scene::{Bounds, Camera, GaussianCloud};
use glam::DVec3;
use rand::{RngExt, SeedableRng};

/// An address at which nothing listens. A port that was free a moment ago may be another test's by now.
pub const NOBODY: &str = "http://127.0.0.1:1";

/// The folder of real inputs, or `None` where it is absent.
pub fn data_dir() -> Option<PathBuf> {
    let dir = std::env::var_os("FMLGS_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    dir.is_dir().then_some(dir)
}

/// `name` inside the folder of real inputs; says so and returns `None` where it is absent.
pub fn data(name: &str) -> Option<PathBuf> {
    let path = data_dir().map(|d| d.join(name)).filter(|p| p.exists());
    if path.is_none() {
        println!("skipped: no {name} among the real inputs");
    }
    path
}

/// The input `name` of those made after public reports; says so and returns `None` where they are absent.
pub fn case(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/cases/files").join(name);
    let path = Some(path).filter(|p| p.exists());
    if path.is_none() {
        println!("skipped: no {name} among the inputs of reports");
    }
    path
}

/// A generator for tests.
pub fn rng(seed: u64) -> rand_pcg::Pcg64Mcg {
    rand_pcg::Pcg64Mcg::seed_from_u64(seed)
}

/// `n` Gaussians in the unit ball with scales around `scale` and random everything else.
pub fn random_cloud(n: usize, degree: u8, scale: f64, seed: u64) -> GaussianCloud<f64> {
    let mut r = rng(seed);
    let mut uniform = |lo: f64, hi: f64| r.random_range(lo..hi);
    let stride = fmlgs::math::sh::coefficients(degree);
    let mut cloud = GaussianCloud { sh_degree: degree, ..GaussianCloud::default() };
    for _ in 0..n {
        cloud.positions.push([uniform(-0.8, 0.8), uniform(-0.8, 0.8), uniform(-0.8, 0.8)]);
        let s = scale.ln();
        cloud.log_scales.push([uniform(s - 0.7, s + 0.7), uniform(s - 0.7, s + 0.7), uniform(s - 0.7, s + 0.7)]);
        cloud.quaternions.push([uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.2, 1.0)]);
        cloud.opacity_logits.push(uniform(-1.5, 2.0));
        for k in 0..stride {
            let a = if k == 0 { 1.5 } else { 0.2 };
            cloud.sh.push([uniform(-a, a), uniform(-a, a), uniform(-a, a)]);
        }
    }
    cloud
}

/// A camera that looks at the unit ball.
pub fn camera(width: u32, height: u32) -> Camera {
    Camera::look_at(DVec3::new(1.1, -2.6, 0.9), DVec3::ZERO, DVec3::Z, 0.9, width, height).expect("valid")
}

/// Three cameras around a splat, at different heights and distances.
pub fn three_views(cloud: &GaussianCloud, width: u32, height: u32) -> Vec<Camera> {
    let bounds = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))).expect("not empty");
    let (center, radius) = (bounds.center(), bounds.radius());
    [(0.3_f64, -0.3, 2.2), (2.4, -0.9, 1.6), (4.4, 0.2, 3.0)]
        .into_iter()
        .map(|(angle, height_over, distance)| {
            let eye = center + DVec3::new(angle.cos(), height_over, angle.sin()) * radius * distance;
            Camera::look_at(eye, center, -DVec3::Y, 0.8, width, height).expect("valid")
        })
        .collect()
}

/// PSNR in dB of two pictures' planes, peak 1.
pub fn psnr<A: Real, B: Real>(a: &[Vec<A>], b: &[Vec<B>]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
        sum += (x.f64() - y.f64()).powi(2);
        n += 1.0;
    }
    -10.0 * (sum / n).log10()
}

/// Runs a test that counts what its whole process does in a process of its own: says whether this is that process,
/// and where it is not, starts it and waits. `module` is `module_path!()`.
///
/// # Panics
/// Panics if the test fails there.
#[must_use]
pub fn alone(module: &str, test: &str) -> bool {
    const ALONE: &str = "FMLGS_TEST_ALONE";
    let name = module.split_once("::").map_or_else(|| test.to_owned(), |(_, inner)| format!("{inner}::{test}"));
    if std::env::var(ALONE).is_ok_and(|only| only == name) {
        return true;
    }
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    let done = command.args(["--exact", &name]).env(ALONE, &name).output().expect("it starts");
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success(), "{said}{}", String::from_utf8_lossy(&done.stderr));
    assert!(said.contains("1 passed"), "no test is called {name}:\n{said}");
    false
}
