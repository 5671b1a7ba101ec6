//! Surfels: Gaussians without thickness, met by each pixel's ray (2D Gaussian Splatting, Huang et
//! al. 2024).
//!
//! A surfel is a Gaussian whose third scale is ignored: a disk across its first two axes. Where the
//! ray through a pixel meets the disk's plane gives the Gaussian's value there, the depth, and so a
//! surface that does not move with the view. As in the paper, a surfel is never drawn smaller than a
//! pixel: the squared distance is the smaller of that in the plane and that in the picture.
//!
//! Sorting and binning are those of [`super::Renderer`]; own are projection ([`project`]),
//! compositing ([`blend`], [`blend_backward`]) and the way back ([`mod@project_backward`]). With
//! depth asked for, frames also hold normals and the distortion `sum over pairs (w_i w_j (1/z_i -
//! 1/z_j)²)`, which is in inverse depth because that is what a picture can resolve.

pub mod blend;
pub mod blend_backward;
pub mod disk;
pub mod project;
pub mod project_backward;

use std::time::Instant;

use rayon::prelude::*;

use self::blend::{BlendRow, RowOut};
use self::blend_backward::{BlendRowBackward, RECORD, RowIn};
use self::project::SHAPE;
use self::project_backward::project_backward;
use super::bin::{self, Tiles};
use super::project::{Chunk, View};
use super::project_backward::GaussianGradient;
use super::sort::{self, Ordered};
use super::{Clock, NONE, RenderStats, checked, empty_frame, finish, validate, with_channels};
use crate::math::Real;
use crate::math::finite::{CHECKED, NotFinite};
use crate::render::{Features, Frame, FrameGradient, MAX_CHANNELS, RenderSettings, TILE_PX};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Most channels of one pass: those of every renderer, and normals.
const MOST: usize = MAX_CHANNELS + 3;

/// Channels that the kernels are compiled for: colour; with normals; any.
fn padded(channels: usize) -> usize {
    [3, 6].into_iter().find(|&c| channels <= c).unwrap_or(MOST)
}

/// A renderer of surfels with its buffers, to be kept from frame to frame.
#[derive(Debug, Default)]
pub struct Rasterizer<R> {
    parts: Vec<Chunk<R>>,
    pub(super) ordered: Ordered<R>,
    splat_of: Vec<u32>,
    tiles: Tiles,
    pixels: Pixels<R>,
    pub(super) records: Vec<R>,
    frame: Option<FrameInfo<R>>,
    pub(super) stats: RenderStats,
}

/// What the forward pass leaves of each pixel for the backward pass.
#[derive(Debug, Default)]
struct Pixels<R> {
    transmittance: Vec<R>,
    last: Vec<u32>,
    /// `sum(w / z)` and `sum(w / z²)`.
    inverse_depth: [Vec<R>; 2],
    /// Place in the tile's list, from 1, of the splat that gives the median depth.
    median: Vec<u32>,
}

/// The part of a plane that a row of tiles covers; nothing of an empty plane.
fn cut<'a, T>(plane: &'a [T], span: &std::ops::Range<usize>) -> &'a [T] {
    plane.get(span.clone()).unwrap_or(&[])
}

/// What the backward pass must know of the forward pass.
#[derive(Debug, Clone)]
struct FrameInfo<R> {
    view: View<R>,
    settings: RenderSettings,
    gaussians: usize,
    extra: usize,
    channels: usize,
}

impl<R: Real> Rasterizer<R> {
    /// Draws `cloud` as `camera` sees it. Camera and lengths have been checked.
    pub(super) fn render(
        &mut self,
        cloud: &GaussianCloud<R>,
        features: Features<'_, R>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<R>, NotFinite> {
        let extra = features.channels;
        let channels = padded(3 + extra + if settings.depth { 3 } else { 0 });
        let view = View::new(camera, cloud.origin, settings.near);
        let size = view.size;
        let mut clock = Clock::start();
        project::project(&mut self.parts, cloud, features, &view, settings, channels);
        let project_secs = clock.lap();
        sort::sort(&mut self.ordered, &self.parts, SHAPE + channels, false);
        let sort_secs = clock.lap();
        bin::bin(&mut self.tiles, &self.ordered.splats, size);
        let bin_secs = clock.lap();
        checked(&self.parts, &self.ordered, &self.tiles, true)?;

        let n = size[0] * size[1];
        self.pixels.transmittance.resize(n, R::ONE);
        self.pixels.last.resize(n, 0);
        let geometry = if settings.depth { n } else { 0 };
        self.pixels.inverse_depth.iter_mut().for_each(|p| p.resize(geometry, R::ZERO));
        self.pixels.median.resize(geometry, 0);
        let mut frame = empty_frame(size, extra, settings.depth);
        frame.normals = std::array::from_fn(|_| vec![R::ZERO; geometry]);
        let products = self.blend(&mut frame, channels, size, settings);
        finish(&mut frame, &self.pixels.transmittance, settings.background);
        let [first, second] = &self.pixels.inverse_depth;
        let spread = |((a, m), s): ((&R, &R), &R)| (*a * *s - *m * *m).max(R::ZERO);
        frame.distortion = frame.alpha.iter().zip(first).zip(second).map(spread).collect();
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
        self.frame = Some(FrameInfo { view, settings: settings.clone(), gaussians: cloud.len(), extra, channels });
        Ok(frame)
    }

    fn blend(&mut self, frame: &mut Frame<R>, channels: usize, size: [usize; 2], settings: &RenderSettings) -> u64 {
        let strip = size[0] * TILE_PX;
        let [first, second] = &mut self.pixels.inverse_depth;
        let mut rows: Vec<RowOut<'_, R>> = self
            .pixels
            .transmittance
            .chunks_mut(strip)
            .zip(self.pixels.last.chunks_mut(strip))
            .map(|(transmittance, last)| RowOut { transmittance, last, ..RowOut::default() })
            .collect();
        let planes = frame.color.iter_mut().chain(&mut frame.features).chain(&mut frame.normals);
        for plane in planes {
            rows.iter_mut().zip(plane.chunks_mut(strip)).for_each(|(row, part)| row.planes.push(part));
        }
        let depths = [&mut frame.depth, first, second, &mut frame.median_depth];
        for plane in depths {
            rows.iter_mut().zip(plane.chunks_mut(strip)).for_each(|(row, part)| row.depths.push(part));
        }
        rows.iter_mut().zip(self.pixels.median.chunks_mut(strip)).for_each(|(row, part)| row.median = part);
        let (splats, values, tiles) = (&self.ordered.splats, &self.ordered.values, &self.tiles);
        let near = R::of(settings.near);
        rows.par_iter_mut()
            .enumerate()
            .map(|(ty, out)| {
                with_channels!(channels, C in [3 6, MOST] => {
                    R::vectorize(BlendRow::<R, C> { splats, values, tiles, size, ty, near, out })
                })
            })
            .sum()
    }

    /// Backward pass over the tiles of the last frame; does nothing before the first.
    pub(super) fn backward_tiles(&mut self, gradient: &FrameGradient<R>) {
        let Some(info) = &self.frame else { return };
        let clock = Instant::now();
        self.splat_of.clear();
        self.splat_of.resize(info.gaussians, NONE);
        for (s, splat) in self.ordered.splats.iter().enumerate() {
            self.splat_of[splat.gaussian as usize] = s as u32;
        }
        let size = info.view.size;
        let n = size[0] * size[1];
        let d_transmittance = super::transmittance_gradient(gradient, info.settings.background, n);
        let stride = RECORD + info.channels;
        self.records.resize(self.tiles.entries.len() * stride, R::ZERO);
        let strip = size[0] * TILE_PX;
        let pixels = &self.pixels;
        let mut rest = self.records.as_mut_slice();
        let mut tasks = Vec::with_capacity(self.tiles.grid[1]);
        for ty in 0..self.tiles.grid[1] {
            let span = ty * strip..((ty + 1) * strip).min(n);
            let mut planes: Vec<&[R]> = gradient.color.iter().map(|p| cut(p, &span)).collect();
            planes.extend((0..info.extra).map(|k| gradient.features.get(k).map_or(&[][..], |p| cut(p, &span))));
            let mut depths: [&[R]; 3] = [&[]; 3];
            if info.settings.depth {
                planes.extend(gradient.normals.iter().map(|p| cut(p, &span)));
                depths = [&gradient.depth, &gradient.distortion, &gradient.median_depth].map(|p| cut(p, &span));
            }
            let input = RowIn {
                planes,
                depths,
                transmittance_gradient: &d_transmittance[span.clone()],
                transmittance: &pixels.transmittance[span.clone()],
                last: &pixels.last[span.clone()],
                inverse_depth: pixels.inverse_depth.each_ref().map(|p| cut(p, &span)),
                median: cut(&pixels.median, &span),
            };
            let [from, to] = [ty * self.tiles.grid[0], (ty + 1) * self.tiles.grid[0]];
            let entries = (self.tiles.first[to] - self.tiles.first[from]) as usize;
            let (own, others) = rest.split_at_mut(entries * stride);
            rest = others;
            tasks.push((ty, input, own));
        }
        let (splats, values, tiles) = (&self.ordered.splats, &self.ordered.values, &self.tiles);
        let near = info.view.near;
        tasks.into_par_iter().for_each(|(ty, input, own)| {
            with_channels!(info.channels, C in [3 6, MOST] => {
                let input = &input;
                R::vectorize(BlendRowBackward::<R, C> { splats, values, tiles, size, ty, near, input, records: own });
            });
        });
        self.stats.backward_secs = clock.elapsed().as_secs_f64();
    }

    /// Sum of surfel `i`'s tile records, or `None` if it was not drawn.
    fn record(&self, i: usize, stride: usize) -> Option<[R; RECORD + MOST]> {
        let s = *self.splat_of.get(i)?;
        if s == NONE {
            return None;
        }
        let (from, to) = self.tiles.span[s as usize];
        let mut sum = [R::ZERO; RECORD + MOST];
        for &place in &self.tiles.places[from as usize..to as usize] {
            let at = place as usize * stride;
            for (total, v) in sum.iter_mut().zip(&self.records[at..at + stride]) {
                *total += *v;
            }
        }
        Some(sum)
    }

    /// Gradient of surfel `i`, whose parameters are still those that were drawn; `None` if it was
    /// not drawn. The third scale has none.
    pub(super) fn gaussian_gradient(&self, gaussian: &Gaussian<'_, R>, i: usize) -> Option<GaussianGradient<R>> {
        let info = self.frame.as_ref()?;
        let record = self.record(i, RECORD + info.channels)?;
        let normal = info.settings.depth.then_some(RECORD + 3 + info.extra);
        project_backward(gaussian, &info.view, &info.settings, &record, normal)
    }

    /// Gradient with respect to the extra channels of surfel `i`; leaves `out` alone and returns
    /// false if it was not drawn.
    pub(super) fn feature_gradient(&self, i: usize, out: &mut [R]) -> bool {
        let Some(stride) = self.frame.as_ref().map(|f| RECORD + f.channels) else { return false };
        let Some(record) = self.record(i, stride) else { return false };
        out.copy_from_slice(&record[RECORD + 3..RECORD + 3 + out.len()]);
        true
    }
}
