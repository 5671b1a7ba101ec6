//! The CPU renderer: at `f64` the oracle that every kernel and gradient is held against, at `f32`
//! (tile-parallel, eight pixels a register) the fast path where there is no GPU.
//!
//! Stages, one file each: [`project`], [`sort`], [`bin`], [`blend`]; backward: [`blend_backward`],
//! [`mod@project_backward`]. Results do not depend on the number of threads.

pub mod adam;
pub mod bin;
pub mod blend;
pub mod blend_backward;
pub mod contributions;
pub mod lanes;
pub mod normals;
pub mod project;
pub mod project_backward;
pub mod sort;
pub mod ssim;
pub mod surfel;
pub mod validate;

use std::time::Instant;

use rayon::prelude::*;

use self::bin::Tiles;
use self::blend::{BlendRow, RowOut};
use self::blend_backward::{BlendRowBackward, MOMENTS, RowIn};
use self::contributions::{ContributionRow, ContributionSink};
use self::project::{Chunk, View};
use self::project_backward::{GaussianGradient, project_backward};
use self::sort::Ordered;
use super::{
    CloudGradient, Cutoffs, Features, Frame, FrameGradient, MAX_CHANNELS, RenderError, RenderSettings, TILE_PX,
};
use crate::math::Real;
use crate::math::finite::{CHECKED, NotFinite, all_finite};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Runs `$body` with the constant `$c` set to the number of channels `$n` is padded to: one of those
/// listed, else the most.
macro_rules! with_channels {
    ($n:expr, $c:ident in [$($some:literal)*, $most:expr] => $body:expr) => {
        match $n {
            $($some => {
                const $c: usize = $some;
                $body
            })*
            _ => {
                const $c: usize = $most;
                $body
            }
        }
    };
}
use with_channels;

/// Channels that the kernels are compiled for: colour; with depth; with six codes and depth; any.
fn padded(channels: usize) -> usize {
    [3, 4, 10].into_iter().find(|&c| channels <= c).unwrap_or(MAX_CHANNELS)
}

/// No splat.
const NONE: u32 = u32::MAX;

/// What the last frame cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderStats {
    /// Gaussians that reach at least one pixel.
    pub visible: usize,
    /// Gaussians left out because their shape is degenerate.
    pub degenerate: usize,
    /// Tile list entries.
    pub entries: usize,
    /// Splat-pixel products evaluated by the forward pass.
    pub products: u64,
    /// Seconds per stage: project, sort, bin, blend.
    pub stage_secs: [f64; 4],
    /// Seconds of the backward pass over the tiles.
    pub backward_secs: f64,
}

/// A renderer with its buffers, to be kept from frame to frame.
#[derive(Debug, Default)]
pub struct Renderer<R> {
    parts: Vec<Chunk<R>>,
    ordered: Ordered<R>,
    /// For each Gaussian its splat, or `NONE`; filled by the backward pass.
    splat_of: Vec<u32>,
    tiles: Tiles,
    transmittance: Vec<R>,
    last: Vec<u32>,
    records: Vec<R>,
    frame: Option<FrameInfo<R>>,
    stats: RenderStats,
    /// Draws where surfels are asked for.
    surfels: Option<Box<surfel::Rasterizer<R>>>,
}

/// What the backward pass must know of the forward pass.
#[derive(Debug, Clone)]
struct FrameInfo<R> {
    view: View<R>,
    settings: RenderSettings,
    /// Size of the cloud.
    gaussians: usize,
    /// Channels in use and as padded.
    channels: [usize; 2],
    depth_channel: Option<usize>,
}

impl<R: Real> Renderer<R> {
    /// A renderer with empty buffers.
    pub fn new() -> Self {
        Self { ..Self::default() }
    }

    /// Bytes of working memory that it keeps for the next frame, those of surfels left out.
    pub fn working_bytes(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        let parts: usize = self.parts.iter().map(|p| of(&p.splats) + of(&p.values)).sum();
        let ordered = of(&self.ordered.splats) + of(&self.ordered.values);
        let tiles = of(&self.tiles.first) + of(&self.tiles.entries) + of(&self.tiles.span) + of(&self.tiles.places);
        parts + ordered + tiles + of(&self.splat_of) + of(&self.transmittance) + of(&self.last) + of(&self.records)
    }

    /// The Gaussians of the last frame, front to back, and their depths.
    pub fn drawn(&self) -> impl Iterator<Item = (usize, R)> {
        let splats = self.surfels.as_ref().map_or(&self.ordered.splats, |s| &s.ordered.splats);
        splats.iter().map(|s| (s.gaussian as usize, s.depth))
    }

    /// What the last frame cost.
    pub fn stats(&self) -> RenderStats {
        self.stats
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
        let used = 3 + extra + usize::from(settings.depth);
        if used > MAX_CHANNELS {
            return Err(RenderError::Channels(extra));
        }
        if features.values.len() != cloud.len() * extra {
            return Err(RenderError::FeatureLength { have: features.values.len(), want: cloud.len() * extra });
        }
        if settings.surfels {
            self.frame = None;
            let surfels = self.surfels.get_or_insert_default();
            let frame = surfels.render(cloud, features, camera, settings)?;
            self.stats = surfels.stats;
            return Ok(frame);
        }
        self.surfels = None;
        let view = View::new(camera, cloud.origin, settings.near);
        let size = view.size;
        let channels = padded(used);
        let mut clock = Clock::start();
        project::project(&mut self.parts, cloud, features, &view, settings, channels);
        let project_secs = clock.lap();
        sort::sort(&mut self.ordered, &self.parts, channels, settings.keep_order);
        let sort_secs = clock.lap();
        bin::bin(&mut self.tiles, &self.ordered.splats, size);
        let bin_secs = clock.lap();
        checked(&self.parts, &self.ordered, &self.tiles, !settings.keep_order)?;

        let pixels = size[0] * size[1];
        self.transmittance.resize(pixels, R::ONE);
        self.last.resize(pixels, 0);
        let mut frame = empty_frame(size, extra, settings.depth);
        let products = self.blend(&mut frame, channels, size, settings.cutoffs);
        finish(&mut frame, &self.transmittance, settings.background);
        if CHECKED {
            validate::drawn(&frame)?;
        }
        self.stats = RenderStats {
            visible: self.ordered.splats.len(),
            degenerate: self.parts.iter().map(|p| p.degenerate).sum(),
            entries: self.tiles.entries.len(),
            products,
            stage_secs: [project_secs, sort_secs, bin_secs, clock.lap()],
            backward_secs: 0.0,
        };
        self.frame = Some(FrameInfo {
            view,
            settings: settings.clone(),
            gaussians: cloud.len(),
            channels: [used, channels],
            depth_channel: settings.depth.then_some(used - 1),
        });
        Ok(frame)
    }

    fn blend(&mut self, frame: &mut Frame<R>, channels: usize, size: [usize; 2], cutoffs: Cutoffs) -> u64 {
        let strip = size[0] * TILE_PX;
        let mut rows: Vec<RowOut<'_, R>> = self
            .transmittance
            .chunks_mut(strip)
            .zip(self.last.chunks_mut(strip))
            .map(|(transmittance, last)| RowOut { planes: Vec::new(), transmittance, last, median: &mut [] })
            .collect();
        let planes = frame.color.iter_mut().chain(&mut frame.features).chain(std::iter::once(&mut frame.depth));
        for plane in planes {
            for (row, part) in rows.iter_mut().zip(plane.chunks_mut(strip)) {
                row.planes.push(part);
            }
        }
        for (row, part) in rows.iter_mut().zip(frame.median_depth.chunks_mut(strip)) {
            row.median = part;
        }
        let (splats, values, tiles) = (&self.ordered.splats, &self.ordered.values, &self.tiles);
        rows.par_iter_mut()
            .enumerate()
            .map(|(ty, out)| {
                with_channels!(channels, C in [3 4 10, MAX_CHANNELS] => R::vectorize(BlendRow::<R, C> { splats, values, tiles, size, ty, cutoffs, out }))
            })
            .sum()
    }

    /// Hands the weight of every Gaussian at every pixel of a view to `sinks`, one for each row
    /// of tiles, which are `height.div_ceil(TILE_PX)`. Surfels count as flat Gaussians.
    ///
    /// # Errors
    /// If the camera is not usable.
    pub fn contributions<S: ContributionSink<R>>(
        &mut self,
        cloud: &GaussianCloud<R>,
        camera: &Camera,
        settings: &RenderSettings,
        sinks: &mut [S],
    ) -> Result<(), RenderError> {
        camera.validate()?;
        let view = View::new(camera, cloud.origin, settings.near);
        let settings = RenderSettings { sh_degree: 0, depth: false, ..settings.clone() };
        let channels = padded(3);
        project::project(&mut self.parts, cloud, Features::NONE, &view, &settings, channels);
        sort::sort(&mut self.ordered, &self.parts, channels, false);
        bin::bin(&mut self.tiles, &self.ordered.splats, view.size);
        checked(&self.parts, &self.ordered, &self.tiles, true)?;
        // The buffers no longer belong to a rendered frame.
        self.frame = None;
        self.surfels = None;
        let (splats, tiles) = (&self.ordered.splats, &self.tiles);
        sinks.par_iter_mut().take(tiles.grid[1]).enumerate().for_each(|(ty, sink)| {
            R::vectorize(ContributionRow { splats, tiles, size: view.size, ty, cutoffs: settings.cutoffs, sink });
        });
        Ok(())
    }

    /// Backward pass over the tiles of the last frame. Afterwards [`Self::gaussian_gradient`]
    /// answers for each Gaussian. Does nothing before the first frame.
    pub fn backward_tiles(&mut self, gradient: &FrameGradient<R>) {
        if let Some(surfels) = &mut self.surfels {
            surfels.backward_tiles(gradient);
            self.stats = surfels.stats;
        }
        let Some(info) = &self.frame else { return };
        let clock = Instant::now();
        self.splat_of.clear();
        self.splat_of.resize(info.gaussians, NONE);
        for (s, splat) in self.ordered.splats.iter().enumerate() {
            self.splat_of[splat.gaussian as usize] = s as u32;
        }
        let (size, cutoffs) = (info.view.size, info.settings.cutoffs);
        let pixels = size[0] * size[1];
        let d_transmittance = transmittance_gradient(gradient, info.settings.background, pixels);

        let stride = MOMENTS + info.channels[1];
        self.records.resize(self.tiles.entries.len() * stride, R::ZERO);
        let strip = size[0] * TILE_PX;
        let mut rest = self.records.as_mut_slice();
        let mut tasks = Vec::with_capacity(self.tiles.grid[1]);
        for ty in 0..self.tiles.grid[1] {
            let span = ty * strip..((ty + 1) * strip).min(pixels);
            let planes: [&Vec<R>; 3] = [&gradient.color[0], &gradient.color[1], &gradient.color[2]];
            let planes = planes.into_iter().chain(&gradient.features);
            let mut planes: Vec<&[R]> = planes.map(|p| p.get(span.clone()).unwrap_or(&[])).collect();
            if let Some(channel) = info.depth_channel {
                planes.resize(channel, &[]);
                planes.push(gradient.depth.get(span.clone()).unwrap_or(&[]));
            }
            let input = RowIn {
                planes,
                transmittance_gradient: &d_transmittance[span.clone()],
                transmittance: &self.transmittance[span.clone()],
                last: &self.last[span],
            };
            let [from, to] = [ty * self.tiles.grid[0], (ty + 1) * self.tiles.grid[0]];
            let entries = (self.tiles.first[to] - self.tiles.first[from]) as usize;
            let (own, others) = rest.split_at_mut(entries * stride);
            rest = others;
            tasks.push((ty, input, own));
        }
        let (splats, values, tiles) = (&self.ordered.splats, &self.ordered.values, &self.tiles);
        tasks.into_par_iter().for_each(|(ty, input, own)| {
            with_channels!(info.channels[1], C in [3 4 10, MAX_CHANNELS] => {
                let input = &input;
                R::vectorize(BlendRowBackward::<R, C> { splats, values, tiles, size, ty, cutoffs, input, records: own });
            });
        });
        self.stats.backward_secs = clock.elapsed().as_secs_f64();
    }

    /// Whether the backward pass over the tiles left finite numbers.
    ///
    /// # Errors
    /// Names the first that is none.
    pub fn check_backward(&self) -> Result<(), NotFinite> {
        let records = self.surfels.as_ref().map_or(&self.records, |s| &s.records);
        all_finite("blending backward", "record", records)
    }

    /// Sum of Gaussian `i`'s tile records, or `None` if it was not drawn.
    fn record(&self, i: usize, stride: usize) -> Option<(usize, [R; MOMENTS + MAX_CHANNELS])> {
        let s = *self.splat_of.get(i)?;
        if s == NONE {
            return None;
        }
        let (from, to) = self.tiles.span[s as usize];
        let mut sum = [R::ZERO; MOMENTS + MAX_CHANNELS];
        for &place in &self.tiles.places[from as usize..to as usize] {
            let at = place as usize * stride;
            for (total, v) in sum.iter_mut().zip(&self.records[at..at + stride]) {
                *total += *v;
            }
        }
        Some((s as usize, sum))
    }

    /// Gradient of Gaussian `i`, whose parameters are still those that were drawn, after
    /// [`Self::backward_tiles`]; `None` if it was not drawn.
    #[inline(always)]
    pub fn gaussian_gradient(&self, gaussian: &Gaussian<'_, R>, i: usize) -> Option<GaussianGradient<R>> {
        let Some(info) = &self.frame else { return self.surfels.as_ref()?.gaussian_gradient(gaussian, i) };
        let (s, record) = self.record(i, MOMENTS + info.channels[1])?;
        let splat = &self.ordered.splats[s];
        project_backward(gaussian, splat, &info.view, &info.settings, &record, info.depth_channel)
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
            radius_px: vec![0.0; n],
        };
        for i in 0..n {
            let Some(g) = self.gaussian_gradient(&cloud.gaussian(i), i) else { continue };
            out.positions[i] = g.position;
            out.log_scales[i] = g.log_scale;
            out.quaternions[i] = g.quaternion;
            out.opacity_logits[i] = g.opacity_logit;
            out.screen[i] = g.screen;
            out.radius_px[i] = g.radius_px.f32();
            for (k, sh) in out.sh[i * stride..(i + 1) * stride].iter_mut().enumerate() {
                *sh = g.color.map(|c| c * g.basis[k]);
            }
            self.feature_gradient(i, &mut out.features[i * features.channels..(i + 1) * features.channels]);
        }
        out
    }

    /// Gradient with respect to the extra channels of Gaussian `i`, after [`Self::backward_tiles`].
    /// Leaves `out`, one value per channel, alone if the Gaussian was not drawn, and says whether it was.
    pub fn feature_gradient(&self, i: usize, out: &mut [R]) -> bool {
        let Some(stride) = self.frame.as_ref().map(|f| MOMENTS + f.channels[1]) else {
            return self.surfels.as_ref().is_some_and(|s| s.feature_gradient(i, out));
        };
        let Some((_, record)) = self.record(i, stride) else { return false };
        out.copy_from_slice(&record[MOMENTS + 3..MOMENTS + 3 + out.len()]);
        true
    }
}

/// Under `debug-validation`: whether projection, sorting (if `by_depth`) and binning left what they should.
fn checked<R: Real>(parts: &[Chunk<R>], ordered: &Ordered<R>, tiles: &Tiles, by_depth: bool) -> Result<(), NotFinite> {
    if CHECKED {
        validate::projected(parts)?;
        validate::ordered(ordered, by_depth)?;
        validate::binned(tiles, ordered.splats.len())?;
    }
    Ok(())
}

/// Seconds between laps.
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let secs = now.duration_since(self.0).as_secs_f64();
        self.0 = now;
        secs
    }
}

fn empty_frame<R: Real>(size: [usize; 2], extra: usize, depth: bool) -> Frame<R> {
    let pixels = size[0] * size[1];
    let plane = || vec![R::ZERO; pixels];
    let optional = || if depth { vec![R::ZERO; pixels] } else { Vec::new() };
    Frame {
        width_px: size[0],
        height_px: size[1],
        color: std::array::from_fn(|_| plane()),
        features: (0..extra).map(|_| plane()).collect(),
        alpha: plane(),
        depth: optional(),
        median_depth: optional(),
        ..Frame::default()
    }
}

/// `dL/dtransmittance`: background times colour gradient, minus the gradient of alpha.
fn transmittance_gradient<R: Real>(gradient: &FrameGradient<R>, background: [f32; 3], pixels: usize) -> Vec<R> {
    let mut d_transmittance = vec![R::ZERO; pixels];
    for (plane, level) in gradient.color.iter().zip(background) {
        let level = R::of(f64::from(level));
        d_transmittance.iter_mut().zip(plane).for_each(|(t, g)| *t += *g * level);
    }
    d_transmittance.iter_mut().zip(&gradient.alpha).for_each(|(t, g)| *t -= *g);
    d_transmittance
}

/// Adds the background and turns transmittance into alpha.
fn finish<R: Real>(frame: &mut Frame<R>, transmittance: &[R], background: [f32; 3]) {
    for (plane, level) in frame.color.iter_mut().zip(background) {
        if level != 0.0 {
            let level = R::of(f64::from(level));
            plane.iter_mut().zip(transmittance).for_each(|(p, t)| *p += *t * level);
        }
    }
    frame.alpha.iter_mut().zip(transmittance).for_each(|(a, t)| *a = R::ONE - *t);
}
