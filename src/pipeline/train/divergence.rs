//! Guard against divergence: a loss far above the recent ones.

use std::collections::VecDeque;

use crate::math::stats::median;

/// Multiple of the running median from which a loss counts as divergence.
const DIVERGED: f64 = 10.0;
/// Losses that are remembered, and that are enough to tell.
const REMEMBERED: usize = 200;
const ENOUGH: usize = 100;

/// Recent losses of a run.
#[derive(Debug, Default)]
pub(super) struct LossGuard {
    recent: VecDeque<f64>,
}

impl LossGuard {
    /// Returns whether the loss at `step` is not finite or far above the recent losses.
    pub(super) fn diverges(&mut self, loss: f64, step: u64) -> bool {
        self.recent.push_back(loss);
        if self.recent.len() > REMEMBERED {
            self.recent.pop_front();
        }
        let usual = if self.recent.len() >= ENOUGH && step % 20 == 0 {
            median(&self.recent.iter().copied().collect::<Vec<_>>())
        } else {
            f64::INFINITY
        };
        !loss.is_finite() || loss > DIVERGED * usual
    }

    /// Forgets all losses: the next ones are of other Gaussians.
    pub(super) fn clear(&mut self) {
        self.recent.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_loss_far_above_the_usual_diverges() {
        let mut guard = LossGuard::default();
        assert!(!(0..140).any(|step| guard.diverges(0.1 + 0.01 * (step % 3) as f64, step)));
        assert!(!guard.diverges(0.9, 140) && guard.diverges(1.2, 160) && guard.diverges(f64::NAN, 161));
        guard.clear();
        assert!(!guard.diverges(1.2, 180), "nothing to compare with");
    }
}
