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
}

impl Failure {
    /// The failure of an error and all its causes.
    pub(crate) fn of(error: &dyn std::error::Error, remedy: impl Into<String>) -> Self {
        Self { message: chain(error), remedy: remedy.into() }
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

impl<E: std::error::Error + 'static> From<E> for Stop {
    fn from(error: E) -> Self {
        let job = (&error as &dyn std::error::Error).downcast_ref::<JobError>();
        if job.map_or_else(|| Interrupted::is_cause_of(&error), JobError::is_cancelled) {
            return Self::Cancelled;
        }
        Self::Failed(Failure::of(&error, job.map_or("", remedy)))
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
