//! Gradients of one row of tiles: back-to-front walk over what [`super::blend`] composited.
//!
//! Per tile entry the pass leaves the sums over the tile's pixels of `dL/dpower` (power = -q/2)
//! times `1, dx, dy, dx², dx dy, dy²`, then `dL/dvalue` per channel. Everything about the splat's
//! shape follows from those six moments.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::lanes::{SLOTS, SplatLanes, Walk, ramp, slots_of_rows};
use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::render::{ALPHA_MAX, Cutoffs, TILE_PX};

/// Moments in front of the channels in a tile entry's record.
pub const MOMENTS: usize = 6;

/// What the backward pass reads of one row of tiles, `width * rows` values each.
pub struct RowIn<'a, R> {
    /// `dL/dplane` for each channel; missing or empty = zero.
    pub planes: Vec<&'a [R]>,
    /// `dL/dtransmittance`: background times colour gradient, minus the gradient of alpha.
    pub transmittance_gradient: &'a [R],
    /// Transmittance left by the forward pass.
    pub transmittance: &'a [R],
    /// As the forward pass left it.
    pub last: &'a [u32],
}

/// Backward pass of the tiles of row `ty`: fills `records` with `MOMENTS + C` values per entry of
/// the tile row, in the order of the lists.
pub struct BlendRowBackward<'a, 'b, R, const C: usize> {
    /// The frame's splats.
    pub splats: &'a [Splat<R>],
    /// `C` values per splat.
    pub values: &'a [R],
    /// Their tile lists.
    pub tiles: &'a Tiles,
    /// Picture size in px.
    pub size: [usize; 2],
    /// Which row of tiles.
    pub ty: usize,
    /// What is too little to be drawn.
    pub cutoffs: Cutoffs,
    /// What to read.
    pub input: &'a RowIn<'b, R>,
    /// Where to write.
    pub records: &'a mut [R],
}

impl<R: Real, const C: usize> LaneOp<R> for BlendRowBackward<'_, '_, R, C> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) {
        for tx in 0..self.tiles.grid[0] {
            self.tile(l, tx);
        }
    }
}

impl<R: Real, const C: usize> BlendRowBackward<'_, '_, R, C> {
    #[inline(always)]
    fn tile<L: Lanes<R>>(&mut self, l: L, tx: usize) {
        let (values, _) = self.values.as_chunks::<C>();
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let height = TILE_PX.min(self.size[1] - corner[1]);
        let width = TILE_PX.min(self.size[0] - corner[0]);
        let index = self.ty * self.tiles.grid[0] + tx;
        let (first, end) = (self.tiles.first[index] as usize, self.tiles.first[index + 1] as usize);
        let base = self.tiles.first[self.ty * self.tiles.grid[0]] as usize;
        let stride = MOMENTS + C;

        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let mut gradient = [[zero; C]; SLOTS];
        let mut left = [one; SLOTS];
        // Light that arrives from behind the current splat, times its gradient.
        let mut behind = [zero; SLOTS];
        let mut last = [zero; SLOTS];
        let mut furthest = [0_u32; SLOTS];
        let input = self.input;
        let part = |plane: &[R], at: usize, count: usize| {
            let mut lane = [R::ZERO; LANES];
            lane[..count].copy_from_slice(&plane[at..at + count]);
            l.load(&lane)
        };
        for row in 0..height {
            for g in 0..width.div_ceil(LANES) {
                let slot = g * TILE_PX + row;
                let count = LANES.min(width - g * LANES);
                let at = row * self.size[0] + corner[0] + g * LANES;
                for (c, plane) in input.planes.iter().enumerate().filter(|(_, p)| !p.is_empty()) {
                    gradient[slot][c] = part(plane, at, count);
                }
                left[slot] = part(input.transmittance, at, count);
                behind[slot] = l.mul(left[slot], part(input.transmittance_gradient, at, count));
                let mut places = [R::ZERO; LANES];
                for (p, v) in places.iter_mut().zip(&input.last[at..at + count]) {
                    *p = R::of(f64::from(*v));
                    furthest[slot] = furthest[slot].max(*v);
                }
                last[slot] = l.load(&places);
            }
        }
        let deepest = furthest.iter().fold(0, |m, &v| m.max(v)) as usize;

        let records = &mut self.records[(first - base) * stride..(end - base) * stride];
        records[deepest * stride..].fill(R::ZERO);
        let capped = l.splat(R::of(ALPHA_MAX));
        let (ramp, all) = (ramp(l), slots_of_rows(height));
        for k in (0..deepest).rev() {
            let id = self.tiles.entries[first + k].load(Relaxed) as usize;
            let s = &self.splats[id];
            let walk = Walk::new(l, s, corner, ramp);
            let mut slots = walk.slots & all;
            let lanes = SplatLanes::new(l, s, self.cutoffs.alpha);
            let value = values[id].map(|v| l.splat(v));
            let place = l.splat(R::of((k + 1) as f64));
            let mut moments = [zero; MOMENTS];
            let mut value_sums = [zero; C];
            let dx = walk.dx(l, ramp);
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                if (k as u32) >= furthest[slot] {
                    continue;
                }
                let (dx, dy) = (dx[slot / TILE_PX], l.splat(walk.dy[slot % TILE_PX]));
                let alpha = lanes.alphas(l, dx, walk.row(l, slot % TILE_PX));
                let alpha = l.keep(l.ge(last[slot], place), alpha);
                let mut along = zero;
                for c in 0..C {
                    along = l.mul_add(gradient[slot][c], value[c], along);
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
                let px = l.mul(power, dx);
                let py = l.mul(power, dy);
                moments[0] = l.add(moments[0], power);
                moments[1] = l.add(moments[1], px);
                moments[2] = l.add(moments[2], py);
                moments[3] = l.mul_add(px, dx, moments[3]);
                moments[4] = l.mul_add(px, dy, moments[4]);
                moments[5] = l.mul_add(py, dy, moments[5]);
            }
            let record = &mut records[k * stride..(k + 1) * stride];
            let sum = |i: usize| if i < MOMENTS { moments[i] } else { value_sums[i - MOMENTS] };
            for (part, eight) in record.chunks_mut(LANES).enumerate() {
                let sums = std::array::from_fn(|i| {
                    let i = part * LANES + i;
                    if i < MOMENTS + C { sum(i) } else { zero }
                });
                eight.copy_from_slice(&l.store(l.sums(sums))[..eight.len()]);
            }
        }
    }
}
