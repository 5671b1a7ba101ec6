//! Splatting: clouds of Gaussians to pictures, and gradients of pictures back to Gaussians.
//!
//! EWA splatting as in 3D Gaussian Splatting, with three rules that both backends share:
//!
//! * a Gaussian touches a pixel where `alpha = min(ALPHA_MAX, opacity * exp(-q / 2)) >= ALPHA_MIN`,
//!   `q` the squared Mahalanobis distance of the pixel's center in the picture plane;
//! * it reaches a tile if the smallest `q` over the tile's pixel centers allows that;
//! * a pixel is closed before the splat that would bring its transmittance under
//!   `TRANSMITTANCE_MIN`.
//!
//! Positions are made relative to the camera in `f64` before they become `f32`. Losses and metrics accumulate in
//! `f64`.

pub mod cpu;
pub mod gpu;
pub(crate) mod lod;
mod renderer;

pub(crate) use cpu::adam::{AdamStep, Rates};
pub(crate) use cpu::contributions::ContributionSink;
pub(crate) use cpu::kept_view::KeptView;
pub use cpu::labels::LabelWinner;
pub(crate) use cpu::labels::{PixelWeights, UNKNOWN, label_winners};
pub use cpu::pose_gradient::PoseGradient;
pub(crate) use cpu::ssim::{LossParts, PhotoLoss, ssim};
pub(crate) use cpu::view_weights::ViewWeights;
pub(crate) use cpu::{RenderStats, normals, validate};
pub(crate) use gpu::timing::StageTimes;
pub use gpu::trainer::{GpuTrainer, StepLoss, TrainerSettings};
pub use gpu::{Device, DevicePhoto, DevicePicture, GpuError, real_gpu};
pub use renderer::{BackendChoice, DifferentiableRenderer, DrawError, FrameCost, Renderer, instead_of_gpu};

use serde::{Deserialize, Serialize};

use crate::math::Real;
use crate::math::finite::NotFinite;
use crate::scene::{CameraError, SplatRenderMode};

/// Side of a tile in px, on every backend.
pub const TILE_PX: usize = 16;
/// Smallest alpha that counts.
pub const ALPHA_MIN: f64 = 1.0 / 255.0;
/// Largest alpha of one splat.
pub const ALPHA_MAX: f64 = 0.999;
/// A pixel stops before its transmittance falls under this.
pub const TRANSMITTANCE_MIN: f64 = 1e-4;
/// Brightest color of a splat, far above any display. Its fourth power, of which SSIM is made, is
/// still a number in `f32`.
pub const COLOR_MAX: f64 = 1e9;
/// Variance in px² added along both picture axes (3DGS's low-pass filter).
pub const BLUR_PX2: f64 = 0.3;
/// Tangents of the viewing angle are clamped to this multiple of the picture's half extent before
/// the projection is linearized, so that splats far outside do not blow up.
pub(crate) const TANGENT_CLAMP: f64 = 1.3;

/// Most channels that one pass composites, color and depth included.
pub(crate) const MAX_CHANNELS: usize = 32;

/// Error of a picture that could not be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum RenderError {
    #[error("camera: {0}")]
    Camera(#[from] CameraError),
    #[error("{0} extra channels are too many for one pass (at most {max}); render them in groups", max = MAX_CHANNELS - 4)]
    Channels(usize),
    #[error("the GPU draws with the default cut-offs only; choose the CPU for others")]
    Cutoffs,
    #[error("the feature array holds {have} values, expected {want}")]
    FeatureLength { have: usize, want: usize },
    /// A stage left a number that is not finite; checked under `debug-validation` only.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
}

/// Cut-offs below which nothing is drawn: the first knob between accuracy and time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cutoffs {
    /// Smallest alpha that counts, above 0.
    pub(crate) alpha: f64,
    /// A pixel is closed before its transmittance falls under this.
    pub(crate) transmittance: f64,
}

impl Default for Cutoffs {
    fn default() -> Self {
        Self { alpha: ALPHA_MIN, transmittance: TRANSMITTANCE_MIN }
    }
}

/// Settings of a rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RenderSettings {
    /// Highest spherical-harmonics degree used; the cloud's own if lower.
    pub sh_degree: u8,
    /// Color behind the Gaussians. Extra channels have 0 behind them.
    pub background: [f32; 3],
    /// Distance of the near plane in scene units: Gaussians whose center is nearer are left out.
    pub near: f64,
    /// Variance added to each splat along both picture axes, px².
    pub blur_px2: f64,
    /// Scale opacities so that the blur keeps a splat's energy (Mip-Splatting's 2-D filter).
    pub antialias: bool,
    /// Also return expected depth `sum(w z)` and median depth; of surfels, normals and distortion
    /// too.
    pub depth: bool,
    /// Draw surfels: disks across the first two axes, whose third scale is ignored (2D Gaussian
    /// Splatting). On the CPU only; a GPU draws them as the flat Gaussians that they are stored as.
    pub surfels: bool,
    /// Cut-offs for Gaussians on the CPU. A GPU, whose shaders are made with the defaults, refuses others; surfels are
    /// always drawn with the defaults.
    pub cutoffs: Cutoffs,
    /// Draw in the order of the picture before, as far as it is known, instead of sorting anew: for
    /// Gaussians on the CPU.
    pub keep_order: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            sh_degree: 3,
            background: [0.0; 3],
            near: 0.01,
            blur_px2: BLUR_PX2,
            antialias: false,
            depth: false,
            surfels: false,
            cutoffs: Cutoffs::default(),
            keep_order: false,
        }
    }
}

impl RenderSettings {
    /// Returns whether Gaussians have the same weights at each pixel as with `other`.
    pub(crate) fn sees_like(&self, other: &Self) -> bool {
        let shape = |s: &Self| (s.near, s.blur_px2, s.antialias, s.surfels, s.cutoffs);
        shape(self) == shape(other)
    }

    /// Returns the same with another blur, px².
    pub(crate) fn blurred_by(&self, blur_px2: f64) -> Self {
        Self { blur_px2, ..self.clone() }
    }

    /// Settings for Gaussians of this mode.
    pub(crate) fn of_mode(mode: SplatRenderMode) -> Self {
        let (antialias, surfels) = (mode == SplatRenderMode::Mip, mode == SplatRenderMode::Surfels);
        Self { antialias, surfels, ..Self::default() }
    }
}

/// Values per Gaussian that are composited like colors, in the same pass.
#[derive(Clone, Copy, Debug)]
pub struct Features<'a, R> {
    /// Channels per Gaussian.
    pub channels: usize,
    /// `[n * channels]`, those of one Gaussian together.
    pub values: &'a [R],
}

impl<R> Features<'_, R> {
    /// No extra channels.
    pub const NONE: Self = Self { channels: 0, values: &[] };
}

/// A rendered picture, channel planes of `width_px * height_px` values each, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame<R> {
    /// Width in px.
    pub width_px: usize,
    /// Height in px.
    pub height_px: usize,
    /// Red, green, blue over the background.
    pub color: [Vec<R>; 3],
    /// The extra channels (not divided by alpha).
    pub features: Vec<Vec<R>>,
    /// Accumulated opacity, 0 to 1.
    pub alpha: Vec<R>,
    /// `sum(w z)` in scene units, not divided by alpha; empty unless asked for.
    pub depth: Vec<R>,
    /// Depth at which transmittance first falls to one half, 0 where it never does; empty unless
    /// asked for. Carries a gradient for surfels only.
    pub median_depth: Vec<R>,
    /// Normals of surfels, toward the camera in world axes, `sum(w n)`; empty for Gaussians and
    /// without depth.
    pub normals: [Vec<R>; 3],
    /// Distortion of surfels along a ray: the sum over pairs of `w_i w_j (1/z_i - 1/z_j)²`; empty for Gaussians and
    /// without depth.
    pub distortion: Vec<R>,
}

impl<R: Real> Frame<R> {
    /// Expected depth `sum(w z) / alpha` in scene units, 0 where less than half of the light comes
    /// from the scene; empty unless depth was asked for.
    pub(crate) fn expected_depth(&self) -> Vec<R> {
        let one = |(d, a): (&R, &R)| if *a >= R::HALF { *d / *a } else { R::ZERO };
        self.depth.iter().zip(&self.alpha).map(one).collect()
    }

    /// Its colors as interleaved 8-bit RGB, clamped and rounded.
    pub fn to_rgb8(&self) -> Vec<[u8; 3]> {
        cpu::pack::rgb8(&self.color)
    }
}

/// Gradient of a loss with respect to a [`Frame`]; empty vectors mean zero.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "each name says what it is")]
pub struct FrameGradient<R> {
    pub color: [Vec<R>; 3],
    pub features: Vec<Vec<R>>,
    pub alpha: Vec<R>,
    pub depth: Vec<R>,
    pub median_depth: Vec<R>,
    pub normals: [Vec<R>; 3],
    pub distortion: Vec<R>,
}

/// Gradient with respect to every parameter of a cloud, laid out like the cloud.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "each name says what it is")]
pub struct CloudGradient<R> {
    pub positions: Vec<[R; 3]>,
    pub log_scales: Vec<[R; 3]>,
    pub quaternions: Vec<[R; 4]>,
    pub opacity_logits: Vec<R>,
    pub sh: Vec<[R; 3]>,
    pub features: Vec<R>,
    /// Length of the gradient with respect to the center's position in the picture, in loss per
    /// half picture side (normalized device coordinates, as 3DGS thresholds it); 0 where unseen.
    pub screen: Vec<R>,
}

/// Statistics of each Gaussian for density control since it last ran.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DensityStats {
    /// Sum of the screen gradients' lengths, loss per half picture side.
    pub gradient: Vec<f32>,
    /// Frames in which it was drawn.
    pub seen: Vec<u32>,
}

impl DensityStats {
    /// Empty statistics of `n` Gaussians.
    pub(crate) fn new(n: usize) -> Self {
        Self { gradient: vec![0.0; n], seen: vec![0; n] }
    }
}
