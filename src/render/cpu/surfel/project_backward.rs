//! From the sums of a surfel's tile records back to the raw parameters of its Gaussian.

use super::super::project::CameraView;
use super::super::project_backward::{ColorGradient, GaussianGradient, color_gradient, quaternion_gradient};
use super::RECORD;
use super::project::geometry;
use crate::math::Real;
use crate::render::RenderSettings;
use crate::scene::Gaussian;

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Backward of the projection. `normal` is where in `record` the gradient of the normal begins, if
/// it was composited.
#[inline(always)]
pub(crate) fn project_backward<R: Real>(
    gaussian: &Gaussian<'_, R>,
    view: &CameraView<R>,
    settings: &RenderSettings,
    record: &[R],
    normal: Option<usize>,
) -> Option<GaussianGradient<R>> {
    let g = geometry(gaussian, view)?;
    let [m0, ax, ay, bx, by, along_u, along_v, depth, cx, cy] = *record.first_chunk::<RECORD>()?;
    let z = g.local[2];
    let focal = view.focal;
    let tangent = [g.local[0] / z, g.local[1] / z];
    // The picture's derivatives are focal * (axis_x - tangent * axis_z) and the same for y.
    let mut d_axes = [[R::ZERO; 3]; 2];
    for (k, (dx, dy, dz)) in [(ax, bx, along_u), (ay, by, along_v)].into_iter().enumerate() {
        let (dx, dy) = (focal[0] * dx, focal[1] * dy);
        d_axes[k] = [dx, dy, dz - tangent[0] * dx - tangent[1] * dy];
    }
    let d_tangent = [
        focal[0] * (cx - g.axes[0][2] * ax - g.axes[1][2] * ay),
        focal[1] * (cy - g.axes[0][2] * bx - g.axes[1][2] * by),
    ];
    let d_local =
        [d_tangent[0] / z, d_tangent[1] / z, depth - (tangent[0] * d_tangent[0] + tangent[1] * d_tangent[1]) / z];
    let world = |d: [R; 3]| -> [R; 3] {
        std::array::from_fn(|k| view.rows[0][k] * d[0] + view.rows[1][k] * d[1] + view.rows[2][k] * d[2])
    };
    let mut position = world(d_local);
    // A longer focal length draws the same as a disk that is stretched along that axis of the camera.
    let stretched = |k: usize| g.local[k] * d_local[k] + g.axes[0][k] * d_axes[0][k] + g.axes[1][k] * d_axes[1][k];
    let focal = [stretched(0) / focal[0], stretched(1) / focal[1]];
    let log_scale = [dot(g.axes[0], d_axes[0]), dot(g.axes[1], d_axes[1]), R::ZERO];
    let columns = [
        world(d_axes[0]).map(|c| c * g.scale[0]),
        world(d_axes[1]).map(|c| c * g.scale[1] * g.sign),
        normal.map_or([R::ZERO; 3], |at| std::array::from_fn(|k| -g.sign * record[at + k])),
    ];
    let d_rotation: [[R; 3]; 3] = std::array::from_fn(|r| std::array::from_fn(|k| columns[k][r]));

    let ColorGradient { color, basis, position: turned } =
        color_gradient(gaussian, g.relative, settings, [record[RECORD], record[RECORD + 1], record[RECORD + 2]]);
    for k in 0..3 {
        position[k] += turned[k];
    }
    // The projected center moves per px as the center does, whatever path the gradient took.
    let half = [R::of(view.size[0] as f64 * 0.5), R::of(view.size[1] as f64 * 0.5)];
    let on_screen = [d_local[0] * z / view.focal[0] * half[0], d_local[1] * z / view.focal[1] * half[1]];
    Some(GaussianGradient {
        position,
        turned,
        focal,
        log_scale,
        quaternion: quaternion_gradient(gaussian.quaternion, &d_rotation)?,
        // m0 is dL/dopacity times opacity; through the sigmoid that leaves 1 - sigmoid.
        opacity_logit: m0 * (-gaussian.opacity_logit).sigmoid(),
        color,
        basis,
        screen: (on_screen[0] * on_screen[0] + on_screen[1] * on_screen[1]).sqrt(),
    })
}
