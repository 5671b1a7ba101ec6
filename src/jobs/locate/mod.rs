//! Locates photos that nobody posed in a trained scene.

pub(crate) mod check;
pub(crate) mod kept;
mod lens;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod write;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use self::lens::PhotoLens;
use super::error::chain;
use super::{JobError, Scene, open};
use crate::io;
use crate::io::photo::{is_photo, is_unread};
use crate::math::format;
use crate::pipeline::locate::{FocalKnowledge, FoundPlace, Locator, PHOTO_PX, USUAL_PX};
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::scene::{Camera, Dataset, Distortion, Photo, PhotoExposure, text};

/// Largest longer side at which colors are aligned, px: photos are loaded no larger.
pub(crate) const MOST_PX: u32 = PHOTO_PX;
/// Usual longer side at which colors are aligned, px.
pub(crate) const DEFAULT_PX: u32 = USUAL_PX;

/// Endings of photos, as dialogs take them.
pub(crate) const PICTURES: [&str; 7] = [".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp"];

/// Returns whether a file of this name is a picture, also of a known format that is not read.
pub(crate) fn is_picture(path: &Path) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| is_photo(name) || is_unread(name))
}

/// Last component of a path, as it may be shown.
pub(crate) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    text::line(&name.to_string_lossy()).into_owned()
}

/// Choices for locating photos.
#[derive(Clone, Debug)]
pub(crate) struct LocateOptions {
    /// Focal length of the photos at full size, px.
    pub(crate) focal_px: Option<f64>,
    /// Longer side at which colors are aligned at last, px.
    pub(crate) finest_px: u32,
    /// Data set of the scene; else the one it was trained on, if that is still there.
    pub(crate) dataset: Option<PathBuf>,
}

/// A photo and what was found of it.
#[derive(Clone, Debug, Serialize)]
pub struct LocatedPhoto {
    pub(crate) photo: PathBuf,
    /// True if it shows the scene, and `place` is where it was taken.
    pub(crate) located: bool,
    /// `None` if it could not be looked for.
    pub(crate) place: Option<PhotoPlace>,
    /// Reason for which it was not located.
    pub(crate) problem: Option<String>,
    /// Remarks, for example on its focal length.
    pub(crate) notes: Vec<String>,
    pub(crate) secs: f64,
}

/// The place at which a photo was taken, or the most likely one.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PhotoPlace {
    /// The pinhole camera at the photo's full size.
    pub(crate) camera: Camera,
    /// Lens of the file relative to that pinhole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) distortion: Option<Distortion>,
    /// Share of the photo's blocks with structure that the scene explains.
    pub(crate) explained: f64,
    /// Mean correlation of these blocks.
    pub(crate) correlation: f64,
    /// Places of the photo that were found in the scene and agree on the pose.
    pub(crate) agreeing: usize,
    /// Gain of its colors against the scene's, by channel.
    pub(crate) gain: [f32; 3],
    /// Summand of its colors beside that gain, by channel.
    pub(crate) bias: [f32; 3],
    /// Standard deviation of the center, scene units.
    pub(crate) center_deviation: Option<f64>,
    /// Standard deviation of the rotation, degrees.
    pub(crate) rotation_deviation_deg: Option<f64>,
    /// Covariance of move along the camera's axes (scene units), turn about them (radians) and logarithm of the focal
    /// length.
    pub(crate) covariance: Option<[[f64; 7]; 7]>,
}

impl PhotoPlace {
    fn of(found: &FoundPlace, photo: &Photo) -> Self {
        let full = &photo.camera;
        let deviations = found.deviations();
        Self {
            camera: found.camera.resized(full.width_px, full.height_px),
            distortion: photo.distortion,
            explained: found.explained,
            correlation: found.correlation,
            agreeing: found.agreeing,
            gain: found.gain,
            bias: found.bias,
            center_deviation: deviations.map(|d| d.0),
            rotation_deviation_deg: deviations.map(|d| d.1),
            covariance: found.covariance,
        }
    }

    /// "93 % explained".
    pub(crate) fn share_text(&self) -> String {
        format!("{:.0} % explained", 100.0 * self.explained)
    }

    /// "\u{b1} 0.8 cm and 0.05\u{b0}", standard deviations; `None` where the photo does not determine its place.
    pub(crate) fn deviation_text(&self, meters_per_unit: Option<f64>) -> Option<String> {
        let (center, turn_deg) = self.center_deviation.zip(self.rotation_deviation_deg)?;
        let turn = if turn_deg < 0.005 { "0.01".to_owned() } else { format!("{turn_deg:.2}") };
        Some(format!("\u{b1} {} and {turn}\u{b0}", format::length(center, meters_per_unit)))
    }
}

impl LocatedPhoto {
    /// Name of the file.
    pub(crate) fn name(&self) -> String {
        file_name(&self.photo)
    }

    /// The photo with its camera and lens, if it was located.
    pub(crate) fn posed(&self) -> Option<Photo> {
        let place = self.place.as_ref().filter(|_| self.located)?;
        Some(Photo { distortion: place.distortion, ..Photo::new(self.name(), &*self.photo, place.camera.clone()) })
    }

    /// Exposure of its colors beside the scene's; the usual one if nothing is known of it.
    pub(crate) fn exposure(&self) -> PhotoExposure {
        let of =
            |place: &PhotoPlace| PhotoExposure { gain: place.gain.map(f64::from), bias: place.bias.map(f64::from) };
        self.place.as_ref().map(of).unwrap_or_default()
    }

    /// Sentence on why it was not located.
    pub(crate) fn refusal_text(&self) -> String {
        let why = self.problem.as_deref().unwrap_or_default();
        format!("No place was found for {}: {}.", self.name(), why.trim_end_matches('.'))
    }
}

/// A scene that photos are located in, opened once for all of them.
pub(crate) struct LocateJob {
    locator: Locator,
    cameras: Vec<Camera>,
    dataset: Option<Arc<Dataset>>,
    /// Largest distance of a camera from the middle of all, scene units.
    pub(crate) radius: f64,
    /// Seconds of looking at the scene, once.
    pub(crate) prepare_secs: f64,
}

impl LocateJob {
    /// Looks at the scene from the cameras that it was trained on.
    pub(crate) fn new(scene: &Scene, options: &LocateOptions, observer: &mut dyn Observer) -> Result<Self, JobError> {
        let path = options.dataset.clone().or_else(|| scene.dataset_path.clone());
        let dataset = match (path, &options.dataset) {
            (Some(path), Some(_)) => Some(open::dataset(&path)?),
            // Without its photos, a scene still has its cameras.
            (Some(path), None) => open::dataset(&path).ok(),
            (None, _) => None,
        };
        let dataset = dataset.map(|d| Arc::new(d.with_alpha(scene.config.alpha).into_owned()));
        let known = match (&dataset, scene.cameras.is_empty()) {
            (Some(dataset), true) => open::cameras(dataset, scene.config.holdout_every),
            _ => scene.cameras.clone(),
        };
        // Photos that are located to measure with must not be known.
        let trained_on: Vec<Camera> = known.iter().filter(|c| !c.held_out).map(|c| c.camera.clone()).collect();
        let cameras = if trained_on.is_empty() { known.into_iter().map(|c| c.camera).collect() } else { trained_on };
        let settings = match &dataset {
            Some(dataset) => scene.settings_beside(dataset),
            None => scene.settings.clone(),
        };
        let start = Instant::now();
        let locator = Locator::new(Arc::clone(&scene.cloud), &settings, &cameras, options.finest_px, observer)?;
        let prepare_secs = start.elapsed().as_secs_f64();
        let (middle, extent) = Camera::extent_of(cameras.iter());
        let farthest = cameras.iter().map(|c| c.center.distance(middle)).fold(0.0, f64::max);
        let radius = if farthest > 0.0 { farthest.min(extent) } else { extent };
        Ok(Self { locator, cameras, dataset, radius, prepare_secs })
    }

    /// Locates one photo. What is wrong with the photo is part of the answer.
    ///
    /// # Errors
    /// If the observer asks to stop.
    pub(crate) fn locate(
        &mut self,
        path: &Path,
        options: &LocateOptions,
        observer: &dyn Observer,
    ) -> Result<LocatedPhoto, JobError> {
        let start = Instant::now();
        let mut notes = Vec::new();
        let found = self.look_for(path, options, &mut notes, observer);
        let secs = start.elapsed().as_secs_f64();
        let photo = path.to_path_buf();
        match found {
            Err(error) if error.is_cancelled() => Err(error),
            Err(error) => {
                let problem = Some(chain(&error));
                Ok(LocatedPhoto { photo, located: false, place: None, problem, notes, secs })
            }
            Ok((found, taken)) => {
                let place = Some(PhotoPlace::of(&found, &taken));
                let problem = (!found.accepted).then(|| refusal(&found));
                Ok(LocatedPhoto { photo, located: found.accepted, place, problem, notes, secs })
            }
        }
    }

    fn look_for(
        &mut self,
        path: &Path,
        options: &LocateOptions,
        notes: &mut Vec<String>,
        observer: &dyn Observer,
    ) -> Result<(FoundPlace, Photo), JobError> {
        let usual = self.locator.usual_focal_sides();
        let PhotoLens { photo, focal } =
            lens::of(path, options.focal_px, (&self.cameras, self.dataset.as_deref()), usual, notes)?;
        let found = self.of_photo(&photo, focal, observer)?;
        if found.accepted || focal != FocalKnowledge::Near {
            return Ok((found, photo));
        }
        // A photo that was cropped or zoomed says the focal length of another one.
        let free = lens::unknown(path, &photo.camera, usual);
        let again = self.of_photo(&free, FocalKnowledge::Unknown, observer)?;
        if again.accepted {
            notes.push("its focal length is not the one that was expected: it was found with the pose".into());
            return Ok((again, free));
        }
        Ok((found, photo))
    }

    /// Locates a photo whose camera is right but for the pose.
    fn of_photo(
        &mut self,
        photo: &Photo,
        focal: FocalKnowledge,
        observer: &dyn Observer,
    ) -> Result<FoundPlace, JobError> {
        let pixels = io::photo::load(photo, PHOTO_PX)?;
        let lens = photo.camera.resized(pixels.width_px, pixels.height_px);
        Ok(self.locator.locate(&pixels, &lens, focal, observer)?)
    }
}

/// Reason of a refusal.
fn refusal(found: &FoundPlace) -> String {
    let agreeing = match found.agreeing {
        0 => "no place of it was found in the scene".to_owned(),
        n => format!("{n} places of it agree on a pose"),
    };
    let explained = 100.0 * found.explained;
    format!("it does not show this scene, or too little of it: {agreeing}, and {explained:.0} % of it are explained")
}

/// Locates photos one after another.
pub(crate) fn run(
    scene: &Scene,
    photos: &[PathBuf],
    options: &LocateOptions,
    observer: &mut dyn Observer,
) -> Result<(LocateJob, Vec<LocatedPhoto>), JobError> {
    let mut job = LocateJob::new(scene, options, observer)?;
    let mut ticker = Ticker::new("Locating photos", photos.len());
    let mut found = Vec::with_capacity(photos.len());
    for (done, path) in photos.iter().enumerate() {
        ticker.proceed(observer)?;
        let located = job.locate(path, options, observer)?;
        for note in &located.notes {
            observer.note(Severity::Info, format!("{}: {note}", path.display()));
        }
        found.push(located);
        ticker.report(done as u64 + 1, observer);
    }
    Ok((job, found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;

    #[test]
    fn bad_photos_are_told_one_by_one_and_a_scene_without_cameras_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("text.jpg"), b"no picture").expect("written");
        image::RgbImage::from_pixel(1, 1, image::Rgb([9, 9, 9])).save(at("one.png")).expect("written");
        let camera = Camera::look_at(glam::DVec3::new(0.0, -3.0, 1.0), glam::DVec3::ZERO, glam::DVec3::Z, 0.8, 64, 48);
        let cameras =
            vec![io::trained::SceneCamera { name: "a".into(), camera: camera.expect("valid"), held_out: false }];
        let cloud = crate::scene::GaussianCloud::isotropic(vec![[0.0; 3]], -1.0, 2.0);
        let scene = Scene { cloud: Arc::new(cloud), cameras, ..Scene::default() };
        let options = LocateOptions { focal_px: None, finest_px: 100, dataset: None };
        let photos = ["text.jpg", "one.png", "gone.jpg"].map(at);
        let (_, found) = run(&scene, &photos, &options, &mut Silent).expect("told one by one");
        assert!(found.iter().all(|f| !f.located && f.place.is_none()));
        let problem = |i: usize| found[i].problem.clone().expect("a problem");
        assert!(problem(0).contains("text.jpg"), "{}", problem(0));
        assert!(problem(1).contains("1 x 1 px"), "{}", problem(1));
        assert!(problem(2).contains("gone.jpg"), "{}", problem(2));
        let without = Scene { cameras: Vec::new(), ..scene };
        let refused = run(&without, &photos, &options, &mut Silent).err().expect("refused");
        assert!(refused.to_string().contains("no cameras"), "{refused}");
    }
}
