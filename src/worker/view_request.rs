//! Requests to the drawing thread, and its answers.
//!
//! Views beside the first are other images of one frame, which share its maps, or other Gaussians from the same camera.

use std::sync::Arc;

use super::Versioned;
use super::failure::Failure;
use super::view_modes::ViewMode;
use crate::render::lod::MOVING_SECS;
use crate::render::{DevicePicture, GpuError, RenderSettings, Renderer, StageTimes};
use crate::scene::{Camera, GaussianCloud, PhotoExposure, PhotoPixels, ScenePlan, SemanticMap};

/// Request to draw a view.
#[derive(Clone, Debug)]
pub struct ViewRequest {
    /// The Gaussians.
    pub cloud: Versioned<GaussianCloud>,
    /// The camera at full resolution.
    pub camera: Camera,
    /// Quantity to draw.
    pub mode: ViewMode,
    /// Quantity of the views beside it, if there are any.
    pub second: Option<ViewMode>,
    /// Gaussians of the views beside it, if they are others, and the settings to draw them with.
    pub others: Vec<(Versioned<GaussianCloud>, RenderSettings)>,
    /// Degree of the colors, background, filter. Depth is drawn where it is needed.
    pub settings: RenderSettings,
    /// Time that the frame may take.
    pub budget: QualityBudget,
    /// The photo taken from this camera, for the difference and for PSNR.
    pub photo: Option<Arc<PhotoPixels>>,
    /// Exposure of the photo beside the scene's colors, which is no difference.
    pub exposure: PhotoExposure,
    /// Objects and parts of the Gaussians, whose maps are drawn too once the camera rests.
    pub semantics: Option<Versioned<SemanticMap>>,
    /// True if they are drawn while the camera moves too, at the frame's resolution: masks are on screen.
    pub follow: bool,
    /// True if blended codes are drawn too.
    pub codes: bool,
    /// Passes to leave out.
    pub skip: SkipPasses,
    /// True if the window can paint from the memory of the drawing device: colors of moving frames then stay there.
    pub on_device: bool,
    /// True if the stages are timed where that is not free.
    pub timed: bool,
    /// Number that comes back with the frame.
    pub ticket: u64,
}

impl ViewRequest {
    /// Returns whether both ask for the same frame. Tickets do not count, nor does the device, which is the same as
    /// long as the window is.
    pub(crate) fn is_same_picture(&self, other: &Self) -> bool {
        let others = |request: &Self| request.others.iter().map(|(cloud, _)| cloud.generation()).collect::<Vec<_>>();
        self.shows_same_scene(other)
            && self.camera == other.camera
            && (self.mode, self.second) == (other.mode, other.second)
            && others(self) == others(other)
            && self.settings == other.settings
            && (self.budget, self.skip, self.timed) == (other.budget, other.skip, other.timed)
            && (self.photo.is_some(), self.exposure) == (other.photo.is_some(), other.exposure)
            && (self.codes, self.follow) == (other.codes, other.follow)
    }

    /// Returns whether both show the same Gaussians with the same objects and parts.
    pub(crate) fn shows_same_scene(&self, other: &Self) -> bool {
        let generations =
            |request: &Self| (request.cloud.generation(), request.semantics.as_ref().map(Versioned::generation));
        generations(self) == generations(other)
    }
}

/// Passes that the scene's plan skips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkipPasses {
    pub(crate) parts: bool,
    pub(crate) gpu: bool,
    /// Levels of detail.
    pub(crate) levels: bool,
}

impl SkipPasses {
    /// Passes that `plan` leaves out.
    pub fn of(plan: &ScenePlan) -> Self {
        Self { parts: !plan.parts, gpu: plan.on_cpu, levels: !plan.levels }
    }
}

/// Time that a frame may take; decides its resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityBudget {
    /// The camera moves: keep up with it.
    Moving,
    /// The camera rests while something else needs the processor.
    Shared,
    /// The camera rests: full resolution, and depth to pick from.
    Full,
}

impl QualityBudget {
    /// Seconds a frame should take at most; `None` = as long as it takes.
    pub(super) fn secs(self) -> Option<f64> {
        match self {
            Self::Moving => Some(MOVING_SECS),
            Self::Shared => Some(0.120),
            Self::Full => None,
        }
    }
}

/// Picture of a view beside the first.
#[derive(Clone, Debug)]
pub struct PictureBeside {
    /// Row-major sRGB.
    pub rgb: Vec<[u8; 3]>,
    pub(crate) depth_range: Option<(f32, f32)>,
    /// As in the first view.
    pub psnr: Option<f64>,
}

/// A drawn view.
#[derive(Clone, Debug)]
pub struct ViewPicture {
    /// The request's.
    pub ticket: u64,
    /// True at the request's full resolution, with all Gaussians.
    pub full: bool,
    /// The camera at the size that was drawn.
    pub camera: Camera,
    /// Row-major sRGB; empty where the texture holds the colors.
    pub rgb: Vec<[u8; 3]>,
    /// The colors, where they stayed on the device that drew them.
    pub(crate) texture: Option<DevicePicture>,
    /// Median depth in scene units, row-major, 0 where there is none; `None` if not drawn.
    pub median_depth: Option<Vec<f32>>,
    /// Depths at the two ends of the color scale, in the depth mode.
    pub(crate) depth_range: Option<(f32, f32)>,
    /// PSNR in dB against the photo, if the request had one.
    pub psnr: Option<f64>,
    /// Pictures of the views beside it: of the same frame, or one for each of the other Gaussians.
    pub beside: Vec<PictureBeside>,
    /// Seconds that rendering took.
    pub secs: f64,
    /// The same by stage, where that is known.
    pub(crate) stages: StageTimes,
    /// Seconds from colors to bytes: depth scales, differences.
    pub(crate) paint_secs: f64,
    /// Renderer: "CPU", or the name of the GPU.
    pub(crate) drawn_by: String,
    /// Reason for which the CPU drew it though there is a GPU.
    pub(crate) instead_of_gpu: Option<String>,
}

impl ViewPicture {
    /// Returns whether it is the picture of the request with `ticket` at full resolution.
    pub(crate) fn is_full_of(&self, ticket: u64) -> bool {
        self.full && self.ticket == ticket
    }

    /// The picture of the second view, if there is one.
    pub fn second(&self) -> Option<&PictureBeside> {
        self.beside.first()
    }

    /// Its pixels on the host; those of the second view, if that is wanted and there is one.
    ///
    /// # Errors
    /// If reading them back from a device fails.
    pub(crate) fn pixels(&self, second: bool) -> Result<PhotoPixels, GpuError> {
        let rgb = match (self.second().filter(|_| second), &self.texture) {
            (Some(second), _) => second.rgb.clone(),
            (None, Some(texture)) => texture.to_rgb8()?,
            (None, None) => self.rgb.clone(),
        };
        let Camera { width_px, height_px, .. } = self.camera;
        Ok(PhotoPixels { width_px, height_px, rgb, coverage: None, alpha: None })
    }

    /// Returns whether a GPU drew it.
    pub(crate) fn on_gpu(&self) -> bool {
        self.drawn_by != Renderer::CPU
    }
}

/// The result of a request.
pub type ViewResult = Result<Arc<ViewPicture>, Failure>;
