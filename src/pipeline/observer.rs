//! How long work reports what it does, and learns whether to go on.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::scene::GaussianCloud;
pub use crate::scene::{Evaluation, StepMetrics, ViewScore};

/// What the work should do next; asked at every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Go on.
    Continue,
    /// Wait, and ask again.
    Pause,
    /// Stop at a consistent state and return.
    Cancel,
}

/// Where a piece of long work stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// What is being done, for people: "Training", "Loading photos".
    pub stage: String,
    /// Units done so far.
    pub done: u64,
    /// Units in all.
    pub total: u64,
    /// Seconds of work so far, pauses left out, earlier runs of a resumed job included.
    pub elapsed_secs: f64,
    /// Units per second over the last few seconds; 0 if not known yet.
    pub rate: f64,
}

impl Progress {
    /// Seconds to go at the present rate; `None` if not known.
    pub fn eta_secs(&self) -> Option<f64> {
        (self.rate > 0.0).then(|| self.total.saturating_sub(self.done) as f64 / self.rate)
    }
}

/// Something a person should see in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Level {
    /// For the record.
    Info,
    /// Something was left out or changed.
    Warning,
}

/// What long work calls as it goes. Every method but `signal` may be ignored.
pub trait Observer: Send {
    /// Asked at every step.
    fn signal(&self) -> Signal {
        Signal::Continue
    }
    /// Now and then, at least ten times a second where steps are short.
    fn progress(&mut self, _progress: Progress) {}
    /// Training measurements.
    fn step(&mut self, _metrics: StepMetrics) {}
    /// A held-out evaluation.
    fn evaluation(&mut self, _evaluation: Evaluation) {}
    /// A line for the log.
    fn note(&mut self, _level: Level, _text: String) {}
    /// Whether a copy of the cloud is wanted now. Copies cost time, so the observer limits them.
    fn wants_cloud(&self) -> bool {
        false
    }
    /// The cloud as it is.
    fn cloud(&mut self, _cloud: Arc<GaussianCloud>, _step: u64) {}
}

/// An observer that looks at nothing.
pub struct Silent;

impl Observer for Silent {}
