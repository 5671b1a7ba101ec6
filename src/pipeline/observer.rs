//! How long work reports what it does, and learns whether to go on.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::scene::GaussianCloud;

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

/// Measurements of one training step (reported every few steps).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepMetrics {
    /// Steps done.
    pub step: u64,
    /// Seconds of training so far.
    pub secs: f64,
    /// L1 + 0.2 D-SSIM, mean over the steps since the last report.
    pub loss: f64,
    /// PSNR in dB of the training photos of those steps, mean.
    pub train_psnr: f64,
    /// Gaussians now.
    pub gaussians: usize,
}

/// Quality on one held-out photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewScore {
    /// The photo's name.
    pub name: String,
    /// PSNR in dB.
    pub psnr: f64,
    /// SSIM.
    pub ssim: f64,
}

/// Quality on the held-out photos.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Steps done.
    pub step: u64,
    /// Seconds of training so far (evaluation itself not counted).
    pub secs: f64,
    /// Mean PSNR in dB over the views.
    pub psnr: f64,
    /// Mean SSIM over the views.
    pub ssim: f64,
    /// Gaussians at that step.
    pub gaussians: usize,
    /// Each view.
    pub views: Vec<ViewScore>,
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
