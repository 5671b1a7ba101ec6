//! Forward and backward pass of one kind of primitive, with the buffers between the stages.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;

use super::bin::{self, Tiles};
use super::blend::{BlendRow, RowOut};
use super::blend_backward::{BlendRowBackward, RowIn};
use super::chunk::{CHUNK, Chunk, DrawInput};
use super::contributions::{ContributionRow, ContributionSink};
use super::project::{CameraView, Splat};
use super::project_backward::GaussianGradient;
use super::project_chunk::project;
use super::sort::{self, KeptOrder};
use super::walk::{Primitive, TileRow, Values};
use super::{RenderStats, validate};
use crate::math::Real;
use crate::math::finite::{CHECKED, NotFinite};
use crate::render::lod::Cut;
use crate::render::{Features, Frame, FrameGradient, MAX_CHANNELS, RenderSettings, TILE_PX};
use crate::scene::{Camera, Gaussian, GaussianCloud};

const NONE: u32 = u32::MAX;
/// Most values of a record: sums and channels.
const MOST: usize = MAX_CHANNELS + 16;

/// A rasterizer with its buffers, to be kept from frame to frame.
#[derive(Debug)]
pub(crate) struct CpuRasterizer<R, P> {
    lists: SplatLists<R>,
    pixels: Pixels<R>,
    /// For each Gaussian its splat, or `NONE`; filled by the backward pass.
    splat_of: Vec<u32>,
    /// Sums of the backward pass, for each tile entry.
    pub(crate) records: Vec<R>,
    frame: Option<FrameInfo<R, P>>,
    /// State of the last frame of which only the weights were wanted.
    weighed: Option<FrameInfo<R, P>>,
    /// Cut that is drawn instead of clouds that it fits.
    pub(crate) cut: Option<Arc<Cut<R>>>,
    /// True if nothing is kept for a backward pass, which then does nothing.
    pub(crate) forward_only: bool,
    /// Cost of the last frame.
    pub(crate) stats: RenderStats,
}

/// The splats of a frame, and by tile.
#[derive(Debug, Default)]
pub(super) struct SplatLists<R> {
    pub(super) parts: Vec<Chunk<R>>,
    /// The order that the last frame kept, if it kept one.
    pub(super) kept: Option<KeptOrder>,
    pub(super) tiles: Tiles,
}

impl<R: Real> SplatLists<R> {
    /// Row `ty` of tiles.
    fn row<P: Primitive<R>>(&self, info: &FrameInfo<R, P>, ty: usize) -> TileRow<'_, R, P> {
        TileRow {
            primitive: info.primitive,
            parts: &self.parts,
            tiles: &self.tiles,
            size: info.view.size,
            ty,
            least: R::of(P::least_transmittance(&info.settings)),
        }
    }

    /// Hands the weight of every Gaussian at every pixel to `sinks`, one for each row of tiles.
    pub(super) fn weigh<P: Primitive<R>, S: ContributionSink<R>>(&self, info: &FrameInfo<R, P>, sinks: &mut [S]) {
        sinks.par_iter_mut().take(self.tiles.grid[1]).enumerate().for_each(|(ty, sink)| {
            P::run(info.channels, ContributionRow { row: self.row(info, ty), sink });
        });
    }
}

/// State of each pixel that the forward pass keeps for the backward pass.
#[derive(Debug, Default)]
struct Pixels<R> {
    transmittance: Vec<R>,
    last: Vec<R>,
    kept: [Vec<R>; 3],
}

/// State of the forward pass that the backward pass needs.
#[derive(Debug, Clone)]
pub(super) struct FrameInfo<R, P> {
    primitive: P,
    pub(super) view: CameraView<R>,
    settings: RenderSettings,
    pub(super) gaussians: usize,
    extra: usize,
    pub(super) channels: usize,
}

impl<R: Real, P> Default for CpuRasterizer<R, P> {
    fn default() -> Self {
        let (lists, pixels) = (SplatLists::default(), Pixels::default());
        Self {
            lists,
            pixels,
            splat_of: Vec::new(),
            records: Vec::new(),
            frame: None,
            weighed: None,
            cut: None,
            forward_only: false,
            stats: RenderStats::default(),
        }
    }
}

/// The part of a plane that a row of tiles covers; nothing of an empty plane.
fn cut<'a, T>(plane: &'a [T], span: &std::ops::Range<usize>) -> &'a [T] {
    plane.get(span.clone()).unwrap_or(&[])
}

/// Seconds since the last lap.
fn lap(clock: &mut Instant) -> f64 {
    let now = Instant::now();
    now.duration_since(std::mem::replace(clock, now)).as_secs_f64()
}

impl<R: Real, P: Primitive<R>> CpuRasterizer<R, P> {
    /// Bytes of working memory that it keeps for the next frame.
    pub(crate) fn working_bytes(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        let SplatLists { parts, tiles, .. } = &self.lists;
        let Pixels { transmittance, last, kept } = &self.pixels;
        let parts: usize = parts.iter().map(|p| of(&p.splats) + of(&p.values)).sum();
        let tiles = of(&tiles.first) + of(&tiles.entries) + of(&tiles.span) + of(&tiles.ways_back);
        let planes = of(transmittance) + of(last) + kept.iter().map(of).sum::<usize>();
        parts + tiles + planes + of(&self.splat_of) + of(&self.records)
    }

    /// The splats of the last frame, front to back.
    pub(crate) fn splats(&self) -> Vec<&Splat<R>> {
        let mut all: Vec<&Splat<R>> = self.lists.parts.iter().flat_map(|p| &p.splats).collect();
        all.sort_by_key(|s| sort::by_depth(s));
        all
    }

    /// Projects, sorts and bins; returns the state for the later stages, and the seconds of each.
    fn prepare(
        &mut self,
        cloud: &GaussianCloud<R>,
        features: Features<'_, R>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<(FrameInfo<R, P>, [f64; 3]), NotFinite> {
        (self.frame, self.weighed) = (None, None);
        let cut = self.cut.as_deref().filter(|cut| cut.fits(cloud));
        let extra = features.channels;
        let channels = P::padded(P::channels(extra, settings.depth));
        let view = CameraView::new(camera, cloud.origin, settings);
        let SplatLists { parts, kept, tiles } = &mut self.lists;
        let mut clock = Instant::now();
        // Nodes that stand for the same Gaussian cannot be told apart from picture to picture.
        let keeps = settings.keep_order && cut.is_none();
        *kept = keeps.then(|| KeptOrder::of(parts, kept.as_ref()));
        let primitive = P::new(&view, settings);
        project(parts, DrawInput { cloud, features, settings, cut }, &view, primitive, channels);
        let project = lap(&mut clock);
        bin::bin(tiles, parts, kept.as_ref(), view.size);
        let bin = lap(&mut clock);
        sort::sort(&mut tiles.entries, &tiles.first);
        if CHECKED {
            validate::projected(parts)?;
            validate::binned(tiles, parts)?;
            validate::sorted(tiles)?;
        }
        let settings = settings.clone();
        let info = FrameInfo { primitive, view, settings, gaussians: cloud.len(), extra, channels };
        Ok((info, [project, lap(&mut clock), bin]))
    }

    /// Draws `cloud` as `camera` sees it. Camera and lengths have been checked.
    pub(crate) fn render(
        &mut self,
        cloud: &GaussianCloud<R>,
        features: Features<'_, R>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<R>, NotFinite> {
        let (info, [project, sort, bin]) = self.prepare(cloud, features, camera, settings)?;
        let mut clock = Instant::now();
        let size = info.view.size;
        let mut frame = empty_frame(size, info.extra, settings.depth);
        let products = self.blend(&mut frame, &info);
        finish(&mut frame, &self.pixels.transmittance, settings.background);
        P::finish(&mut frame, &self.pixels.kept);
        if CHECKED {
            validate::drawn(&frame)?;
        }
        self.stats = RenderStats {
            visible: self.lists.parts.iter().map(|p| p.splats.len()).sum(),
            degenerate: self.lists.parts.iter().map(|p| p.degenerate).sum(),
            products,
            stage_secs: [project, sort, bin, lap(&mut clock)],
            backward_secs: 0.0,
        };
        self.frame = Some(info);
        Ok(frame)
    }

    /// Composites a prepared frame and returns the number of splat-pixel products evaluated.
    fn blend(&mut self, frame: &mut Frame<R>, info: &FrameInfo<R, P>) -> u64 {
        let (strip, pixels) = (info.view.size[0] * TILE_PX, frame.alpha.len());
        let Pixels { transmittance, last, kept } = &mut self.pixels;
        transmittance.resize(pixels, R::ONE);
        last.resize(if self.forward_only { 0 } else { pixels }, R::ZERO);
        let mut last = last.chunks_mut(strip);
        let mut rows: Vec<RowOut<'_, R>> = transmittance
            .chunks_mut(strip)
            .map(|transmittance| RowOut { planes: Vec::new(), extra: Vec::new(), transmittance, last: last.next() })
            .collect();
        let [planes, extra] = P::planes(frame, kept, info.settings.depth);
        for plane in planes {
            rows.iter_mut().zip(plane.chunks_mut(strip)).for_each(|(row, part)| row.planes.push(part));
        }
        for plane in extra {
            rows.iter_mut().zip(plane.chunks_mut(strip)).for_each(|(row, part)| row.extra.push(part));
        }
        let lists = &self.lists;
        let row = |(ty, out)| P::run(info.channels, BlendRow { row: lists.row(info, ty), out });
        rows.par_iter_mut().enumerate().map(row).sum()
    }

    /// Hands the weight of every Gaussian at every pixel of a view to `sinks`, one for each row of tiles.
    pub(crate) fn contributions<S: ContributionSink<R>>(
        &mut self,
        cloud: &GaussianCloud<R>,
        camera: &Camera,
        settings: &RenderSettings,
        sinks: &mut [S],
    ) -> Result<(), NotFinite> {
        let (info, _) = self.prepare(cloud, Features::NONE, camera, settings)?;
        self.weighed = Some(info);
        self.contributions_again(sinks);
        Ok(())
    }

    /// The same of the frame drawn or weighed last; returns whether there is one.
    pub(crate) fn contributions_again<S: ContributionSink<R>>(&self, sinks: &mut [S]) -> bool {
        self.last().map(|(lists, info)| lists.weigh(info, sinks)).is_some()
    }

    /// The frame drawn or weighed last.
    pub(super) fn last(&self) -> Option<(&SplatLists<R>, &FrameInfo<R, P>)> {
        Some((&self.lists, self.frame.as_ref().or(self.weighed.as_ref())?))
    }

    /// Backward pass over the tiles of the last frame; does nothing before the first, nor where none was kept.
    pub(crate) fn backward_tiles(&mut self, gradient: &FrameGradient<R>) {
        let Some(info) = self.frame.as_ref().filter(|_| !self.forward_only) else { return };
        let clock = Instant::now();
        self.lists.tiles.find_ways_back(self.lists.parts.len() * CHUNK);
        let lists = &self.lists;
        self.splat_of.clear();
        self.splat_of.resize(info.gaussians, NONE);
        for (p, part) in lists.parts.iter().enumerate() {
            for (i, splat) in part.splats.iter().enumerate() {
                self.splat_of[splat.gaussian as usize] = sort::place(p, i);
            }
        }
        let Pixels { transmittance, last, kept } = &self.pixels;
        let (tiles, pixels, depth) = (&lists.tiles, transmittance.len(), info.settings.depth);
        let transmittance_gradient = transmittance_gradient(gradient, info.settings.background, pixels);
        let [planes, state] = P::gradients(gradient, kept, transmittance, info.extra, depth);

        let stride = info.stride();
        self.records.resize(tiles.entries.len() * stride, R::ZERO);
        let strip = info.view.size[0] * TILE_PX;
        let mut rest = self.records.as_mut_slice();
        let mut tasks = Vec::with_capacity(tiles.grid[1]);
        for ty in 0..tiles.grid[1] {
            let span = ty * strip..((ty + 1) * strip).min(pixels);
            let input = RowIn {
                planes: planes.iter().map(|plane| cut(plane, &span)).collect(),
                state: state.iter().map(|plane| cut(plane, &span)).collect(),
                transmittance_gradient: &transmittance_gradient[span.clone()],
                transmittance: &transmittance[span.clone()],
                last: &last[span],
            };
            let [from, to] = [ty * tiles.grid[0], (ty + 1) * tiles.grid[0]];
            let entries = (tiles.first[to] - tiles.first[from]) as usize;
            let (own, others) = rest.split_at_mut(entries * stride);
            rest = others;
            tasks.push((ty, input, own));
        }
        tasks.into_par_iter().for_each(|(ty, input, records)| {
            P::run(info.channels, BlendRowBackward { row: lists.row(info, ty), input: &input, records });
        });
        self.stats.backward_secs = clock.elapsed().as_secs_f64();
    }

    /// The splat of Gaussian `i` and the sum of its tile records, or `None` if it was not drawn.
    #[inline(always)]
    fn record(&self, i: usize, stride: usize) -> Option<(u32, [R; MOST])> {
        let s = *self.splat_of.get(i)?;
        if s == NONE {
            return None;
        }
        let mut sum = [R::ZERO; MOST];
        for &entry in self.lists.tiles.ways_back(s) {
            let at = entry as usize * stride;
            for (total, v) in sum.iter_mut().zip(&self.records[at..at + stride]) {
                *total += *v;
            }
        }
        Some((s, sum))
    }

    /// Gradient of Gaussian `i`, whose parameters are still those that were drawn, after
    /// [`Self::backward_tiles`]; `None` if it was not drawn.
    #[inline(always)]
    pub(crate) fn gaussian_gradient(&self, gaussian: &Gaussian<'_, R>, i: usize) -> Option<GaussianGradient<R>> {
        let info = self.frame.as_ref()?;
        let (s, record) = self.record(i, info.stride())?;
        let (part, at) = sort::part_of(s);
        P::project_backward(
            gaussian,
            &self.lists.parts[part].splats[at],
            &info.view,
            &info.settings,
            &record,
            info.extra,
        )
    }

    /// Gradient with respect to the extra channels of Gaussian `i`, after [`Self::backward_tiles`]. Returns whether the
    /// Gaussian was drawn; if not, leaves `out`, one value per channel, alone.
    pub(crate) fn feature_gradient(&self, i: usize, out: &mut [R]) -> bool {
        let Some(info) = &self.frame else { return false };
        let Some((_, record)) = self.record(i, info.stride()) else { return false };
        let first = info.stride() - info.channels + 3;
        out.copy_from_slice(&record[first..first + out.len()]);
        true
    }
}

impl<R: Real, P: Primitive<R>> FrameInfo<R, P> {
    #[inline(always)]
    fn stride(&self) -> usize {
        P::Sums::all(R::ZERO).as_ref().len() + self.channels
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

/// `dL/dtransmittance`: background times color gradient, minus the gradient of alpha.
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
