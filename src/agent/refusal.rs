//! Refusals of the agent.

use serde::{Deserialize, Serialize};

/// Kind of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RefusalKind {
    Unclear,
    NotFound,
    /// The request conflicts with the facts of the scene.
    Conflict,
    NotPermitted,
    Unreachable,
    /// The request took too many steps or too long.
    Limit,
    Failed,
    /// The user stopped the request.
    Stopped,
}

/// Refusal with its reason in plain words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refusal {
    pub kind: RefusalKind,
    pub(crate) text: String,
}

impl Refusal {
    /// Returns a refusal of this kind.
    pub(crate) fn new(kind: RefusalKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }
}
