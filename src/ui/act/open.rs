//! Opening scenes, reports, camera paths and training settings.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::jobs::demo::QUESTION;
use crate::jobs::locate::is_picture;
use crate::jobs::poses::front_door::PoseRequest;
use crate::jobs::workspace::OpenedPath;
use crate::jobs::{JobError, OpenedScene, phases, presets};
use crate::measure::{Report, is_report};
use crate::pipeline::observer::Observer;
use crate::ui::act::{locate, remote};
use crate::ui::actions::{Action, Pane};
use crate::ui::app::App;
use crate::ui::camera;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::{AppState, ShownReport, Tone};
use crate::worker::{Failure, JobInfo, Makes};

/// File endings of scenes.
const SCENES: [&str; 21] = [
    ".ply", ".splat", ".ksplat", ".spz", ".sog", ".gltf", ".glb", ".json", ".toml", ".npy", ".bin", ".txt", ".zip",
    ".pth", ".pt", ".ckpt", ".yml", ".npz", ".mp4", ".mov", ".m4v",
];

pub(in crate::ui) fn choose_folder(app: &mut App) {
    let request = FileRequest::folder(FileKind::Photos, "Open photos, a scene or a result");
    app.choose(request, |app, path| app.ask(Action::Open(path)));
}

pub(in crate::ui) fn choose_file(app: &mut App) {
    let request = FileRequest::file(FileKind::Scenes, "Open file", vec![FileFormat::new("Scenes", &SCENES)]);
    app.choose(request, |app, path| app.ask(Action::Open(path)));
}

/// Opens a report, a file of training settings, or another scene; in an open scene, a photo is located.
pub(in crate::ui) fn open(app: &mut App, path: PathBuf) {
    if is_report(&path) {
        return report(app, path, false);
    }
    if path.extension().is_some_and(|e| e == "toml") {
        return preset(app, &path);
    }
    if app.state.scene.is_some() && is_picture(&path) {
        return locate::start(app, vec![path]);
    }
    // A scene beside this one, or made from it, is of the same place.
    let is_beside = app.state.beside.iter().any(|other| other.path == path);
    let is_made_of_it = app.state.removed.as_ref().is_some_and(|removed| removed.folder == path);
    let is_kin = is_beside || is_made_of_it || app.state.closer.as_ref() == Some(&path);
    replace_scene(app, move |app| {
        let (workspace, title) = (Arc::clone(&app.workspace), format!("Opening {}", file_name(&path)));
        let info = JobInfo::urgent(title).makes(Makes::Scene);
        app.start(
            info,
            move |observer| workspace.open(&path, observer),
            move |app, opened| match opened {
                OpenedPath::Scene(scene) => {
                    if is_kin || is_same_place(&app.state, &scene) {
                        app.viewport.keep_place();
                    }
                    // With what was compared, its views go.
                    app.layout.split_view &= app.state.beside.is_empty();
                    app.state.opened(*scene, false);
                }
                OpenedPath::Unposed(question) => app.state.unposed = Some(question),
            },
        );
    });
}

/// True if the Gaussians on screen and those of the other scene are results of the same photos.
fn is_same_place(state: &AppState, now: &OpenedScene) -> bool {
    state.is_trained() && now.trained && state.scene.as_ref().is_some_and(|before| before.has_photos_of(now))
}

/// Finds the camera poses of photos or a video, and opens the result.
pub(in crate::ui) fn find_poses(app: &mut App, request: Box<PoseRequest>) {
    let title = format!("Finding camera poses of {}", file_name(&request.photos.folder));
    let info = JobInfo::long(title).makes(Makes::Scene).phases(phases::POSES);
    let workspace = Arc::clone(&app.workspace);
    open_by(
        app,
        info,
        move |observer| workspace.find_poses(&request, observer),
        |app, scene| {
            app.state.opened(scene, false);
        },
    );
}

/// Opens the trained demo and asks it a question.
pub(in crate::ui) fn demo(app: &mut App) {
    let (info, workspace) = (JobInfo::urgent("Opening the demo").makes(Makes::Scene), Arc::clone(&app.workspace));
    open_by(
        app,
        info,
        move |observer| workspace.open_demo(observer),
        |app, scene| {
            app.state.opened(scene, true);
            app.ask(Action::Ask(QUESTION.into()));
        },
    );
}

/// Renders the photos of the demo, opens them and trains on them.
pub(in crate::ui) fn demo_photos(app: &mut App) {
    let info = JobInfo::long("Rendering the demo scene").makes(Makes::Scene).phases(phases::DEMO);
    let info = info.hint("The photos are rendered once; training then starts automatically.");
    let workspace = Arc::clone(&app.workspace);
    open_by(
        app,
        info,
        move |observer| workspace.open_demo_photos(observer),
        |app, scene| {
            app.state.opened(scene, true);
            app.ask(Action::StartTraining);
        },
    );
}

/// Opens another scene by this job.
fn open_by(
    app: &mut App,
    info: JobInfo,
    work: impl FnOnce(&mut dyn Observer) -> Result<OpenedScene, JobError> + Send + 'static,
    then: impl FnOnce(&mut App, OpenedScene) + 'static,
) {
    replace_scene(app, move |app| {
        app.start(info, work, then);
    });
}

/// Opens another scene by `open`; asks first if that ends a running job.
fn replace_scene(app: &mut App, open: impl FnOnce(&mut App) + 'static) {
    // A job on another computer continues there.
    let running = app.state.job.as_ref().filter(|job| !remote::is_remote(job.id));
    let running = running.map(|job| format!("{} is still running. Stop it? {}", job.info.title, job.leaves()));
    let Some(text) = running else {
        remote::disconnect(app);
        return open(app);
    };
    let question = Question { text, yes: "Stop and continue", other: None, no: "Keep running", deletes: false };
    app.put_question(question, |app, answer| {
        if answer == DialogAnswer::Yes {
            remote::cancel_job(app);
            remote::disconnect(app);
            open(app);
        }
    });
}

pub(in crate::ui) fn choose_report(app: &mut App, second: bool) {
    let request =
        FileRequest::file(FileKind::Reports, "Open report", vec![FileFormat::new("Reports (.json)", &[".json"])]);
    app.choose(request, move |app, path| report(app, path, second));
}

/// Reads a report and shows its pane; `second` compares it with the one on screen.
pub(in crate::ui) fn report(app: &mut App, path: PathBuf, second: bool) {
    app.layout.show(Pane::Report);
    let info = JobInfo::short(format!("Opening the report {}", file_name(&path)));
    let read =
        move |_: &mut dyn Observer| Report::read(&path).map(|report| ShownReport { path, report: Arc::new(report) });
    app.start(info, read, move |app, shown| {
        let place = if second { &mut app.state.second_report } else { &mut app.state.report };
        *place = Some(shown);
    });
}

/// Reads settings for the next training from a file.
fn preset(app: &mut App, path: &Path) {
    match presets::read(path) {
        Ok(config) => {
            app.layout.config = config;
            app.state.toast(Tone::Good, format!("The next training uses the settings of {}", path.display()));
        }
        Err(e) => app.state.fail("Reading training settings", Failure::of(&e, "")),
    }
}

pub(in crate::ui) fn choose_path(app: &mut App) {
    let formats = vec![FileFormat::new("Camera paths (.json)", &[".json"])];
    app.choose(FileRequest::file(FileKind::Paths, "Open camera path", formats), |app, path| {
        match camera::read(&path) {
            Ok(read) => {
                app.camera.open(read);
                app.layout.show(Pane::Camera);
            }
            Err(message) => app.state.fail("Opening the camera path", Failure::new(message, "")),
        }
    });
}

/// Last component of a path, for titles.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
