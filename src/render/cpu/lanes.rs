//! What the forward and backward passes over a tile share: pixels in lanes of eight, the alpha
//! rule, and which of a tile's pixels a splat can touch.

use super::project::Splat;
use crate::math::Real;
use crate::math::lanes::{LANES, Lane, Lanes};
use crate::render::{ALPHA_MAX, ALPHA_MIN, TILE_PX};

/// Lane groups per tile row.
pub const GROUPS: usize = TILE_PX / LANES;
/// Lane groups per tile.
pub const SLOTS: usize = TILE_PX * GROUPS;

/// A splat prepared for walking the rows of one tile.
pub struct Walk<R> {
    /// Rows of the tile to visit, first and one past the last.
    pub rows: std::ops::Range<usize>,
    /// Horizontal offsets of the tile's pixel centres from the splat's centre.
    pub dx: [Lane<R>; GROUPS],
    /// Vertical offset of the tile's first row of pixel centres.
    pub dy0: R,
    // The ellipse's horizontal middle in tile pixels at dy = 0, its slope with dy, and its shape.
    middle: R,
    slope: R,
    inverse_a: R,
    curve: R,
    reach: R,
}

impl<R: Real> Walk<R> {
    /// The walk of `s` over the tile whose first pixel is `corner` and that has `height` rows.
    #[inline(always)]
    pub fn new(s: &Splat<R>, corner: [usize; 2], height: usize) -> Self {
        let [a, b, c] = s.conic;
        let left = R::of(corner[0] as f64 + 0.5) - s.mean[0];
        let dy0 = R::of(corner[1] as f64 + 0.5) - s.mean[1];
        let mut dx = [[R::ZERO; LANES]; GROUPS];
        for (g, lane) in dx.iter_mut().enumerate() {
            for (l, x) in lane.iter_mut().enumerate() {
                *x = left + R::of((g * LANES + l) as f64);
            }
        }
        // Row r is at dy0 + r; rows with |dy| <= half height can hold something.
        let lo = (-dy0 - s.half[1]).f32().ceil().max(0.0);
        let hi = (-dy0 + s.half[1]).f32().floor().min(height as f32 - 1.0);
        let rows = if lo <= hi { lo as usize..hi as usize + 1 } else { 0..0 };
        let inverse_a = R::ONE / a;
        let slope = -b * inverse_a;
        Self { rows, dx, dy0, middle: -left, slope, inverse_a, curve: c + b * slope, reach: s.reach }
    }

    /// Vertical offset of a row's pixel centres from the splat's centre.
    #[inline(always)]
    pub fn dy(&self, row: usize) -> R {
        self.dy0 + R::of(row as f64)
    }

    /// The lane groups of the row at `dy` that the ellipse can touch.
    #[inline(always)]
    pub fn groups(&self, dy: R) -> std::ops::Range<usize> {
        let rest = self.reach - self.curve * dy * dy;
        if rest < R::ZERO {
            return 0..0;
        }
        // A hundredth of a pixel of slack covers the rounding of this estimate; the alpha rule
        // decides about each pixel anyway.
        let half = (rest * self.inverse_a).sqrt().f32() + 0.01;
        let middle = (self.middle + self.slope * dy).f32();
        let split = LANES as f32;
        let first = usize::from(middle - half > split - 1.0);
        let last = usize::from(middle + half >= split);
        if middle + half < 0.0 || middle - half > TILE_PX as f32 - 1.0 { 0..0 } else { first..last + 1 }
    }
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
    /// The constants of `s`.
    #[inline(always)]
    pub fn new(l: L, s: &Splat<R>) -> Self {
        Self {
            a: l.splat(s.conic[0]),
            opacity: l.splat(s.opacity),
            minus_half: l.splat(-R::HALF),
            largest: l.splat(R::of(ALPHA_MAX)),
            smallest: l.splat(R::of(ALPHA_MIN)),
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

/// The row constants of [`SplatLanes::alphas`] at `dy`.
#[inline(always)]
pub fn row_terms<R: Real, L: Lanes<R>>(l: L, s: &Splat<R>, dy: R) -> [L::V; 2] {
    [l.splat(R::of(2.0) * s.conic[1] * dy), l.splat(s.conic[2] * dy * dy)]
}
