//! What the dialog was about last, so that "it", "the other one" and "closer" mean something.

use super::camera_args::NORMAL;
use super::tool::ToolCall;
use crate::scene::IdentityId;

/// The last things that were spoken of.
#[derive(Clone, Debug, PartialEq)]
pub struct DialogState {
    pub last: Option<IdentityId>,
    /// What "the left one" and "the second one" choose from: the candidates of the last question.
    pub group: Vec<IdentityId>,
    /// What the present request has marked.
    pub marked: Vec<IdentityId>,
    /// The last movement or flight, for "again" and "a bit more".
    pub moved: Option<ToolCall>,
    /// How close the last target was looked at.
    pub closeness: f64,
}

impl Default for DialogState {
    fn default() -> Self {
        Self { last: None, group: Vec::new(), marked: Vec::new(), moved: None, closeness: NORMAL }
    }
}
