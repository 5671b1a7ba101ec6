//! Progress reports of long work, and signals to pause or cancel it.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::math::format;
use crate::scene::{Camera, GaussianCloud};
pub use crate::scene::{Evaluation, StepMetrics, ViewScore};

/// Signal to the work; queried at every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Go on.
    Continue,
    /// Wait, and query again.
    Pause,
    /// Stop at a consistent state and return.
    Cancel,
}

/// Progress of long work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Stage, for display: "Training", "Loading photos".
    pub stage: String,
    /// Units done so far.
    pub done: u64,
    /// Total units; 0 if not counted.
    pub total: u64,
    /// Seconds of work so far, pauses left out, earlier runs of a resumed job included.
    pub elapsed_secs: f64,
    /// Units per second over the last few seconds; 0 if not known yet.
    pub rate: f64,
}

/// The observer asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("canceled")]
pub struct Interrupted;

impl Interrupted {
    /// Returns whether `error` or one of its sources is [`Interrupted`].
    pub(crate) fn is_cause_of(error: &(dyn Error + 'static)) -> bool {
        error.is::<Self>() || error.source().is_some_and(Self::is_cause_of)
    }
}

/// Seconds over which a rate is measured.
const RATE_SECS: f64 = 3.0;

/// Progress reporter of one stage, which also handles pause and cancel. Pauses do not count as time.
pub(crate) struct Ticker {
    stage: String,
    /// Total units.
    pub(crate) total: u64,
    start: Instant,
    /// Seconds of earlier runs.
    before_secs: f64,
    /// Units done and the time in seconds, over the last few seconds.
    marks: VecDeque<(u64, f64)>,
}

impl Ticker {
    /// Starts the clock of `stage`, which has `total` units.
    pub(crate) fn new(stage: impl Into<String>, total: usize) -> Self {
        Self::resumed(stage, total as u64, 0, 0.0)
    }

    /// Starts the clock of a stage of which earlier runs did `done` units in `secs` seconds.
    pub(crate) fn resumed(stage: impl Into<String>, total: u64, done: u64, secs: f64) -> Self {
        let marks = VecDeque::from([(done, secs)]);
        Self { stage: stage.into(), total, start: Instant::now(), before_secs: secs, marks }
    }

    /// Continues with `stage`. A new stage starts its clock, with `done` units at time zero.
    pub(crate) fn enter(&mut self, stage: &str, done: u64, total: u64) {
        if self.stage != stage {
            *self = Self::resumed(stage, total, done, 0.0);
        }
        self.total = total;
    }

    /// Reports that `done` units are done, and waits out a pause.
    pub(crate) fn tick(&mut self, done: usize, observer: &mut dyn Observer) -> Result<(), Interrupted> {
        self.report(done as u64, observer);
        self.proceed(observer)
    }

    /// Waits out a pause.
    pub(crate) fn proceed(&mut self, observer: &dyn Observer) -> Result<(), Interrupted> {
        let before = Instant::now();
        let result = observer.proceed();
        self.start += before.elapsed();
        result
    }

    /// Reports that `done` units are done.
    pub(crate) fn report(&mut self, done: u64, observer: &mut dyn Observer) {
        let elapsed_secs = self.before_secs + self.start.elapsed().as_secs_f64();
        let rate = self.rate(done, elapsed_secs);
        let (stage, total) = (self.stage.clone(), self.total);
        observer.progress(Progress { stage, done: done.min(total), total, elapsed_secs, rate });
    }

    fn rate(&mut self, done: u64, secs: f64) -> f64 {
        self.marks.push_back((done, secs));
        while self.marks.len() > 2 && self.marks[1].1 < secs - RATE_SECS {
            self.marks.pop_front();
        }
        let (first, since) = self.marks[0];
        if secs > since { done.saturating_sub(first) as f64 / (secs - since) } else { 0.0 }
    }
}

/// Reports the begin of a `stage` without counted steps, and waits out a pause.
pub(crate) fn begin(stage: impl Into<String>, observer: &mut dyn Observer) -> Result<(), Interrupted> {
    Ticker::new(stage, 0).tick(0, observer)
}

impl Progress {
    /// Count for display, "3 of 84"; `None` if steps are not counted.
    pub(crate) fn counted(&self) -> Option<String> {
        (self.total > 0).then(|| format!("{} of {}", format::count(self.done), format::count(self.total)))
    }

    /// Remaining seconds at the present rate; `None` if unknown or done.
    pub(crate) fn eta_secs(&self) -> Option<f64> {
        (self.rate > 0.0 && self.done < self.total).then(|| self.total.saturating_sub(self.done) as f64 / self.rate)
    }
}

/// Cameras and points that a search for poses has found so far.
#[derive(Clone, Debug, Default)]
pub struct FoundSoFar {
    /// Cameras of the photos with a pose.
    pub(crate) cameras: Vec<Camera>,
    /// Sparse points as Gaussians, if there are any.
    pub(crate) cloud: Option<Arc<GaussianCloud>>,
    /// Number of all photos.
    pub(crate) photos: usize,
}

/// Severity of a line in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Severity {
    /// For the record.
    Info,
    /// Something was left out or changed.
    Warning,
}

/// Receiver of the reports of long work. Every method but `signal` may be ignored.
pub trait Observer: Send {
    /// Returns the signal to the work; called at every step.
    fn signal(&self) -> Signal {
        Signal::Continue
    }
    /// Waits out a pause.
    fn proceed(&self) -> Result<(), Interrupted> {
        loop {
            match self.signal() {
                Signal::Continue => return Ok(()),
                Signal::Cancel => return Err(Interrupted),
                Signal::Pause => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }
    /// Receives the progress, at least ten times a second if steps are short.
    fn progress(&mut self, _progress: Progress) {}
    /// Receives training measurements.
    fn step(&mut self, _metrics: StepMetrics) {}
    /// Receives a held-out evaluation.
    fn evaluation(&mut self, _evaluation: Evaluation) {}
    /// Receives a line for the log.
    fn note(&mut self, _severity: Severity, _text: String) {}
    /// Returns whether a copy of the cloud is requested now. Copies cost time, so the observer limits them.
    fn wants_cloud(&self) -> bool {
        false
    }
    /// Receives the present cloud.
    fn cloud(&mut self, _cloud: Arc<GaussianCloud>, _step: u64) {}
    /// Returns whether poses are shown while they are sought. Snapshots of them cost time.
    fn wants_poses(&self) -> bool {
        false
    }
    /// Receives the poses that are known by now.
    fn poses(&mut self, _found: FoundSoFar) {}
}

/// Observer that ignores all reports.
pub struct Silent;

impl Observer for Silent {}

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_last_seconds() {
        let mut ticker = Ticker::resumed("x", 1000, 100, 50.0);
        assert_eq!(ticker.rate(100, 50.0), 0.0);
        assert_eq!(ticker.rate(110, 51.0), 10.0);
        for step in 1..=10 {
            ticker.rate(110 + 20 * step, 51.0 + step as f64);
        }
        assert_eq!(ticker.rate(330, 62.0), 20.0);
        assert!(ticker.marks.len() < 8);
    }

    #[test]
    fn an_interruption_is_found_behind_other_errors() {
        #[derive(Debug, thiserror::Error)]
        enum Inner {
            #[error("stopped")]
            Stopped(#[from] Interrupted),
            #[error("broken")]
            Broken,
        }
        #[derive(Debug, thiserror::Error)]
        #[error(transparent)]
        struct Outer(#[from] Inner);
        assert!(Interrupted::is_cause_of(&Interrupted));
        assert!(Interrupted::is_cause_of(&Outer(Interrupted.into())));
        assert!(!Interrupted::is_cause_of(&Outer(Inner::Broken)));
    }
}
