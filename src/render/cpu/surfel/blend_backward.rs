//! Gradients of the surfels of one row of tiles: back-to-front walk over what [`super::blend`]
//! composited.

use std::sync::atomic::Ordering::Relaxed;

use super::super::bin::Tiles;
use super::super::lanes::{SLOTS, Walk, ramp, slots_of_rows};
use super::super::project::Splat;
use super::blend::of_splat;
use super::disk::{Disk, INVERSE_BLUR};
use crate::math::Real;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::render::{ALPHA_MAX, TILE_PX};

/// Sums in front of the channels in a tile entry's record: `dL/dopacity` times opacity; `dL/d` of
/// the six derivatives of a splat's shape, of its depth, and of its projected centre.
pub const RECORD: usize = 10;

/// What the backward pass reads of one row of tiles, `width * rows` values each; missing or empty
/// gradients = zero.
pub struct RowIn<'a, R> {
    /// `dL/dplane` for each channel.
    pub planes: Vec<&'a [R]>,
    /// `dL/d` of expected depth (not divided by alpha), distortion, median depth.
    pub depths: [&'a [R]; 3],
    /// `dL/dtransmittance`: background times colour gradient, minus the gradient of alpha.
    pub transmittance_gradient: &'a [R],
    /// Transmittance left by the forward pass.
    pub transmittance: &'a [R],
    /// As the forward pass left it.
    pub last: &'a [u32],
    /// `sum(w / z)` and `sum(w / z²)`; empty without geometry.
    pub inverse_depth: [&'a [R]; 2],
    /// Place of the splat of the median depth; empty without geometry.
    pub median: &'a [u32],
}

/// Backward pass of the tiles of row `ty`: fills `records` with `RECORD + C` values per entry of
/// the tile row, in the order of the lists.
pub struct BlendRowBackward<'a, 'b, R, const C: usize> {
    /// The frame's splats.
    pub splats: &'a [Splat<R>],
    /// `SHAPE + C` values per splat.
    pub values: &'a [R],
    /// Their tile lists.
    pub tiles: &'a Tiles,
    /// Picture size in px.
    pub size: [usize; 2],
    /// Which row of tiles.
    pub ty: usize,
    /// Near plane.
    pub near: R,
    /// What to read.
    pub input: &'a RowIn<'b, R>,
    /// Where to write.
    pub records: &'a mut [R],
}

/// What depth adds to a pixel's state: gradients of depth, distortion and median depth, the sums
/// of inverse depth, alpha, the median's place.
#[derive(Clone, Copy)]
struct DepthState<V> {
    gradient: [V; 3],
    inverse: [V; 2],
    alpha: V,
    median: V,
}

impl<R: Real, const C: usize> LaneOp<R> for BlendRowBackward<'_, '_, R, C> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) {
        let geometry = !self.input.median.is_empty() && self.input.depths.iter().any(|d| !d.is_empty());
        for tx in 0..self.tiles.grid[0] {
            if geometry {
                self.tile::<L, true>(l, tx);
            } else {
                self.tile::<L, false>(l, tx);
            }
        }
    }
}

impl<R: Real, const C: usize> BlendRowBackward<'_, '_, R, C> {
    #[inline(always)]
    fn tile<L: Lanes<R>, const GEOMETRY: bool>(&mut self, l: L, tx: usize) {
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let height = TILE_PX.min(self.size[1] - corner[1]);
        let width = TILE_PX.min(self.size[0] - corner[0]);
        let index = self.ty * self.tiles.grid[0] + tx;
        let (first, end) = (self.tiles.first[index] as usize, self.tiles.first[index + 1] as usize);
        let base = self.tiles.first[self.ty * self.tiles.grid[0]] as usize;
        let stride = RECORD + C;

        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let mut gradient = [[zero; C]; SLOTS];
        let empty = DepthState { gradient: [zero; 3], inverse: [zero; 2], alpha: zero, median: zero };
        let mut depths = [empty; SLOTS];
        let mut left = [one; SLOTS];
        // Light that arrives from behind the current splat, times its gradient.
        let mut behind = [zero; SLOTS];
        let mut last = [zero; SLOTS];
        let mut furthest = [0_u32; SLOTS];
        let input = self.input;
        let part = |plane: &[R], at: usize, count: usize| {
            let mut lane = [R::ZERO; LANES];
            if let Some(own) = plane.get(at..at + count) {
                lane[..count].copy_from_slice(own);
            }
            l.load(&lane)
        };
        let places = |plane: &[u32], at: usize, count: usize| {
            let mut lane = [R::ZERO; LANES];
            if let Some(own) = plane.get(at..at + count) {
                lane.iter_mut().zip(own).for_each(|(p, v)| *p = R::of(f64::from(*v)));
            }
            l.load(&lane)
        };
        for row in 0..height {
            for g in 0..width.div_ceil(LANES) {
                let slot = g * TILE_PX + row;
                let count = LANES.min(width - g * LANES);
                let at = row * self.size[0] + corner[0] + g * LANES;
                for (own, plane) in gradient[slot].iter_mut().zip(&input.planes) {
                    *own = part(plane, at, count);
                }
                left[slot] = part(input.transmittance, at, count);
                behind[slot] = l.mul(left[slot], part(input.transmittance_gradient, at, count));
                last[slot] = places(input.last, at, count);
                furthest[slot] = input.last[at..at + count].iter().fold(0, |m, &v| m.max(v));
                if GEOMETRY {
                    depths[slot] = DepthState {
                        gradient: input.depths.map(|plane| part(plane, at, count)),
                        inverse: input.inverse_depth.map(|plane| part(plane, at, count)),
                        alpha: l.sub(one, left[slot]),
                        median: places(input.median, at, count),
                    };
                }
            }
        }
        let deepest = furthest.iter().fold(0, |m, &v| m.max(v)) as usize;

        let records = &mut self.records[(first - base) * stride..(end - base) * stride];
        records[deepest * stride..].fill(R::ZERO);
        let capped = l.splat(R::of(ALPHA_MAX));
        let (ramp, all) = (ramp(l), slots_of_rows(height));
        let (two, blur) = (l.splat(R::of(2.0)), l.splat(R::of(INVERSE_BLUR)));
        for k in (0..deepest).rev() {
            let id = self.tiles.entries[first + k].load(Relaxed) as usize;
            let s = &self.splats[id];
            let walk = Walk::new(l, s, corner, ramp);
            let mut slots = walk.slots & all;
            let (shape, channels) = of_splat::<R, C>(self.values, id);
            let disk = Disk::new(l, s, &shape, self.near);
            let value = channels.map(|v| l.splat(v));
            let place = l.splat(R::of((k + 1) as f64));
            let offset = [s.mean[0] - shape[6], s.mean[1] - shape[7]];
            let dx = walk.dx(l, ramp).map(|x| l.add(x, l.splat(offset[0])));
            let mut shape_sums = [zero; RECORD];
            let mut value_sums = [zero; C];
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                if (k as u32) >= furthest[slot] {
                    continue;
                }
                let (dx, dy) = (dx[slot / TILE_PX], l.splat(walk.dy[slot % TILE_PX] + offset[1]));
                let hit = disk.hit(l, dx, dy);
                let counts = l.ge(last[slot], place);
                let alpha = l.keep(counts, hit.alpha);
                let mut along = zero;
                for c in 0..C {
                    along = l.mul_add(gradient[slot][c], value[c], along);
                }
                let d = &depths[slot];
                let mut near = zero;
                if GEOMETRY {
                    // Distortion A s - m² with A, m, s the sums of w, w / z and w / z².
                    near = l.div(one, hit.depth);
                    let spread = l.mul(near, l.sub(l.mul(near, d.alpha), l.mul(two, d.inverse[0])));
                    along = l.mul_add(d.gradient[0], hit.depth, along);
                    along = l.mul_add(d.gradient[1], l.add(spread, d.inverse[1]), along);
                }
                // Take the splat off: transmittance in front of it, its weight, and dL/dalpha.
                let inverse = l.div(one, l.sub(one, alpha));
                let before = l.mul(left[slot], inverse);
                let weight = l.mul(alpha, before);
                let d_alpha = l.sub(l.mul(before, along), l.mul(behind[slot], inverse));
                // A capped alpha does not depend on the splat's opacity or shape.
                let power = l.select(l.ge(alpha, capped), zero, l.mul(alpha, d_alpha));
                behind[slot] = l.mul_add(weight, along, behind[slot]);
                left[slot] = before;
                for c in 0..C {
                    value_sums[c] = l.mul_add(weight, gradient[slot][c], value_sums[c]);
                }
                let mut d_depth = zero;
                if GEOMETRY {
                    let pull = l.mul(l.mul(near, near), l.sub(d.inverse[0], l.mul(near, d.alpha)));
                    d_depth = l.mul(weight, l.mul_add(l.mul(two, pull), d.gradient[1], d.gradient[0]));
                    let median = l.both(l.ge(d.median, place), l.ge(place, d.median));
                    d_depth = l.add(d_depth, l.keep(median, d.gradient[2]));
                }

                // Through the plane, where its distance counts.
                let d_through = l.keep(hit.through, d_depth);
                let [u, v] = hit.at;
                let d_u = l.sub(l.mul(d_through, disk.along[0]), l.mul(power, u));
                let d_v = l.sub(l.mul(d_through, disk.along[1]), l.mul(power, v));
                let d_w = l.sub(zero, l.mul(hit.inverse, l.mul_add(d_u, u, l.mul(d_v, v))));
                let scale = l.mul(disk.z, hit.inverse);
                let d_p = l.sub(l.mul(d_u, scale), l.mul(disk.along[0], d_w));
                let d_q = l.sub(l.mul(d_v, scale), l.mul(disk.along[1], d_w));
                let [p, q] = hit.raw;
                let d_z = l.mul_add(hit.inverse, l.mul_add(d_u, p, l.mul(d_v, q)), d_depth);
                let [[ax, ay], [bx, by]] = disk.across;
                // Through the picture, where that distance counts.
                let flat = l.mul(blur, l.select(hit.through, zero, power));
                let center_x = l.sub(l.mul(bx, d_q), l.mul(by, d_p));
                let center_y = l.sub(l.mul(ay, d_p), l.mul(ax, d_q));
                let terms = [
                    power,
                    l.mul_add(dy, d_q, l.mul(by, d_w)),
                    l.sub(zero, l.mul_add(dy, d_p, l.mul(bx, d_w))),
                    l.sub(zero, l.mul_add(dx, d_q, l.mul(ay, d_w))),
                    l.mul_add(dx, d_p, l.mul(ax, d_w)),
                    l.sub(l.mul(d_through, u), l.mul(p, d_w)),
                    l.sub(l.mul(d_through, v), l.mul(q, d_w)),
                    d_z,
                    l.mul_add(flat, dx, center_x),
                    l.mul_add(flat, dy, center_y),
                ];
                for (sum, term) in shape_sums.iter_mut().zip(terms) {
                    *sum = l.add(*sum, term);
                }
            }
            let record = &mut records[k * stride..(k + 1) * stride];
            let sum = |i: usize| if i < RECORD { shape_sums[i] } else { value_sums[i - RECORD] };
            for (part, eight) in record.chunks_mut(LANES).enumerate() {
                let sums = std::array::from_fn(|i| {
                    let i = part * LANES + i;
                    if i < RECORD + C { sum(i) } else { zero }
                });
                eight.copy_from_slice(&l.store(l.sums(sums))[..eight.len()]);
            }
        }
    }
}
