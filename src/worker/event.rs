//! Events of jobs: what the status bar, the log and the plots follow. Results do not travel here, but in
//! [`Task`](super::Task)s.

use super::task::{JobEnd, JobId, JobInfo};
use crate::pipeline::observer::{Evaluation, Progress, Severity, StepMetrics};

/// Event of a job. Each job sends `Started` first and `Ended` last.
#[derive(Clone, Debug)]
pub enum Event {
    /// The job has left the queue.
    Started(JobId, JobInfo),
    /// Progress of a job. May be dropped when events are not taken fast enough.
    Progress(JobId, Progress),
    /// Training measurements.
    Step(JobId, StepMetrics),
    /// A held-out evaluation.
    Evaluation(JobId, Evaluation),
    /// A line for the log.
    Note(JobId, Severity, String),
    /// The job now waits (`true`) or goes on (`false`).
    Paused(JobId, bool),
    /// The job has ended; its result is in the task.
    Ended(JobId, JobEnd),
}

impl Event {
    /// The job that the event is about.
    pub fn job(&self) -> JobId {
        match self {
            Self::Started(job, _)
            | Self::Progress(job, _)
            | Self::Step(job, _)
            | Self::Evaluation(job, _)
            | Self::Note(job, ..)
            | Self::Paused(job, _)
            | Self::Ended(job, _) => *job,
        }
    }

    /// Returns whether the job is over.
    pub fn is_end(&self) -> bool {
        matches!(self, Self::Ended(..))
    }
}
