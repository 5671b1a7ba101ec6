//! Projection: Gaussians to splats (mean, conic, reach, color) in the picture of one camera.

use crate::math::number::Number;
use crate::math::{Real, rotation, sh};
use crate::render::{COLOR_MAX, RenderSettings, TANGENT_CLAMP};
use crate::scene::{Camera, Gaussian};

/// A camera in the renderer's precision, relative to a cloud's origin.
#[derive(Clone, Debug)]
pub struct CameraView<R> {
    /// Rows of camera_from_world.
    pub(crate) rows: [[R; 3]; 3],
    /// Cloud origin minus camera center in world axes; kept in f64 so that far-off scenes stay exact.
    pub(crate) offset: [f64; 3],
    /// Focal lengths, px.
    pub focal: [R; 2],
    /// Principal point, px.
    pub principal: [R; 2],
    /// Largest tangent of the viewing angle at which the projection is linearized, per axis.
    pub(crate) clamp: [R; 2],
    pub(crate) near: R,
    /// Variance added to each splat along both picture axes, px².
    blur_px2: R,
    /// Picture size in px.
    pub(crate) size: [usize; 2],
}

impl<R: Real> CameraView<R> {
    /// The view of `camera` on a cloud with this origin.
    pub fn new(camera: &Camera, origin: glam::DVec3, settings: &RenderSettings) -> Self {
        let m = camera.world_from_camera;
        let row = |a: glam::DVec3| [R::of(a.x), R::of(a.y), R::of(a.z)];
        let half = [f64::from(camera.width_px) * 0.5, f64::from(camera.height_px) * 0.5];
        Self {
            rows: [row(m.x_axis), row(m.y_axis), row(m.z_axis)],
            offset: (origin - camera.center).to_array(),
            focal: [R::of(camera.focal_px.x), R::of(camera.focal_px.y)],
            principal: [R::of(camera.principal_px.x), R::of(camera.principal_px.y)],
            clamp: [
                R::of(TANGENT_CLAMP * half[0] / camera.focal_px.x),
                R::of(TANGENT_CLAMP * half[1] / camera.focal_px.y),
            ],
            near: R::of(settings.near),
            blur_px2: R::of(settings.blur_px2),
            size: [camera.width_px as usize, camera.height_px as usize],
        }
    }

    /// A position relative to the camera center, in world axes.
    #[inline(always)]
    pub(crate) fn relative(&self, p: [R; 3]) -> [R; 3] {
        [R::of(p[0].f64() + self.offset[0]), R::of(p[1].f64() + self.offset[1]), R::of(p[2].f64() + self.offset[2])]
    }

    /// Returns whether a box around `mean` contains a pixel center of the picture.
    #[inline(always)]
    pub(crate) fn meets(&self, mean: [R; 2], half: [R; 2]) -> bool {
        let last = |axis: usize| R::of(self.size[axis] as f64) - R::HALF;
        let inside = |axis: usize| mean[axis] + half[axis] >= R::HALF && mean[axis] - half[axis] <= last(axis);
        inside(0) && inside(1)
    }
}

/// A Gaussian as it appears in the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Splat<R> {
    /// Center, px.
    pub(crate) mean: [R; 2],
    /// Inverse covariance `[xx, xy, yy]`, 1/px².
    pub(crate) conic: [R; 3],
    /// Opacity after the sigmoid and the anti-aliasing compensation.
    pub(crate) opacity: R,
    /// Squared Mahalanobis distance up to which alpha is at least the smallest that counts.
    pub(crate) reach: R,
    /// Half width and half height of the ellipse at `reach`, px.
    pub(crate) half: [R; 2],
    pub(crate) depth: R,
    /// Index in the cloud.
    pub(crate) gaussian: u32,
}

/// Everything between a Gaussian's raw parameters and its splat that the backward pass needs too.
pub struct SplatGeometry<N> {
    /// Center relative to the camera, world axes.
    pub relative: [N; 3],
    /// Center in camera axes.
    pub local: [N; 3],
    /// Tangents `x/z`, `y/z` after clamping.
    pub(crate) tangent: [N; 2],
    /// Rows of the linearized projection in world axes, `J W`.
    pub(crate) jacobian: [[N; 3]; 2],
    /// Rotation world_from_local.
    pub(crate) rotation: [[N; 3]; 3],
    pub(crate) scale: [N; 3],
    /// Rows of `J W R S`.
    pub(crate) factor: [[N; 3]; 2],
    /// Blurred covariance `[xx, xy, yy]`, px².
    pub covariance: [N; 3],
    /// Determinant of the unblurred and of the blurred covariance.
    pub determinants: [N; 2],
}

#[inline(always)]
pub(crate) fn dot<N: Number>(a: [N; 3], b: [N; 3]) -> N {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Projects the ellipsoid; `None` behind the near plane, for a degenerate quaternion, or where the
/// depth or the covariance overflows.
#[inline(always)]
pub fn geometry<R: Real>(gaussian: &Gaussian<'_, R>, view: &CameraView<R>) -> Option<SplatGeometry<R>> {
    let g = ellipse(view.relative(gaussian.position), gaussian.log_scale, gaussian.quaternion, view);
    let usable = g.local[2] > view.near && g.local[2].is_finite() && g.determinants[1].is_finite();
    usable.then_some(g)
}

/// The ellipse of a Gaussian, or of several, with its center relative to the camera. Its depth is to be beyond the near
/// plane, and this and the blurred determinant are to be finite, else it has none.
#[inline(always)]
pub(crate) fn ellipse<N: Number>(
    relative: [N; 3],
    log_scale: [N; 3],
    quaternion: [N; 4],
    view: &CameraView<N::Of>,
) -> SplatGeometry<N> {
    let same = |x: N::Of| relative[0].like(x);
    let zero = same(N::Of::ZERO);
    let mut rows = [[zero; 3]; 3];
    for axis in 0..3 {
        for k in 0..3 {
            rows[axis][k] = same(view.rows[axis][k]);
        }
    }
    let local = [dot(rows[0], relative), dot(rows[1], relative), dot(rows[2], relative)];
    let z = local[2];
    let (mut tangent, mut jacobian) = ([zero; 2], [[zero; 3]; 2]);
    for axis in 0..2 {
        let limit = same(view.clamp[axis]);
        tangent[axis] = (local[axis] / z).min(limit).max(-limit);
        let s = same(view.focal[axis]) / z;
        for k in 0..3 {
            jacobian[axis][k] = s * (rows[axis][k] - tangent[axis] * rows[2][k]);
        }
    }
    let rotation = rotation::matrix_of_unit(rotation::scaled_to_unit(quaternion));
    let scale = [log_scale[0].exp(), log_scale[1].exp(), log_scale[2].exp()];
    let mut factor = [[zero; 3]; 2];
    for axis in 0..2 {
        for k in 0..3 {
            let column = [rotation[0][k], rotation[1][k], rotation[2][k]];
            factor[axis][k] = dot(jacobian[axis], column) * scale[k];
        }
    }
    let [u, v] = factor;
    let blur = same(view.blur_px2);
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    // Lagrange's identity keeps the determinant positive where `uu vv - uv²` would cancel.
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let sharp = dot(cross, cross);
    let blurred = sharp + blur * (uu + vv) + blur * blur;
    SplatGeometry {
        relative,
        local,
        tangent,
        jacobian,
        rotation,
        scale,
        factor,
        covariance: [uu + blur, uv, vv + blur],
        determinants: [sharp, blurred],
    }
}

/// Unit viewing direction of a center relative to the camera; forward if they coincide.
#[inline(always)]
pub fn direction<R: Real>(relative: [R; 3]) -> [R; 3] {
    if relative.iter().any(|c| c.abs() > R::ZERO) { toward(relative) } else { [R::ZERO, R::ZERO, R::ONE] }
}

/// The same for centers that do not coincide with the camera.
#[inline(always)]
pub(crate) fn toward<N: Number>([x, y, z]: [N; 3]) -> [N; 3] {
    // Scaled first: squares of far distances overflow.
    let largest = x.abs().max(y.abs()).max(z.abs());
    let [x, y, z] = [x / largest, y / largest, z / largest];
    let length = dot([x, y, z], [x, y, z]).sqrt();
    [x / length, y / length, z / length]
}

/// Color before the clamp at zero: `0.5 + sum(basis * sh)`, up to the degree that is stored.
#[inline(always)]
pub fn raw_color<R: Real>(coefficients: &[[R; 3]], basis: &[R; 16], degree: u8) -> [R; 3] {
    let stored = coefficients.len().min(sh::coefficients(degree));
    // One loop per degree: loops of known length are unrolled.
    match stored {
        16.. => sum::<R, 16>(coefficients, basis),
        9.. => sum::<R, 9>(coefficients, basis),
        4.. => sum::<R, 4>(coefficients, basis),
        _ => sum::<R, 1>(coefficients, basis),
    }
}

#[inline(always)]
fn sum<R: Real, const N: usize>(coefficients: &[[R; 3]], basis: &[R; 16]) -> [R; 3] {
    let mut c = [R::HALF; 3];
    for (b, k) in basis.iter().zip(coefficients.first_chunk::<N>().into_iter().flatten()) {
        for channel in 0..3 {
            c[channel] += *b * k[channel];
        }
    }
    c
}

/// The color as it is composited, between black and `COLOR_MAX`. Coefficients whose sum is NaN give black.
#[inline(always)]
pub(crate) fn color<R: Real>(coefficients: &[[R; 3]], basis: &[R; 16], degree: u8) -> [R; 3] {
    raw_color(coefficients, basis, degree).map(|c| c.max(R::ZERO).min(R::of(COLOR_MAX)))
}

/// Factor on the opacity that keeps a splat's energy under the blur, `sqrt(det / det_blurred)`.
#[inline(always)]
pub fn compensation<N: Number>(g: &SplatGeometry<N>) -> N {
    (g.determinants[0] / g.determinants[1]).sqrt()
}

/// Result of projecting a Gaussian in front of the near plane.
pub(crate) enum Projected<R, S, D> {
    /// It reaches a pixel center: its splat, its shape, and its depth channels.
    Splat(Splat<R>, S, D),
    Outside,
    /// Its shape is not usable.
    Degenerate,
}
