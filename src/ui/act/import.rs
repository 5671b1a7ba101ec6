//! Import: the result of another method becomes a scene of this program.

use std::path::PathBuf;

use super::open::file_name;
use crate::jobs::import::{self, ImportRequest};
use crate::pipeline::observer::Observer;
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::file_dialogs::FileRequest;
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::JobInfo;

pub(in crate::ui) fn choose_folder(app: &mut App) {
    if app.state.scene.as_ref().is_none_or(|scene| scene.method.is_none()) {
        return app.state.toast(Tone::Warning, "Only results of other methods are imported: open one first.");
    }
    app.choose(FileRequest::new_folder(FileKind::Scenes, "Empty folder for the scene"), run);
}

/// Writes the open result as a scene into a folder, and opens that.
pub(in crate::ui) fn run(app: &mut App, folder: PathBuf) {
    let Some(scene) = app.state.scene.clone().filter(|scene| scene.method.is_some()) else { return choose_folder(app) };
    let request = ImportRequest::of_scene(&scene, folder.clone(), app.viewport.compared.size());
    let info = JobInfo::long(format!("Importing into {}", file_name(&folder)));
    let work = move |observer: &mut dyn Observer| import::run(&request, observer);
    app.start(info, work, |app, made| {
        let (objects, parts) = (made.objects, made.parts);
        app.state.result(format!("Imported with {objects} objects and {parts} parts: {}", made.scene.display()));
        if let Some(left_out) = &made.left_out {
            app.state.say(Tone::Warning, format!("Not imported: {left_out}"));
        }
        app.ask(Action::Open(made.scene));
    });
}
