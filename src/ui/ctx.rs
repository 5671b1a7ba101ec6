//! The one argument of panes and tools: what they read of the window, and what they may change.

use super::actions::Action;
use super::layout::Layout;
use super::panes::object_thumbnails::ObjectThumbnails;
use super::state::AppState;
use crate::worker::Tasks;

/// The window, for a pane or a tool.
pub(crate) struct Ctx<'a> {
    pub(crate) state: &'a AppState,
    /// Choices that are stored.
    pub(crate) layout: &'a mut Layout,
    /// The background, for jobs whose result the pane or tool keeps.
    pub(crate) tasks: &'a Tasks,
    pub(crate) thumbnails: &'a ObjectThumbnails,
    /// Requests to the window, carried out after the frame is drawn.
    pub(crate) actions: &'a mut Vec<Action>,
}

impl Ctx<'_> {
    /// Asks the window for an action.
    pub(crate) fn ask(&mut self, action: Action) {
        self.actions.push(action);
    }
}
