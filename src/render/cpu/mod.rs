//! The CPU renderer: at `f64` the oracle that every kernel and gradient is compared with, at `f32`
//! (tile-parallel, eight pixels a register) the fast path where there is no GPU.
//!
//! Stages, one file each: [`project`] ([`mod@project_chunk`]: of a whole cloud), [`bin`], [`sort`], [`blend`];
//! backward: [`blend_backward`], [`mod@project_backward`]; [`walk`] is the loop over a tile that they share. It draws a
//! [`walk::Primitive`]: [`splat`] or [`surfel`]. Results do not depend on the number of threads.

pub mod adam;
pub(crate) mod bin;
pub(crate) mod blend;
pub(crate) mod blend_backward;
pub(crate) mod chunk;
pub(crate) mod contributions;
pub(crate) mod kept_view;
pub(crate) mod labels;
pub mod normals;
pub(crate) mod pack;
pub(crate) mod pose_gradient;
pub mod project;
pub(crate) mod project_backward;
mod project_chunk;
mod project_splats;
pub(crate) mod rasterizer;
pub(crate) mod sort;
pub(crate) mod splat;
pub mod ssim;
pub(crate) mod surfel;
pub(crate) mod validate;
pub(crate) mod view_weights;
pub(crate) mod walk;

use std::sync::Arc;

use self::contributions::ContributionSink;
use self::kept_view::{KeptView, TileNotes};
use self::project_backward::GaussianGradient;
use self::rasterizer::CpuRasterizer;
use self::splat::Splats;
use self::surfel::Surfels;
use super::lod::Cut;
use super::{CloudGradient, Features, Frame, FrameGradient, MAX_CHANNELS, RenderError, RenderSettings};
use crate::math::Real;
use crate::math::finite::{NotFinite, all_finite};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Cost of the last frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderStats {
    /// Gaussians that reach at least one pixel.
    pub visible: usize,
    /// Gaussians left out because their shape is degenerate.
    pub degenerate: usize,
    /// Splat-pixel products evaluated by the forward pass.
    pub(crate) products: u64,
    /// Seconds per stage: project, sort, bin, blend.
    pub(crate) stage_secs: [f64; 4],
    /// Seconds of the backward pass over the tiles.
    pub(crate) backward_secs: f64,
}

/// A renderer with its buffers, to be kept from frame to frame.
#[derive(Debug)]
pub struct CpuRenderer<R> {
    splats: CpuRasterizer<R, Splats<R>>,
    /// Rasterizer of the last frame, if that was of surfels.
    surfels: Option<Box<CpuRasterizer<R, Surfels<R>>>>,
}

/// Asks the rasterizer that drew the last frame.
macro_rules! last {
    ($self:ident, $rasterizer:ident => $call:expr) => {
        match &$self.surfels {
            Some($rasterizer) => $call,
            None => {
                let $rasterizer = &$self.splats;
                $call
            }
        }
    };
}

impl<R: Real> Default for CpuRenderer<R> {
    fn default() -> Self {
        Self { splats: CpuRasterizer::default(), surfels: None }
    }
}

impl<R: Real> CpuRenderer<R> {
    /// A renderer with empty buffers.
    pub fn new() -> Self {
        Self::default()
    }

    /// A renderer without a backward pass, which keeps nothing for it.
    pub(crate) fn forward_only() -> Self {
        let mut renderer = Self::default();
        renderer.splats.forward_only = true;
        renderer
    }

    /// Limits later pictures to the cut, for clouds that it fits; `None` draws all. No gradients pass through a cut.
    pub(crate) fn limit_to(&mut self, cut: Option<Arc<Cut<R>>>) {
        self.splats.cut = cut;
    }

    /// Bytes of working memory that it keeps for the next frame.
    pub(crate) fn working_bytes(&self) -> usize {
        self.splats.working_bytes() + self.surfels.as_ref().map_or(0, |s| s.working_bytes())
    }

    /// The Gaussians of the last frame, front to back, and their depths.
    pub fn drawn(&self) -> impl Iterator<Item = (usize, R)> {
        last!(self, r => r.splats()).into_iter().map(|s| (s.gaussian as usize, s.depth))
    }

    /// Cost of the last frame.
    pub fn stats(&self) -> RenderStats {
        last!(self, r => r.stats)
    }

    /// Draws `cloud` as `camera` sees it.
    pub fn render(
        &mut self,
        cloud: &GaussianCloud<R>,
        features: Features<'_, R>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<R>, RenderError> {
        camera.validate()?;
        let extra = features.channels;
        if 3 + extra + usize::from(settings.depth) > MAX_CHANNELS {
            return Err(RenderError::Channels(extra));
        }
        if features.values.len() != cloud.len() * extra {
            return Err(RenderError::FeatureLength { have: features.values.len(), want: cloud.len() * extra });
        }
        if settings.surfels {
            let settings = RenderSettings { keep_order: false, ..settings.clone() };
            let cut = self.splats.cut.clone();
            let surfels = self.surfels.get_or_insert_default();
            (surfels.cut, surfels.forward_only) = (cut, self.splats.forward_only);
            return Ok(surfels.render(cloud, features, camera, &settings)?);
        }
        self.surfels = None;
        Ok(self.splats.render(cloud, features, camera, settings)?)
    }

    /// Hands the weight of every Gaussian at every pixel of a view to `sinks`, one for each row
    /// of tiles, which are `height.div_ceil(TILE_PX)`. Surfels count as flat Gaussians.
    pub(crate) fn contributions<S: ContributionSink<R>>(
        &mut self,
        cloud: &GaussianCloud<R>,
        camera: &Camera,
        settings: &RenderSettings,
        sinks: &mut [S],
    ) -> Result<(), RenderError> {
        camera.validate()?;
        // The buffers no longer belong to a rendered frame.
        self.surfels = None;
        let settings = RenderSettings { sh_degree: 0, depth: false, keep_order: false, ..settings.clone() };
        Ok(self.splats.contributions(cloud, camera, &settings, sinks)?)
    }

    /// [`Self::contributions`] without projecting, binning and sorting, if the last frame was of this cloud and camera,
    /// seen alike ([`RenderSettings::sees_like`]).
    pub(crate) fn contributions_again<S: ContributionSink<R>>(
        &mut self,
        cloud: &GaussianCloud<R>,
        camera: &Camera,
        settings: &RenderSettings,
        sinks: &mut [S],
    ) -> Result<(), RenderError> {
        // Surfels do not have the weights of Gaussians.
        match self.surfels.is_none() && self.splats.contributions_again(sinks) {
            true => Ok(()),
            false => self.contributions(cloud, camera, settings, sinks),
        }
    }

    /// Backward pass over the tiles of the last frame. Afterwards [`Self::gaussian_gradient`]
    /// answers for each Gaussian. Does nothing before the first frame.
    pub(crate) fn backward_tiles(&mut self, gradient: &FrameGradient<R>) {
        match &mut self.surfels {
            Some(surfels) => surfels.backward_tiles(gradient),
            None => self.splats.backward_tiles(gradient),
        }
    }

    /// Checks that the backward pass over the tiles left finite numbers.
    pub(crate) fn check_backward(&self) -> Result<(), NotFinite> {
        all_finite("blending backward", "record", last!(self, r => &r.records))
    }

    /// Gradient of Gaussian `i`, whose parameters are still those that were drawn, after
    /// [`Self::backward_tiles`]; `None` if it was not drawn.
    #[inline(always)]
    pub(crate) fn gaussian_gradient(&self, gaussian: &Gaussian<'_, R>, i: usize) -> Option<GaussianGradient<R>> {
        last!(self, r => r.gaussian_gradient(gaussian, i))
    }

    /// Gradient with respect to the extra channels of Gaussian `i`, after [`Self::backward_tiles`]. Returns whether the
    /// Gaussian was drawn; if not, leaves `out`, one value per channel, alone.
    pub(crate) fn feature_gradient(&self, i: usize, out: &mut [R]) -> bool {
        last!(self, r => r.feature_gradient(i, out))
    }

    /// Gradient with respect to the whole cloud for the last rendered frame, which must have been
    /// of this cloud.
    pub fn backward(
        &mut self,
        cloud: &GaussianCloud<R>,
        features: Features<'_, R>,
        gradient: &FrameGradient<R>,
    ) -> CloudGradient<R> {
        self.backward_tiles(gradient);
        let n = cloud.len();
        let stride = cloud.sh_stride();
        let mut out = CloudGradient {
            positions: vec![[R::ZERO; 3]; n],
            log_scales: vec![[R::ZERO; 3]; n],
            quaternions: vec![[R::ZERO; 4]; n],
            opacity_logits: vec![R::ZERO; n],
            sh: vec![[R::ZERO; 3]; n * stride],
            features: vec![R::ZERO; n * features.channels],
            screen: vec![R::ZERO; n],
        };
        for i in 0..n {
            let Some(g) = self.gaussian_gradient(&cloud.gaussian(i), i) else { continue };
            out.positions[i] = g.position;
            out.log_scales[i] = g.log_scale;
            out.quaternions[i] = g.quaternion;
            out.opacity_logits[i] = g.opacity_logit;
            out.screen[i] = g.screen;
            for (k, sh) in out.sh[i * stride..(i + 1) * stride].iter_mut().enumerate() {
                *sh = g.color.map(|c| c * g.basis[k]);
            }
            self.feature_gradient(i, &mut out.features[i * features.channels..(i + 1) * features.channels]);
        }
        out
    }
}

impl CpuRenderer<f32> {
    /// Keeps the view that was weighed last; `notes` tell by row of tiles whose weights there are.
    fn keep(&self, notes: &[TileNotes]) -> Option<KeptView> {
        KeptView::of(&self.splats, notes).filter(|_| self.surfels.is_none())
    }
}
