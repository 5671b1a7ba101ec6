//! Scenes beside the current one, and the sheet of what all answer.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::open::file_name;
use super::view;
use crate::jobs::compare::vectors::InstalledEncoders;
use crate::jobs::compare::{self, CompareRequest};
use crate::pipeline::observer::Observer;
use crate::ui::app::App;
use crate::ui::comparison::{ComparedScene, MOST_BESIDE};
use crate::ui::file_dialogs::FileRequest;
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::JobInfo;

pub(in crate::ui) fn choose(app: &mut App) {
    if app.state.beside.len() >= MOST_BESIDE {
        let text = format!("{} scenes are compared at most: close one of them first.", MOST_BESIDE + 1);
        return app.state.toast(Tone::Warning, text);
    }
    app.choose(FileRequest::folder(FileKind::Scenes, "Open to compare"), open);
}

/// Shows a scene beside the others; one made by a removal in place of the removal before.
pub(in crate::ui) fn open(app: &mut App, path: PathBuf) {
    app.layout.split_view = true;
    let (workspace, title) = (Arc::clone(&app.workspace), format!("Opening {} beside", file_name(&path)));
    let open = move |observer: &mut dyn Observer| workspace.open_comparison(&path, observer);
    app.start(JobInfo::short(title), open, |app, scene| {
        let Some(mut scene) = ComparedScene::of(scene) else {
            return app.state.toast(Tone::Warning, "There is nothing to compare with: it has no Gaussians.");
        };
        scene.is_removal = app.state.removed.as_ref().is_some_and(|removed| removed.folder == scene.path);
        let beside = &mut app.state.beside;
        beside.retain(|other| other.path != scene.path && !(scene.is_removal && other.is_removal));
        beside.truncate(MOST_BESIDE - 1);
        beside.push(scene);
    });
}

/// Closes a scene beside the current one, or all.
pub(in crate::ui) fn close(app: &mut App, path: Option<&Path>) {
    app.state.beside.retain(|other| path.is_some_and(|path| other.path != path));
    app.layout.split_view &= !app.state.beside.is_empty();
}

pub(in crate::ui) fn choose_sheet_folder(app: &mut App) {
    if app.viewport.compared.phrase().is_none() {
        return app.state.toast(Tone::Warning, "Type a phrase for all scenes first.");
    }
    let request = FileRequest::new_folder(FileKind::Reports, "Empty folder for the comparison");
    app.choose(request, save_sheet);
}

/// Writes table, pictures and page of what all scenes on screen answer in the photo's view, or in that of the nearest.
pub(in crate::ui) fn save_sheet(app: &mut App, folder: PathBuf) {
    let Some((scene, phrase)) = app.state.scene.clone().zip(app.viewport.compared.phrase().map(str::to_owned)) else {
        return app.state.toast(Tone::Warning, "Type a phrase for all scenes first.");
    };
    let photo = app.viewport.own_photo_index().or_else(|| view::nearest_photo(app, &BTreeSet::new()));
    let by_photo = scene.dataset.as_ref().zip(photo).map(|(data, photo)| data.photos[photo].name.clone());
    let cameras = scene.cameras.iter().map(|camera| &camera.camera);
    let by_camera = || Some(scene.cameras[view::nearest_camera(app, cameras)?].name.clone());
    let Some(name) = by_photo.or_else(by_camera) else {
        let text = "Sheets are made of photos' views, and no photo or camera of this scene is known.";
        return app.state.toast(Tone::Warning, text);
    };
    let first = if scene.method.is_some() { &scene.path } else { scene.stored() };
    let scenes = std::iter::once(first.to_path_buf()).chain(app.state.beside.iter().map(|other| other.path.clone()));
    let photos = scene.dataset.as_ref().map(|data| data.source().to_path_buf());
    let request = CompareRequest::of_view(scenes.collect(), phrase, name, photos, folder.clone());
    let info = JobInfo::long(format!("Comparing into {}", file_name(&folder)));
    let work = move |observer: &mut dyn Observer| {
        let mut encoders = InstalledEncoders::default();
        let mut encode = |name: &str, phrases: &[&str]| encoders.encode(name, phrases);
        compare::run(&request, &mut encode, observer)
    };
    app.start(info, work, move |app, found| {
        let view = found.views.first().cloned().unwrap_or_default();
        app.state.result(format!("Compared in the view of {view}: {}", folder.join("compare.html").display()));
    });
}
