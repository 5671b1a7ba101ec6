//! The pose of a photo that nobody posed, in a trained scene.
//!
//! 1. **Coarse** ([`gallery`], [`signature`]): small renderings of the training cameras are compared with the photo by
//!    the directions of edges, in four quarter turns and several shifts.
//! 2. **Middle** ([`descriptor`], [`matching`], [`mod@consensus`], [`mod@matched`]): features of the photo are matched
//!    with those of the most alike renderings, whose depth makes them points of the scene; then once more with a
//!    rendering from the pose found. Three points give a pose ([`p3p`]), the one that most matches agree on is kept.
//! 3. **Fine** ([`mod@align`], [`photometric`]): the colors are aligned, from small pictures to larger ones.
//!
//! [`mod@likeness`] then says how much of the photo the scene explains; a photo of something else is refused. If this
//! fails, the photo may be a close-up: the middle part is done again with finer renderings of more cameras, and photo and
//! scene are compared at the size at which the scene is sharp ([`sharpness`]). A pose that is nearly right needs the third
//! part alone ([`nearby`]).

mod align;
mod consensus;
mod corners;
mod descriptor;
mod gallery;
mod gray;
mod likeness;
mod matched;
mod matching;
mod nearby;
mod p3p;
mod photometric;
mod pose;
mod sharpness;
mod signature;

use std::sync::Arc;

use self::align::{Aligned, FocalBounds, STEPS, align};
pub(super) use self::align::{Curvature, curvature};
pub(super) use self::consensus::hold_focal;
use self::descriptor::features;
use self::gallery::{AlikeView, FEATURES_PX, Gallery, MOST_FEATURES};
use self::gray::GrayPlane;
use self::likeness::{COMPARED_PX, Likeness, compared_px, likeness};
use self::matched::{CLOSE_UPS, MatchedPose, ORDINARY, SeenPhoto, matched};
pub(crate) use self::nearby::PoseAligner;
use self::photometric::{PhotoLevel, WIDTH};
pub(super) use self::pose::{PARAMETERS, moved};
use super::observer::{Interrupted, Observer};
use crate::math::cholesky::inverse;
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// Longer side at which photos are loaded to be located, px.
pub(crate) const PHOTO_PX: u32 = FEATURES_PX;
/// Shortest side of a photo in which anything is recognized, px.
const LEAST_PX: u32 = 32;
/// Longer side of the pictures whose colors are aligned, from coarse to fine; the last is the caller's.
const LEVELS_PX: [u32; 2] = [96, 192];
/// Steps at the finest pictures at most: each takes as long as all of the coarse ones, and little is left to do.
const FINEST_STEPS: usize = 6;
/// Usual longer side of the finest pictures, px.
pub(crate) const USUAL_PX: u32 = 400;
/// Views that are aligned without matches.
const WITHOUT_MATCHES: usize = 4;
/// Ratios to the usual focal length that are tried where it is not known.
const FOCALS: [f64; 7] = [1.0, 0.8, 1.25, 0.64, 1.56, 0.5, 2.0];
/// Largest change of a focal length that is nearly known (logarithm): rounded to mm, or cropped by stabilization.
const NEARLY: f64 = 0.15;
/// Largest change of an unknown one from the usual (logarithm).
const AT_MOST: f64 = 1.1;
/// Least share of blocks that the scene explains in a photo of it whose pose matches support: half of the photo may be
/// hidden, and a third of the rest be too blurred.
const EXPLAINED: f64 = 0.35;
/// Least mean correlation of such a photo; that of pictures of other things is 0 but for the alignment's luck.
const CORRELATION: f64 = 0.3;
/// Least share of blocks without such support: luck does not reach it.
const EXPLAINED_ALONE: f64 = 0.6;
/// Share of the blocks of the smallest picture below which nothing larger is aligned without such support.
const HOPEFUL: f64 = 0.25;
/// Pixels whose errors are alike, by which errors of a pose are larger than independent pixels had it.
const CORRELATED_PX: f64 = 25.0;

/// Error of a photo that could not be looked for.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum LocateError {
    #[error(
        "the scene has no cameras, around which photos are looked for; open it with its photos, or give them with --photos"
    )]
    NoCameras,
    #[error("{0} x {1} px are too few to recognize anything; the shorter side needs at least {LEAST_PX} px")]
    TooSmall(u32, u32),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// Knowledge of a photo's focal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FocalKnowledge {
    /// Held.
    Known,
    /// Refined a little.
    Near,
    /// Found with the pose; the lens has the usual one.
    Unknown,
}

/// A pose that was found.
#[derive(Clone, Debug)]
pub(crate) struct FoundPlace {
    /// Of the size of the photo's loaded pixels.
    pub(crate) camera: Camera,
    /// True if the photo shows the scene.
    pub(crate) accepted: bool,
    /// Share of the photo's blocks with structure that the scene explains.
    pub(crate) explained: f64,
    /// Mean correlation of these blocks.
    pub(crate) correlation: f64,
    /// Places of the photo that were found in the scene and agree on the pose.
    pub(crate) agreeing: usize,
    /// Gain of the photo's colors against the rendering's, by channel.
    pub(crate) gain: [f32; 3],
    /// Summand of the photo's colors beside that gain, by channel.
    pub(crate) bias: [f32; 3],
    /// Covariance of move (camera axes, scene units), turn (radians) and logarithm of the focal length; `None` where
    /// the photo does not determine the pose.
    pub(crate) covariance: Option<Curvature>,
}

impl FoundPlace {
    /// Standard deviations of the place (scene units) and the turn (degrees).
    pub(crate) fn deviations(&self) -> Option<(f64, f64)> {
        let c = self.covariance.as_ref()?;
        let of = |first: usize| (first..first + 3).map(|i| c[i][i]).sum::<f64>().max(0.0).sqrt();
        Some((of(0), of(3).to_degrees()))
    }
}

/// A scene in which photos are located, with what was rendered of it before.
pub(crate) struct Locator {
    gallery: Gallery,
    finest_px: u32,
}

impl Locator {
    /// Renders the scene from `cameras`, those that it was trained on. Colors are aligned at `finest_px` at last.
    pub(crate) fn new(
        cloud: Arc<GaussianCloud>,
        settings: &RenderSettings,
        cameras: &[Camera],
        finest_px: u32,
        observer: &mut dyn Observer,
    ) -> Result<Self, LocateError> {
        if cameras.is_empty() {
            return Err(LocateError::NoCameras);
        }
        Ok(Self { gallery: Gallery::new(cloud, settings, cameras, observer)?, finest_px })
    }

    /// The usual focal length of the scene's cameras, in longer sides of their pictures.
    pub(crate) fn usual_focal_sides(&self) -> f64 {
        self.gallery.usual_focal_sides()
    }

    /// Locates a photo of at most [`PHOTO_PX`]; `lens` has its size, lens and any pose.
    pub(crate) fn locate(
        &mut self,
        photo: &PhotoPixels,
        lens: &Camera,
        focal: FocalKnowledge,
        observer: &dyn Observer,
    ) -> Result<FoundPlace, LocateError> {
        let (width, height) = (photo.width_px, photo.height_px);
        if width.min(height) < LEAST_PX {
            return Err(LocateError::TooSmall(width, height));
        }
        let gray = GrayPlane::of_photo(photo);
        let alike = self.gallery.alike(&gray, lens);
        let focals = if focal == FocalKnowledge::Unknown { &FOCALS[..] } else { &FOCALS[..1] };
        let seen = SeenPhoto { features: features(&gray, MOST_FEATURES), lens, focals };
        let found = matched(&mut self.gallery, &seen, &alike, &ORDINARY, observer)?;
        let ordinary = self.settled(photo, lens, focal, found, &alike, observer)?;
        if ordinary.accepted {
            return Ok(ordinary);
        }
        let found = matched(&mut self.gallery, &seen, &alike, &CLOSE_UPS, observer)?;
        if !found.is_supported() {
            return Ok(ordinary);
        }
        let close_up = self.settled(photo, lens, focal, found, &alike, observer)?;
        Ok(if close_up.accepted { close_up } else { ordinary })
    }

    /// The pose after alignment, and whether the photo shows the scene there. Where matches do not support a pose, the
    /// views most alike are tried, too.
    fn settled(
        &mut self,
        photo: &PhotoPixels,
        lens: &Camera,
        focal: FocalKnowledge,
        found: MatchedPose,
        alike: &[AlikeView],
        observer: &dyn Observer,
    ) -> Result<FoundPlace, LocateError> {
        let (is_supported, agreeing) = (found.is_supported(), found.agreeing);
        let mut starts: Vec<Camera> = found.pose.map(|f| f.camera).into_iter().collect();
        if !is_supported {
            starts.extend(alike.iter().take(WITHOUT_MATCHES).map(|view| view.pose.clone()));
        }
        let (aligned, level) = self.aligned(photo, lens, starts, focal, is_supported, observer)?;
        // Small pictures are alike by luck more often: without support, all of the photo's detail must be explained.
        let samples = is_supported.then(|| self.gallery.samples_across(&aligned.camera, &aligned.frame)).flatten();
        let Likeness { explained, correlation } = compare(&aligned, &level, compared_px(samples));
        let accepted = match is_supported {
            true => explained >= EXPLAINED && correlation >= CORRELATION,
            false => explained >= EXPLAINED_ALONE,
        };
        Ok(FoundPlace {
            camera: aligned.camera.resized(photo.width_px, photo.height_px),
            accepted,
            explained,
            correlation,
            agreeing,
            gain: aligned.exposure.gain,
            bias: aligned.exposure.bias,
            covariance: covariance(&aligned.curvature, focal),
        })
    }

    /// The best of the poses after alignment, and the photo at that size.
    fn aligned(
        &mut self,
        photo: &PhotoPixels,
        lens: &Camera,
        starts: Vec<Camera>,
        focal: FocalKnowledge,
        is_supported: bool,
        observer: &dyn Observer,
    ) -> Result<(Aligned, PhotoLevel), LocateError> {
        let most = match focal {
            FocalKnowledge::Known => None,
            FocalKnowledge::Near => Some(NEARLY),
            FocalKnowledge::Unknown => Some(AT_MOST),
        };
        let sizes: Vec<u32> = LEVELS_PX.into_iter().filter(|px| *px < self.finest_px).chain([self.finest_px]).collect();
        let mut starts = starts;
        let mut last = None;
        for px in sizes {
            let size = lens.limited_to(px);
            let level = PhotoLevel::of(photo, size.width_px as usize, size.height_px as usize);
            let mut best: Option<(Likeness, Aligned)> = None;
            for start in &starts {
                observer.proceed()?;
                let start = start.resized(size.width_px, size.height_px);
                let changed = (start.focal_px.x / size.focal_px.x).ln();
                let bounds: FocalBounds = most.map(|most| [-most - changed, most - changed]);
                let steps = if px == self.finest_px { FINEST_STEPS } else { STEPS };
                let aligned = align(&mut self.gallery, &level, &start, bounds, steps)?;
                let alike = compare(&aligned, &level, COMPARED_PX);
                if best.as_ref().is_none_or(|(most, _)| alike.sum() > most.sum()) {
                    best = Some((alike, aligned));
                }
            }
            let Some((alike, aligned)) = best else { return Err(LocateError::NoCameras) };
            starts = vec![aligned.camera.clone()];
            last = Some((aligned, level));
            if !is_supported && alike.explained < HOPEFUL {
                break;
            }
        }
        last.ok_or(LocateError::NoCameras)
    }
}

/// Likeness of a rendering at its pose, in the photo's exposure, with the photo, at most so large.
fn compare(aligned: &Aligned, level: &PhotoLevel, most_px: usize) -> Likeness {
    let rendered = GrayPlane::of_planes(&aligned.exposure.applied(&aligned.frame.color), level.width);
    likeness(&rendered, &GrayPlane::of_planes(&level.planes, level.width), &level.coverage, most_px)
}

/// Covariance of a pose from the curvature of the loss there.
fn covariance(curvature: &Curvature, focal: FocalKnowledge) -> Option<Curvature> {
    // The loss is in units of its width, and errors of neighboring pixels are alike.
    let scale = CORRELATED_PX / f64::from(WIDTH * WIDTH);
    let mut out = inverse(curvature)?.map(|row| row.map(|v| v * scale));
    if focal == FocalKnowledge::Known {
        out[PARAMETERS - 1][PARAMETERS - 1] = 0.0;
    }
    Some(out)
}

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
