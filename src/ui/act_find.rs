//! Finding objects: asks with what where photos came without labels, downloads what that needs, and goes on by itself.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use super::app::App;
use super::find_dialog::{AwaitedModels, Means};
use super::panes::models::Models;
use super::state::Tone;
use crate::jobs::find_objects::FindRequest;
use crate::worker::{Command, Event};

impl App {
    /// Finds objects and parts with the labels that came with the photos; without, asks what is to look at them.
    pub(super) fn find_objects(&mut self) {
        let has_labels = self.state.scene.as_ref().is_some_and(|s| s.masks.is_some() || s.dataset.is_none());
        if has_labels || !self.state.is_trained() {
            return self.find_objects_by(None);
        }
        // Files may have been put there by hand since they were listed.
        self.models = Models::default();
        self.find_dialog.open();
    }

    /// Shows the dialog if it is open, and goes on with what is decided there.
    pub(super) fn ask_for_means(&mut self, ctx: &egui::Context) {
        if self.find_dialog.is_open() {
            self.models.keep_listed(&self.state, &self.worker);
        }
        let max_seeds = self.layout.finding.max_seeds;
        let means = self.find_dialog.show(ctx, &self.state, max_seeds, &mut self.actions);
        means.into_iter().for_each(|means| self.find_with(means));
    }

    fn find_with(&mut self, means: Means) {
        let Means { segmenter, encoder, missing } = means;
        (self.layout.finding.segmenter, self.layout.finding.encoder) = (Some(segmenter), Some(encoder));
        self.find_after(missing);
    }

    /// Finds objects once these models are here: downloads the first of them, or finds if there is none.
    fn find_after(&mut self, mut missing: VecDeque<String>) {
        let Some(id) = missing.pop_front() else { return self.find_objects_by(None) };
        let scene = self.state.scene_number;
        let job = self.submit(Command::InstallModel { id, brought: None });
        self.awaited = job.map(|job| AwaitedModels { job, then: missing, scene });
    }

    /// Takes note of what happens to the downloads that a search waits for.
    pub(super) fn hear(&mut self, event: &Event) {
        let Some(awaited) = self.awaited.take_if(|a| event.is_end() && event.job() == a.job) else { return };
        if !matches!(event, Event::Finished(..)) {
            let text = "Objects are not looked for: a model is missing. What was downloaded is kept; find objects again \
                        to go on.";
            return self.state.toast(Tone::Warning, text);
        }
        // Another scene was opened meanwhile: nobody asked about that one.
        if awaited.scene == self.state.scene_number {
            self.find_after(awaited.then);
        }
    }

    /// Finds objects and parts with these masks, those that came with the photos, or none.
    pub(super) fn find_objects_by(&mut self, masks: Option<PathBuf>) {
        let scene = self.state.scene.clone();
        let Some((scene, dataset)) = scene.as_ref().and_then(|s| Some((s, s.dataset.clone()?))) else {
            self.state.toast(Tone::Warning, "Open a folder of posed photos first: masks refer to photos.");
            return;
        };
        let masks = masks.or_else(|| scene.masks.clone());
        match self.viewport.cloud().cloned().filter(|_| self.state.is_trained()) {
            Some(cloud) => {
                self.submit(Command::FindObjects(Box::new(FindRequest {
                    folder: scene.out.clone(),
                    cloud: Arc::clone(&cloud),
                    settings: self.state.render_settings(),
                    dataset,
                    holdout_every: self.layout.config.holdout_every,
                    masks,
                    side_px: self.state.plan.object_side_px,
                    with: self.layout.finding.clone(),
                })));
            }
            None => self.state.toast(Tone::Warning, "Train first: objects are found among trained Gaussians."),
        }
    }
}

#[cfg(test)]
mod tests;
