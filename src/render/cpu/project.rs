//! Projection: Gaussians to splats (mean, conic, reach, color) in the picture of one camera.

use crate::math::{Real, rotation, sh};
use crate::render::lod::Cut;
use crate::render::{BLUR_PX2, COLOR_MAX, Features, RenderSettings, TANGENT_CLAMP};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Gaussians that one task projects.
pub(crate) const CHUNK: usize = 2_048;

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
    /// Picture size in px.
    pub(crate) size: [usize; 2],
}

impl<R: Real> CameraView<R> {
    /// The view of `camera` on a cloud with this origin.
    pub fn new(camera: &Camera, origin: glam::DVec3, near: f64) -> Self {
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
            near: R::of(near),
            size: [camera.width_px as usize, camera.height_px as usize],
        }
    }

    /// A position relative to the camera center, in world axes.
    #[inline(always)]
    pub(crate) fn relative(&self, p: [R; 3]) -> [R; 3] {
        [R::of(p[0].f64() + self.offset[0]), R::of(p[1].f64() + self.offset[1]), R::of(p[2].f64() + self.offset[2])]
    }

    /// Whether a box around `mean` has a pixel center of the picture in it.
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
pub struct SplatGeometry<R> {
    /// Center relative to the camera, world axes.
    pub relative: [R; 3],
    /// Center in camera axes.
    pub local: [R; 3],
    /// Tangents `x/z`, `y/z` after clamping, and whether they were clamped.
    pub(crate) tangent: [R; 2],
    pub(crate) clamped: [bool; 2],
    /// Rows of the linearized projection in world axes, `J W`.
    pub(crate) jacobian: [[R; 3]; 2],
    /// Rotation world_from_local.
    pub(crate) rotation: [[R; 3]; 3],
    pub(crate) scale: [R; 3],
    /// Rows of `J W R S`.
    pub(crate) factor: [[R; 3]; 2],
    /// Blurred covariance `[xx, xy, yy]`, px².
    pub covariance: [R; 3],
    /// Determinant of the unblurred and of the blurred covariance.
    pub determinants: [R; 2],
}

#[inline(always)]
pub(crate) fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Projects the ellipsoid; `None` behind the near plane, for a degenerate quaternion, or where the
/// depth or the covariance overflows.
#[inline(always)]
pub fn geometry<R: Real>(gaussian: &Gaussian<'_, R>, view: &CameraView<R>) -> Option<SplatGeometry<R>> {
    let relative = view.relative(gaussian.position);
    let local = [dot(view.rows[0], relative), dot(view.rows[1], relative), dot(view.rows[2], relative)];
    let z = local[2];
    if !(z > view.near && z.is_finite()) {
        return None;
    }
    let mut tangent = [local[0] / z, local[1] / z];
    let mut clamped = [false; 2];
    for axis in 0..2 {
        let limit = view.clamp[axis];
        if tangent[axis] > limit || tangent[axis] < -limit {
            clamped[axis] = true;
            tangent[axis] = if tangent[axis] > limit { limit } else { -limit };
        }
    }
    let mut jacobian = [[R::ZERO; 3]; 2];
    for axis in 0..2 {
        let s = view.focal[axis] / z;
        for k in 0..3 {
            jacobian[axis][k] = s * (view.rows[axis][k] - tangent[axis] * view.rows[2][k]);
        }
    }
    let rotation = rotation::matrix_from_quaternion(gaussian.quaternion)?;
    let [a, b, c] = gaussian.log_scale;
    let [a, b, c, _] = R::exp_each([a, b, c, R::ZERO]);
    let scale = [a, b, c];
    let mut factor = [[R::ZERO; 3]; 2];
    for axis in 0..2 {
        for k in 0..3 {
            let column = [rotation[0][k], rotation[1][k], rotation[2][k]];
            factor[axis][k] = dot(jacobian[axis], column) * scale[k];
        }
    }
    let [u, v] = factor;
    let blur = R::of(BLUR_PX2);
    let (uu, uv, vv) = (dot(u, u), dot(u, v), dot(v, v));
    // Lagrange's identity keeps the determinant positive where `uu vv - uv²` would cancel.
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let sharp = dot(cross, cross);
    let blurred = sharp + blur * (uu + vv) + blur * blur;
    if !blurred.is_finite() {
        return None;
    }
    Some(SplatGeometry {
        relative,
        local,
        tangent,
        clamped,
        jacobian,
        rotation,
        scale,
        factor,
        covariance: [uu + blur, uv, vv + blur],
        determinants: [sharp, blurred],
    })
}

/// Unit viewing direction of a center relative to the camera; forward if they coincide.
#[inline(always)]
pub fn direction<R: Real>(relative: [R; 3]) -> [R; 3] {
    let largest = relative.iter().fold(R::ZERO, |m, c| m.max(c.abs()));
    if !(largest > R::ZERO) {
        return [R::ZERO, R::ZERO, R::ONE];
    }
    // Scaled first: the square of what is far away overflows.
    let scaled = relative.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    scaled.map(|c| c / length)
}

/// Color before the clamp at zero: `0.5 + sum(basis * sh)`.
#[inline(always)]
pub fn raw_color<R: Real>(coefficients: &[[R; 3]], basis: &[R; 16], degree: u8) -> [R; 3] {
    let mut c = [R::HALF; 3];
    for (b, k) in basis.iter().zip(&coefficients[..sh::coefficients(degree)]) {
        for channel in 0..3 {
            c[channel] += *b * k[channel];
        }
    }
    c
}

/// The color as it is composited, between black and `COLOR_MAX`. Coefficients whose sum is no number
/// give black.
#[inline(always)]
pub(crate) fn color<R: Real>(coefficients: &[[R; 3]], basis: &[R; 16], degree: u8) -> [R; 3] {
    raw_color(coefficients, basis, degree).map(|c| c.max(R::ZERO).min(R::of(COLOR_MAX)))
}

/// Factor on the opacity that keeps a splat's energy under the blur, `sqrt(det / det_blurred)`.
#[inline(always)]
pub fn compensation<R: Real>(g: &SplatGeometry<R>) -> R {
    (g.determinants[0] / g.determinants[1]).sqrt()
}

/// The splats of some consecutive Gaussians with their composited values, in the cloud's order.
#[derive(Debug, Default)]
pub(crate) struct Chunk<R> {
    /// The Gaussians that reach at least one pixel center.
    pub(crate) splats: Vec<Splat<R>>,
    /// `[splats * channels]`: color, extra channels, depth if asked for, padding zeros.
    pub(crate) values: Vec<R>,
    /// Gaussians left out because their covariance or rotation is degenerate.
    pub(crate) degenerate: usize,
}

/// What is to be drawn, and how.
#[derive(Clone, Copy)]
pub(crate) struct DrawInput<'a, R> {
    pub(crate) cloud: &'a GaussianCloud<R>,
    pub(crate) features: Features<'a, R>,
    pub(crate) settings: &'a RenderSettings,
    /// What is drawn instead of all of it.
    pub(crate) cut: Option<&'a Cut<R>>,
}

impl<'a, R: Real> DrawInput<'a, R> {
    /// How many Gaussians are to be drawn.
    pub(crate) fn len(&self) -> usize {
        self.cut.map_or(self.cloud.len(), Cut::len)
    }

    /// The `k`-th of them: the cloud that it is in, its place there, and the Gaussian of `cloud` that it stands for.
    #[inline(always)]
    pub(crate) fn of(&self, k: usize) -> (&'a GaussianCloud<R>, usize, u32) {
        self.cut.map_or((self.cloud, k, k as u32), |cut| cut.of(self.cloud, k))
    }
}

/// What becomes of a Gaussian in front of the near plane.
pub(crate) enum Projected<R, S, D> {
    /// It reaches a pixel center: its splat, its shape, and what depth composites.
    Splat(Splat<R>, S, D),
    Outside,
    /// Its shape is not usable.
    Degenerate,
}

#[inline(always)]
pub(crate) fn splat<R: Real>(
    gaussian: &Gaussian<'_, R>,
    mut opacity: R,
    alpha_min: R,
    view: &CameraView<R>,
    settings: &RenderSettings,
) -> Projected<R, [R; 0], [R; 1]> {
    let Some(g) = geometry(gaussian, view) else { return Projected::Degenerate };
    if settings.antialias {
        opacity *= compensation(&g);
        if !(opacity >= alpha_min) {
            return Projected::Outside;
        }
    }
    let depth = g.local[2];
    let mean = [0, 1].map(|axis| view.focal[axis] * (g.local[axis] / depth) + view.principal[axis]);
    let reach = R::of(2.0) * (opacity / alpha_min).ln();
    let [xx, xy, yy] = g.covariance;
    let half = [(reach * xx).sqrt(), (reach * yy).sqrt()];
    if !view.meets(mean, half) {
        return Projected::Outside;
    }
    let det = g.determinants[1];
    let conic = [yy / det, -xy / det, xx / det];
    // A covariance so wide that its inverse underflows has no usable shape.
    if !(conic[0] > R::ZERO && conic[2] > R::ZERO && half[0].is_finite() && half[1].is_finite()) {
        return Projected::Degenerate;
    }
    Projected::Splat(Splat { mean, conic, opacity, reach, half, depth, gaussian: 0 }, [], [depth])
}
