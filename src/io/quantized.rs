//! What the quantized splat formats share: fixed-point numbers, opacities, quaternions without
//! their largest component.

use std::f32::consts::SQRT_2;

/// Opacities nearer to 0 or 1 than this are moved here: their logit would be infinite.
const OPACITY_MARGIN: f32 = 1e-6;

/// The low `bits` of `value` as 0 to 1.
pub(super) fn unorm(value: u32, bits: u32) -> f32 {
    let mask = (1_u32 << bits) - 1;
    (value & mask) as f32 / mask as f32
}

pub(super) fn logit(opacity: f32) -> f32 {
    let p = opacity.clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
    (p / (1.0 - p)).ln()
}

/// The unit quaternion `[w, x, y, z]` whose component `largest` is left out and whose others,
/// in that order, are `rest`: 0 to 1 for -1/√2 to 1/√2.
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
    fn extreme_opacities_stay_finite() {
        for p in [0.0, 0.25, 1.0] {
            assert!(logit(p).is_finite());
        }
        assert!((logit(0.25) + 3.0_f32.ln()).abs() < 1e-6);
        assert_eq!((unorm(255, 8), unorm(256, 8), unorm(u32::MAX, 11)), (1.0, 0.0, 1.0));
    }
}
