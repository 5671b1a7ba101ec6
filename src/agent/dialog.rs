//! What the dialog was about last, so that "it", "the other one" and "closer" mean something.

use super::camera_args::NORMAL;
use super::tool::ToolCall;
use crate::scene::IdentityId;

/// The last things that were spoken of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DialogState {
    pub(crate) last: Option<IdentityId>,
    /// What "the left one" and "the second one" choose from: the candidates of the last question.
    pub(crate) group: Vec<IdentityId>,
    /// What the present request has marked.
    pub(crate) marked: Vec<IdentityId>,
    /// What the present request draws alone.
    pub(crate) isolated: Vec<IdentityId>,
    /// The last movement or flight, for "again" and "a bit more".
    pub(crate) moved: Option<ToolCall>,
    /// How close the last target was looked at.
    pub(crate) closeness: f64,
}

impl Default for DialogState {
    fn default() -> Self {
        let (group, marked, isolated) = (Vec::new(), Vec::new(), Vec::new());
        Self { last: None, group, marked, isolated, moved: None, closeness: NORMAL }
    }
}
