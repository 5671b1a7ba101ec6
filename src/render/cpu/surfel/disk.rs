//! Intersections of eight pixels' rays with a surfel's plane, and the contribution of the surfel to them.
//!
//! A point `(u, v)` of the disk has the depth `Z + a u + b v` and lies `(A u + A' v) / depth` px to
//! the right of the projected center and `(B u + B' v) / depth` px below it. Solved for the point
//! that a pixel at offset `(dx, dy)` sees:
//!
//! ```text
//! u = Z p / w,   p = B' dx - A' dy        w = D - a p - b q
//! v = Z q / w,   q = A dy - B dx          D = A B' - A' B,   depth = Z D / w
//! ```
//!
//! The second coordinate's sign is such that `D` is not negative.

use super::super::project::Splat;
use super::super::walk::{GROUPS, Reach};
use super::project::{INVERSE_BLUR, SHAPE};
use crate::math::Real;
use crate::math::lanes::Lanes;
use crate::render::{ALPHA_MAX, ALPHA_MIN, TILE_PX};

/// A surfel's constants in vector registers.
pub(crate) struct Disk<R: Real, L: Lanes<R>> {
    /// `[A, A'], [B, B']`, px times depth.
    pub(crate) across: [[L::V; 2]; 2],
    /// `a, b`.
    pub(crate) along: [L::V; 2],
    /// Depth of the center.
    pub(crate) z: L::V,
    /// `D`, not negative.
    pub(crate) determinant: L::V,
    depth_factor: L::V,
    near: L::V,
    opacity: L::V,
    /// Horizontal offsets of each group's pixel centers from the projected center.
    dx: [L::V; GROUPS],
    /// From the ellipse's center down to the projected center.
    down: R,
}

/// Contribution of a surfel to eight pixels.
#[derive(Clone, Copy)]
pub(crate) struct SurfelHit<R: Real, L: Lanes<R>> {
    /// Offsets of the pixel centers from the projected center.
    pub(crate) offset: [L::V; 2],
    /// `p, q`.
    pub(crate) raw: [L::V; 2],
    /// Coordinates in the disk; 0 where the picture's distance counts.
    pub(crate) at: [L::V; 2],
    /// `1 / w`; 0 where the picture's distance counts.
    pub(crate) inverse: L::V,
    /// Lanes in which the distance in the plane counts.
    pub(crate) through: L::M,
    /// Depth along the camera's axis.
    pub(crate) depth: L::V,
    /// Alpha, 0 where it does not count.
    pub(crate) alpha: L::V,
}

impl<R: Real, L: Lanes<R>> Disk<R, L> {
    /// The constants of `s`, whose shape is as `project` laid it out.
    #[inline(always)]
    pub(crate) fn new(l: L, s: &Splat<R>, shape: &[R], near: R, dx: [L::V; GROUPS]) -> Self {
        let [ax, ay, bx, by, along_u, along_v, x, y]: [R; SHAPE] = std::array::from_fn(|k| shape[k]);
        let right = l.splat(s.mean[0] - x);
        let determinant = ax * by - ay * bx;
        Self {
            across: [[l.splat(ax), l.splat(ay)], [l.splat(bx), l.splat(by)]],
            along: [l.splat(along_u), l.splat(along_v)],
            z: l.splat(s.depth),
            determinant: l.splat(determinant),
            depth_factor: l.splat(s.depth * determinant),
            near: l.splat(near),
            opacity: l.splat(s.opacity),
            dx: dx.map(|dx| l.add(dx, right)),
            down: s.mean[1] - y,
        }
    }

    /// Contribution to the pixels of a slot.
    #[inline(always)]
    pub(crate) fn hit(&self, l: L, reach: &Reach<R>, slot: usize) -> SurfelHit<R, L> {
        let (dx, dy) = (self.dx[slot / TILE_PX], l.splat(reach.dy[slot % TILE_PX] + self.down));
        let zero = l.splat(R::ZERO);
        let [[ax, ay], [bx, by]] = self.across;
        let raw = [l.sub(l.mul(by, dx), l.mul(ay, dy)), l.sub(l.mul(ax, dy), l.mul(bx, dx))];
        let w = l.sub(l.sub(self.determinant, l.mul(self.along[0], raw[0])), l.mul(self.along[1], raw[1]));
        let inverse = l.div(l.splat(R::ONE), w);
        let scale = l.mul(self.z, inverse);
        let (u, v) = (l.mul(raw[0], scale), l.mul(raw[1], scale));
        let plane = l.mul_add(u, u, l.mul(v, v));
        let picture = l.mul(l.splat(R::of(INVERSE_BLUR)), l.mul_add(dx, dx, l.mul(dy, dy)));
        // In front of the near plane; false for an edge-on disk, whose determinant is 0, and for NaN.
        let ahead = l.both(l.gt(w, zero), l.ge(self.depth_factor, l.mul(self.near, w)));
        let through = l.both(ahead, l.ge(picture, plane));
        let square = l.select(through, plane, picture);
        let alpha = l.mul(self.opacity, l.exp_neg(l.mul(l.splat(-R::HALF), square)));
        let alpha = l.min(alpha, l.splat(R::of(ALPHA_MAX)));
        SurfelHit {
            offset: [dx, dy],
            raw,
            at: [l.keep(through, u), l.keep(through, v)],
            inverse: l.keep(through, inverse),
            depth: l.select(through, l.mul(self.depth_factor, inverse), self.z),
            through,
            alpha: l.keep(l.ge(alpha, l.splat(R::of(ALPHA_MIN))), alpha),
        }
    }
}
