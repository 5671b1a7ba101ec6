//! Contributions of Gaussians to pixels: the weights `alpha * transmittance` that [`super::blend`] composites with,
//! handed to a sink.

use super::walk::{Primitive, RowPass, Sink, Tile, TileRow};
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, Lanes};
use crate::render::TILE_PX;

/// Takes the weights of one row of tiles.
pub(crate) trait ContributionSink<R: Real>: Send {
    /// `gaussian` contributes `weights` to the pixels of row `y` from column `x` on; zeros where it
    /// does not, also beyond the picture's right edge. Calls come tile after tile, front to back
    /// in each, all of a Gaussian in a tile together.
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<R>);

    /// [`Self::add`] for sinks that go on computing with vectors.
    #[inline(always)]
    fn add_lanes<L: Lanes<R>>(&mut self, l: L, gaussian: u32, x: usize, y: usize, weights: L::V) {
        self.add(gaussian, x, y, &l.store(weights));
    }
}

/// Hands the weights of a row of tiles on.
pub(crate) struct ContributionRow<'a, R, P, S> {
    pub(crate) row: TileRow<'a, R, P>,
    pub(crate) sink: &'a mut S,
}

impl<R: Real, P: Primitive<R>, S: ContributionSink<R>> RowPass<R> for ContributionRow<'_, R, P, S> {
    type Output = ();
    #[inline(always)]
    fn tiles<L: Lanes<R>, const C: usize>(self, l: L) {
        for tx in 0..self.row.tiles.grid[0] {
            let tile = self.row.tile(tx);
            let mut weights = Weights { row: &self.row, tile: &tile, sink: &mut *self.sink };
            self.row.front_to_back::<L, _, C>(l, &tile, &mut weights);
        }
    }
}

struct Weights<'a, R, P, S> {
    row: &'a TileRow<'a, R, P>,
    tile: &'a Tile,
    sink: &'a mut S,
}

impl<R: Real, P: Primitive<R>, L: Lanes<R>, S: ContributionSink<R>> Sink<R, P, L> for Weights<'_, R, P, S> {
    type Own = u32;

    #[inline(always)]
    fn own(&self, _: L, id: u32, _: usize) -> u32 {
        self.row.splat(id).gaussian
    }

    #[inline(always)]
    fn add(&mut self, l: L, slot: usize, gaussian: &u32, _: &P::Hit<L>, [weight, ..]: [L::V; 3]) {
        if l.bits(l.gt(weight, l.splat(R::ZERO))) != 0 {
            let [x, y] = self.tile.corner;
            self.sink.add_lanes(l, *gaussian, x + slot / TILE_PX * LANES, y + slot % TILE_PX, weight);
        }
    }
}
