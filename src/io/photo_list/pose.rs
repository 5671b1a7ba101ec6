//! Poses from files, with rounding and scale removed from their rotations.

use glam::DMat3;

use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::scene::CameraError;

/// Largest deviation from a rotation that counts as rounding.
const ROUNDING: f64 = 1e-3;
/// Accepted scales of a pose.
const SCALES: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Returns the rotation closest to `m` without its scale, and true if more than rounding was removed.
///
/// # Errors
/// If `m` mirrors, shears or flattens, or is not finite.
pub(crate) fn straightened(m: DMat3) -> Result<(DMat3, bool), CameraError> {
    let scale = m.determinant().cbrt();
    if !SCALES.contains(&scale) {
        return Err(CameraError::Rotation(rotation_error(&m)));
    }
    let is_rotation = rotation_error(&m) <= ROUNDING;
    let unit = if is_rotation { m } else { m * scale.recip() };
    match rotation_error(&unit) {
        error if error <= ROUNDING => Ok((nearest_rotation(&unit), !is_rotation)),
        error => Err(CameraError::Rotation(error)),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn rounding_and_scale_are_removed() {
        let exact = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.1);
        let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * 1e4).round() / 1e4));
        assert!(rotation_error(&rounded) > 1e-6);
        for (scale, told) in [(1.0, false), (1.01, true), (0.37, true), (250.0, true)] {
            let (fixed, scaled) = straightened(rounded * scale).expect("close");
            assert!(rotation_error(&fixed) < 1e-14);
            assert!((fixed - exact).to_cols_array().iter().all(|v| v.abs() < 1e-4), "{scale}");
            assert_eq!(scaled, told, "{scale}");
        }
    }

    #[test]
    fn what_is_no_rotation_at_any_scale_is_refused() {
        let exact = DMat3::from_rotation_z(0.3);
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.01, 1.0, 0.0), DVec3::Z);
        let stretched = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.01));
        for bad in [-exact, sheared, stretched, DMat3::ZERO, DMat3::NAN, exact * 1e-9, exact * f64::INFINITY] {
            assert!(matches!(straightened(bad), Err(CameraError::Rotation(_))), "{bad}");
        }
    }
}
