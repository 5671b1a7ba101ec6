//! Removal of objects and parts: the result is a new scene, shown beside the unchanged one.

use super::actions::Action;
use super::app::App;
use super::dialogs::Question;
use super::state::Tone;
use crate::jobs::remove::{RemovalOptions, RemoveRequest};
use crate::scene::IdentityId;
use crate::worker::Command;

impl App {
    /// Makes a scene without these identities.
    pub(super) fn remove(&mut self, ids: &[IdentityId]) {
        let Some(folder) = self.state.scene.as_ref().filter(|_| self.state.is_trained()).map(|s| s.out.clone()) else {
            return self.state.toast(Tone::Warning, "Only from a trained scene can something be removed.");
        };
        self.submit_removal(RemoveRequest { folder, options: RemovalOptions::of(ids), retrain: false });
    }

    /// Asks for confirmation before the scene made by a removal is deleted.
    pub(super) fn ask_to_delete_removed(&mut self) {
        let Some(removed) = &self.state.removed else {
            return self.state.toast(Tone::Warning, "No scene was made by removing something from this one.");
        };
        let text = format!(
            "Delete {}, the scene without {}? This cannot be undone; the scene that it was made of stays.",
            removed.folder.display(),
            removed.name
        );
        self.question =
            Some(Question { text, yes: "Delete it", other: None, no: "Keep it", action: Action::DeleteRemoved });
    }

    /// Deletes the scene made by a removal.
    pub(super) fn delete_removed(&mut self) {
        let Some(removed) = self.state.removed.take() else { return };
        match removed.delete() {
            Ok(()) => {
                self.state.beside = self.state.beside.take().filter(|beside| beside.path != removed.folder);
                self.state.toast(Tone::Good, format!("Deleted {}", removed.folder.display()));
            }
            Err(e) => {
                self.state.toast(Tone::Error, e.to_string());
                self.state.removed = Some(removed);
            }
        }
    }

    /// Makes a scene without the identities of the request, from the open one.
    pub(super) fn submit_removal(&mut self, request: RemoveRequest) {
        if self.editing.is_some() || !self.edits.is_empty() {
            return self.state.toast(Tone::Warning, "Objects are being changed; remove it once that is done.");
        }
        if self.state.scene.as_ref().is_none_or(|s| s.out != request.folder) {
            return self
                .state
                .toast(Tone::Warning, "Another scene is open now; open that one first to remove from it.");
        }
        self.submit(Command::Remove(Box::new(request)));
    }
}
