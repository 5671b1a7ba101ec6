//! Adam (Kingma and Ba 2015) on single parameters, robust against outlier gradients;
//! `shaders/adam.wgsl` has the same rule.
//!
//! Plain Adam remembers the square of a gradient for some 1,000 steps per power of e: one that is 1e15
//! times too large would hold its parameter still for 70,000. Here no gradient counts for more than the one that
//! doubles its parameter's second moment, so the parameter keeps at least 0.7 of its speed. Lasting growth is followed,
//! because doubling is fast. A parameter without a second moment, new or just reset, has nothing to compare with: its
//! first gradient counts as it is.

/// Learning rates of one step, in units of the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "each name says what it is")]
pub struct Rates {
    pub position: f32,
    pub log_scale: f32,
    pub quaternion: f32,
    pub opacity_logit: f32,
    pub sh_constant: f32,
    pub sh_rest: f32,
}

/// Constants of one optimizer step.
#[derive(Clone, Copy, Debug)]
pub struct AdamStep {
    /// `1 / (1 - beta1^t)`.
    pub(crate) first_correction: f32,
    /// `1 / (1 - beta2^t)`.
    pub(crate) second_correction: f32,
}

/// Decay of the first moment.
pub(crate) const BETA1: f32 = 0.9;
/// Decay of the second moment.
pub(crate) const BETA2: f32 = 0.999;
/// Added to the root of the second moment (3DGS's value).
pub(crate) const EPSILON: f32 = 1e-15;

/// Gradients are cut to this before they are squared, far from overflow.
pub(crate) const CLIP: f32 = 1e15;
/// Square of the largest gradient, in units of the second moment: the one that doubles it.
pub(crate) const GROWTH: f32 = 1.0 / (1.0 - BETA2);
/// A gradient this many times too large is an outlier, which is counted. Gradients of Gaussians that become visible for
/// the first time may be 1e10 times those before.
pub(crate) const OUTLIER: f32 = 1e12;

impl AdamStep {
    /// The constants of step `t`, counted from 1.
    pub fn new(t: u64) -> Self {
        let correction = |beta: f32| (1.0 / (1.0 - f64::from(beta).powf(t.max(1) as f64))) as f32;
        Self { first_correction: correction(BETA1), second_correction: correction(BETA2) }
    }

    /// Moves one parameter against its gradient, which must be finite. Returns whether that was an outlier.
    #[inline(always)]
    pub fn update(&self, parameter: &mut f32, gradient: f32, first: &mut f32, second: &mut f32, rate: f32) -> bool {
        let limit = if *second > 0.0 { (GROWTH * *second).sqrt().min(CLIP) } else { CLIP };
        let outlier = gradient.abs() > OUTLIER * limit;
        let gradient = gradient.clamp(-limit, limit);
        *first += (1.0 - BETA1) * (gradient - *first);
        *second += (1.0 - BETA2) * (gradient * gradient - *second);
        let step = *first * self.first_correction;
        *parameter -= rate * step / ((*second * self.second_correction).sqrt() + EPSILON);
        outlier
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
