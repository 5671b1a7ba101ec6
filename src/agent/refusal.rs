//! Why the agent does not do something.

use serde::{Deserialize, Serialize};

/// The kind of reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RefusalKind {
    Unclear,
    NotFound,
    /// The request is against the facts of the scene.
    Conflict,
    NotPermitted,
    Unreachable,
    /// It took too many steps or too long.
    Limit,
    Failed,
    /// The user stopped it.
    Stopped,
}

/// A refusal in plain words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    pub kind: RefusalKind,
    pub(crate) text: String,
}

impl Refusal {
    /// A refusal of this kind.
    pub(crate) fn new(kind: RefusalKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }
}
