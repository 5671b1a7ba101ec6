//! Edited Gaussians: the scene continues in another folder, as the same scene to the window.

use std::sync::Arc;

use super::{AppState, Tone};
use crate::jobs::OpenedScene;
use crate::jobs::rearrange::RearrangedScene;

impl AppState {
    /// Takes over edited Gaussians.
    pub(super) fn take_rearranged(&mut self, done: RearrangedScene) {
        let RearrangedScene { cloud, map, folder, name, state, facts } = done;
        let Some(before) = &self.scene else { return };
        if !before.is_edited {
            let text = format!("Edits go into {}; {} stays as it is.", folder.display(), before.name);
            self.toast(Tone::Info, text);
            self.remember(folder.clone());
        }
        let Some(before) = self.scene.take() else { return };
        self.scene = Some(Arc::new(OpenedScene {
            path: folder.clone(),
            name,
            trained: true,
            cloud: Some(Arc::clone(&cloud)),
            semantics: map.clone(),
            report_out: folder.join("report"),
            out: folder,
            state: Some(state),
            // The new folder has no training to continue.
            resumable: None,
            is_edited: true,
            ..(*before).clone()
        }));
        self.resumable = None;
        self.rearranged = Some(cloud);
        self.explored = None;
        self.set_facts(facts);
        self.set_semantics(map);
    }
}
