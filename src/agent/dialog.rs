//! State of the dialog, which resolves "it", "the other one" and "closer".

use super::camera_args::NORMAL;
use super::tool::ToolCall;
use crate::scene::IdentityId;

/// Things and movements that were mentioned last.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DialogState {
    pub(crate) last: Option<IdentityId>,
    /// Candidates of the last question, from which "the left one" and "the second one" choose.
    pub(crate) group: Vec<IdentityId>,
    /// Identities that the current request has marked.
    pub(crate) marked: Vec<IdentityId>,
    /// Identities that the current request has isolated.
    pub(crate) isolated: Vec<IdentityId>,
    /// Last movement or flight, for "again" and "a bit more".
    pub(crate) moved: Option<ToolCall>,
    /// Closeness of the last flight to a target.
    pub(crate) closeness: f64,
}

impl Default for DialogState {
    fn default() -> Self {
        let (group, marked, isolated) = (Vec::new(), Vec::new(), Vec::new());
        Self { last: None, group, marked, isolated, moved: None, closeness: NORMAL }
    }
}
