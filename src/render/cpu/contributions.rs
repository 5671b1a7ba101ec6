//! Which Gaussian contributes how much to which pixel: the weights `alpha * transmittance` that
//! [`super::blend`] composites with, handed to whoever counts them.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::lanes::{SLOTS, SplatLanes, Walk, ramp, slots_of_rows};
use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, LaneOp, Lanes};
use crate::render::{Cutoffs, TILE_PX};

/// Takes the weights of one row of tiles.
pub trait ContributionSink<R>: Send {
    /// `gaussian` contributes `weights` to the pixels of row `y` from column `x` on; zeros where it
    /// does not, also beyond the picture's right edge. Calls come tile after tile, front to back
    /// in each, all of a Gaussian in a tile together.
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<R>);
}

/// Walks the tiles of row `ty`.
pub struct ContributionRow<'a, R, V> {
    /// The frame's splats.
    pub splats: &'a [Splat<R>],
    /// Their tile lists.
    pub tiles: &'a Tiles,
    /// Picture size in px.
    pub size: [usize; 2],
    /// Which row of tiles.
    pub ty: usize,
    /// What is too little to be drawn.
    pub cutoffs: Cutoffs,
    /// Who takes them.
    pub sink: &'a mut V,
}

impl<R: Real, V: ContributionSink<R>> LaneOp<R> for ContributionRow<'_, R, V> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes<R>>(mut self, l: L) {
        for tx in 0..self.tiles.grid[0] {
            self.tile(l, tx);
        }
    }
}

impl<R: Real, V: ContributionSink<R>> ContributionRow<'_, R, V> {
    #[inline(always)]
    fn tile<L: Lanes<R>>(&mut self, l: L, tx: usize) {
        let corner = [tx * TILE_PX, self.ty * TILE_PX];
        let height = TILE_PX.min(self.size[1] - corner[1]);
        let width = TILE_PX.min(self.size[0] - corner[0]);
        let index = self.ty * self.tiles.grid[0] + tx;
        let (first, end) = (self.tiles.first[index] as usize, self.tiles.first[index + 1] as usize);
        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let least = l.splat(R::of(self.cutoffs.transmittance));
        let ramp = ramp(l);
        // Lanes beyond the picture's right edge start closed.
        let inside = l.ge(l.splat(R::of(width as f64) - R::ONE), ramp);
        let beyond = l.ge(l.splat(R::of(width as f64 - LANES as f64) - R::ONE), ramp);
        let mut left = [zero; SLOTS];
        for (slot, left) in left.iter_mut().enumerate() {
            *left = l.keep(if slot < TILE_PX { inside } else { beyond }, one);
        }
        let mut alive = slots_of_rows(height);
        for entry in &self.tiles.entries[first..end] {
            let s = &self.splats[entry.load(Relaxed) as usize];
            let walk = Walk::new(l, s, corner, ramp);
            let mut slots = walk.slots & alive;
            if slots == 0 {
                continue;
            }
            let lanes = SplatLanes::new(l, s, self.cutoffs.alpha);
            let dx = walk.dx(l, ramp);
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                let alpha = lanes.alphas(l, dx[slot / TILE_PX], walk.row(l, slot % TILE_PX));
                let before = left[slot];
                let still = l.ge(l.mul(before, l.sub(one, alpha)), least);
                let weight = l.keep(still, l.mul(alpha, before));
                left[slot] = l.keep(still, l.sub(before, weight));
                if l.bits(still) == 0 {
                    alive &= !(1 << slot);
                }
                if l.bits(l.gt(weight, zero)) != 0 {
                    let (x, y) = (corner[0] + slot / TILE_PX * LANES, corner[1] + slot % TILE_PX);
                    self.sink.add(s.gaussian, x, y, &l.store(weight));
                }
            }
            if alive == 0 {
                break;
            }
        }
    }
}
