//! Measures how well photos are located: held-out photos of a scene, whose poses are hidden, and photos of other things.

mod changes;

use std::path::PathBuf;
use std::time::Instant;

use glam::{DMat3, DVec2, DVec3};
use rand::SeedableRng;
use serde::Serialize;

use self::changes::{PhotoChange, noise};
use super::{LocateJob, LocateOptions};
use crate::io;
use crate::io::IoError;
use crate::jobs::held_out::held_out;
use crate::jobs::{JobError, Scene, open};
use crate::math::stats::{median, quantile};
use crate::navigate::pose::angle;
use crate::pipeline::locate::{FocalKnowledge, FoundPlace, LocateError, PHOTO_PX};
use crate::pipeline::observer::{Observer, Ticker};
use crate::scene::{Camera, Dataset, PhotoPixels};

/// Bounds of the center's error (shares of the scene's radius) and of the rotation's (degrees): of a good pose, and of
/// one that is right.
const BOUNDS: [(f64, f64); 2] = [(0.005, 0.3), (0.02, 1.0)];
/// Photos of another data set at most.
const MOST_OTHERS: usize = 64;
/// Pictures of noise of each kind: white, and with spots of about so many px.
const NOISES: usize = 8;
const SPOTS_PX: [usize; 3] = [1, 8, 40];

/// Choices for the measurement.
#[derive(Clone, Debug, Default)]
pub(crate) struct LocateCheckOptions {
    /// Data set of something else, none of whose photos should be accepted.
    pub(crate) others: Option<PathBuf>,
    /// True to hide the focal lengths, too.
    pub(crate) unknown_focal: bool,
    /// True to locate changed copies of the held-out photos, too.
    pub(crate) changes: bool,
}

/// A picture that was located, without its pose.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CheckedPicture {
    pub(crate) name: String,
    pub(crate) accepted: bool,
    pub(crate) explained: f64,
    pub(crate) correlation: f64,
    pub(crate) agreeing: usize,
    pub(crate) secs: f64,
}

/// A photo whose pose was hidden.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CheckedPhoto {
    #[serde(flatten)]
    pub(crate) picture: CheckedPicture,
    /// Error of the center, in radii of the scene.
    pub(crate) center_error: f64,
    pub(crate) rotation_error_deg: f64,
    /// Ratio of the focal length found to the true one.
    pub(crate) focal_ratio: f64,
    /// Standard deviation of the center that was told, in radii of the scene.
    pub(crate) center_deviation: Option<f64>,
    pub(crate) rotation_deviation_deg: Option<f64>,
}

/// Medians, 95 % quantiles and counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct CheckSummary {
    pub(crate) photos: usize,
    pub(crate) accepted: usize,
    /// Photos within 0.5 % and 0.3 degrees, and within 2 % and 1 degree.
    pub(crate) within_bounds: [usize; 2],
    /// Accepted photos whose pose is not within the wider bounds.
    pub(crate) accepted_wrongly: usize,
    /// Median and 95 % quantile, in radii of the scene.
    pub(crate) center_error: [f64; 2],
    pub(crate) rotation_error_deg: [f64; 2],
    pub(crate) secs: [f64; 2],
    pub(crate) others: usize,
    pub(crate) others_accepted: usize,
    pub(crate) noises: usize,
    pub(crate) noises_accepted: usize,
}

/// Copies of the held-out photos with one change.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CheckedChange {
    pub(crate) change: &'static str,
    pub(crate) photos: Vec<CheckedPhoto>,
    pub(crate) summary: CheckSummary,
}

/// Result of the measurement.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LocateCheck {
    pub(crate) photos: Vec<CheckedPhoto>,
    pub(crate) changes: Vec<CheckedChange>,
    /// Pictures that do not show the scene.
    pub(crate) others: Vec<CheckedPicture>,
    pub(crate) noises: Vec<CheckedPicture>,
    pub(crate) summary: CheckSummary,
    /// Largest distance of a training camera from the middle of all, scene units.
    pub(crate) radius: f64,
    /// Seconds of looking at the scene, once for all photos.
    pub(crate) prepare_secs: f64,
}

impl LocateJob {
    /// Locates one held-out photo; `None` if it shows nothing.
    fn check(
        &mut self,
        dataset: &Dataset,
        index: usize,
        change: Option<PhotoChange>,
        unknown_focal: bool,
        observer: &dyn Observer,
    ) -> Result<Option<CheckedPhoto>, JobError> {
        let photo = &dataset.photos[index];
        let start = Instant::now();
        let pixels = match io::photo::load(photo, PHOTO_PX) {
            Err(IoError::NothingShown { .. }) => return Ok(None),
            pixels => pixels?,
        };
        let mut truth = photo.camera.resized(pixels.width_px, pixels.height_px);
        let mut pixels = pixels;
        if let Some(change) = change {
            (pixels, truth) = change.of(&pixels, &truth, index as u64);
        }
        let unknown_focal = unknown_focal || change.is_some_and(PhotoChange::hides_focal);
        let (picture, found) = self.located(photo.name.clone(), &pixels, &truth, unknown_focal, start, observer)?;
        let turn = angle(&found.camera.world_from_camera, &truth.world_from_camera);
        let deviations = found.deviations();
        Ok(Some(CheckedPhoto {
            picture,
            center_error: found.camera.center.distance(truth.center) / self.radius,
            rotation_error_deg: turn.to_degrees(),
            focal_ratio: found.camera.focal_px.x / truth.focal_px.x,
            center_deviation: deviations.map(|d| d.0 / self.radius),
            rotation_deviation_deg: deviations.map(|d| d.1),
        }))
    }

    /// Locates a picture by a camera without its pose; the time counts from `start`.
    fn located(
        &mut self,
        name: String,
        pixels: &PhotoPixels,
        truth: &Camera,
        unknown_focal: bool,
        start: Instant,
        observer: &dyn Observer,
    ) -> Result<(CheckedPicture, FoundPlace), LocateError> {
        let (lens, focal) = self.hidden(truth, unknown_focal);
        let found = self.locator.locate(pixels, &lens, focal, observer)?;
        let picture = CheckedPicture {
            name,
            accepted: found.accepted,
            explained: found.explained,
            correlation: found.correlation,
            agreeing: found.agreeing,
            secs: start.elapsed().as_secs_f64(),
        };
        Ok((picture, found))
    }

    /// The camera without its pose, and without its focal length if that is to be hidden.
    fn hidden(&self, truth: &Camera, unknown_focal: bool) -> (Camera, FocalKnowledge) {
        let blank = Camera { world_from_camera: DMat3::IDENTITY, center: DVec3::ZERO, ..truth.clone() };
        if !unknown_focal {
            return (blank, FocalKnowledge::Known);
        }
        let longer = f64::from(truth.width_px.max(truth.height_px));
        let focal_px = DVec2::splat(self.locator.usual_focal_sides() * longer);
        let principal_px = DVec2::new(f64::from(truth.width_px), f64::from(truth.height_px)) * 0.5;
        (Camera { focal_px, principal_px, ..blank }, FocalKnowledge::Unknown)
    }

    fn check_other(
        &mut self,
        name: String,
        pixels: &PhotoPixels,
        truth: &Camera,
        unknown_focal: bool,
        observer: &dyn Observer,
    ) -> Result<Option<CheckedPicture>, JobError> {
        match self.located(name, pixels, truth, unknown_focal, Instant::now(), observer) {
            Err(LocateError::TooSmall(..)) => Ok(None),
            found => Ok(Some(found?.0)),
        }
    }
}

/// Locates the held-out photos of a scene, pictures of noise, and photos of something else.
pub(crate) fn run(
    scene: &Scene,
    options: &LocateOptions,
    check: &LocateCheckOptions,
    observer: &mut dyn Observer,
) -> Result<LocateCheck, JobError> {
    let photos = scene.photos(options.dataset.as_deref())?;
    let dataset = open::dataset(&photos)?;
    let dataset = dataset.with_alpha(scene.config.alpha);
    let held = held_out(&dataset, &scene.cameras, None, scene.config.holdout_every);
    let Some(&first) = held.first() else { return Err(JobError::NothingHeldOut(photos)) };
    let others = check.others.as_deref().map(open::dataset).transpose()?;
    let mut job = LocateJob::new(scene, options, observer)?;
    let hide = check.unknown_focal;

    let kinds: Vec<Option<PhotoChange>> =
        std::iter::once(None).chain(PhotoChange::ALL.into_iter().filter(|_| check.changes).map(Some)).collect();
    let mut ticker = Ticker::new("Locating held-out photos", kinds.len() * held.len());
    let mut checked = Vec::with_capacity(held.len());
    let mut changed = Vec::new();
    for (kind, change) in kinds.into_iter().enumerate() {
        let mut photos = Vec::with_capacity(held.len());
        for (done, &index) in held.iter().enumerate() {
            ticker.proceed(observer)?;
            photos.extend(job.check(&dataset, index, change, hide, observer)?);
            ticker.report((kind * held.len() + done) as u64 + 1, observer);
        }
        match change {
            None => checked = photos,
            Some(change) => {
                let summary = summary(&photos, &[], &[]);
                changed.push(CheckedChange { change: change.name(), photos, summary });
            }
        }
    }

    let camera = dataset.photos[first].camera.limited_to(PHOTO_PX);
    let mut ticker = Ticker::new("Refusing noise", SPOTS_PX.len() * NOISES);
    let mut noises = Vec::new();
    for (kind, spot_px) in SPOTS_PX.into_iter().enumerate() {
        for k in 0..NOISES {
            ticker.tick(kind * NOISES + k, observer)?;
            let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64((kind * NOISES + k) as u64);
            let (width_px, height_px) = (camera.width_px, camera.height_px);
            let rgb = noise((width_px as usize, height_px as usize), spot_px, &mut rng);
            let pixels = PhotoPixels { width_px, height_px, rgb, coverage: None, alpha: None };
            let name = format!("noise of {spot_px} px, {k}");
            noises.extend(job.check_other(name, &pixels, &camera, hide, observer)?);
        }
    }

    let mut refused = Vec::new();
    if let Some(others) = &others {
        let every = others.photos.len().div_ceil(MOST_OTHERS).max(1);
        let mut ticker = Ticker::new("Refusing other photos", others.photos.len().div_ceil(every));
        for (done, photo) in others.photos.iter().step_by(every).enumerate() {
            ticker.tick(done, observer)?;
            let pixels = io::photo::load(photo, PHOTO_PX)?;
            let truth = photo.camera.resized(pixels.width_px, pixels.height_px);
            refused.extend(job.check_other(photo.name.clone(), &pixels, &truth, hide, observer)?);
        }
    }
    let summary = summary(&checked, &refused, &noises);
    let (radius, prepare_secs) = (job.radius, job.prepare_secs);
    Ok(LocateCheck { photos: checked, changes: changed, others: refused, noises, summary, radius, prepare_secs })
}

fn summary(photos: &[CheckedPhoto], others: &[CheckedPicture], noises: &[CheckedPicture]) -> CheckSummary {
    let is_within =
        |p: &CheckedPhoto, (center, turn): (f64, f64)| p.center_error <= center && p.rotation_error_deg <= turn;
    let both = |of: fn(&CheckedPhoto) -> f64| {
        let values: Vec<f64> = photos.iter().map(of).collect();
        if values.is_empty() { [0.0; 2] } else { [median(&values), quantile(&values, 0.95)] }
    };
    let accepted = |list: &[CheckedPicture]| list.iter().filter(|o| o.accepted).count();
    CheckSummary {
        photos: photos.len(),
        accepted: photos.iter().filter(|p| p.picture.accepted).count(),
        within_bounds: BOUNDS.map(|bounds| photos.iter().filter(|p| is_within(p, bounds)).count()),
        accepted_wrongly: photos.iter().filter(|p| p.picture.accepted && !is_within(p, BOUNDS[1])).count(),
        center_error: both(|p| p.center_error),
        rotation_error_deg: both(|p| p.rotation_error_deg),
        secs: both(|p| p.picture.secs),
        others: others.len(),
        others_accepted: accepted(others),
        noises: noises.len(),
        noises_accepted: accepted(noises),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo(center_error: f64, rotation_error_deg: f64, accepted: bool) -> CheckedPhoto {
        let picture =
            CheckedPicture { name: String::new(), accepted, explained: 1.0, correlation: 1.0, agreeing: 9, secs: 2.0 };
        CheckedPhoto {
            picture,
            center_error,
            rotation_error_deg,
            focal_ratio: 1.0,
            center_deviation: None,
            rotation_deviation_deg: None,
        }
    }

    #[test]
    fn a_wrong_pose_that_was_accepted_is_counted() {
        let photos = [photo(0.001, 0.1, true), photo(0.01, 0.2, true), photo(0.5, 0.2, true), photo(0.5, 9.0, false)];
        let found = summary(&photos, &[], &[]);
        assert_eq!((found.accepted, found.within_bounds, found.accepted_wrongly), (3, [1, 2], 1));
        assert_eq!(summary(&[], &[], &[]), CheckSummary::default());
    }

    #[test]
    fn angles_between_rotations_are_theirs() {
        let turned = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(1.2);
        let angle_deg = |a: &DMat3, b: &DMat3| angle(a, b).to_degrees();
        assert!(angle_deg(&turned, &turned) < 1e-6);
        let more = turned * DMat3::from_rotation_y(0.01);
        assert!((angle_deg(&turned, &more) - 0.01_f64.to_degrees()).abs() < 1e-9);
    }
}
