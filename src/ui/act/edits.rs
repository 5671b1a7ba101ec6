//! Edits of objects and parts in the order of the requests, with undo and redo: each builds on the one before.

use std::path::PathBuf;
use std::sync::Arc;

use super::remote;
use crate::agent::scene::UndoneRequest;
use crate::jobs::JobError;
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::rearrange::{RearrangeRequest, SplatChange, SplatEdit};
use crate::jobs::select::empty_map;
use crate::math::format;
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Identities, IdentityId, Level};
use crate::ui::app::App;
use crate::ui::context::SceneContext;
use crate::ui::history::texts::{edit_text, splat_edit_text};
use crate::ui::history::{EditSnapshot, EditStep, Editing, ViewState};
use crate::ui::labels::sentence;
use crate::ui::state::Tone;
use crate::worker::{JobInfo, Stop};

/// Remedy of a change of Gaussians that failed.
const UNCHANGED: &str = "Nothing has changed.";

/// Queues an edit after those requested before.
pub(in crate::ui) fn queue(app: &mut App, step: EditStep) {
    app.edits.push_back((app.state.scene_number, step));
    next(app);
}

/// Begins the next edits, up to one that runs as a job.
pub(in crate::ui) fn next(app: &mut App) {
    while app.editing.is_none() {
        let Some((scene, step)) = app.edits.pop_front() else { return };
        // An edit of a scene that is no longer open has no place.
        if scene != app.state.scene_number {
            continue;
        }
        settle(app, true);
        match step {
            EditStep::Request(request) => apply(app, request, None),
            EditStep::Said(request, sentence) => apply(app, request, Some(sentence)),
            EditStep::Rearrange(edit) => rearrange(app, edit),
            EditStep::Undo => go_in_history(app, false),
            EditStep::Redo => go_in_history(app, true),
            EditStep::UndoSentence(undone) => undo_sentence(app, undone),
        }
    }
}

/// Undoes the changes of a sentence of the chat. If the user has changed something since, only these.
fn undo_sentence(app: &mut App, undone: UndoneRequest) {
    let UndoneRequest { hidden, names } = undone;
    let is_like = |before: &EditSnapshot| {
        hidden.as_ref().is_none_or(|ids| before.view.hidden.iter().eq(ids))
            && names.iter().all(|(id, name)| before.is_called(*id, name))
    };
    if app.state.changes.before().is_some_and(is_like) {
        return go_in_history(app, false);
    }
    hidden.into_iter().for_each(|ids| app.viewport.visibility.set_hidden(ids));
    let scene = app.state.scene_number;
    let rename = |(id, name)| (scene, EditStep::Request(EditRequest::Apply(Edit::Rename(id, name))));
    names.into_iter().map(rename).rev().for_each(|step| app.edits.push_front(step));
}

fn apply(app: &mut App, request: EditRequest, number: Option<u64>) {
    let none = Identities::default();
    let all = app.state.semantics.as_ref().map_or(&none, |map| &map.identities);
    let what = Some(edit_text(&request, all));
    start_edit(app, request, None, Editing { what, redo: false, sentence: number });
}

/// Starts a change of objects and parts, which is stored in the folder `also`, too. Returns false if it is impossible.
fn start_edit(app: &mut App, request: EditRequest, also: Option<PathBuf>, editing: Editing) -> bool {
    let Some(SceneContext { scene, cloud, map, .. }) = SceneContext::new(app) else { return false };
    if remote::takes_edit(app, &request) {
        return false;
    }
    // An opened result of another method keeps its files: the first edit makes a scene of it.
    if scene.method.is_some() && !scene.is_stored() && map.is_some() {
        return start_rearrangement(app, SplatChange::Objects(request), editing);
    }
    let map = map.map_or_else(|| Arc::new(empty_map(&cloud)), |map| Arc::clone(&map));
    let (cloud, out, workspace) = (Arc::clone(&cloud), scene.out.clone(), Arc::clone(&app.workspace));
    let adds = matches!(request, EditRequest::Apply(Edit::AddPiece { .. }));
    let change = move |observer: &mut dyn Observer| {
        let not_stored = |e| Stop::from(e).or_remedy("The change is not stored.");
        let new = workspace.edit_objects(&cloud, &map, &request, &out).map_err(not_stored)?;
        if let Some(folder) = also
            && let Err(e) = workspace.edit_objects(&cloud, &map, &EditRequest::Restore(Arc::clone(&new)), &folder)
        {
            observer.note(Severity::Warning, format!("{} keeps its objects: {e}", folder.display()));
        }
        Ok::<_, Stop>(new)
    };
    app.editing = Some(editing);
    let started = app.start_in_scene(JobInfo::short("Editing objects"), change, move |app, map| {
        if let Some(map) = map {
            let newest = map.identities.iter().last().map(|(id, _)| id).filter(|_| adds);
            app.state.set_semantics(Some(map));
            // Not while the next one is being selected.
            if newest.is_some() && !app.viewport.is_selecting() {
                app.viewport.picking.select(newest);
            }
        }
        ended(app);
    });
    app.editing.take_if(|_| !started);
    started
}

fn rearrange(app: &mut App, edit: SplatEdit) {
    let none = Identities::default();
    let all = app.state.semantics.as_ref().map_or(&none, |map| &map.identities);
    let what = Some(splat_edit_text(&edit, all));
    start_rearrangement(app, SplatChange::Apply(edit), Editing { what, redo: false, sentence: None });
}

/// Starts a change of Gaussians. Returns false if it is impossible.
fn start_rearrangement(app: &mut App, change: SplatChange, editing: Editing) -> bool {
    if !app.state.is_trained() {
        app.state.toast(Tone::Warning, "Only trained Gaussians can be edited.");
        return false;
    }
    let Some(SceneContext { scene, cloud, map, cameras, .. }) = SceneContext::new(app) else { return false };
    let title = "Editing Gaussians";
    if remote::refuses(app, title, "run 'fmlgs edit' or 'fmlgs clean' there, or export the Gaussians here first") {
        return false;
    }
    let (cloud, map) = (Arc::clone(&cloud), map.map(|map| Arc::clone(&map)));
    let (facts, path, is_edited) = (app.state.plan.facts.clone(), scene.stored().to_path_buf(), scene.is_edited);
    let (name, measurements) = (scene.name.clone(), app.viewport.measurements.clone());
    let request = RearrangeRequest { path, name, is_edited, cloud, map, change, measurements, facts, cameras };
    let workspace = Arc::clone(&app.workspace);
    let change = move |_: &mut dyn Observer| {
        workspace.rearrange(&request).map_err(|e: JobError| Stop::from(e).or_remedy(UNCHANGED))
    };
    app.editing = Some(editing);
    let started = app.start_in_scene(JobInfo::short(title), change, |app, done| {
        if let Some(done) = done {
            app.viewport.measurements.retain(|m| !done.stale.contains(&m.id));
            let cloud = app.state.rearranged(done);
            app.viewport.set_cloud(cloud);
        }
        ended(app);
    });
    app.editing.take_if(|_| !started);
    started
}

/// Ends the running edit. The next one begins once the viewport has taken over scene and Gaussians: another scene may
/// have been opened just now.
fn ended(app: &mut App) {
    if let Some(editing) = app.editing.take() {
        record(app, editing);
    }
}

/// Records the end of an edit in the history.
fn record(app: &mut App, editing: Editing) {
    if app.state.changes.now().is_none_or(|now| now.scene != app.state.scene_number) {
        return;
    }
    let map = app.state.semantics.as_deref().cloned();
    let Some(what) = editing.what else {
        // An edit that could not be stored leaves everything unchanged.
        if !app.state.changes.has(&snapshot(app))
            && let Some((_, back)) = app.state.changes.go(!editing.redo)
        {
            show_state(app, back.view);
        }
        return;
    };
    let before = app.state.changes.now().and_then(|now| now.map.clone());
    let (mut emptied, mut by) = (Vec::new(), "It");
    if let (Some(old), Some(new)) = (before, map) {
        if old.identities.len() < new.identities.len() {
            let is_part =
                new.identities.get(new.identities.len() as IdentityId).is_some_and(|i| i.level == Level::Part);
            by = if is_part { "The new part" } else { "The new object" };
        }
        if old.identities.len() > new.identities.len() {
            app.viewport.visibility.renumber(&old.identities, &new.identities);
        } else {
            emptied = edit::emptied(&old, &new);
        }
    }
    // A refused or failed edit was reported and leaves nothing to undo.
    if let Some(what) = app.state.changes.settle_as(&snapshot(app), Some(&what), editing.sentence) {
        let copy = app.state.copied.take().map(|name| format!(". Changes go to a copy, \u{201c}{name}\u{201d}."));
        app.state.toast(Tone::Good, sentence(&what) + &copy.unwrap_or_default());
        if !emptied.is_empty() {
            let text = format!("{by} took all Gaussians of {}. Undo brings them back.", together(&emptied));
            app.state.toast(Tone::Warning, text);
        }
    }
}

/// Joins full names; parts of one whole name it once: "lid and rim of the cookie jar".
fn together(names: &[String]) -> String {
    let parts: Vec<(&str, &str)> = names.iter().filter_map(|name| name.split_once(BETWEEN)).collect();
    match parts.as_slice() {
        [(_, whole), ..] if parts.len() == names.len() && parts.iter().all(|(_, of)| of == whole) => {
            let parts: Vec<String> = parts.iter().map(|(part, _)| (*part).to_owned()).collect();
            format!("{} of the {whole}", format::list(&parts))
        }
        _ => format::list(names),
    }
}

/// Undoes the last change, or redoes the next.
fn go_in_history(app: &mut App, redo: bool) {
    let Some((what, to)) = app.state.changes.go(redo) else {
        app.state.toast(Tone::Info, if redo { "Nothing to redo." } else { "Nothing to undo." });
        return;
    };
    if !app.state.changes.has(&snapshot(app)) {
        let now = app.viewport.cloud().map(|cloud| Arc::clone(cloud));
        let editing = Editing { what: None, redo, sentence: None };
        // A change that was made in the scene before a copy was derived from it is stored there.
        let out = app.state.scene.as_ref().map(|scene| scene.out.clone());
        let also = Some(to.folder).filter(|folder| Some(folder) != out.as_ref());
        let started = match (to.cloud, to.map) {
            (Some(cloud), map) if now.is_none_or(|now| !Arc::ptr_eq(&now, &cloud)) => {
                start_rearrangement(app, SplatChange::Restore(cloud, map), editing)
            }
            (_, Some(map)) => start_edit(app, EditRequest::Restore(map), also, editing),
            (_, None) => false,
        };
        if !started {
            app.state.changes.go(!redo);
            return;
        }
    }
    show_state(app, to.view);
    app.state.toast(Tone::Info, format!("{}: {what}", if redo { "Redone" } else { "Undone" }));
}

/// Shows an earlier or later state of the view.
fn show_state(app: &mut App, view: ViewState) {
    let ViewState { hidden, crop, modes, split, dim, cameras, path, measurements, pinned, recipes } = view;
    if app.viewport.visibility.hidden() != &hidden {
        app.viewport.visibility.set_hidden(hidden);
    }
    app.viewport.visibility.set_crop(crop);
    ([app.layout.mode, app.layout.second_mode], app.layout.cameras) = (modes, cameras);
    (app.layout.split_view, app.layout.dim) = (split, dim);
    app.camera.set_path(path);
    app.viewport.measurements = measurements;
    if let Some(map) = app.state.semantics.clone() {
        app.viewport.queries.set_recipes(&recipes, &map);
        app.viewport.queries.pin_only(&pinned, &map);
    }
}

/// State of the window that can be undone.
pub(in crate::ui) fn snapshot(app: &App) -> EditSnapshot {
    let (layout, viewport) = (&app.layout, &app.viewport);
    let view = ViewState {
        hidden: viewport.visibility.hidden().clone(),
        crop: viewport.visibility.crop(),
        modes: [layout.mode, layout.second_mode],
        split: layout.split_view,
        dim: layout.dim,
        cameras: layout.cameras,
        path: app.camera.path.clone(),
        measurements: viewport.measurements.clone(),
        pinned: viewport.queries.pinned_texts(),
        recipes: viewport.queries.recipes(),
    };
    let map = app.state.semantics.as_deref().cloned();
    let cloud = viewport.cloud().filter(|_| app.state.is_trained()).map(|cloud| Arc::clone(cloud));
    let folder = app.state.scene.as_ref().map(|scene| scene.out.clone()).unwrap_or_default();
    EditSnapshot { scene: app.state.scene_number, folder, map, cloud, view }
}

/// Records changes since the last call in the history, unless objects and parts are about to change. Camera path,
/// crop box and measurements only `at_rest`: without a drag or typing in progress.
pub(in crate::ui) fn settle(app: &mut App, at_rest: bool) {
    settle_as(app, at_rest, None);
}

/// Records what the chat's sentence of this `number` has changed just now.
pub(in crate::ui) fn settle_as(app: &mut App, at_rest: bool, number: Option<u64>) {
    if app.editing.is_some() {
        return;
    }
    let mut now = snapshot(app);
    let before = app.state.changes.now().filter(|before| before.scene == now.scene);
    if let Some(before) = before.filter(|_| !at_rest) {
        (now.view.path, now.view.crop) = (before.view.path.clone(), before.view.crop);
        now.view.measurements.clone_from(&before.view.measurements);
    }
    let shown = before.is_some_and(|before| before.view.hidden != now.view.hidden);
    let Some(what) = app.state.changes.settle_as(&now, None, number) else { return };
    match shown {
        true => app.state.toast(Tone::Info, sentence(&what)),
        false => app.state.say(Tone::Info, sentence(&what)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_one_whole_name_it_once() {
        let names = |all: &[&str]| together(&all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        let of = |part: &str, whole: &str| format!("{part}{BETWEEN}{whole}");
        let (lid, rim) = (of("lid", "jar"), of("rim", "jar"));
        assert_eq!(names(&[&lid, &rim]), "lid and rim of the jar");
        // Controls: another whole, and a whole itself.
        let spout = of("spout", "kettle");
        assert_eq!(names(&[&lid, &spout]), format!("{lid} and {spout}"));
        assert_eq!(names(&["mug", &rim]), format!("mug and {rim}"));
    }
}
