//! Questions to the scene: the query field, lists of phrases, true masks, and the chat.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Key, Modifiers};

use super::{add, edits, locate, objects};
use crate::agent::scene::{AgentScene, Effect, ScenePhotos};
use crate::jobs::edit::EditRequest;
use crate::jobs::export;
use crate::jobs::phrases::{self, PhrasesRequest, TrueMasks};
use crate::jobs::query::write_mask;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Camera, LevelFilter};
use crate::ui::actions::Pane;
use crate::ui::app::App;
use crate::ui::chat::Snapshot;
use crate::ui::context::SceneContext;
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::history::EditStep;
use crate::ui::keys;
use crate::ui::state::Tone;
use crate::worker::{Failure, JobInfo};

/// Longer side of the views that are queried, px.
const SIDE_PX: u32 = 1008;

/// Focuses the query field. If queries are impossible, the field reports why and discards the text.
pub(in crate::ui) fn type_query(app: &mut App, ctx: &egui::Context) {
    if app.viewport.compared.is_on() {
        return app.viewport.compared.start_typing();
    }
    app.asks_in_vain = app.state.why_no_query().is_some();
    keys::type_in_vain(ctx, app.asks_in_vain);
    if app.asks_in_vain {
        return;
    }
    // Queries do not go to another scene in the second view.
    if !app.state.beside.is_empty() {
        app.viewport.queries.work_in(false);
    }
    app.viewport.queries.start_typing();
}

/// Closes the disabled field on Escape, Enter, a click or the focus of another field. Opens the query field once queries
/// are possible. Runs before other code takes keys.
pub(in crate::ui) fn follow_vain_query(app: &mut App, ctx: &egui::Context) {
    if !app.asks_in_vain {
        return;
    }
    if app.state.why_no_query().is_none() {
        return type_query(app, ctx);
    }
    let left = ctx.input_mut(|i| {
        let is_left = [Key::Escape, Key::Enter].map(|key| i.consume_key(Modifiers::NONE, key));
        is_left.contains(&true) || i.pointer.any_pressed()
    });
    app.asks_in_vain = !left && !ctx.text_edit_focused();
    keys::type_in_vain(ctx, app.asks_in_vain);
}

/// Answers a query; of all scenes on screen, if they are compared.
pub(in crate::ui) fn ask(app: &mut App, text: &str) {
    if app.viewport.compared.is_on() {
        return app.viewport.compared.ask(text);
    }
    if let Some(semantics) = app.state.semantics.clone() {
        app.viewport.queries.ask(text, &semantics);
    }
}

pub(in crate::ui) fn choose_phrases_folder(app: &mut App) {
    app.choose(FileRequest::new_folder(FileKind::Masks, "Folder for the masks"), |app, to| run_phrases(app, Some(to)));
}

/// Runs the list of phrases; writes the masks into `to`, if given.
pub(in crate::ui) fn run_phrases(app: &mut App, to: Option<PathBuf>) {
    app.layout.hidden.retain(|p| *p != Pane::Phrases);
    let phrases = match phrases::listed(&app.phrases.text) {
        Ok(phrases) => phrases,
        Err(e) => return app.state.toast(Tone::Warning, e.to_string()),
    };
    let Some(SceneContext { cloud, map: Some(map), settings, scene, .. }) = SceneContext::new(app) else {
        return app.state.toast(Tone::Warning, "Find objects first: queries search among them.");
    };
    let photos = scene.dataset.as_ref().filter(|_| app.phrases.all_photos);
    let views: Vec<(String, Camera)> = match (photos, app.viewport.picture()) {
        (Some(d), _) => d.photos.iter().map(|p| (p.name.clone(), p.camera.limited_to(SIDE_PX))).collect(),
        (None, Some(picture)) => vec![("this view".to_owned(), picture.camera.limited_to(SIDE_PX))],
        (None, None) => return,
    };
    // A true mask belongs to one view only.
    let truth = app.viewport.queries.truth().filter(|_| photos.is_none()).map_or(TrueMasks::None, TrueMasks::Mask);
    let colors = app.viewport.queries.colors_of(&phrases);
    let request = PhrasesRequest {
        cloud: Arc::clone(&cloud),
        map: Arc::clone(&map),
        settings,
        views,
        colors,
        phrases,
        level: LevelFilter::Auto,
        up: app.viewport.up(&scene),
        meters: scene.meters_per_unit(),
        recipe: app.viewport.queries.recipe().clone(),
        top: 1,
        truth,
        export: to,
    };
    let run = move |observer: &mut dyn Observer| phrases::run(&request, observer).map(|rows| (rows, request.export));
    app.start_in_scene(JobInfo::long("Running the phrase list").pausable(), run, |app, found| {
        if let Some((rows, to)) = found {
            app.state.phrases.finished(rows, to);
        }
    });
}

pub(in crate::ui) fn choose_true_mask(app: &mut App) {
    let request = FileRequest::file(
        FileKind::Masks,
        "True mask of this view",
        vec![FileFormat::new("Masks (.png, .bmp, .tif)", &[".png", ".bmp", ".tif", ".tiff"])],
    );
    app.choose(request, |app, path| compare_with_mask(app, Some(&path)));
}

/// Compares the newest answer with a true mask of the current view, or with none.
pub(in crate::ui) fn compare_with_mask(app: &mut App, path: Option<&Path>) {
    let Some(path) = path else { return app.viewport.queries.compare_with(None) };
    let read = phrases::true_mask(path).and_then(|mask| match app.viewport.queries.maps() {
        Some(maps) => phrases::fitted(mask, maps.identities.width_px, maps.identities.height_px, path),
        None => Ok(mask),
    });
    match read {
        Ok(mask) => {
            let pose = app.viewport.pose();
            app.viewport.queries.compare_with(Some((Arc::new(mask), pose)));
        }
        Err(e) => app.state.fail("Opening the true mask", Failure::of(&e, "Choose a .png of this view.")),
    }
}

/// Writes the true mask of the current view.
pub(in crate::ui) fn save_true_mask(app: &mut App) {
    if app.viewport.queries.truth().is_none() {
        return app.state.toast(Tone::Info, "This view has no true mask: load or paint one.");
    }
    let scene = app.state.scene.as_ref().map_or("scene", |s| &s.name);
    let request = FileRequest::save(
        FileKind::Masks,
        "Save true mask",
        &format!("{scene}-true-mask"),
        vec![FileFormat::new("PNG (.png)", &[".png"])],
    );
    app.choose(request, |app, path| {
        let Some(mask) = app.viewport.queries.truth() else { return };
        match export::check(&path, &[".png"], &[]).and_then(|()| write_mask(&path, &mask)) {
            Ok(()) => super::export::is_saved(app, path),
            Err(e) => app.state.fail("Saving the true mask", Failure::of(&e, "Choose another place.")),
        }
    });
}

pub(in crate::ui) fn start_chat(app: &mut App) {
    app.layout.show(Pane::Chat);
    app.chat.start_typing();
}

/// Sends the typed text to the agent, with a snapshot of the scene.
pub(in crate::ui) fn send_chat(app: &mut App) {
    let Some(text) = app.chat.wants() else { return };
    let Some(SceneContext { scene, cloud, map: Some(map), settings, cameras, up, eye, aspect, explored }) =
        SceneContext::new(app)
    else {
        return app.chat.answer("Open or train a scene and find its objects first.");
    };
    let snapshot = Snapshot {
        cloud: cloud.generation(),
        parts: AgentScene {
            cloud: Arc::clone(&cloud),
            settings,
            map: Arc::clone(&map),
            cameras,
            up,
            meters: scene.meters_per_unit(),
            exports: scene.out.join("exports"),
            folder: app.state.is_trained().then(|| scene.out.clone()),
            recipe: app.viewport.queries.recipe().clone(),
            explored,
        },
        scene: app.state.scene_number,
        eye,
        aspect,
        hidden: app.viewport.visibility.hidden().iter().copied().collect(),
        undoable: app.state.changes.last().map(str::to_owned),
        photos: ScenePhotos { locator: locate::locator(app).ok(), given: app.state.located.given.clone() },
    };
    app.chat.send(text, snapshot, app.layout.chat.clone(), &app.repaint);
}

/// Applies an effect of the agent to the window.
pub(in crate::ui) fn effect(app: &mut App, effect: Effect) {
    match effect {
        Effect::Fly(flight, about) => {
            if let Some(point) = about {
                app.viewport.turn_about(point);
            }
            app.camera.play_flight(*flight, String::new());
        }
        Effect::Mark(ids) => {
            if let Some(map) = app.state.semantics.clone() {
                let names: Vec<String> = ids.iter().take(6).map(|id| map.identities.full_name(*id)).collect();
                app.viewport.queries.mark(&names, &map);
            }
        }
        Effect::Hidden(ids) => app.viewport.visibility.set_hidden(ids),
        Effect::Remove(ids) => objects::remove(app, &ids),
        Effect::Undo => edits::queue(app, EditStep::Undo),
        Effect::Renamed(id, name) => {
            let sentence = app.chat.sent;
            edits::queue(app, EditStep::Said(EditRequest::Apply(Edit::Rename(id, name)), sentence));
        }
        Effect::Undone(undone) => edits::queue(app, EditStep::UndoSentence(undone)),
        Effect::Located(found, differs) => locate::show(app, *found, differs),
        Effect::AddPhotos(photos) => add::start(app, photos),
        Effect::Explored(explored) => app.state.explored = Some(explored),
    }
}
