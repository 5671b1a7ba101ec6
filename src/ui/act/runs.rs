//! Training runs and the folders of scenes: opening the last, renaming, deleting, showing and copying.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::export::is_saved;
use super::open::file_name;
use super::remote;
use crate::jobs::{JobError, runs, save_copy, show_folder};
use crate::pipeline::observer::Observer;
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::file_dialogs::FileRequest;
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::{Failure, JobInfo, Stop};

pub(in crate::ui) fn open_last(app: &mut App) {
    match app.state.recent.first().cloned() {
        Some(path) => app.ask(Action::Open(path)),
        None => app.state.toast(Tone::Info, "No scene was open before."),
    }
}

/// Gives a training run another name.
pub(in crate::ui) fn rename(app: &mut App, run: PathBuf, name: String) {
    let workspace = Arc::clone(&app.workspace);
    let rename = move |_: &mut dyn Observer| runs::rename(workspace.folders(), &run, &name);
    app.start(JobInfo::short("Renaming the training"), rename, |app, ()| app.photos.runs.refresh());
}

/// Asks for confirmation, and deletes a training run.
pub(in crate::ui) fn ask_to_delete(app: &mut App, run: PathBuf) {
    let is_open = app.state.scene.as_ref().is_some_and(|s| s.out == run);
    if is_open && (app.state.job.is_some() || app.is_editing()) {
        let text = "This training is being worked on; stop that first (Esc).";
        return app.state.toast(Tone::Warning, text);
    }
    let known = app.state.scene.as_ref().and_then(|s| s.runs.iter().find(|known| known.folder == run));
    let (what, stays) = match known {
        Some(known) if !known.is_training => ("edited scene", "The training that it was made of stays."),
        _ => ("training", "The photos and the other trainings stay."),
    };
    let name = known.map_or_else(|| file_name(&run), |known| format!("{} ({})", known.name, known.facts()));
    let text = format!(
        "Delete the {what} {name}? Its Gaussians and objects are deleted with its folder. {stays} This cannot be \
         undone.\n\n{}",
        run.display()
    );
    let question = Question::deletion(text);
    app.put_question(question, |app, answer| {
        if answer == DialogAnswer::Yes {
            delete(app, run);
        }
    });
}

/// Asks for confirmation, and deletes the open scene.
pub(super) fn ask_to_delete_open(app: &mut App) {
    let Some(scene) = app.state.scene.as_ref().filter(|s| s.is_stored() && s.remote.is_none()) else {
        let text = "Nothing to delete: the open scene has no folder of its own. Its file is yours to delete.";
        return app.state.toast(Tone::Warning, text);
    };
    if scene.runs.iter().any(|run| run.folder == scene.out) {
        let run = scene.out.clone();
        return ask_to_delete(app, run);
    }
    if app.state.job.is_some() || app.is_editing() {
        return app.state.toast(Tone::Warning, "This scene is being worked on; stop that first (Esc).");
    }
    let (folder, name) = (scene.out.clone(), &scene.name);
    let text = format!(
        "Delete the scene {name}? Its Gaussians and objects are deleted with its folder. This cannot be undone.\n\n{}",
        folder.display()
    );
    let question = Question::deletion(text);
    app.put_question(question, |app, answer| {
        if answer == DialogAnswer::Yes {
            delete(app, folder);
        }
    });
}

fn delete(app: &mut App, folder: PathBuf) {
    let workspace = Arc::clone(&app.workspace);
    let delete = move |_: &mut dyn Observer| workspace.delete(&folder).map(|()| folder);
    app.start(JobInfo::short("Deleting the scene"), delete, |app, folder| {
        app.state.toast(Tone::Good, format!("Deleted {}", folder.display()));
        app.state.recent.retain(|path| *path != folder);
        app.photos.runs.refresh();
        // What was deleted is not worked on any more.
        if let Some(scene) = app.state.scene.as_ref().filter(|s| s.out == folder) {
            // The photos of a training stay; of any other scene, the one before is gone on with.
            let is_training = scene.runs.iter().any(|run| run.folder == folder);
            let photos = scene.dataset.as_ref().filter(|_| is_training).map(|d| d.source().to_path_buf());
            let next = photos.filter(|path| path.exists()).or_else(|| app.state.recent.first().cloned());
            app.ask(next.map_or(Action::OpenDemo, Action::Open));
        }
    });
}

/// Shows a folder, or that of the open scene, in the system's file manager. Where there is none, its path is on the
/// clipboard.
pub(in crate::ui) fn show_folder(app: &mut App, ctx: &egui::Context, of: Option<PathBuf>) {
    let place = |path: &Path| if path.is_file() { path.parent().map(Path::to_path_buf) } else { Some(path.into()) };
    let Some(folder) = of.or_else(|| place(app.state.scene.as_ref()?.stored())) else {
        return app.state.toast(Tone::Warning, "Open a scene first: there is no folder to show.");
    };
    if remote::refuses(app, "Showing the folder", "look there") {
        return;
    }
    let (ctx, path) = (ctx.clone(), folder.display().to_string());
    let show = move |_: &mut dyn Observer| {
        let remedy = "Its path is on the clipboard now.";
        let failed = |e| Failure::new(format!("{} cannot be shown here: {e}.", folder.display()), remedy);
        show_folder::run(&folder).map_err(|e| Stop::Failed(failed(e)))
    };
    app.start_to_end(JobInfo::short("Showing the folder"), show, move |_, _, end| {
        if end.is_err() {
            ctx.copy_text(path);
        }
    });
}

/// Copies the scene's folder to another place.
pub(in crate::ui) fn save_copy(app: &mut App) {
    let scene = app.state.scene.as_ref();
    let Some((from, is_stored, name)) = scene.map(|s| (s.out.clone(), s.is_stored(), s.name.clone())) else {
        return app.state.toast(Tone::Warning, "Nothing to copy yet: open a scene first.");
    };
    if remote::refuses(app, "Copying the scene", "copy its folder there") {
        return;
    }
    if app.state.is_training() || !is_stored {
        let text = "Nothing to copy yet: a scene is copied once it is trained. Export Gaussians writes a splat file.";
        return app.state.toast(Tone::Warning, text);
    }
    // The program's own folder is out of sight: copies of its scenes go to where files were chosen last.
    let is_own = from.starts_with(&app.workspace.folders().data);
    let beside = from.parent().filter(|_| !is_own).map(Path::to_path_buf);
    let last = || app.layout.folder_of(FileKind::Scenes).map(Path::to_path_buf);
    let within = beside.clone().or_else(last).or_else(std::env::home_dir).unwrap_or_default();
    let request = FileRequest::made_folder(FileKind::Scenes, "Save a copy of the scene", &free_copy(&name, &within));
    app.choose(request.within(beside), move |app, to| {
        let info = JobInfo::long(format!("Copying the scene to {}", file_name(&to))).pausable();
        let copy =
            move |observer: &mut dyn Observer| -> Result<PathBuf, JobError> { save_copy::run(&from, &to, observer) };
        app.start(info, copy, is_saved);
    });
}

/// A name for a copy that nothing in the folder has: "fox-copy".
fn free_copy(name: &str, within: &Path) -> String {
    let name = format!("{}-copy", name.trim().replace(std::path::is_separator, "-"));
    let numbered = (2..).map(|n: u32| format!("{name}-{n}"));
    let free = |name: &String| within.join(name).symlink_metadata().is_err();
    std::iter::once(name.clone()).chain(numbered).find(free).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_have_names_that_are_free() {
        let folder = tempfile::tempdir().expect("folder");
        assert_eq!(free_copy("my fox", folder.path()), "my fox-copy");
        assert_eq!(free_copy("a/b", folder.path()), "a-b-copy");
        std::fs::create_dir(folder.path().join("my fox-copy")).expect("made");
        assert_eq!(free_copy("my fox", folder.path()), "my fox-copy-2");
    }
}
