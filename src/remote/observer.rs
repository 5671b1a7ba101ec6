//! Observer of a served training, which forwards everything to the training's own observer and to the hub.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::hub::Hub;
use super::wire::WireEvent;
use crate::pipeline::observer::{Evaluation, Observer, Progress, Severity, Signal, StepMetrics};
use crate::scene::GaussianCloud;

/// Observer that forwards everything to `inner` and to the hub. It never waits for a client.
pub(crate) struct ServedObserver<'a> {
    pub(super) inner: &'a mut dyn Observer,
    pub(super) hub: Arc<Hub>,
    /// Pause state that was last reported.
    pub(super) paused: AtomicBool,
}

impl Observer for ServedObserver<'_> {
    fn signal(&self) -> Signal {
        // The local user takes precedence over clients.
        let signal = match self.inner.signal() {
            Signal::Continue => self.hub.control.signal(),
            own => own,
        };
        let paused = signal == Signal::Pause;
        if self.paused.swap(paused, Ordering::AcqRel) != paused {
            self.hub.report(WireEvent::Paused(paused));
        }
        signal
    }

    fn progress(&mut self, progress: Progress) {
        self.hub.progress(Some(progress.clone()));
        self.inner.progress(progress);
    }

    fn step(&mut self, metrics: StepMetrics) {
        self.hub.report(WireEvent::Step(metrics));
        self.inner.step(metrics);
    }

    fn evaluation(&mut self, evaluation: Evaluation) {
        self.hub.report(WireEvent::Evaluation(evaluation.clone()));
        self.inner.evaluation(evaluation);
    }

    fn note(&mut self, severity: Severity, text: String) {
        self.hub.report(WireEvent::Note(severity, text.clone()));
        self.inner.note(severity, text);
    }

    fn wants_cloud(&self) -> bool {
        self.hub.wants_cloud() || self.inner.wants_cloud()
    }

    fn cloud(&mut self, cloud: Arc<GaussianCloud>, step: u64) {
        self.hub.publish(Arc::clone(&cloud), step);
        self.inner.cloud(cloud, step);
    }
}
