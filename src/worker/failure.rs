//! Ends of a job without its outcome: canceled, or failed.

use crate::io::OpenError;
use crate::jobs::JobError;
use crate::jobs::error::chain;
use crate::pipeline::observer::Interrupted;

/// Failure of a job, for display: the problem, its place, and a remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The problem, with file and place.
    pub message: String,
    /// Remedy for the user; empty if the message already has one.
    pub remedy: String,
    /// True if the request made no sense and nothing is broken: a passing message tells it.
    pub is_refusal: bool,
}

impl Failure {
    /// The failure of an error and all its causes.
    pub(crate) fn of(error: &dyn std::error::Error, remedy: impl Into<String>) -> Self {
        Self::new(chain(error), remedy)
    }

    /// A failure with this message and remedy.
    pub fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into(), is_refusal: false }
    }

    /// Message and remedy in a line.
    pub(crate) fn in_a_line(&self) -> String {
        format!("{} {}", self.message, self.remedy)
    }
}

/// End of a job without its outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The job was canceled.
    Cancelled,
    /// The job has failed.
    Failed(Failure),
}

impl Stop {
    /// The same with a remedy, if it has none.
    pub(crate) fn or_remedy(mut self, remedy: &str) -> Self {
        if let Self::Failed(failure) = &mut self
            && failure.remedy.is_empty()
        {
            failure.remedy = remedy.into();
        }
        self
    }
}

impl<E: std::error::Error + 'static> From<E> for Stop {
    fn from(error: E) -> Self {
        let job = (&error as &dyn std::error::Error).downcast_ref::<JobError>();
        if job.map_or_else(|| Interrupted::is_cause_of(&error), JobError::is_cancelled) {
            return Self::Cancelled;
        }
        let is_refusal = matches!(job, Some(JobError::Edit(_) | JobError::SplatEdit(_)));
        Self::Failed(Failure { is_refusal, ..Failure::of(&error, job.map_or("", remedy)) })
    }
}

/// Remedy in the window, where the error itself does not name one.
fn remedy(error: &JobError) -> &'static str {
    match error {
        JobError::Open(OpenError::NotFound { .. }) => "Check the path: the file may have been moved or renamed.",
        JobError::Open(OpenError::Unrecognized { .. }) => {
            "Open the folder that holds the photos and their poses, or a splat (.ply, .sog, .glb)."
        }
        JobError::NothingHeldOut(_) => "Choose how many to hold out in the Training pane.",
        _ => "",
    }
}
