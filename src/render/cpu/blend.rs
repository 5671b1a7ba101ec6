//! Front-to-back compositing of one row of tiles.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::lanes::{SLOTS, SplatLanes, Walk, ramp, slots_of_rows};
use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::render::{Cutoffs, TILE_PX};

/// Splats between two looks at which pixels are still open.
const CLOSED_CHECK: usize = 16;

/// The rows of the output planes that one row of tiles writes, `width * rows` values each.
pub struct RowOut<'a, R> {
    /// Composited values, without background; as many planes as are wanted, at most `C`.
    pub planes: Vec<&'a mut [R]>,
    /// Transmittance left.
    pub transmittance: &'a mut [R],
    /// One past the position in the tile's list of the last splat that contributed; 0 = none.
    pub last: &'a mut [u32],
    /// Median depth; empty = not wanted.
    pub median: &'a mut [R],
}

/// Compositing of the tiles of row `ty`; returns the number of splat-pixel products evaluated.
pub struct BlendRow<'a, 'b, R, const C: usize> {
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
    /// Where to write.
    pub out: &'a mut RowOut<'b, R>,
}

impl<R: Real, const C: usize> LaneOp<R> for BlendRow<'_, '_, R, C> {
    type Output = u64;
    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) -> u64 {
        let median = !self.out.median.is_empty();
        let mut groups = 0;
        for tx in 0..self.tiles.grid[0] {
            groups += if median { self.tile::<L, true>(l, tx) } else { self.tile::<L, false>(l, tx) };
        }
        groups * LANES as u64
    }
}

impl<R: Real, const C: usize> BlendRow<'_, '_, R, C> {
    /// Composites one tile and returns the number of lane groups evaluated.
    #[inline(always)]
    fn tile<L: Lanes<R>, const MEDIAN: bool>(&mut self, l: L, tx: usize) -> u64 {
        let (values, _) = self.values.as_chunks::<C>();
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let height = TILE_PX.min(self.size[1] - corner[1]);
        let index = self.ty * self.tiles.grid[0] + tx;
        let (first, end) = (self.tiles.first[index] as usize, self.tiles.first[index + 1] as usize);

        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let (half, least) = (l.splat(R::HALF), l.splat(R::of(self.cutoffs.transmittance)));
        let mut sums = [[zero; C]; SLOTS];
        // Light left at each pixel; negative once the pixel is closed. Selecting between a new value
        // and the one in memory would become a masked store, whose result the next splat would
        // have to wait for; hence the sign, and `max` below.
        let mut left = [one; SLOTS];
        let mut last = [zero; SLOTS];
        let mut median = [zero; SLOTS];
        let ramp = ramp(l);
        let all = slots_of_rows(height);
        let mut alive = all;
        let mut groups = 0_u64;

        for (k, entry) in self.tiles.entries[first..end].iter().enumerate() {
            let id = entry.load(Relaxed) as usize;
            let s = &self.splats[id];
            let walk = Walk::new(l, s, corner, ramp);
            let mut slots = walk.slots & alive;
            if slots == 0 {
                continue;
            }
            groups += u64::from(slots.count_ones());
            let lanes = SplatLanes::new(l, s, self.cutoffs.alpha);
            let value = values[id].map(|v| l.splat(v));
            let place = l.splat(R::of((k + 1) as f64));
            let dx = walk.dx(l, ramp);
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                let alpha = lanes.alphas(l, dx[slot / TILE_PX], walk.row(l, slot % TILE_PX));
                let before = left[slot];
                // A pixel stays open while the next splat leaves it enough light.
                let still = l.ge(l.mul(before, l.sub(one, alpha)), least);
                let weight = l.keep(still, l.mul(alpha, before));
                let after = l.sub(before, weight);
                left[slot] = l.select(still, after, l.min(before, l.sub(zero, before)));
                if MEDIAN {
                    let arrived = l.select(l.ge(half, after), l.splat(s.depth), median[slot]);
                    median[slot] = l.select(l.ge(half, before), median[slot], arrived);
                }
                last[slot] = l.max(last[slot], l.keep(l.gt(weight, zero), place));
                for c in 0..C {
                    sums[slot][c] = l.mul_add(weight, value[c], sums[slot][c]);
                }
            }
            if k % CLOSED_CHECK == CLOSED_CHECK - 1 {
                alive = (0..SLOTS as u32)
                    .filter(|&slot| all >> slot & 1 == 1 && l.bits(l.ge(left[slot as usize], zero)) != 0)
                    .fold(0, |m, slot| m | 1 << slot);
                if alive == 0 {
                    break;
                }
            }
        }

        let width = TILE_PX.min(self.size[0] - corner[0]);
        let out = &mut *self.out;
        for row in 0..height {
            for g in 0..width.div_ceil(LANES) {
                let slot = g * TILE_PX + row;
                let count = LANES.min(width - g * LANES);
                let at = row * self.size[0] + corner[0] + g * LANES;
                for (c, plane) in out.planes.iter_mut().enumerate() {
                    plane[at..at + count].copy_from_slice(&l.store(sums[slot][c])[..count]);
                }
                out.transmittance[at..at + count]
                    .copy_from_slice(&l.store(l.max(left[slot], l.sub(zero, left[slot])))[..count]);
                for (o, v) in out.last[at..at + count].iter_mut().zip(l.store(last[slot])) {
                    *o = v.f32() as u32;
                }
                if MEDIAN {
                    out.median[at..at + count].copy_from_slice(&l.store(median[slot])[..count]);
                }
            }
        }
        groups
    }
}
