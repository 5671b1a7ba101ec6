//! What the forward and backward passes over a tile share: pixels in lanes of eight, the alpha
//! rule, and which of a tile's pixels a splat can touch.

use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, Lanes};
use crate::render::{ALPHA_MAX, TILE_PX};

/// Lane groups per tile row.
pub const GROUPS: usize = TILE_PX / LANES;
/// Lane groups per tile.
pub const SLOTS: usize = TILE_PX * GROUPS;

/// The lane groups of one tile that a splat can touch, and the row constants of its quadratic form.
///
/// Group `g` of row `row` is slot `g * TILE_PX + row`.
pub struct Walk<R> {
    /// One bit per slot.
    pub slots: u32,
    /// Vertical offsets of the rows of pixel centres from the splat's centre.
    pub dy: [R; TILE_PX],
    /// `2 b dy` per row.
    linear: [R; TILE_PX],
    /// `c dy²` per row.
    constant: [R; TILE_PX],
    /// Horizontal offset of the first pixel centre from the splat's centre.
    left: R,
}

/// Slots of the rows `0..height`.
#[inline(always)]
pub fn slots_of_rows(height: usize) -> u32 {
    let rows = (1_u32 << height) - 1;
    rows | rows << TILE_PX
}

impl<R: Real> Walk<R> {
    /// The walk of `s` over the tile whose first pixel is `corner`. `ramp` is 0, 1, ... 7.
    #[inline(always)]
    pub fn new<L: Lanes<R>>(l: L, s: &Splat<R>, corner: [usize; 2], ramp: L::V) -> Self {
        let [a, b, c] = s.conic;
        let left = R::of(corner[0] as f64 + 0.5) - s.mean[0];
        let top = R::of(corner[1] as f64 + 0.5) - s.mean[1];
        let slope = -b / a;
        // A row at dy meets the ellipse for pixels within `half` of `middle`; see `alphas` for the
        // form. A hundredth of a pixel of slack covers rounding: the alpha rule decides anyway.
        let (curve, inverse_a) = (l.splat(c + b * slope), l.splat(R::ONE / a));
        let slack = R::of(0.01);
        let mut walk =
            Self { slots: 0, dy: [R::ZERO; TILE_PX], linear: [R::ZERO; TILE_PX], constant: [R::ZERO; TILE_PX], left };
        for part in 0..GROUPS {
            let dy = l.add(l.splat(top + R::of((part * LANES) as f64)), ramp);
            let square = l.mul(dy, dy);
            let rest = l.sub(l.splat(s.reach), l.mul(curve, square));
            // Outside the ellipse the root is NaN and every comparison false.
            let half = l.add(l.sqrt(l.mul(rest, inverse_a)), l.splat(slack));
            let middle = l.mul_add(l.splat(slope), dy, l.splat(-left));
            let (from, to) = (l.sub(middle, half), l.add(middle, half));
            for g in 0..GROUPS {
                let first = l.splat(R::of((g * LANES) as f64));
                let last = l.splat(R::of((g * LANES + LANES - 1) as f64));
                let touched = l.both(l.ge(last, from), l.ge(to, first));
                walk.slots |= l.bits(touched) << (g * TILE_PX + part * LANES);
            }
            let rows = part * LANES..(part + 1) * LANES;
            walk.dy[rows.clone()].copy_from_slice(&l.store(dy));
            walk.linear[rows.clone()].copy_from_slice(&l.store(l.mul(l.splat(R::of(2.0) * b), dy)));
            walk.constant[rows].copy_from_slice(&l.store(l.mul(l.splat(c), square)));
        }
        walk
    }

    /// Horizontal offsets of each group's pixel centres from the splat's centre.
    #[inline(always)]
    pub fn dx<L: Lanes<R>>(&self, l: L, ramp: L::V) -> [L::V; GROUPS] {
        std::array::from_fn(|g| l.add(ramp, l.splat(self.left + R::of((g * LANES) as f64))))
    }

    /// The row constants that [`SplatLanes::alphas`] wants.
    #[inline(always)]
    pub fn row<L: Lanes<R>>(&self, l: L, row: usize) -> [L::V; 2] {
        [l.splat(self.linear[row]), l.splat(self.constant[row])]
    }
}

/// 0, 1, ... 7.
#[inline(always)]
pub fn ramp<R: Real, L: Lanes<R>>(l: L) -> L::V {
    let lane: Lane<R> = std::array::from_fn(|i| R::of(i as f64));
    l.load(&lane)
}

/// A splat's constants in vector registers.
pub struct SplatLanes<R: Real, L: Lanes<R>> {
    a: L::V,
    opacity: L::V,
    minus_half: L::V,
    largest: L::V,
    smallest: L::V,
}

impl<R: Real, L: Lanes<R>> SplatLanes<R, L> {
    /// The constants of `s`; an alpha below `alpha_min` does not count.
    #[inline(always)]
    pub fn new(l: L, s: &Splat<R>, alpha_min: f64) -> Self {
        Self {
            a: l.splat(s.conic[0]),
            opacity: l.splat(s.opacity),
            minus_half: l.splat(-R::HALF),
            largest: l.splat(R::of(ALPHA_MAX)),
            smallest: l.splat(R::of(alpha_min)),
        }
    }

    /// Alpha of each pixel of a lane group at horizontal offsets `dx`, 0 where it does not count.
    /// `row` holds the part of the quadratic form that is constant along a row: `2 b dy`, `c dy²`.
    #[inline(always)]
    pub fn alphas(&self, l: L, dx: L::V, row: [L::V; 2]) -> L::V {
        let q = l.mul_add(l.mul_add(self.a, dx, row[0]), dx, row[1]);
        let raw = l.mul(self.opacity, l.exp_neg(l.mul(self.minus_half, q)));
        let alpha = l.min(raw, self.largest);
        l.keep(l.ge(alpha, self.smallest), alpha)
    }
}
