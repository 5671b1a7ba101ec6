//! How long work reports what it does, and learns whether to go on.

use std::collections::VecDeque;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::math::format;
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
    /// What is being done, for display: "Training", "Loading photos".
    pub stage: String,
    /// Units done so far.
    pub done: u64,
    /// Units in all; 0 where they are not counted.
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
    /// Whether `error`, or what caused it, is that the observer asked to stop.
    pub(crate) fn is_cause_of(error: &(dyn Error + 'static)) -> bool {
        error.is::<Self>() || error.source().is_some_and(Self::is_cause_of)
    }
}

/// Seconds over which a rate is measured.
const RATE_SECS: f64 = 3.0;

/// Reports the progress of one stage, and asks whether to go on. Pauses do not count as time.
pub(crate) struct Ticker {
    stage: String,
    /// Units in all.
    pub(crate) total: u64,
    start: Instant,
    /// Seconds of earlier runs.
    before_secs: f64,
    /// Units that were done at a time in seconds: those of the last few seconds.
    marks: VecDeque<(u64, f64)>,
}

impl Ticker {
    /// Starts the clock of `stage`, which has `total` units.
    pub(crate) fn new(stage: impl Into<String>, total: usize) -> Self {
        Self::resumed(stage, total as u64, 0, 0.0)
    }

    /// The same where earlier runs did `done` units in `secs` seconds.
    pub(crate) fn resumed(stage: impl Into<String>, total: u64, done: u64, secs: f64) -> Self {
        let marks = VecDeque::from([(done, secs)]);
        Self { stage: stage.into(), total, start: Instant::now(), before_secs: secs, marks }
    }

    /// Goes on with `stage`: its clock starts if it is another than before, and what is `done` by then took no time.
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

/// Says that a `stage` has begun whose steps are not counted, and waits out a pause.
pub(crate) fn begin(stage: impl Into<String>, observer: &mut dyn Observer) -> Result<(), Interrupted> {
    Ticker::new(stage, 0).tick(0, observer)
}

impl Progress {
    /// How far it is, "3 of 84"; `None` where its steps are not counted.
    pub(crate) fn counted(&self) -> Option<String> {
        (self.total > 0).then(|| format!("{} of {}", format::count(self.done), format::count(self.total)))
    }

    /// Seconds to go at the present rate; `None` if not known, and where all is done.
    pub(crate) fn eta_secs(&self) -> Option<f64> {
        (self.rate > 0.0 && self.done < self.total).then(|| self.total.saturating_sub(self.done) as f64 / self.rate)
    }
}

/// Something the user should see in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Severity {
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
    /// Now and then, at least ten times a second where steps are short.
    fn progress(&mut self, _progress: Progress) {}
    /// Training measurements.
    fn step(&mut self, _metrics: StepMetrics) {}
    /// A held-out evaluation.
    fn evaluation(&mut self, _evaluation: Evaluation) {}
    /// A line for the log.
    fn note(&mut self, _severity: Severity, _text: String) {}
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
