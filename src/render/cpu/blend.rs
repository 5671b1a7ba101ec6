//! Front-to-back compositing of one row of tiles.

use super::walk::{Primitive, RowPass, SLOTS, Sink, TileRow, Values};
use crate::math::Real;
use crate::math::lanes::{LANES, Lanes};

/// The rows of the output planes that one row of tiles writes, `width * rows` values each.
pub(crate) struct RowOut<'a, R> {
    /// Composited values, without background; as many planes as are wanted.
    pub(crate) planes: Vec<&'a mut [R]>,
    /// The primitive's extra values; none = not wanted.
    pub(crate) extra: Vec<&'a mut [R]>,
    pub(crate) transmittance: &'a mut [R],
    /// Place in the tile's list, from 1, of the last splat that contributed; 0 = none. Not wanted without a backward
    /// pass.
    pub(crate) last: Option<&'a mut [R]>,
}

/// Compositing of a row of tiles; returns the number of splat-pixel products evaluated.
pub(crate) struct BlendRow<'a, 'b, R, P> {
    pub(crate) row: TileRow<'a, R, P>,
    pub(crate) out: &'a mut RowOut<'b, R>,
}

impl<R: Real, P: Primitive<R>> RowPass<R> for BlendRow<'_, '_, R, P> {
    type Output = u64;
    #[inline(always)]
    fn tiles<L: Lanes<R>, const C: usize>(self, l: L) -> u64 {
        let mut groups = 0;
        for tx in 0..self.row.tiles.grid[0] {
            groups += match self.out.extra.is_empty() {
                true => tile::<R, P, L, C, false>(l, &self.row, self.out, tx),
                false => tile::<R, P, L, C, true>(l, &self.row, self.out, tx),
            };
        }
        groups * LANES as u64
    }
}

/// The sums of a tile's pixels.
struct Sums<'a, R: Real, P: Primitive<R>, L: Lanes<R>, const C: usize, const EXTRA: bool> {
    row: &'a TileRow<'a, R, P>,
    channels: [[L::V; C]; SLOTS],
    extra: [P::Extra<L::V>; SLOTS],
    last: [L::V; SLOTS],
    keeps_last: bool,
}

impl<R: Real, P: Primitive<R>, L: Lanes<R>, const C: usize, const EXTRA: bool> Sink<R, P, L>
    for Sums<'_, R, P, L, C, EXTRA>
{
    type Own = ([L::V; C], L::V);

    #[inline(always)]
    fn own(&self, l: L, id: u32, place: usize) -> Self::Own {
        let (_, channels) = self.row.values_of::<C>(id);
        (std::array::from_fn(|c| l.splat(channels[c])), l.splat(R::of(place as f64)))
    }

    #[inline(always)]
    fn add(&mut self, l: L, slot: usize, (values, place): &Self::Own, hit: &P::Hit<L>, light: [L::V; 3]) {
        let [weight, before, after] = light;
        if EXTRA {
            let half = l.splat(R::HALF);
            let crossed = l.both(l.ge(half, after), l.gt(before, half));
            P::gather(l, &mut self.extra[slot], hit, weight, crossed, *place);
        }
        if self.keeps_last {
            self.last[slot] = l.max(self.last[slot], l.keep(l.gt(weight, l.splat(R::ZERO)), *place));
        }
        for c in 0..C {
            self.channels[slot][c] = l.mul_add(weight, values[c], self.channels[slot][c]);
        }
    }
}

/// Composites one tile and returns the number of lane groups evaluated.
#[inline(always)]
fn tile<R: Real, P: Primitive<R>, L: Lanes<R>, const C: usize, const EXTRA: bool>(
    l: L,
    row: &TileRow<'_, R, P>,
    out: &mut RowOut<'_, R>,
    tx: usize,
) -> u64 {
    let (tile, zero) = (row.tile(tx), l.splat(R::ZERO));
    let mut sums = Sums::<R, P, L, C, EXTRA> {
        row,
        channels: [[zero; C]; SLOTS],
        extra: [P::Extra::all(zero); SLOTS],
        last: [zero; SLOTS],
        keeps_last: out.last.is_some(),
    };
    let (left, groups) = row.front_to_back::<L, _, C>(l, &tile, &mut sums);
    for (slot, at, count) in tile.slots(row.size[0]) {
        let store = |plane: &mut [R], v: L::V| plane[at..at + count].copy_from_slice(&l.store(v)[..count]);
        out.planes.iter_mut().zip(sums.channels[slot]).for_each(|(plane, sum)| store(plane, sum));
        store(out.transmittance, l.max(left[slot], l.sub(zero, left[slot])));
        if let Some(last) = &mut out.last {
            store(last, sums.last[slot]);
        }
        if EXTRA {
            out.extra.iter_mut().zip(sums.extra[slot].as_ref()).for_each(|(plane, sum)| store(plane, *sum));
        }
    }
    groups
}
