//! Edits of objects and parts as they are asked for: one history for the user's and the agent's.

use std::sync::Arc;

use crate::jobs::edit::EditRequest;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::undo::UndoHistory;
use crate::scene::{IdentityId, SemanticMap};

/// A step that waits for those before it: what it comes to depends on where they lead.
pub(super) enum EditStep {
    Request(EditRequest),
    Undo,
    Redo,
    /// The agent took a rename back, after which the identity is called this again.
    UndoRename(IdentityId, String),
}

impl EditStep {
    /// What it comes to now; `None` if there is nothing to undo or redo.
    pub(super) fn request(self, history: &UndoHistory<Arc<SemanticMap>>) -> Option<EditRequest> {
        let restore = |map: Option<&Arc<SemanticMap>>| map.cloned().map(EditRequest::Restore);
        match self {
            Self::Request(request) => Some(request),
            Self::Undo => restore(history.last()),
            Self::Redo => restore(history.next()),
            Self::UndoRename(id, name) => {
                let called = |map: &&Arc<SemanticMap>| {
                    map.identities.get(id).is_some_and(|i| i.names.first().map_or("", |n| n) == name)
                };
                // Where the user has edited since, the name alone is taken back.
                restore(history.last().filter(called)).or(Some(EditRequest::Apply(Edit::Rename(id, name))))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NOBODY};

    fn called(name: &str) -> Arc<SemanticMap> {
        let mut identities = Identities::default();
        identities.add(Level::Object, NOBODY, vec![name.into()]);
        Arc::new(SemanticMap { identities, ..SemanticMap::default() })
    }

    #[test]
    fn an_agent_takes_its_rename_back_as_ctrl_z_would() {
        let lamp = called("lamp");
        let mut history = UndoHistory::default();
        let step = || EditStep::UndoRename(1, "lamp".into());
        history.record(Arc::clone(&lamp));
        let restored = |request| matches!(request, Some(EditRequest::Restore(map)) if Arc::ptr_eq(&map, &lamp));
        assert!(restored(step().request(&history)) && restored(EditStep::Undo.request(&history)));
        // The user has renamed it once more.
        history.record(called("torch"));
        let Some(EditRequest::Apply(Edit::Rename(1, name))) = step().request(&history) else {
            panic!("the user's edit would be lost");
        };
        assert_eq!(name, "lamp");
        assert!(EditStep::Redo.request(&history).is_none());
    }
}
