//! Finding objects and parts, with the downloads that it needs, and removing them.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::{edits, remote, view};
use crate::jobs::find_objects::{self, FindRequest, FindSettings};
use crate::jobs::models::{self, Source};
use crate::jobs::phases;
use crate::jobs::remove::{self as removal, RemovalOptions, RemoveRequest};
use crate::pipeline::observer::Observer;
use crate::scene::{Bounds, IdentityId, SemanticMap};
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::find_dialog::Means;
use crate::ui::history::FoundStep;
use crate::ui::keep_dialog::{KeepAnswer, KeepDialog, PlannedSearch};
use crate::ui::labels::sentence;
use crate::ui::panes::models::ModelsPane;
use crate::ui::state::Tone;
use crate::worker::{JobInfo, Makes};

/// Finds objects and parts with the labels of the photos; without labels, opens the dialog with the methods.
pub(in crate::ui) fn find(app: &mut App) {
    let has_labels = app.state.scene.as_ref().is_some_and(|s| s.masks.is_some() || s.dataset.is_none());
    if has_labels || !app.state.is_trained() {
        return begin_search(app, PlannedSearch::default());
    }
    // The user may have added files since the list was made.
    app.models = ModelsPane::default();
    app.find_dialog.open(&app.layout.finding);
}

pub(in crate::ui) fn choose_masks(app: &mut App) {
    app.choose(FileRequest::folder(FileKind::Masks, "Folder with masks"), |app, masks| {
        begin_search(app, PlannedSearch { masks: Some(masks), ..PlannedSearch::default() });
    });
}

/// Shows the open dialogs of a search, and continues with the user's decisions.
pub(in crate::ui) fn show_dialogs(app: &mut App, ctx: &egui::Context) {
    let recipe = app.viewport.queries.recipe().preparation;
    app.find_dialog.follow_recipe(recipe, &mut app.layout.finding);
    if app.find_dialog.is_open() {
        app.models.keep_listed(&app.state, &app.tasks);
    }
    let max_seeds = app.layout.finding.max_seeds;
    let mut dialog = std::mem::take(&mut app.find_dialog);
    let means = dialog.show(ctx, max_seeds, &mut app.context().0);
    app.find_dialog = dialog;
    if let Some(Means { segmenter, encoder, missing }) = means {
        (app.layout.finding.segmenter, app.layout.finding.encoder) = (Some(segmenter), Some(encoder));
        begin_search(app, PlannedSearch { missing, ..PlannedSearch::default() });
    }
    let Some(answer) = app.keep_dialog.as_ref().and_then(|dialog| dialog.show(ctx)) else { return };
    let Some(KeepDialog { search, .. }) = app.keep_dialog.take() else { return };
    match answer {
        KeepAnswer::Keep => find_after(app, search),
        KeepAnswer::ReplaceAll => find_after(app, PlannedSearch { replace_all: true, ..search }),
        KeepAnswer::Cancel => {}
    }
}

/// Begins a search; asks first if objects and parts were edited by the user.
fn begin_search(app: &mut App, search: PlannedSearch) {
    app.searches += 1;
    let by_hand = app.state.semantics.as_deref().map_or_else(Vec::new, |map| find_objects::by_hand(map));
    match by_hand.is_empty() {
        true => find_after(app, search),
        false => app.keep_dialog = Some(KeepDialog { by_hand, search }),
    }
}

/// Finds objects once their models are installed: downloads the first missing one, or starts the search.
fn find_after(app: &mut App, mut search: PlannedSearch) {
    let Some(id) = search.missing.pop_front() else { return search_all(app, search) };
    let (scene, number) = (app.state.scene_number, app.searches);
    install(app, id, None, move |app, is_installed| {
        // Another search was asked for since.
        if number != app.searches {
            return;
        }
        if !is_installed {
            let text = "The search was not started: a model is missing. A download that was cut off goes on where it \
                        ended: find objects again.";
            return app.state.toast(Tone::Warning, text);
        }
        // If another scene was opened meanwhile, the search no longer applies.
        if scene == app.state.scene_number {
            find_after(app, search);
        }
    });
}

pub(in crate::ui) fn choose_model_files(app: &mut App, id: String) {
    let checkpoints = FileFormat::new("Checkpoints", &[".pt", ".pth", ".bin", ".safetensors"]);
    let formats = vec![checkpoints, FileFormat::new("Descriptions of exported files (.json)", &[".json"])];
    let request = FileRequest::file(FileKind::Models, &format!("Files of {id}"), formats);
    app.choose(request, |app, path| install_model(app, id, Some(path)));
}

/// Downloads a model, or installs the user's files.
pub(in crate::ui) fn install_model(app: &mut App, id: String, brought: Option<PathBuf>) {
    install(app, id, brought, |_, _| ());
}

/// Installs a model; `then` learns whether it can be used.
fn install(app: &mut App, id: String, brought: Option<PathBuf>, then: impl FnOnce(&mut App, bool) + 'static) {
    let info = JobInfo::long(format!("Installing the model {id}")).pausable();
    let install = move |observer: &mut dyn Observer| {
        let source = brought.as_deref().map_or(Source::Fetch(None), Source::Brought);
        models::install(&id, source, observer).map(|_| id)
    };
    app.start_to_end(info, install, |app, _, installed| {
        if let Ok(id) = &installed {
            app.state.models_installed += 1;
            app.state.toast(Tone::Good, format!("Model {id} is ready"));
        }
        then(app, installed.is_ok());
    });
}

fn search_all(app: &mut App, search: PlannedSearch) {
    let PlannedSearch { masks, replace_all, .. } = search;
    let had_objects = app.state.semantics.is_some();
    let step = had_objects.then(|| FoundStep { what: "found objects anew".into(), adds: false });
    start_search(app, SearchScope { masks, replace_all, ..SearchScope::default() }, step);
}

/// Adds the unlabeled regions of one photo: the one looked through, or else the nearest training photo.
pub(in crate::ui) fn segment_photo(app: &mut App) {
    let Some(known) = app.state.semantics.as_deref().cloned() else {
        return app.state.toast(Tone::Warning, "Find objects first: what one more photo shows is added to them.");
    };
    if app.is_editing() {
        // The search would begin with the state before the edit.
        return app.state.toast(Tone::Warning, "Objects are being changed; add from the photo once that is done.");
    }
    let scene = app.state.scene.clone();
    let Some(dataset) = scene.as_ref().and_then(|s| s.dataset.as_ref()) else {
        return app.state.toast(Tone::Warning, "This scene has no photos.");
    };
    let held: BTreeSet<usize> =
        scene.as_ref().map(|s| s.held_out(app.layout.config.holdout_every)).into_iter().flatten().collect();
    let Some(photo) = app.viewport.own_photo_index().or_else(|| view::nearest_photo(app, &held)) else { return };
    let seed = dataset.photos[photo].name.clone();
    let step = FoundStep { what: format!("added objects from {seed}"), adds: true };
    start_search(app, SearchScope { add: Some((known, seed)), ..SearchScope::default() }, Some(step));
}

/// Photos and regions to search.
#[derive(Default)]
struct SearchScope {
    /// Folder of masks to use in place of the photos' own.
    masks: Option<PathBuf>,
    /// Known objects and parts, and the photo whose unlabeled regions are added to them; all photos without it.
    add: Option<(Arc<SemanticMap>, String)>,
    /// True if objects and parts that the user edited are replaced, too.
    replace_all: bool,
}

/// Starts a search. Its end becomes `step` in the history.
fn start_search(app: &mut App, scope: SearchScope, step: Option<FoundStep>) {
    let SearchScope { masks, add, replace_all } = scope;
    let scene = app.state.scene.clone();
    let Some((scene, dataset)) = scene.as_ref().and_then(|s| Some((s, s.dataset.clone()?))) else {
        return app.state.toast(Tone::Warning, "Open a folder of posed photos first: masks refer to photos.");
    };
    let Some(cloud) = app.viewport.cloud().cloned().filter(|_| app.state.is_trained()) else {
        return app.state.toast(Tone::Warning, "Train first: objects are found among trained Gaussians.");
    };
    let (known, seed) = add.unzip();
    let mut with = FindSettings { replace_all, vectors_first: true, ..app.layout.finding.clone() };
    with.seed = seed.or(with.seed);
    let title = match &known {
        Some(_) => format!("Adding objects from {}", with.seed.as_deref().unwrap_or("a photo")),
        None => format!("Finding objects in {}", dataset.name),
    };
    if remote::refuses(app, &title, "run 'fmlgs preprocess' there") {
        return;
    }
    let is_new = known.is_none();
    let request = FindRequest {
        known,
        folder: scene.out.clone(),
        cloud: Arc::clone(&cloud),
        settings: app.state.render_settings(),
        dataset,
        holdout_every: app.layout.config.holdout_every,
        masks: masks.or_else(|| scene.masks.clone()),
        side_px: app.state.plan.object_side_px,
        with,
    };
    let info = JobInfo::long(title).makes(Makes::Objects).pausable().phases(phases::FINDING);
    let workspace = Arc::clone(&app.workspace);
    let find = move |observer: &mut dyn Observer| workspace.find_objects(&request, observer);
    app.start_in_scene(info, find, move |app, found| {
        let Some(map) = found else { return };
        if is_new {
            app.state.result(format!("{} found", map.identities.counted()));
        }
        app.state.set_semantics(Some(map));
        if let Some(step) = step {
            record(app, &step);
        }
    });
}

/// Records the end of a search in the history, so that it can be undone.
fn record(app: &mut App, step: &FoundStep) {
    let count = |map: Option<&Arc<SemanticMap>>| map.map_or(0, |map| map.identities.len());
    let before = app.state.changes.now().map_or(0, |now| count(now.map.as_ref()));
    let new = count(app.state.semantics.as_deref()).saturating_sub(before);
    if !step.adds && !app.state.changes.has(&edits::snapshot(app)) {
        // The numbers now belong to other identities.
        app.viewport.visibility.set_hidden([]);
        app.viewport.picking.select(None);
    }
    let now = edits::snapshot(app);
    let settled = app.state.changes.settle(&now, Some(&step.what));
    if let Some(what) = settled.filter(|_| step.adds) {
        let new = match new {
            0 => "nothing new".to_owned(),
            1 => "one new object or part".to_owned(),
            n => format!("{n} new objects and parts"),
        };
        app.state.toast(Tone::Good, format!("{}: {new}", sentence(&what)));
    }
}

/// Makes a scene without these identities, shown beside the unchanged one.
pub(in crate::ui) fn remove(app: &mut App, ids: &[IdentityId]) {
    if let [id] = ids
        && super::view::is_empty(app, *id)
    {
        return;
    }
    let Some(folder) = app.state.scene.as_ref().filter(|_| app.state.is_trained()).map(|s| s.stored().to_path_buf())
    else {
        return app.state.toast(Tone::Warning, "Only from a trained scene can something be removed.");
    };
    submit_removal(app, RemoveRequest { folder, options: RemovalOptions::of(ids), retrain: false });
}

/// Makes a scene without the identities of the request, from the open one.
pub(in crate::ui) fn submit_removal(app: &mut App, request: RemoveRequest) {
    if app.is_editing() {
        return app.state.toast(Tone::Warning, "Objects are being changed; remove it once that is done.");
    }
    if app.state.scene.as_ref().is_none_or(|s| s.stored() != request.folder) {
        let text = "Another scene is open now; open that one first to remove from it.";
        return app.state.toast(Tone::Warning, text);
    }
    if remote::refuses(app, "Removing", "run 'fmlgs remove' there") {
        return;
    }
    let all = if request.retrain { phases::RETRAINING } else { phases::REMOVAL };
    let (ids, map) = (request.options.ids.iter(), app.state.semantics.as_deref());
    let names: Vec<String> = ids.filter_map(|id| Some(map?.identities.full_name(*id))).collect();
    let info = JobInfo::long(format!("Removing {}", names.join(", "))).pausable().phases(all);
    let remove = move |observer: &mut dyn Observer| removal::run_request(&request, observer);
    app.start_in_scene(info, remove, |app, removed| {
        let Some(removed) = removed else { return };
        app.state.result(removal::summary(&removed.name, &removed.report));
        app.state.say(Tone::Info, format!("Saved to {}", removed.folder.display()));
        // Another fill takes its place beside the scene, but stays on disk.
        app.state.remember_made(removed.folder.clone());
        super::comparing::open(app, removed.folder.clone());
        // Both views show the place of what was removed.
        let all = removed.request.options.ids.iter().filter_map(|id| app.viewport.bounds_of(*id, &app.state));
        if let Some(bounds) = all.reduce(|a, b| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }) {
            app.viewport.ask_for(bounds);
        }
        app.state.removed = Some(removed);
    });
}

/// Asks for confirmation, and deletes the scene made by a removal, while it is shown beside the open one.
pub(in crate::ui) fn ask_to_delete_removed(app: &mut App) {
    let Some(removed) = &app.state.removed else { return super::runs::ask_to_delete_open(app) };
    let (name, folder) = (&removed.name, removed.folder.display());
    let text = format!(
        "Delete the copy without \u{201c}{name}\u{201d}? The original stays. This cannot be undone.\n\n{folder}"
    );
    let question = Question::deletion(text);
    app.put_question(question, |app, answer| {
        if answer == DialogAnswer::Yes {
            delete_removed(app);
        }
    });
}

fn delete_removed(app: &mut App) {
    let Some(removed) = app.state.removed.take() else { return };
    match removed.delete() {
        Ok(()) => {
            app.state.beside.retain(|other| other.path != removed.folder);
            app.state.recent.retain(|path| *path != removed.folder);
            app.state.toast(Tone::Good, format!("Deleted {}", removed.folder.display()));
        }
        Err(e) => {
            app.state.toast(Tone::Error, e.to_string());
            app.state.removed = Some(removed);
        }
    }
}

#[cfg(test)]
mod tests;
