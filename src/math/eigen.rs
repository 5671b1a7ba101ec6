//! Axes of a symmetric 3 x 3 matrix, such as a covariance.

use glam::{DMat3, DVec3};

/// Sweeps after which nothing is left beside the diagonal; three or four do for most.
const SWEEPS: usize = 12;

/// Eigenvalues from the largest down, and the rotation whose columns are their axes (Jacobi's method).
pub(crate) fn axes(symmetric: &DMat3) -> (DVec3, DMat3) {
    let (mut m, mut turn) = (*symmetric, DMat3::IDENTITY);
    for _ in 0..SWEEPS {
        let beside = m.x_axis.y.abs() + m.x_axis.z.abs() + m.y_axis.z.abs();
        if !(beside > f64::EPSILON * 1e-2 * (m.x_axis.x.abs() + m.y_axis.y.abs() + m.z_axis.z.abs())) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = m.col(p)[q];
            if off == 0.0 {
                continue;
            }
            let theta = (m.col(q)[q] - m.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let mut step = DMat3::IDENTITY;
            step.col_mut(p)[p] = c;
            step.col_mut(q)[q] = c;
            step.col_mut(p)[q] = -t * c;
            step.col_mut(q)[p] = t * c;
            m = step.transpose() * m * step;
            turn *= step;
        }
    }
    let values = DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let [a, b, _] = order.map(|k| turn.col(k));
    // Its third axis as the cross product makes it a rotation, not a reflection.
    (DVec3::from_array(order.map(|k| values[k])), DMat3::from_cols(a, b, a.cross(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::rotation_error;

    #[test]
    fn axes_rebuild_the_matrix() {
        let turned = |values: DVec3, angles: DVec3| {
            let turn = DMat3::from_quat(glam::DQuat::from_scaled_axis(angles));
            turn * DMat3::from_diagonal(values) * turn.transpose()
        };
        for (values, angles) in [
            (DVec3::new(9.0, 4.0, 1.0), DVec3::new(0.3, -1.2, 0.7)),
            (DVec3::new(1e-9, 3.0, 1e6), DVec3::new(2.0, 0.1, -0.4)),
            (DVec3::new(2.0, 2.0, 1e-12), DVec3::new(-0.2, 0.9, 1.4)),
            (DVec3::splat(5.0), DVec3::X),
            (DVec3::ZERO, DVec3::ZERO),
        ] {
            let matrix = turned(values, angles);
            let (found, axes) = axes(&matrix);
            assert!(found.x >= found.y && found.y >= found.z, "{found}");
            assert!(rotation_error(&axes) < 1e-12, "{axes}");
            let again = axes * DMat3::from_diagonal(found) * axes.transpose();
            let largest = matrix.to_cols_array().iter().fold(1e-300, |m: f64, v| m.max(v.abs()));
            let error = (again - matrix).to_cols_array().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(error <= 1e-12 * largest, "{error} of {largest}");
        }
    }
}
