//! Projection of surfels: constants for compositing, and an ellipse around all pixels that each touches.

use super::super::project::{CameraView, Projected, Splat};
use crate::math::{Real, rotation};
use crate::scene::Gaussian;

/// One over the variance, in px², below which no surfel is drawn in the picture.
pub(crate) const INVERSE_BLUR: f64 = 2.0;

/// Numbers per splat in front of the composited channels: derivatives of the picture's x by the
/// disk's two coordinates and of its y, both times depth, and of depth; the projected center in px.
pub(crate) const SHAPE: usize = 8;

/// Everything between a surfel's raw parameters and its splat that the backward pass needs too.
pub(crate) struct SurfelGeometry<R> {
    /// Center relative to the camera, world axes.
    pub(crate) relative: [R; 3],
    /// Center in camera axes.
    pub local: [R; 3],
    /// The disk's two half axes in camera axes, lengths one standard deviation; the second one
    /// turned such that the determinant of `across` is not negative.
    pub(crate) axes: [[R; 3]; 2],
    /// The sign by which the second axis was turned.
    pub(crate) sign: R,
    /// Standard deviations along both axes.
    pub(crate) scale: [R; 2],
    /// Derivatives of the picture position times depth: those of x by both coordinates, those of y.
    pub(crate) across: [[R; 2]; 2],
    /// Determinant of `across`, not negative.
    pub(crate) determinant: R,
    pub(crate) center: [R; 2],
    /// Unit normal toward the camera, world axes.
    pub(crate) normal: [R; 3],
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The disk in camera axes; `None` behind the near plane, for a degenerate quaternion, or where
/// sizes overflow.
#[inline(always)]
pub(crate) fn geometry<R: Real>(gaussian: &Gaussian<'_, R>, view: &CameraView<R>) -> Option<SurfelGeometry<R>> {
    let relative = view.relative(gaussian.position);
    let local: [R; 3] = std::array::from_fn(|k| dot(view.rows[k], relative));
    let z = local[2];
    if !(z > view.near && z.is_finite()) {
        return None;
    }
    let rotation = rotation::matrix_from_quaternion(gaussian.quaternion)?;
    let column = |k: usize| [rotation[0][k], rotation[1][k], rotation[2][k]];
    let scale = [gaussian.log_scale[0].exp(), gaussian.log_scale[1].exp()];
    let mut axes: [[R; 3]; 2] =
        std::array::from_fn(|k| std::array::from_fn(|r| dot(view.rows[r], column(k)) * scale[k]));
    let tangent = [local[0] / z, local[1] / z];
    let across_of =
        |axes: &[[R; 3]; 2], k: usize| std::array::from_fn(|i| view.focal[k] * (axes[i][k] - tangent[k] * axes[i][2]));
    let mut across: [[R; 2]; 2] = [across_of(&axes, 0), across_of(&axes, 1)];
    let mut determinant = across[0][0] * across[1][1] - across[0][1] * across[1][0];
    let sign = if determinant < R::ZERO { -R::ONE } else { R::ONE };
    axes[1] = axes[1].map(|c| c * sign);
    across[0][1] *= sign;
    across[1][1] *= sign;
    determinant *= sign;
    // A finite square leaves room for the products that follow.
    if !(determinant * determinant).is_finite()
        || !dot(axes[0], axes[0]).is_finite()
        || !dot(axes[1], axes[1]).is_finite()
    {
        return None;
    }
    let center = [view.focal[0] * tangent[0] + view.principal[0], view.focal[1] * tangent[1] + view.principal[1]];
    Some(SurfelGeometry {
        relative,
        local,
        axes,
        sign,
        scale,
        across,
        determinant,
        center,
        // The third axis points away from the camera where the determinant was positive.
        normal: column(2).map(|c| -sign * c),
    })
}

/// An ellipse around all pixels that get alpha from a surfel.
pub(crate) struct Bound<R> {
    /// Its center, relative to the projected center, px.
    pub(crate) offset: [R; 2],
    /// `[xx, xy, yy]` such that the ellipse is `d' inverse(this) d <= 1`.
    pub(crate) squared: [R; 3],
    /// Determinant of `squared`.
    pub(crate) determinant: R,
}

/// The bound for squared distances up to `reach`; `None` if the disk so far out crosses the
/// camera's plane, so that it may touch any pixel.
#[inline(always)]
pub(crate) fn bound<R: Real>(g: &SurfelGeometry<R>, reach: R) -> Option<Bound<R>> {
    let (along, z) = ([g.axes[0][2], g.axes[1][2]], g.local[2]);
    // Change of depth across the disk, as a share of the center's depth, squared.
    let slope = reach * (along[0] * along[0] + along[1] * along[1]) / (z * z);
    let rest = R::ONE - slope;
    if !(rest > R::of(1e-6)) {
        return None;
    }
    // The picture of the circle, from its dual conic.
    let [x, y] = g.across;
    let size = reach / (rest * z * z);
    let offset = [-size * (x[0] * along[0] + x[1] * along[1]), -size * (y[0] * along[0] + y[1] * along[1])];
    let xx = offset[0] * offset[0] + size * (x[0] * x[0] + x[1] * x[1]);
    let xy = offset[0] * offset[1] + size * (x[0] * y[0] + x[1] * y[1]);
    let yy = offset[1] * offset[1] + size * (y[0] * y[0] + y[1] * y[1]);
    let area = size * g.determinant;
    let sharp = area * area / rest;
    // Around it and the least disk about the projected center, which lies off the ellipse's center
    // by the share sqrt(slope): (t s + r)² <= (1 + t)(t s² + r²).
    let t = slope.sqrt();
    let (wide, blur) = ((t * (R::ONE + t)).max(R::ONE), (R::ONE + t) * reach / R::of(INVERSE_BLUR));
    let squared = [wide * xx + blur, wide * xy, wide * yy + blur];
    let determinant = wide * wide * sharp + wide * blur * (xx + yy) + blur * blur;
    let usable = determinant.is_finite() && squared[0].is_finite() && squared[2].is_finite();
    usable.then_some(Bound { offset, squared, determinant })
}

/// Projects a Gaussian as a surfel: the ellipse around the pixels it touches, for binning and the walk over a tile, its
/// shape, and its normal.
#[inline(always)]
pub(crate) fn surfel<R: Real>(
    gaussian: &Gaussian<'_, R>,
    opacity: R,
    alpha_min: R,
    view: &CameraView<R>,
) -> Projected<R, [R; SHAPE], [R; 3]> {
    let Some(g) = geometry(gaussian, view) else { return Projected::Degenerate };
    let reach = R::of(2.0) * (opacity / alpha_min).ln();
    // Nothing is drawn where the opacity is just the least: a reach of 0 bounds no ellipse.
    if !(reach > R::ZERO) {
        return Projected::Outside;
    }
    let bounded = bound(&g, reach).and_then(|b| {
        let half = [b.squared[0].sqrt(), b.squared[2].sqrt()];
        let [xx, xy, yy] = b.squared.map(|s| s * reach / b.determinant);
        // An ellipse so wide that its inverse underflows is as good as the whole picture.
        let usable = xx > R::ZERO && yy > R::ZERO && b.offset[0].is_finite() && b.offset[1].is_finite();
        let mean = [g.center[0] + b.offset[0], g.center[1] + b.offset[1]];
        usable.then_some((mean, [yy, -xy, xx], half))
    });
    let (mean, conic, half) = bounded.unwrap_or_else(|| {
        let size = view.size.map(|s| R::of(s as f64));
        let half = size[0] + size[1];
        let around = reach / (half * half);
        (size.map(|s| s * R::HALF), [around, R::ZERO, around], [half; 2])
    });
    if !view.meets(mean, half) {
        return Projected::Outside;
    }
    let ([[ax, ay], [bx, by]], [u, v]) = (g.across, g.axes);
    let shape = [ax, ay, bx, by, u[2], v[2], g.center[0], g.center[1]];
    let splat = Splat { mean, conic, opacity, reach, half, depth: g.local[2], gaussian: 0 };
    Projected::Splat(splat, shape, g.normal)
}
