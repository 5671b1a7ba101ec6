//! Finding objects: asks for a method if the photos have no labels, downloads its models, then starts the search.

use std::collections::{BTreeSet, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::app::App;
use super::find_dialog::{AwaitedModels, Means};
use super::history::FoundStep;
use super::keep_dialog::{KeepAnswer, KeepDialog, PlannedSearch};
use super::labels::sentence;
use super::panes::models::Models;
use super::state::Tone;
use crate::jobs::find_objects::{self, FindRequest, FindSettings};
use crate::scene::{Camera, SemanticMap};
use crate::worker::{Command, Event, JobId};

impl App {
    /// Finds objects and parts with the labels of the photos; without labels, opens the dialog with the methods.
    pub(super) fn find_objects(&mut self) {
        let has_labels = self.state.scene.as_ref().is_some_and(|s| s.masks.is_some() || s.dataset.is_none());
        if has_labels || !self.state.is_trained() {
            return self.find_objects_by(None);
        }
        // The user may have added files since the list was made.
        self.models = Models::default();
        self.find_dialog.open();
    }

    /// Shows the dialog if it is open, and continues with the user's decision.
    pub(super) fn ask_for_means(&mut self, ctx: &egui::Context) {
        let recipe = self.viewport.queries.recipe().preparation;
        self.find_dialog.follow_recipe(recipe, &mut self.layout.finding);
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
        self.begin_search(PlannedSearch { masks: None, missing, replace_all: false });
    }

    /// Begins a search; asks first if objects and parts were edited by the user.
    fn begin_search(&mut self, search: PlannedSearch) {
        let by_hand = self.state.semantics.as_deref().map_or_else(Vec::new, |map| find_objects::by_hand(map));
        match by_hand.is_empty() {
            true => self.find_after(search),
            false => self.keep_dialog = Some(KeepDialog { by_hand, search }),
        }
    }

    /// Finds objects once their models are installed: downloads the first missing one, or starts the search.
    fn find_after(&mut self, mut search: PlannedSearch) {
        let Some(id) = search.missing.pop_front() else { return self.search_all(search) };
        let scene = self.state.scene_number;
        let job = self.submit(Command::InstallModel { id, brought: None });
        self.awaited = job.map(|job| AwaitedModels { job, then: search, scene });
    }

    fn search_all(&mut self, search: PlannedSearch) {
        let PlannedSearch { masks, replace_all, .. } = search;
        let had_objects = self.state.semantics.is_some();
        let job = self.submit_search(masks, None, replace_all);
        let step = |job| FoundStep { job, what: "found objects anew".into(), adds: false };
        self.finding = job.filter(|_| had_objects).map(step);
    }

    /// Asks what to keep, while that dialog is open.
    pub(super) fn ask_what_to_keep(&mut self, ctx: &egui::Context) {
        let Some(answer) = self.keep_dialog.as_ref().and_then(|dialog| dialog.show(ctx)) else { return };
        let Some(KeepDialog { search, .. }) = self.keep_dialog.take() else { return };
        match answer {
            KeepAnswer::Keep => self.find_after(search),
            KeepAnswer::ReplaceAll => self.find_after(PlannedSearch { replace_all: true, ..search }),
            KeepAnswer::Cancel => {}
        }
    }

    /// Follows the downloads that a search waits for.
    pub(super) fn hear(&mut self, event: &Event) {
        let Some(awaited) = self.awaited.take_if(|a| event.is_end() && event.job() == a.job) else { return };
        if !matches!(event, Event::Finished(..)) {
            let text = "Objects are not looked for: a model is missing. A download that was cut off goes on where it \
                        ended: find objects again.";
            return self.state.toast(Tone::Warning, text);
        }
        // If another scene was opened meanwhile, the search no longer applies.
        if awaited.scene == self.state.scene_number {
            self.find_after(awaited.then);
        }
    }

    /// Finds objects and parts with the masks in `masks`, or with those of the photos, or without any.
    pub(super) fn find_objects_by(&mut self, masks: Option<PathBuf>) {
        self.begin_search(PlannedSearch { masks, missing: VecDeque::new(), replace_all: false });
    }

    /// Adds the unlabeled regions of one photo: the one looked through, or else the nearest training photo.
    pub(super) fn segment_photo(&mut self) {
        let Some(known) = self.state.semantics.as_deref().cloned() else {
            return self.state.toast(Tone::Warning, "Find objects first: what one more photo shows is added to them.");
        };
        if self.editing.is_some() || !self.edits.is_empty() {
            // The search would begin with the state before the edit.
            return self.state.toast(Tone::Warning, "Objects are being changed; segment the photo once that is done.");
        }
        let (scene, eye) = (self.state.scene.clone(), self.viewport.pose());
        let Some(dataset) = scene.as_ref().and_then(|s| s.dataset.as_ref()) else {
            return self.state.toast(Tone::Warning, "This scene has no photos.");
        };
        let held: BTreeSet<usize> =
            scene.as_ref().map(|s| s.held_out(self.layout.config.holdout_every)).into_iter().flatten().collect();
        let trained_on = (0..dataset.photos.len()).filter(|i| !held.contains(i));
        let size = scene.as_ref().map_or(1.0, |s| s.home.bounds.radius());
        let away = |camera: &Camera| {
            let turn = 1.0 - (camera.world_from_camera * DVec3::Z).dot(eye.world_from_camera * DVec3::Z);
            camera.center.distance(eye.center) / size + turn
        };
        let nearest = || {
            let away = |i: &usize| away(&dataset.photos[*i].camera);
            trained_on.min_by(|a, b| away(a).total_cmp(&away(b)))
        };
        let Some(photo) = self.viewport.photo_index().or_else(nearest) else { return };
        let name = dataset.photos[photo].name.clone();
        let what = format!("segmented {name}");
        let job = self.submit_search(None, Some((known, name)), false);
        self.finding = job.map(|job| FoundStep { job, what, adds: true });
    }

    /// Records the end of a search in the history, so that it can be undone.
    pub(super) fn found(&mut self, step: FoundStep) {
        let count = |map: Option<&Arc<SemanticMap>>| map.map_or(0, |map| map.identities.len());
        let before = self.state.changes.now().map_or(0, |now| count(now.map.as_ref()));
        let new = count(self.state.semantics.as_deref()).saturating_sub(before);
        if !step.adds && !self.state.changes.has(&self.snapshot()) {
            // The numbers now belong to other identities.
            self.viewport.visibility.set_hidden([]);
            self.viewport.picking.select(None);
        }
        let settled = self.state.changes.settle(&self.snapshot(), Some(&step.what));
        if let Some(what) = settled.filter(|_| step.adds) {
            let new = match new {
                0 => "nothing new".to_owned(),
                1 => "one new object or part".to_owned(),
                n => format!("{n} new objects and parts"),
            };
            self.state.toast(Tone::Good, format!("{}: {new}", sentence(&what)));
        }
    }

    /// Searches all photos, or only the unlabeled regions of the photo named in `add`.
    fn submit_search(
        &mut self,
        masks: Option<PathBuf>,
        add: Option<(Arc<SemanticMap>, String)>,
        replace_all: bool,
    ) -> Option<JobId> {
        let scene = self.state.scene.clone();
        let Some((scene, dataset)) = scene.as_ref().and_then(|s| Some((s, s.dataset.clone()?))) else {
            self.state.toast(Tone::Warning, "Open a folder of posed photos first: masks refer to photos.");
            return None;
        };
        let (known, seed) = add.unzip();
        let mut with = FindSettings { replace_all, ..self.layout.finding.clone() };
        with.seed = seed.or(with.seed);
        let masks = masks.or_else(|| scene.masks.clone());
        match self.viewport.cloud().cloned().filter(|_| self.state.is_trained()) {
            Some(cloud) => self.submit(Command::FindObjects(Box::new(FindRequest {
                known,
                folder: scene.out.clone(),
                cloud: Arc::clone(&cloud),
                settings: self.state.render_settings(),
                dataset,
                holdout_every: self.layout.config.holdout_every,
                masks,
                side_px: self.state.plan.object_side_px,
                with,
            }))),
            None => {
                self.state.toast(Tone::Warning, "Train first: objects are found among trained Gaussians.");
                None
            }
        }
    }
}

#[cfg(test)]
mod tests;
