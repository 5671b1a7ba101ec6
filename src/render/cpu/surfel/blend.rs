//! Front-to-back compositing of the surfels of one row of tiles.

use std::sync::atomic::Ordering::Relaxed;

use super::super::bin::Tiles;
use super::super::lanes::{SLOTS, Walk, ramp, slots_of_rows};
use super::super::project::Splat;
use super::disk::Disk;
use super::project::SHAPE;
use crate::math::Real;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::render::{TILE_PX, TRANSMITTANCE_MIN};

/// Splats between two looks at which pixels are still open.
const CLOSED_CHECK: usize = 16;

/// The rows of the output planes that one row of tiles writes, `width * rows` values each.
#[derive(Default)]
pub struct RowOut<'a, R> {
    /// Composited channels, without background; as many planes as are wanted, at most `C`.
    pub planes: Vec<&'a mut [R]>,
    /// `sum(w z)`, `sum(w / z)`, `sum(w / z²)`, median depth; none = no geometry wanted.
    pub depths: Vec<&'a mut [R]>,
    /// Place in the tile's list, from 1, of the splat of the median depth; empty as above.
    pub median: &'a mut [u32],
    /// Transmittance left.
    pub transmittance: &'a mut [R],
    /// One past the position in the tile's list of the last splat that contributed; 0 = none.
    pub last: &'a mut [u32],
}

/// Compositing of the tiles of row `ty`; returns the number of splat-pixel products evaluated.
pub struct BlendRow<'a, 'b, R, const C: usize> {
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
    /// Where to write.
    pub out: &'a mut RowOut<'b, R>,
}

/// The shape and the channels of splat `id`.
#[inline(always)]
pub fn of_splat<R: Real, const C: usize>(values: &[R], id: usize) -> ([R; SHAPE], [R; C]) {
    let stride = SHAPE + C;
    let own = &values[id * stride..(id + 1) * stride];
    (std::array::from_fn(|k| own[k]), std::array::from_fn(|c| own[SHAPE + c]))
}

impl<R: Real, const C: usize> LaneOp<R> for BlendRow<'_, '_, R, C> {
    type Output = u64;
    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) -> u64 {
        let geometry = !self.out.depths.is_empty();
        let mut groups = 0;
        for tx in 0..self.tiles.grid[0] {
            groups += if geometry { self.tile::<L, true>(l, tx) } else { self.tile::<L, false>(l, tx) };
        }
        groups * LANES as u64
    }
}

impl<R: Real, const C: usize> BlendRow<'_, '_, R, C> {
    /// Composites one tile and returns the number of lane groups evaluated.
    #[inline(always)]
    fn tile<L: Lanes<R>, const GEOMETRY: bool>(&mut self, l: L, tx: usize) -> u64 {
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let height = TILE_PX.min(self.size[1] - corner[1]);
        let index = self.ty * self.tiles.grid[0] + tx;
        let (first, end) = (self.tiles.first[index] as usize, self.tiles.first[index + 1] as usize);

        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let (half, least) = (l.splat(R::HALF), l.splat(R::of(TRANSMITTANCE_MIN)));
        let mut sums = [[zero; C]; SLOTS];
        let mut depths = [[zero; 4]; SLOTS];
        // Light left at each pixel; negative once the pixel is closed.
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
            let (shape, channels) = of_splat::<R, C>(self.values, id);
            let disk = Disk::new(l, s, &shape, self.near);
            let value = channels.map(|v| l.splat(v));
            let place = l.splat(R::of((k + 1) as f64));
            let offset = [s.mean[0] - shape[6], s.mean[1] - shape[7]];
            let dx = walk.dx(l, ramp).map(|x| l.add(x, l.splat(offset[0])));
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                let hit = disk.hit(l, dx[slot / TILE_PX], l.splat(walk.dy[slot % TILE_PX] + offset[1]));
                let before = left[slot];
                let still = l.ge(l.mul(before, l.sub(one, hit.alpha)), least);
                let weight = l.keep(still, l.mul(hit.alpha, before));
                let after = l.sub(before, weight);
                left[slot] = l.select(still, after, l.min(before, l.sub(zero, before)));
                if GEOMETRY {
                    let inverse = l.div(one, hit.depth);
                    let near = l.mul(weight, inverse);
                    let d = &mut depths[slot];
                    d[0] = l.mul_add(weight, hit.depth, d[0]);
                    d[1] = l.add(d[1], near);
                    d[2] = l.mul_add(near, inverse, d[2]);
                    let crossed = l.both(l.ge(half, after), l.gt(before, half));
                    d[3] = l.select(crossed, hit.depth, d[3]);
                    median[slot] = l.select(crossed, place, median[slot]);
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
                for (plane, sum) in out.planes.iter_mut().zip(sums[slot]) {
                    plane[at..at + count].copy_from_slice(&l.store(sum)[..count]);
                }
                out.transmittance[at..at + count]
                    .copy_from_slice(&l.store(l.max(left[slot], l.sub(zero, left[slot])))[..count]);
                for (o, v) in out.last[at..at + count].iter_mut().zip(l.store(last[slot])) {
                    *o = v.f32() as u32;
                }
                if GEOMETRY {
                    for (plane, depth) in out.depths.iter_mut().zip(depths[slot]) {
                        plane[at..at + count].copy_from_slice(&l.store(depth)[..count]);
                    }
                    for (o, v) in out.median[at..at + count].iter_mut().zip(l.store(median[slot])) {
                        *o = v.f32() as u32;
                    }
                }
            }
        }
        groups
    }
}
