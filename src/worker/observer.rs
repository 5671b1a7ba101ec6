//! The observer that turns what a job reports into events.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::Sender;

use super::event::Event;
use super::task::JobId;
use super::{Control, Slot};
use crate::pipeline::observer::{Evaluation, FoundSoFar, Observer, Progress, Severity, Signal, StepMetrics};
use crate::scene::GaussianCloud;

/// Called after every event, from the worker's threads: asks the window to look.
pub(crate) type Repaint = Arc<dyn Fn() + Send + Sync>;

/// A copy of the Gaussians in training.
#[derive(Clone, Debug)]
pub struct CloudSnapshot {
    /// The training job.
    pub job: JobId,
    pub(crate) cloud: Arc<GaussianCloud>,
    /// Number of training steps so far.
    pub step: u64,
}

/// Poses found so far by a job.
#[derive(Clone, Debug)]
pub struct PosesSnapshot {
    /// The search for poses.
    pub(crate) job: JobId,
    pub(crate) found: FoundSoFar,
}

/// Least time between two copies of the cloud: three a second keep the picture alive and cost
/// training little.
const CLOUD_EVERY: Duration = Duration::from_millis(320);
/// Progress is dropped once fewer than this many places are left, so that it never makes other
/// events wait.
const KEPT_FREE: usize = 64;

pub(super) struct JobObserver {
    pub(super) job: JobId,
    pub(super) control: Arc<Control>,
    pub(super) events: Sender<Event>,
    pub(super) clouds: Arc<Slot<CloudSnapshot>>,
    pub(super) poses: Arc<Slot<PosesSnapshot>>,
    pub(super) repaint: Repaint,
    pub(super) last_cloud: Option<Instant>,
    /// True if the job was last reported as paused.
    pub(super) paused: AtomicBool,
    /// Set once the receiver of events is gone.
    pub(super) alone: AtomicBool,
}

impl JobObserver {
    /// Sends an event that must not be lost: waits while the channel is full.
    pub(super) fn send(&self, event: Event) {
        if self.events.send(event).is_err() {
            self.alone.store(true, Ordering::Release);
        }
        (self.repaint)();
    }
}

impl Observer for JobObserver {
    fn signal(&self) -> Signal {
        if self.alone.load(Ordering::Acquire) {
            return Signal::Cancel;
        }
        let signal = self.control.signal();
        let paused = signal == Signal::Pause;
        if self.paused.swap(paused, Ordering::AcqRel) != paused {
            self.send(Event::Paused(self.job, paused));
        }
        signal
    }

    fn progress(&mut self, progress: Progress) {
        let free = self.events.capacity().map_or(usize::MAX, |c| c - self.events.len().min(c));
        if free > KEPT_FREE && self.events.try_send(Event::Progress(self.job, progress)).is_ok() {
            (self.repaint)();
        }
    }

    fn step(&mut self, metrics: StepMetrics) {
        self.send(Event::Step(self.job, metrics));
    }

    fn evaluation(&mut self, evaluation: Evaluation) {
        self.send(Event::Evaluation(self.job, evaluation));
    }

    fn note(&mut self, severity: Severity, text: String) {
        self.send(Event::Note(self.job, severity, text));
    }

    fn wants_cloud(&self) -> bool {
        self.last_cloud.is_none_or(|t| t.elapsed() >= CLOUD_EVERY)
    }

    fn cloud(&mut self, cloud: Arc<GaussianCloud>, step: u64) {
        self.last_cloud = Some(Instant::now());
        self.clouds.publish(CloudSnapshot { job: self.job, cloud, step });
        (self.repaint)();
    }

    fn wants_poses(&self) -> bool {
        true
    }

    fn poses(&mut self, found: FoundSoFar) {
        self.poses.publish(PosesSnapshot { job: self.job, found });
        (self.repaint)();
    }
}
