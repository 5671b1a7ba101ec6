//! Measurements of a training, for the plots.

use crate::pipeline::observer::{Evaluation, StepMetrics};

/// Measurements kept for the plots; beyond that every second one is dropped.
pub(super) const MAX_STEPS: usize = 4_000;

/// Measurements of a training so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainHistory {
    /// Measurements, oldest first, thinned out if there are many.
    pub steps: Vec<StepMetrics>,
    /// Held-out evaluations, oldest first.
    pub(crate) evaluations: Vec<Evaluation>,
}

impl TrainHistory {
    /// Adds a measurement.
    pub(super) fn push(&mut self, metrics: StepMetrics) {
        // A resumed run continues the earlier measurements; a new one starts over.
        self.steps.retain(|s| s.step < metrics.step);
        self.evaluations.retain(|e| e.step <= metrics.step);
        if self.steps.len() >= MAX_STEPS {
            let mut keep = false;
            self.steps.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.steps.push(metrics);
    }
}
