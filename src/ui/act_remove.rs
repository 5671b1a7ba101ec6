//! Removing things: the result is a scene of its own, seen beside this one, which stays as it is.

use super::app::App;
use super::state::Tone;
use crate::jobs::remove::{RemovalOptions, RemoveRequest};
use crate::scene::IdentityId;
use crate::worker::Command;

impl App {
    /// Makes a scene without the identity.
    pub(super) fn remove(&mut self, id: IdentityId) {
        self.submit_removal(RemovalOptions::of(id), false);
    }

    /// Makes a scene without what `options` say, trained anew if wanted.
    pub(super) fn submit_removal(&mut self, options: RemovalOptions, retrain: bool) {
        if self.editing.is_some() || !self.edits.is_empty() {
            return self.state.toast(Tone::Warning, "Objects are being changed; remove it once that is done.");
        }
        let Some(folder) = self.state.scene.as_ref().filter(|_| self.state.is_trained()).map(|s| s.out.clone()) else {
            return self.state.toast(Tone::Warning, "Only from a trained scene can something be removed.");
        };
        self.submit(Command::Remove(Box::new(RemoveRequest { folder, options, retrain })));
    }
}
