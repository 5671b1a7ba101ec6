//! What the forward and backward passes over a tile share: pixels in lanes of eight, the alpha
//! rule, and which of a tile's pixels a splat can touch.

use super::project::Splat;
use crate::math::Real;
use crate::render::{ALPHA_MAX, ALPHA_MIN, TILE_PX};

/// Pixels that are computed together: one AVX register of `f32`.
pub const LANES: usize = 8;
/// Lane groups per tile row.
pub const GROUPS: usize = TILE_PX / LANES;
/// Lane groups per tile.
pub const SLOTS: usize = TILE_PX * GROUPS;

/// One value per pixel of a lane group.
pub type Lane<R> = [R; LANES];

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

/// Alpha of each pixel of a lane group, 0 where it does not count. `row` holds the part of the
/// quadratic form that is constant along a row: `2 b dy` and `c dy²`.
#[inline(always)]
pub fn alphas<R: Real>(s: &Splat<R>, dx: &Lane<R>, row: [R; 2]) -> Lane<R> {
    let mut alpha = [R::ZERO; LANES];
    for l in 0..LANES {
        let q = (s.conic[0] * dx[l] + row[0]) * dx[l] + row[1];
        let raw = s.opacity * (-R::HALF * q).exp_neg();
        let capped = if raw < R::of(ALPHA_MAX) { raw } else { R::of(ALPHA_MAX) };
        alpha[l] = if capped >= R::of(ALPHA_MIN) { capped } else { R::ZERO };
    }
    alpha
}

/// The constants of [`alphas`] for the row at `dy`.
#[inline(always)]
pub fn row_terms<R: Real>(s: &Splat<R>, dy: R) -> [R; 2] {
    [R::of(2.0) * s.conic[1] * dy, s.conic[2] * dy * dy]
}
