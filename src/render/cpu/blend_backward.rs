//! Gradients of one row of tiles: back-to-front walk over what [`super::blend`] composited.
//!
//! Per tile entry the pass leaves the primitive's sums over the tile's pixels, from which everything about its
//! shape follows, then `dL/dvalue` per channel.

use super::walk::{Primitive, Reach, RowPass, SLOTS, TileRow, Values, ramp, slots_of_rows};
use crate::math::Real;
use crate::math::lanes::{LANES, Lanes};
use crate::render::ALPHA_MAX;

/// Inputs of the backward pass for one row of tiles, `width * rows` values each.
pub(crate) struct RowIn<'a, R> {
    /// `dL/dplane` for each channel; missing or empty = zero.
    pub(crate) planes: Vec<&'a [R]>,
    /// The primitive's state; none = nothing but channels has a gradient.
    pub(crate) state: Vec<&'a [R]>,
    /// `dL/dtransmittance`: background times color gradient, minus the gradient of alpha.
    pub(crate) transmittance_gradient: &'a [R],
    /// Transmittance left by the forward pass.
    pub(crate) transmittance: &'a [R],
    /// As the forward pass left it.
    pub(crate) last: &'a [R],
}

/// Backward pass of a row of tiles: fills `records` with the primitive's sums and those of `C` channels per
/// entry of the tile row, in the order of the lists.
pub(crate) struct BlendRowBackward<'a, 'b, R, P> {
    pub(crate) row: TileRow<'a, R, P>,
    pub(crate) input: &'a RowIn<'b, R>,
    pub(crate) records: &'a mut [R],
}

impl<R: Real, P: Primitive<R>> RowPass<R> for BlendRowBackward<'_, '_, R, P> {
    type Output = ();
    #[inline(always)]
    fn tiles<L: Lanes<R>, const C: usize>(mut self, l: L) {
        for tx in 0..self.row.tiles.grid[0] {
            match self.input.state.is_empty() {
                true => self.tile::<L, C, false>(l, tx),
                false => self.tile::<L, C, true>(l, tx),
            }
        }
    }
}

/// Numbers of a plane, zeros where it has none.
#[inline(always)]
fn load<R: Real, L: Lanes<R>>(l: L, plane: &[R], at: usize, count: usize) -> L::V {
    let mut lane = [R::ZERO; LANES];
    if let Some(own) = plane.get(at..at + count) {
        lane[..count].copy_from_slice(own);
    }
    l.load(&lane)
}

impl<R: Real, P: Primitive<R>> BlendRowBackward<'_, '_, R, P> {
    #[inline(always)]
    fn tile<L: Lanes<R>, const C: usize, const STATE: bool>(&mut self, l: L, tx: usize) {
        let (row, input) = (&self.row, self.input);
        let tile = row.tile(tx);
        let (zero, one) = (l.splat(R::ZERO), l.splat(R::ONE));
        let mut gradient = [[zero; C]; SLOTS];
        let mut state = [P::State::all(zero); SLOTS];
        let mut left = [one; SLOTS];
        // Light that arrives from behind the current splat, times its gradient.
        let mut behind = [zero; SLOTS];
        let mut last = [zero; SLOTS];
        let mut furthest = [0_u32; SLOTS];
        for (slot, at, count) in tile.slots(row.size[0]) {
            for (own, plane) in gradient[slot].iter_mut().zip(&input.planes) {
                *own = load(l, plane, at, count);
            }
            left[slot] = load(l, input.transmittance, at, count);
            behind[slot] = l.mul(left[slot], load(l, input.transmittance_gradient, at, count));
            last[slot] = load(l, input.last, at, count);
            furthest[slot] = input.last[at..at + count].iter().fold(0, |m, v| m.max(v.f32() as u32));
            if STATE {
                for (own, plane) in state[slot].as_mut().iter_mut().zip(&input.state) {
                    *own = load(l, plane, at, count);
                }
            }
        }
        let deepest = furthest.iter().fold(0, |m, &v| m.max(v)) as usize;

        let sums = P::Sums::all(zero);
        let before_channels = sums.as_ref().len();
        let stride = before_channels + C;
        let base = row.tiles.first[row.ty * row.tiles.grid[0]] as usize;
        let records = &mut self.records[(tile.entries.start - base) * stride..(tile.entries.end - base) * stride];
        records[deepest * stride..].fill(R::ZERO);
        let capped = l.splat(R::of(ALPHA_MAX));
        let (ramp, all) = (ramp(l), slots_of_rows(tile.size[1]));
        for k in (0..deepest).rev() {
            let id = row.tiles.splat(tile.entries.start + k);
            let s = row.splat(id);
            let reach = Reach::new(l, s, tile.corner, ramp);
            let mut slots = reach.slots & all;
            let (shape, channels) = row.values_of::<C>(id);
            let constants = row.primitive.constants(l, s, shape, reach.dx(l, ramp));
            let value: [L::V; C] = std::array::from_fn(|c| l.splat(channels[c]));
            let place = l.splat(R::of((k + 1) as f64));
            let mut sums = P::Sums::all(zero);
            let mut value_sums = [zero; C];
            while slots != 0 {
                let slot = slots.trailing_zeros() as usize;
                slots &= slots - 1;
                if (k as u32) >= furthest[slot] {
                    continue;
                }
                let hit = P::hit(l, &constants, &reach, slot);
                let alpha = l.keep(l.ge(last[slot], place), P::alpha(&hit));
                let mut along = zero;
                for c in 0..C {
                    along = l.mul_add(gradient[slot][c], value[c], along);
                }
                if STATE {
                    along = P::along(l, &state[slot], &hit, along);
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
                P::sum::<L, STATE>(l, &mut sums, &constants, &hit, &state[slot], [power, weight, place]);
            }
            let record = &mut records[k * stride..(k + 1) * stride];
            let sums = sums.as_ref();
            for (part, eight) in record.chunks_mut(LANES).enumerate() {
                let all = std::array::from_fn(|i| match part * LANES + i {
                    i if i < before_channels => sums[i],
                    i if i < stride => value_sums[i - before_channels],
                    _ => zero,
                });
                eight.copy_from_slice(&l.store(l.sums(all))[..eight.len()]);
            }
        }
    }
}
