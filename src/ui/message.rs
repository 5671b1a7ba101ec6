//! What the window says: lines of the log, messages that go away, errors that stay.

use crate::worker::Failure;

/// How a message is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tone {
    Info,
    Good,
    /// Something was left out or changed.
    Warning,
    Error,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// How it is meant.
    pub(crate) tone: Tone,
    /// What it says.
    pub text: String,
}

/// A message that goes away by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Toast {
    /// Names it, so that the window can time it.
    pub(crate) id: u64,
    /// How it is meant.
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

/// An error that is shown until a user has read it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ErrorBox {
    /// What was being done: "Opening fox".
    pub(crate) doing: String,
    /// What went wrong, and what to do.
    pub(crate) failure: Failure,
}
