//! Quaternions and rotation matrices, with the degenerate cases defined.

use glam::DMat3;

use super::Real;
use super::number::Number;

/// The rotation matrix (rows) of the unit quaternion along `q = [w, x, y, z]`, or `None` if `q`
/// is zero, not finite, or has no usable length (its squares under- or overflow even after scaling).
#[inline(always)]
pub fn matrix_from_quaternion<R: Real>(q: [R; 4]) -> Option<[[R; 3]; 3]> {
    Some(matrix_of_unit(unit_quaternion(q)?))
}

/// The rotation matrix (rows) of a unit quaternion.
#[inline(always)]
pub(crate) fn matrix_of_unit<N: Number>([w, x, y, z]: [N; 4]) -> [[N; 3]; 3] {
    let (one, two) = (w.like(N::Of::ONE), w.like(N::Of::of(2.0)));
    [
        [one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y)],
        [two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x)],
        [two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y)],
    ]
}

/// `q` scaled to unit length. Scales by the largest component first, so neither tiny nor huge
/// quaternions lose their direction.
#[inline(always)]
pub fn unit_quaternion<R: Real>(q: [R; 4]) -> Option<[R; 4]> {
    let u = scaled_to_unit(q);
    u.iter().all(|c| c.is_finite()).then_some(u)
}

/// The same; not finite if the length is unusable.
#[inline(always)]
pub(crate) fn scaled_to_unit<N: Number>([w, x, y, z]: [N; 4]) -> [N; 4] {
    let largest = w.abs().max(x.abs()).max(y.abs().max(z.abs()));
    let [w, x, y, z] = [w / largest, x / largest, y / largest, z / largest];
    let length = (w * w + x * x + y * y + z * z).sqrt();
    [w / length, x / length, y / length, z / length]
}

/// Deviation of `m` from a proper rotation: the largest entry of `|m mᵀ - I|`, or infinity if its determinant is not
/// positive or an entry is not finite.
pub fn rotation_error(m: &DMat3) -> f64 {
    if !m.is_finite() || m.determinant() <= 0.0 {
        return f64::INFINITY;
    }
    let d = *m * m.transpose() - DMat3::IDENTITY;
    d.to_cols_array().iter().fold(0.0, |w, e| w.max(e.abs()))
}

/// The rotation nearest to `m` (the orthogonal factor of its polar decomposition), for an `m` that
/// is one up to rounding.
pub(crate) fn nearest_rotation(m: &DMat3) -> DMat3 {
    // Newton's iteration (Higham 1986); its error squares at every step.
    (0..8).fold(*m, |r, _| (r + r.inverse().transpose()) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_of_a_quaternion_does_not_occupancy() {
        let q = [0.3_f32, -0.2, 0.7, 0.1];
        let a = matrix_from_quaternion(q).expect("valid");
        for s in [1e-30_f32, 1e-3, 1e30] {
            let b = matrix_from_quaternion(q.map(|c| c * s)).expect("valid");
            for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
                assert!((x - y).abs() < 1e-5, "{x} {y}");
            }
        }
    }

    #[test]
    fn degenerate_quaternions_are_refused() {
        assert!(matrix_from_quaternion([0.0_f32; 4]).is_none());
        assert!(matrix_from_quaternion([f32::NAN, 0.0, 0.0, 1.0]).is_none());
        assert!(matrix_from_quaternion([f32::INFINITY, 0.0, 0.0, 1.0]).is_none());
    }

    #[test]
    fn the_nearest_rotation_is_one_and_leaves_rotations_alone() {
        let r = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-2.0);
        let skew = DMat3::from_cols_array(&[1.0, 2e-4, 0.0, -1e-4, 1.0, 3e-4, 0.0, 0.0, 1.0002]);
        let fixed = nearest_rotation(&(r * skew));
        assert!(rotation_error(&fixed) < 1e-14);
        assert!((fixed - r).to_cols_array().iter().all(|e| e.abs() < 3e-4));
        assert!((nearest_rotation(&r) - r).to_cols_array().iter().all(|e| e.abs() < 1e-15));
    }

    #[test]
    fn matrices_are_those_of_the_quaternion() {
        for q in [[0.3, -0.2, 0.7, 0.1], [-0.9, 0.4, 0.2, -0.6], [0.1, 0.8, -0.3, 0.5], [2.0, 0.0, 0.0, 0.0]] {
            let [w, x, y, z] = q;
            let unit = glam::DQuat::from_vec4(glam::DVec4::new(x, y, z, w).try_normalize().expect("turns"));
            let expected = DMat3::from_quat(unit).transpose().to_cols_array();
            let rows = matrix_from_quaternion(q).expect("valid");
            assert!(rows.iter().flatten().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{rows:?} {expected:?}");
            let u = unit_quaternion(q).expect("valid");
            assert!(u.iter().zip([unit.w, unit.x, unit.y, unit.z]).all(|(a, b)| (a - b).abs() < 1e-15), "{u:?}");
        }
        assert!(unit_quaternion([1e-310_f64, 0.0, 0.0, 0.0]).is_some_and(|u| u == [1.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn the_error_of_a_rotation_is_its_largest_entry() {
        // (1.1)² - 1 = 0.21 on the diagonal; 0.1 in a corner is 0.1 beside it and 0.01 on it.
        let stretched = DMat3::from_diagonal(glam::DVec3::new(1.0, 1.1, 1.0));
        assert!((rotation_error(&stretched) - 0.21).abs() < 1e-12);
        let skew = DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0]);
        assert!((rotation_error(&skew) - 0.1).abs() < 1e-12);
        assert!(rotation_error(&DMat3::IDENTITY) < 1e-15 && rotation_error(&-DMat3::IDENTITY).is_infinite());
        assert!(rotation_error(&DMat3::ZERO).is_infinite());
        assert!(rotation_error(&(DMat3::IDENTITY * f64::NAN)).is_infinite());
    }
}
