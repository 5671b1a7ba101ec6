//! From the moments of a splat back to the raw parameters of its Gaussian.

use super::project::{CameraView, Splat, SplatGeometry, direction, geometry, raw_color};
use crate::math::{Real, rotation::unit_quaternion, sh};
use crate::render::RenderSettings;
use crate::scene::Gaussian;

/// Sums in front of the channels in a tile entry's record: `dL/dpower` (power = -q/2) times
/// `1, dx, dy, dx², dx dy, dy²`.
pub(crate) const MOMENTS: usize = 6;

/// Gradient with respect to the raw parameters of one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GaussianGradient<R> {
    pub(crate) position: [R; 3],
    /// Share of `position` through the viewing direction, on which the color depends.
    pub(crate) turned: [R; 3],
    /// With respect to the camera's focal lengths, from what this Gaussian draws, per px.
    pub(crate) focal: [R; 2],
    pub(crate) log_scale: [R; 3],
    pub(crate) quaternion: [R; 4],
    pub(crate) opacity_logit: R,
    /// With respect to its color before the clamp; the gradient of SH coefficient `k` is
    /// `basis[k]` times this.
    pub(crate) color: [R; 3],
    /// SH basis in the viewing direction.
    pub(crate) basis: [R; 16],
    /// Length of the gradient with respect to the projected center, per half picture side.
    pub(crate) screen: R,
}

/// Backward of the projection. `record` is the sum of the splat's tile records: moments, color,
/// features, depth. `depth_channel` is the channel that carries depth, if any does.
#[inline(always)]
pub(crate) fn project_backward<R: Real>(
    gaussian: &Gaussian<'_, R>,
    splat: &Splat<R>,
    view: &CameraView<R>,
    settings: &RenderSettings,
    record: &[R],
    depth_channel: Option<usize>,
) -> Option<GaussianGradient<R>> {
    let g = geometry(gaussian, view)?;
    let [m0, mx, my, mxx, mxy, myy] = [record[0], record[1], record[2], record[3], record[4], record[5]];
    let [a, b, c] = splat.conic;
    let d_mean = [a * mx + b * my, b * mx + c * my];
    let d_factor = factor_gradient(&g, splat.conic, [mxx, mxy, myy], settings.antialias.then_some(m0));

    let mut log_scale = [R::ZERO; 3];
    let mut d_rotation = [[R::ZERO; 3]; 3];
    let mut d_jacobian = [[R::ZERO; 3]; 2];
    for k in 0..3 {
        log_scale[k] = g.factor[0][k] * d_factor[0][k] + g.factor[1][k] * d_factor[1][k];
        for r in 0..3 {
            d_rotation[r][k] = g.scale[k] * (g.jacobian[0][r] * d_factor[0][k] + g.jacobian[1][r] * d_factor[1][k]);
            for axis in 0..2 {
                d_jacobian[axis][r] += g.rotation[r][k] * g.scale[k] * d_factor[axis][k];
            }
        }
    }

    let z = g.local[2];
    let (mut d_local, mut focal) = ([R::ZERO; 3], [R::ZERO; 2]);
    for axis in 0..2 {
        let s = view.focal[axis] / z;
        let d_tangent = -s * dot(view.rows[2], d_jacobian[axis]);
        let along = dot(g.jacobian[axis], d_jacobian[axis]);
        d_local[2] -= along / z;
        focal[axis] = along / view.focal[axis] + d_mean[axis] * (g.local[axis] / z);
        // Where the tangent was clamped it does not depend on the position, but its limit on the focal length.
        if g.tangent[axis] == g.local[axis] / z {
            d_local[axis] += d_tangent / z;
            d_local[2] -= d_tangent * g.tangent[axis] / z;
        } else {
            focal[axis] -= d_tangent * g.tangent[axis] / view.focal[axis];
        }
        d_local[axis] += s * d_mean[axis];
        d_local[2] -= s * (g.local[axis] / z) * d_mean[axis];
    }
    if let Some(channel) = depth_channel {
        d_local[2] += record[MOMENTS + channel];
    }
    let mut position = [R::ZERO; 3];
    for k in 0..3 {
        position[k] = view.rows[0][k] * d_local[0] + view.rows[1][k] * d_local[1] + view.rows[2][k] * d_local[2];
    }

    let ColorGradient { color, basis, position: turned } =
        color_gradient(gaussian, g.relative, settings, [record[MOMENTS], record[MOMENTS + 1], record[MOMENTS + 2]]);
    for k in 0..3 {
        position[k] += turned[k];
    }

    // m0 is dL/dopacity times opacity; through the sigmoid that leaves 1 - sigmoid.
    let opacity_logit = m0 * (-gaussian.opacity_logit).sigmoid();
    let half = [R::of(view.size[0] as f64 * 0.5), R::of(view.size[1] as f64 * 0.5)];
    let on_screen = [d_mean[0] * half[0], d_mean[1] * half[1]];
    Some(GaussianGradient {
        position,
        turned,
        focal,
        log_scale,
        quaternion: quaternion_gradient(gaussian.quaternion, &d_rotation)?,
        opacity_logit,
        color,
        basis,
        screen: (on_screen[0] * on_screen[0] + on_screen[1] * on_screen[1]).sqrt(),
    })
}

/// Gradients that follow from that of a Gaussian's color.
pub(super) struct ColorGradient<R> {
    /// With respect to the color before the clamp.
    pub(crate) color: [R; 3],
    /// SH basis in the viewing direction.
    pub(crate) basis: [R; 16],
    /// With respect to the position, through the viewing direction.
    pub(crate) position: [R; 3],
}

/// Backward of the color: `color` is the gradient with respect to the clamped one, `relative` the
/// center relative to the camera in world axes.
#[inline(always)]
pub(super) fn color_gradient<R: Real>(
    gaussian: &Gaussian<'_, R>,
    relative: [R; 3],
    settings: &RenderSettings,
    mut color: [R; 3],
) -> ColorGradient<R> {
    let degree = settings.sh_degree.min(stored_degree(gaussian.sh.len()));
    let toward = direction(relative);
    let basis = sh::basis(degree, toward);
    let raw = raw_color(gaussian.sh, &basis, degree);
    for (d, r) in color.iter_mut().zip(raw) {
        // Above the brightest color it stays, so that training leads back.
        if !(r >= R::ZERO) {
            *d = R::ZERO;
        }
    }
    let mut position = [R::ZERO; 3];
    if degree > 0 {
        let d_toward = direction_gradient(gaussian.sh, degree, toward, color);
        let length = dot(relative, relative).sqrt();
        let radial = dot(toward, d_toward);
        if length > R::ZERO {
            for k in 0..3 {
                position[k] = (d_toward[k] - toward[k] * radial) / length;
            }
        }
    }
    ColorGradient { color, basis, position }
}

/// Degree of a Gaussian that stores this many coefficients.
#[inline(always)]
fn stored_degree(coefficients: usize) -> u8 {
    match coefficients {
        16.. => 3,
        9.. => 2,
        4.. => 1,
        _ => 0,
    }
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Gradient with respect to the rows `u, v` of `J W R S`, from the second moments through the
/// inverse of the covariance, `dK = -K dC K`, and from the compensation where it is on (`m0`).
#[inline(always)]
fn factor_gradient<R: Real>(
    g: &SplatGeometry<R>,
    [a, b, c]: [R; 3],
    [mxx, mxy, myy]: [R; 3],
    compensated: Option<R>,
) -> [[R; 3]; 2] {
    // dL/dK as a symmetric matrix [[ga, gb], [gb, gc]].
    let (ga, gb, gc) = (-R::HALF * mxx, -R::HALF * mxy, -R::HALF * myy);
    let (p00, p01) = (ga * a + gb * b, ga * b + gb * c);
    let (p10, p11) = (gb * a + gc * b, gb * b + gc * c);
    let two = R::of(2.0);
    let xx = -(a * p00 + b * p10);
    let xy = -two * (a * p01 + b * p11);
    let yy = -(b * p01 + c * p11);
    let [u, v] = g.factor;
    let mut d = [[R::ZERO; 3]; 2];
    for k in 0..3 {
        d[0][k] = two * xx * u[k] + xy * v[k];
        d[1][k] = two * yy * v[k] + xy * u[k];
    }
    if let Some(m0) = compensated {
        // The logarithm of the compensation changes by the inverse of the unblurred covariance less that of
        // the blurred one; inverses, as a product of three covariances may overflow.
        let sharp = g.determinants[0];
        let inverse =
            if sharp > R::ZERO { [dot(v, v), -g.covariance[1], dot(u, u)].map(|s| s / sharp) } else { [R::ZERO; 3] };
        for k in 0..3 {
            d[0][k] += m0 * ((inverse[0] * u[k] + inverse[1] * v[k]) - (a * u[k] + b * v[k]));
            d[1][k] += m0 * ((inverse[2] * v[k] + inverse[1] * u[k]) - (c * v[k] + b * u[k]));
        }
    }
    d
}

/// Gradient of the color along the viewing direction.
#[inline(always)]
fn direction_gradient<R: Real>(coefficients: &[[R; 3]], degree: u8, toward: [R; 3], color: [R; 3]) -> [R; 3] {
    let slopes = sh::basis_gradient(degree, toward);
    let mut d = [R::ZERO; 3];
    for (slope, k) in slopes.iter().zip(&coefficients[..sh::coefficients(degree)]) {
        let along = dot(*k, color);
        for axis in 0..3 {
            d[axis] += slope[axis] * along;
        }
    }
    d
}

/// Chain rule through `R(q / |q|)`.
#[inline(always)]
pub(crate) fn quaternion_gradient<R: Real>(q: [R; 4], g: &[[R; 3]; 3]) -> Option<[R; 4]> {
    let [w, x, y, z] = unit_quaternion(q)?;
    let two = R::of(2.0);
    let d = [
        two * (x * (g[2][1] - g[1][2]) + y * (g[0][2] - g[2][0]) + z * (g[1][0] - g[0][1])),
        two * (y * (g[0][1] + g[1][0]) + z * (g[0][2] + g[2][0]) + w * (g[2][1] - g[1][2])
            - two * x * (g[1][1] + g[2][2])),
        two * (x * (g[0][1] + g[1][0]) + z * (g[1][2] + g[2][1]) + w * (g[0][2] - g[2][0])
            - two * y * (g[0][0] + g[2][2])),
        two * (x * (g[0][2] + g[2][0]) + y * (g[1][2] + g[2][1]) + w * (g[1][0] - g[0][1])
            - two * z * (g[0][0] + g[1][1])),
    ];
    let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    let u = [w, x, y, z];
    let radial = u.iter().zip(&d).fold(R::ZERO, |s, (u, d)| s + *u * *d);
    let mut out = [R::ZERO; 4];
    for k in 0..4 {
        out[k] = (d[k] - u[k] * radial) / length;
    }
    Some(out)
}
