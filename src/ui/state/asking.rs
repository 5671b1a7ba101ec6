//! Conditions for queries.

use super::AppState;
use crate::scene::IdentityId;
use crate::worker::JobKind;

impl AppState {
    /// True if neither an object or part nor its parts have a Gaussian.
    pub(crate) fn is_empty(&self, id: IdentityId) -> bool {
        self.sizes.get(id as usize) == Some(&0)
    }

    /// Reason why queries are impossible, as a sentence; `None` if they are possible.
    pub(crate) fn why_no_query(&self) -> Option<String> {
        if self.semantics.is_some() {
            return None;
        }
        let Some(scene) = &self.scene else { return Some("Nothing to query yet: open a scene first.".into()) };
        let is_running = |kind| self.job.as_ref().is_some_and(|j| j.kind == kind);
        let why = match &scene.remote {
            Some(origin) => return Some(format!("Nothing to query yet: no objects are known on {}.", origin.host)),
            None if self.is_training() => "Nothing to query while training runs: objects come after it.",
            None if is_running(JobKind::Objects) => "Nothing to query yet: objects are being found.",
            None if !self.is_trained() => "Nothing to query yet: train, then find objects first (Objects pane).",
            None if scene.dataset.is_some() => "Nothing to query yet: find objects first (Objects pane).",
            None => {
                "Nothing to query yet: select an object by clicks first (Ctrl+P, \u{201c}select a new object\u{201d})."
            }
        };
        Some(why.into())
    }
}
