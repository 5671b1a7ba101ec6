//! Encoding and decoding shared by the quantized splat formats: fixed-point numbers, colors, opacities, scales,
//! quaternions without their largest component.

use std::f32::consts::SQRT_2;

use crate::math::Real;
use crate::math::rotation;
use crate::math::sh::SH_C0;

/// Opacities are kept this far from 0 and 1: their logit would be infinite.
const OPACITY_MARGIN: f32 = 1e-6;

/// Maps the low `bits` of `value` to 0 to 1.
pub(super) fn unorm(value: u32, bits: u32) -> f32 {
    let mask = (1_u32 << bits) - 1;
    (value & mask) as f32 / mask as f32
}

/// Rounds 0 to 1 to a number of so many `bits`; values outside are clamped.
pub(super) fn to_unorm(value: f32, bits: u32) -> u32 {
    let most = (1_u32 << bits) - 1;
    // NaN becomes 0.
    ((value * most as f32 + 0.5) as u32).min(most)
}

/// Rounds 0 to 1 to a byte.
pub(super) fn to_byte(value: f32) -> u8 {
    to_unorm(value, 8) as u8
}

/// Color of a constant harmonic, 0 to 1 within the range of a display.
pub(super) fn color(dc: f32) -> f32 {
    0.5 + SH_C0 as f32 * dc
}

/// Constant harmonic of a color.
pub(super) fn constant(color: f32) -> f32 {
    (color - 0.5) / SH_C0 as f32
}

/// Smallest standard deviation; smaller ones are raised to it, as the logarithm of 0 is infinite.
const SMALLEST_SCALE: f32 = 1e-12;

/// Logarithm of a standard deviation; NaN stays NaN and is refused later.
pub(super) fn log_scale(scale: f32) -> f32 {
    if scale < SMALLEST_SCALE { SMALLEST_SCALE.ln() } else { scale.ln() }
}

/// Opacity of a logit as a byte.
pub(super) fn opacity_byte(logit: f32) -> u8 {
    to_byte(logit.sigmoid())
}

pub(super) fn logit(opacity: f32) -> f32 {
    let p = opacity.clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
    (p / (1.0 - p)).ln()
}

/// Restores the unit quaternion `[w, x, y, z]` whose component `largest` is left out and whose others, in that order,
/// are `rest`: 0 to 1 for -1/√2 to 1/√2.
pub(super) fn unit_quaternion(largest: usize, rest: [f32; 3]) -> [f32; 4] {
    let [a, b, c] = rest.map(|t| (t - 0.5) * SQRT_2);
    let d = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    match largest {
        0 => [d, a, b, c],
        1 => [a, d, b, c],
        2 => [a, b, d, c],
        _ => [a, b, c, d],
    }
}

/// Normalizes a quaternion; one without a direction becomes the identity.
pub(super) fn unit(q: [f32; 4]) -> [f32; 4] {
    rotation::unit_quaternion(q).unwrap_or([1.0, 0.0, 0.0, 0.0])
}

/// Index of the largest component of `q`, and the others as [`unit_quaternion`] takes them.
pub(super) fn without_largest(q: [f32; 4]) -> (usize, [f32; 3]) {
    let q = unit(q);
    let largest = (1..4).fold(0, |best, k| if q[k].abs() > q[best].abs() { k } else { best });
    // Both signs are the same rotation; the largest is positive in all formats.
    let rest = |k: usize| q[k].copysign(q[k] * q[largest]) / SQRT_2 + 0.5;
    let [a, b, c] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][largest];
    (largest, [rest(a), rest(b), rest(c)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_come_back_from_three_components() {
        let q = [0.1_f32, -0.5, 0.7, 0.5];
        let q = q.map(|c| c / 1.0_f32);
        let length = q.iter().map(|c| c * c).sum::<f32>().sqrt();
        for largest in 0..4 {
            let mut u = q.map(|c| c / length);
            u.swap(2, largest);
            let rest: Vec<f32> = (0..4).filter(|&k| k != largest).map(|k| u[k] / SQRT_2 + 0.5).collect();
            let back = unit_quaternion(largest, [rest[0], rest[1], rest[2]]);
            assert!(u.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-6), "{u:?} {back:?}");
        }
        // Components that are too long together do not make it NaN.
        assert!(unit_quaternion(0, [1.0; 3]).iter().all(|c| c.is_finite()));
    }

    #[test]
    fn quaternions_lose_their_largest_component_and_their_length_alone() {
        for q in [[0.1_f32, -0.5, 0.7, 0.5], [-9.0, 1.0, 2.0, -3.0], [0.0, 0.0, -1e-30, 0.0], [1.0; 4], [0.0; 4]] {
            let (largest, rest) = without_largest(q);
            let (u, back) = (unit(q), unit_quaternion(largest, rest));
            let dot: f32 = u.iter().zip(back).map(|(a, b)| a * b).sum();
            assert!(dot.abs() > 1.0 - 1e-6, "{q:?} {back:?}");
            assert!(back[largest] >= 0.5 && rest.iter().all(|t| (0.0..=1.0).contains(t)), "{rest:?}");
        }
    }

    #[test]
    fn numbers_are_rounded_and_kept_within_their_bits() {
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 7.0, f32::NAN].map(to_byte), [0, 0, 128, 255, 255, 0]);
        assert_eq!((to_unorm(1.0, 11), to_unorm(0.25, 10)), (2047, 256));
        assert!((0..=255).all(|b| to_byte(unorm(b, 8)) == b as u8 && opacity_byte(logit(unorm(b, 8))) == b as u8));
        assert!((constant(color(0.7)) - 0.7).abs() < 1e-6);
        assert!(log_scale(0.0).is_finite() && (log_scale(2.0) - 2.0_f32.ln()).abs() < 1e-6);
    }

    #[test]
    fn extreme_opacities_stay_finite() {
        for p in [0.0, 0.25, 1.0] {
            assert!(logit(p).is_finite());
        }
        assert!((logit(0.25) + 3.0_f32.ln()).abs() < 1e-6);
        assert_eq!((unorm(255, 8), unorm(256, 8), unorm(u32::MAX, 11)), (1.0, 0.0, 1.0));
    }
}
