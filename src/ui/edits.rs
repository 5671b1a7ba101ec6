//! Edits of objects and parts in the order of the requests, with undo and redo: each builds on the one before.

use std::sync::Arc;

use super::app::App;
use super::context::SceneContext;
use super::history::{EditSnapshot, EditStep, Editing, ViewState, edit_text, splat_edit_text};
use super::labels::sentence;
use super::state::Tone;
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::rearrange::{RearrangeRequest, SplatChange, SplatEdit};
use crate::jobs::select::{SelectRequest, empty_map};
use crate::pipeline::semantics::edit::Edit;
use crate::scene::Identities;
use crate::worker::{Command, JobId};

impl App {
    /// Queues an edit after those requested before.
    pub(super) fn edit(&mut self, step: EditStep) {
        self.edits.push_back(step);
        self.next_edit();
    }

    /// Begins the next edits, up to one that runs as a job.
    pub(super) fn next_edit(&mut self) {
        loop {
            match self.editing.take() {
                Some(editing) if editing.job > self.state.short_jobs_done => {
                    self.editing = Some(editing);
                    return;
                }
                Some(editing) => self.edited(editing),
                None => {}
            }
            let Some(step) = self.edits.pop_front() else { return };
            self.settle(true);
            match step {
                EditStep::Request(request) => self.request(request),
                EditStep::Rearrange(edit) => self.rearrange(edit),
                EditStep::Undo => self.go_in_history(false),
                EditStep::Redo => self.go_in_history(true),
                // If the user has changed something since, only the agent's change is undone.
                EditStep::UndoRename(id, name) if self.was(|s| s.is_called(id, &name)) => self.go_in_history(false),
                EditStep::UndoRename(id, name) => self.request(EditRequest::Apply(Edit::Rename(id, name))),
                EditStep::UndoHidden(ids) if self.was(|s| s.view.hidden.iter().eq(&ids)) => self.go_in_history(false),
                EditStep::UndoHidden(ids) => self.viewport.visibility.set_hidden(ids),
            }
        }
    }

    /// True if the state that undo leads to satisfies `like`.
    fn was(&self, like: impl Fn(&EditSnapshot) -> bool) -> bool {
        self.state.changes.before().is_some_and(like)
    }

    /// Submits the next click or stroke of the selection tool, or the preparation that it needs.
    pub(super) fn next_stroke(&mut self) {
        let (done, is_training) = (self.state.short_jobs_done, self.state.is_training());
        let Some((step, before)) = self.viewport.next_select_step(done, is_training) else { return };
        let (Some(SceneContext { scene, cloud, map, settings, cameras, .. }), Some(tool)) =
            (self.context(), &self.viewport.select)
        else {
            return;
        };
        let map = map.map_or_else(|| Arc::new(empty_map(&cloud)), |map| Arc::clone(&map));
        let (purpose, home, cloud) = (tool.purpose.clone(), scene.home.clone(), Arc::clone(&cloud));
        let request = SelectRequest { cloud, settings, cameras, home, map, purpose, before, step: step.clone() };
        let job = self.submit(Command::Select(Box::new(request)));
        self.viewport.select_step_runs(job, &step);
    }

    fn request(&mut self, request: EditRequest) {
        let none = Identities::default();
        let all = self.state.semantics.as_ref().map_or(&none, |map| &map.identities);
        let what = Some(edit_text(&request, all));
        self.editing = self.submit_edit(request).map(|job| Editing { job, what, redo: false });
    }

    fn submit_edit(&mut self, request: EditRequest) -> Option<JobId> {
        let SceneContext { scene, cloud, map, .. } = self.context()?;
        let map = map.map_or_else(|| Arc::new(empty_map(&cloud)), |map| Arc::clone(&map));
        let (cloud, out) = (Arc::clone(&cloud), scene.out.clone());
        self.submit(Command::EditObjects { cloud, map, request, out })
    }

    /// Submits an edit of Gaussians.
    fn rearrange(&mut self, edit: SplatEdit) {
        let none = Identities::default();
        let all = self.state.semantics.as_ref().map_or(&none, |map| &map.identities);
        let what = Some(splat_edit_text(&edit, all));
        let job = self.submit_rearrangement(SplatChange::Apply(edit));
        self.editing = job.map(|job| Editing { job, what, redo: false });
    }

    fn submit_rearrangement(&mut self, change: SplatChange) -> Option<JobId> {
        if !self.state.is_trained() {
            self.state.toast(Tone::Warning, "Only trained Gaussians can be edited.");
            return None;
        }
        let SceneContext { scene, cloud, map, cameras, .. } = self.context()?;
        let (cloud, map) = (Arc::clone(&cloud), map.map(|map| Arc::clone(&map)));
        let (facts, path, is_edited) = (self.state.plan.facts.clone(), scene.stored().to_path_buf(), scene.is_edited);
        let request =
            RearrangeRequest { path, name: scene.name.clone(), is_edited, cloud, map, change, facts, cameras };
        self.submit(Command::Rearrange(Box::new(request)))
    }

    /// Records the end of an edit in the history.
    fn edited(&mut self, editing: Editing) {
        if self.state.changes.now().is_none_or(|now| now.scene != self.state.scene_number) {
            return;
        }
        let map = self.state.semantics.as_deref().cloned();
        let Some(what) = editing.what else {
            // An edit that could not be stored leaves everything unchanged.
            if !self.state.changes.has(&self.snapshot())
                && let Some((_, back)) = self.state.changes.go(!editing.redo)
            {
                self.show_state(back.view);
            }
            return;
        };
        let before = self.state.changes.now().and_then(|now| now.map.clone());
        let mut emptied = Vec::new();
        if let (Some(old), Some(new)) = (before, map) {
            if old.identities.len() > new.identities.len() {
                self.viewport.visibility.renumber(&old.identities, &new.identities);
            } else {
                emptied = edit::emptied(&old, &new);
            }
        }
        // A refused or failed edit was reported and leaves nothing to undo.
        if let Some(what) = self.state.changes.settle(&self.snapshot(), Some(&what)) {
            self.state.toast(Tone::Good, sentence(&what));
            for name in emptied {
                let text = format!("{name} is empty now: all of its Gaussians became others'. Undo brings them back.");
                self.state.toast(Tone::Warning, text);
            }
        }
    }

    /// Undoes the last change, or redoes the next.
    fn go_in_history(&mut self, redo: bool) {
        let Some((what, to)) = self.state.changes.go(redo) else {
            self.state.toast(Tone::Info, if redo { "Nothing to redo." } else { "Nothing to undo." });
            return;
        };
        if !self.state.changes.has(&self.snapshot()) {
            let now = self.viewport.cloud().map(|cloud| Arc::clone(cloud));
            let job = match (to.cloud, to.map) {
                (Some(cloud), map) if now.is_none_or(|now| !Arc::ptr_eq(&now, &cloud)) => {
                    self.submit_rearrangement(SplatChange::Restore(cloud, map))
                }
                (_, Some(map)) => self.submit_edit(EditRequest::Restore(map)),
                (_, None) => None,
            };
            let Some(job) = job else {
                self.state.changes.go(!redo);
                return;
            };
            self.editing = Some(Editing { job, what: None, redo });
        }
        self.show_state(to.view);
        self.state.toast(Tone::Info, format!("{}: {what}", if redo { "Redone" } else { "Undone" }));
    }

    fn show_state(&mut self, view: ViewState) {
        let ViewState { hidden, crop, modes, split, dim, cameras, path, pinned, recipes } = view;
        if self.viewport.visibility.hidden() != &hidden {
            self.viewport.visibility.set_hidden(hidden);
        }
        self.viewport.visibility.set_crop(crop);
        ([self.layout.mode, self.layout.second_mode], self.layout.cameras) = (modes, cameras);
        (self.layout.split_view, self.layout.dim) = (split, dim);
        self.camera.set_path(path);
        if let Some(map) = self.state.semantics.clone() {
            self.viewport.queries.set_recipes(&recipes, &map);
            self.viewport.queries.pin_only(&pinned, &map);
        }
    }

    pub(super) fn snapshot(&self) -> EditSnapshot {
        let (layout, viewport) = (&self.layout, &self.viewport);
        let view = ViewState {
            hidden: viewport.visibility.hidden().clone(),
            crop: viewport.visibility.crop(),
            modes: [layout.mode, layout.second_mode],
            split: layout.split_view,
            dim: layout.dim,
            cameras: layout.cameras,
            path: self.camera.path.clone(),
            pinned: viewport.queries.pinned_texts(),
            recipes: viewport.queries.recipes(),
        };
        let map = self.state.semantics.as_deref().cloned();
        let cloud = viewport.cloud().filter(|_| self.state.is_trained()).map(|cloud| Arc::clone(cloud));
        EditSnapshot { scene: self.state.scene_number, map, cloud, view }
    }

    /// Records changes since the last call in the history, unless objects and parts are about to change. Camera path
    /// and crop box only `at_rest`: without a drag or typing in progress.
    pub(super) fn settle(&mut self, at_rest: bool) {
        if self.editing.is_some() {
            return;
        }
        let mut now = self.snapshot();
        let before = self.state.changes.now().filter(|before| before.scene == now.scene);
        if let Some(before) = before.filter(|_| !at_rest) {
            (now.view.path, now.view.crop) = (before.view.path.clone(), before.view.crop);
        }
        let shown = before.is_some_and(|before| before.view.hidden != now.view.hidden);
        let Some(what) = self.state.changes.settle(&now, None) else { return };
        match shown {
            true => self.state.toast(Tone::Info, sentence(&what)),
            false => self.state.say(Tone::Info, sentence(&what)),
        }
    }
}
