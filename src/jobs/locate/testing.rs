//! A small made-up scene for tests, and photos of it and of another one.

use std::path::{Path, PathBuf};

use super::{LocatedPhoto, PhotoPlace};
use crate::io::trained::SceneCamera;
use crate::jobs::Scene;
use crate::pipeline::locate::testing;
use crate::render::{Features, Renderer};
use crate::scene::Camera;

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
        let cameras = (0..16).map(|i| testing::at(f64::from(i) / 16.0 * std::f64::consts::TAU, 2.2, 3.6));
        let camera = |(i, camera)| SceneCamera { name: format!("{i}.png"), camera, held_out: false };
        let (cloud, path) = (testing::scene(1), self.folder.path().join("scene"));
        Scene {
            path,
            cloud,
            cameras: cameras.enumerate().map(camera).collect(),
            settings: testing::settings(),
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
        bias: [0.0; 3],
        center_deviation: Some(0.012),
        rotation_deviation_deg: Some(0.1),
        covariance: None,
    };
    LocatedPhoto { photo: path.into(), located: true, place: Some(place), problem: None, notes: Vec::new(), secs: 1.0 }
}

/// Camera that took the photo.
pub(crate) fn truth() -> Camera {
    testing::at(0.47, 2.5, 3.3)
}

/// Writes a photo of the scene of this seed.
pub(crate) fn photo_of(path: &Path, seed: u64) {
    let camera = truth();
    let frame =
        Renderer::new().render(&testing::scene(seed), Features::NONE, &camera, &testing::settings()).expect("renders");
    let byte = |v: f32| (v * 255.0).round().clamp(0.0, 255.0) as u8;
    let pixel = |x: u32, y: u32| {
        let i = (y * camera.width_px + x) as usize;
        image::Rgb([0, 1, 2].map(|c| byte(frame.color[c][i])))
    };
    image::RgbImage::from_fn(camera.width_px, camera.height_px, pixel).save(path).expect("written");
}
