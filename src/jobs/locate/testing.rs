//! A small made-up scene for tests, and photos of it and of another one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{LocatedPhoto, PhotoPlace};
use crate::io::trained::SceneCamera;
use crate::jobs::Scene;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// A scene whose photo, in a file, nobody posed.
pub(crate) struct TestPlace {
    folder: tempfile::TempDir,
    pub(crate) photo: PathBuf,
}

impl TestPlace {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let photo = folder.path().join("photo.png");
        photo_of(&photo, 1);
        Self { folder, photo }
    }

    /// A photo of something else.
    pub(crate) fn other_photo(&self) -> PathBuf {
        let path = self.folder.path().join("other.png");
        photo_of(&path, 2);
        path
    }

    pub(crate) fn scene(&self) -> Scene {
        let cameras = (0..16).map(|i| at(f64::from(i) / 16.0 * std::f64::consts::TAU, 2.2, 3.6));
        let camera = |(i, camera)| SceneCamera { name: format!("{i}.png"), camera, held_out: false };
        let (cloud, path) = (Arc::new(cloud(1)), self.folder.path().join("scene"));
        Scene {
            path,
            cloud,
            cameras: cameras.enumerate().map(camera).collect(),
            settings: settings(),
            ..Scene::default()
        }
    }
}

/// A photo that was located, in words and numbers alone.
pub(crate) fn found(path: &Path, camera: Camera) -> LocatedPhoto {
    let place = PhotoPlace {
        camera,
        distortion: None,
        explained: 0.9,
        correlation: 0.8,
        agreeing: 40,
        gain: [1.0; 3],
        center_deviation: Some(0.012),
        rotation_deviation_deg: Some(0.1),
        covariance: None,
    };
    LocatedPhoto { photo: path.into(), located: true, place: Some(place), problem: None, notes: Vec::new(), secs: 1.0 }
}

/// Camera that took the photo.
pub(crate) fn truth() -> Camera {
    at(0.47, 2.5, 3.3)
}

/// Writes a photo of the scene of this seed.
pub(crate) fn photo_of(path: &Path, seed: u64) {
    let camera = truth();
    let frame = Renderer::new().render(&cloud(seed), Features::NONE, &camera, &settings()).expect("renders");
    let byte = |v: f32| (v * 255.0).round().clamp(0.0, 255.0) as u8;
    let pixel = |x: u32, y: u32| {
        let i = (y * camera.width_px + x) as usize;
        image::Rgb([0, 1, 2].map(|c| byte(frame.color[c][i])))
    };
    image::RgbImage::from_fn(camera.width_px, camera.height_px, pixel).save(path).expect("written");
}

/// Colored Gaussians of many sizes over a bumpy floor.
fn cloud(seed: u64) -> GaussianCloud {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut v = |scale: f32| rng.random_range(-scale..scale);
    let n = 1500;
    let positions: Vec<[f32; 3]> = (0..n)
        .map(|i| {
            let (x, y) = (v(1.8), v(1.8));
            let hill = 0.5 * (x * 1.9 + seed as f32).sin() * (y * 1.4).cos();
            [x, y, hill + if i % 3 == 0 { 0.2 + v(0.2) } else { 0.0 }]
        })
        .collect();
    GaussianCloud {
        log_scales: (0..n).map(|i| [0; 3].map(|_| v(0.6) - if i % 4 == 0 { 2.1 } else { 2.9 })).collect(),
        quaternions: (0..n).map(|_| [0; 4].map(|_| v(1.0))).collect(),
        opacity_logits: (0..n).map(|_| 2.5 + v(1.0)).collect(),
        sh_degree: 0,
        sh: (0..n).map(|_| [v(1.6), v(1.6), v(1.6)]).collect(),
        positions,
        ..GaussianCloud::default()
    }
}

fn at(turn: f64, height: f64, distance: f64) -> Camera {
    let eye = DVec3::new(distance * turn.cos(), distance * turn.sin(), height);
    Camera::look_at(eye, DVec3::new(0.1, 0.0, 0.0), DVec3::Z, 0.75, 320, 240).expect("valid")
}

fn settings() -> RenderSettings {
    RenderSettings { background: [0.2, 0.25, 0.3], ..RenderSettings::default() }
}
