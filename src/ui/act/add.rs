//! Photos that are added to the open scene: a training makes a better one beside it, which is then opened.

use std::path::PathBuf;

use super::open::file_name;
use crate::jobs::locate::PICTURES;
use crate::jobs::{JobError, add, phases};
use crate::math::format::things;
use crate::pipeline::observer::Observer;
use crate::ui::actions::{Action, Pane};
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::{JobInfo, Makes, Stop};

pub(in crate::ui) fn choose_folder(app: &mut App) {
    if !refuses(app) {
        app.choose(FileRequest::folder(FileKind::Pictures, "Folder of photos to add"), |app, path| {
            start(app, vec![path]);
        });
    }
}

pub(in crate::ui) fn choose_photo(app: &mut App) {
    if refuses(app) {
        return;
    }
    let formats = vec![FileFormat::new("Photos", &PICTURES), FileFormat::new("Posed photos (.json)", &[".json"])];
    app.choose(FileRequest::file(FileKind::Pictures, "Photo to add", formats), |app, path| start(app, vec![path]));
}

/// Returns true, with a message, if no photos can be added now.
fn refuses(app: &mut App) -> bool {
    let editing = || "Objects are being changed; add photos once that is done.".to_owned();
    let why = app.state.why_no_added_photos().or_else(|| app.is_editing().then(editing));
    let is_refused = why.is_some();
    why.into_iter().for_each(|why| app.state.toast(Tone::Warning, why));
    is_refused
}

/// Adds photos, files or folders, to the open scene. The new scene is opened, unless another one is open by then.
pub(in crate::ui) fn start(app: &mut App, photos: Vec<PathBuf>) {
    if refuses(app) {
        return;
    }
    let Some(scene) = app.state.scene.clone() else { return };
    let what = match photos.as_slice() {
        [one] => file_name(one),
        all => things(all.len(), "photo"),
    };
    let info = JobInfo::long(format!("Adding {what} to {}", scene.name)).makes(Makes::SceneBeside);
    let (before, number) = (scene.out.clone(), app.state.scene_number);
    let folder = before.clone();
    let work = move |observer: &mut dyn Observer| add::beside(&folder, &photos, observer);
    let is_begun = app.start_to_end(info.pausable().phases(phases::ADDING), work, move |app, _, end| {
        let is_open = number == app.state.scene_number;
        match end {
            Ok(done) => {
                app.state.result(done.told(&before));
                app.state.remember_made(done.out.clone());
                if is_open {
                    app.state.closer = Some(done.out.clone());
                    app.ask(Action::Open(done.out));
                }
            }
            Err(Stop::Cancelled) if is_open => {
                let text = "Stopped; this scene is as it was. Add the same photos again to go on.";
                app.state.toast(Tone::Info, text);
            }
            Err(_) => {}
        }
    });
    if is_begun && app.layout.shows(Pane::Training) {
        app.layout.dock.activate(Pane::Training);
    }
}

/// Opens a folder that was dropped on a scene, or adds its photos to the scene if the user says so.
pub(in crate::ui) fn offer(app: &mut App, folder: PathBuf) {
    let (info, path) = (JobInfo::short(format!("Looking at {}", file_name(&folder))), folder.clone());
    let look = move |_: &mut dyn Observer| Ok::<_, JobError>(add::holds_photos(&path));
    app.start_in_scene(info, look, move |app, holds_photos| {
        let name = app.state.scene.as_ref().map(|scene| scene.name.clone());
        let Some(scene) = name.filter(|_| holds_photos == Some(true)) else {
            return app.ask(Action::Open(folder));
        };
        let text = format!(
            "{} holds photos. Add them to {scene}, or open them instead? Adding them trains a better scene in a folder of \
             its own.",
            file_name(&folder)
        );
        let question =
            Question { text, yes: "Add to this scene", other: Some("Open them"), no: "Cancel", deletes: false };
        app.put_question(question, |app, answer| match answer {
            DialogAnswer::Yes => start(app, vec![folder]),
            DialogAnswer::Other => app.ask(Action::Open(folder)),
            DialogAnswer::No => {}
        });
    });
}
