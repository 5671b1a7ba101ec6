//! What the talk was about last, so that "it", "the other one" and "closer" mean something.

use super::tool::ToolCall;
use super::wish::NORMAL;
use crate::scene::IdentityId;

/// The last things that were spoken of.
#[derive(Clone, Debug, PartialEq)]
pub struct Focus {
    /// The last target.
    pub last: Option<IdentityId>,
    /// What "the left one" and "the second one" choose from: the candidates of the last question.
    pub group: Vec<IdentityId>,
    /// The last call that had a target, for "and the other one".
    pub call: Option<ToolCall>,
    /// The last movement or flight, for "again" and "a bit more".
    pub moved: Option<ToolCall>,
    /// How close the last target was looked at; see [`super::wish::GoWish`].
    pub closeness: f64,
}

impl Default for Focus {
    fn default() -> Self {
        Self { last: None, group: Vec::new(), call: None, moved: None, closeness: NORMAL }
    }
}
