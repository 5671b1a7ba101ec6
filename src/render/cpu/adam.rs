//! Adam (Kingma and Ba 2015) on single parameters.

/// Learning rates of one step, in units of the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Positions, scene units.
    pub position: f32,
    /// Log-scales.
    pub log_scale: f32,
    /// Quaternions.
    pub quaternion: f32,
    /// Opacity logits.
    pub opacity_logit: f32,
    /// Constant colour.
    pub sh_constant: f32,
    /// Other coefficients.
    pub sh_rest: f32,
}

/// Constants of one optimiser step.
#[derive(Clone, Copy, Debug)]
pub struct AdamStep {
    /// `1 / (1 - beta1^t)`.
    pub first_correction: f32,
    /// `1 / (1 - beta2^t)`.
    pub second_correction: f32,
}

/// Decay of the first moment.
pub const BETA1: f32 = 0.9;
/// Decay of the second moment.
pub const BETA2: f32 = 0.999;
/// Added to the root of the second moment (3DGS's value).
pub const EPSILON: f32 = 1e-15;

impl AdamStep {
    /// The constants of step `t`, counted from 1.
    pub fn new(t: u64) -> Self {
        let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powf(t.max(1) as f64))) as f32;
        Self { first_correction: correction(BETA1), second_correction: correction(BETA2) }
    }

    /// Moves one parameter against its gradient. `gradient` must be finite.
    #[inline(always)]
    pub fn update(&self, parameter: &mut f32, gradient: f32, first: &mut f32, second: &mut f32, rate: f32) {
        *first += (1.0 - BETA1) * (gradient - *first);
        *second += (1.0 - BETA2) * (gradient * gradient - *second);
        let step = *first * self.first_correction;
        *parameter -= rate * step / ((*second * self.second_correction).sqrt() + EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_step_has_the_length_of_the_rate() {
        for g in [1e-12_f32, 1.0, 1e15] {
            let (mut p, mut m, mut v) = (0.0, 0.0, 0.0);
            AdamStep::new(1).update(&mut p, g, &mut m, &mut v, 0.1);
            assert!((p + 0.1).abs() < 1e-3, "{g}: {p}");
        }
    }

    #[test]
    fn zero_gradients_forever_stay_finite() {
        let (mut p, mut m, mut v) = (1.0, 1.0, 1.0);
        for t in 1..100_000 {
            AdamStep::new(t).update(&mut p, 0.0, &mut m, &mut v, 1e-3);
        }
        assert!(p.is_finite() && m >= 0.0 && v >= 0.0);
    }
}
