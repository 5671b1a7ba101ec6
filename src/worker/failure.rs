//! How a job ends short of its outcome: it was asked to, or something went wrong.

use crate::io::OpenError;
use crate::jobs::JobError;
use crate::jobs::error::chain;
use crate::pipeline::observer::Interrupted;

/// Why a job failed, for display: what went wrong where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What went wrong, with file and place.
    pub message: String,
    /// What the user can do about it; empty if the message already says so.
    pub remedy: String,
}

impl Failure {
    /// The failure of an error and all its causes.
    pub(crate) fn of(error: &dyn std::error::Error, remedy: impl Into<String>) -> Self {
        Self { message: chain(error), remedy: remedy.into() }
    }
}

/// How a job ends short of its outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// It was asked to.
    Cancelled,
    /// Something went wrong.
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

/// What the user can do in the window, where the error does not say that itself.
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
