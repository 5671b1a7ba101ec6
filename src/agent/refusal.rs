//! Why the agent does not do something.

use serde::{Deserialize, Serialize};

/// The kind of reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RefusalKind {
    /// It is not clear what is meant.
    Unclear,
    /// The target is not in the scene.
    NotFound,
    /// The request is against the facts of the scene.
    Conflict,
    /// The policy does not permit it.
    NotPermitted,
    /// The camera cannot go there.
    Unreachable,
    /// It took too many steps or too long.
    Limit,
    /// Something broke.
    Failed,
    /// The user did not want it after all, or stopped it.
    Stopped,
}

/// A refusal in plain words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    /// Its kind.
    pub kind: RefusalKind,
    /// Its reason, one or two sentences.
    pub text: String,
}

impl Refusal {
    /// A refusal of this kind.
    pub fn new(kind: RefusalKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }
}
