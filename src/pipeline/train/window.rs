//! Measurements between two training reports. A checkpoint keeps the unreported ones, so that every report covers
//! equally many steps.

use serde::{Deserialize, Serialize};

use crate::math::stats::mean;
use crate::pipeline::observer::StepMetrics;

/// Losses and PSNRs since the last report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepWindow {
    /// Losses; `None` for values that are not finite, which JSON lacks.
    losses: Vec<Option<f64>>,
    psnrs: Vec<f64>,
}

impl StepWindow {
    pub(super) fn add(&mut self, loss: f64, psnr: f64) {
        self.losses.push(Some(loss).filter(|loss| loss.is_finite()));
        if psnr.is_finite() {
            self.psnrs.push(psnr);
        }
    }

    /// Report after `step`: means of the measurements since the last one.
    pub(super) fn metrics(&self, step: u64, secs: f64, gaussians: usize) -> StepMetrics {
        let losses: Vec<f64> = self.losses.iter().map(|loss| loss.unwrap_or(f64::NAN)).collect();
        StepMetrics { step, secs, loss: mean(&losses), train_psnr: mean(&self.psnrs), gaussians }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_checkpoint_keeps_is_reported_as_if_it_had_never_been_stored() {
        let step = |k: u64| (0.1 + 0.01 * k as f64, 20.0 + 0.3 * k as f64);
        let added = |mut window: StepWindow, steps: std::ops::Range<u64>| {
            steps.map(step).for_each(|(loss, psnr)| window.add(loss, psnr));
            window
        };
        let stored = |window: &StepWindow| -> StepWindow {
            serde_json::from_str(&serde_json::to_string(window).expect("JSON")).expect("read")
        };
        let through = added(StepWindow::default(), 0..10).metrics(10, 1.0, 7);
        let half = stored(&added(StepWindow::default(), 0..4));
        assert_eq!(added(half, 4..10).metrics(10, 1.0, 7), through);
        // The control: without the first half it is another report.
        assert!(added(StepWindow::default(), 4..10).metrics(10, 1.0, 7) != through);
        // A loss that is not finite stays so, and the checkpoint stays readable.
        let mut broken = StepWindow::default();
        broken.add(f64::INFINITY, f64::NAN);
        assert!(stored(&broken) == broken && broken.metrics(1, 0.0, 1).loss.is_nan());
    }
}
