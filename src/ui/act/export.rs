//! Writing: objects, pages, pictures, videos, camera paths and the conversation.

use std::path::PathBuf;
use std::sync::Arc;

use strum::VariantArray;

use super::open::file_name;
use crate::io::splat_format::SplatFormat;
use crate::jobs::export_all::{ExportAllRequest, MaskFormat};
use crate::jobs::page::PageRequest;
use crate::jobs::video::VideoRequest;
use crate::jobs::{export, export_all, page as page_job, phases, video as video_job};
use crate::render::BackendChoice;
use crate::ui::app::App;
use crate::ui::camera;
use crate::ui::context::SceneContext;
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::ui::video_choice::VideoFile;
use crate::ui::video_dialog::{self, VideoFacts};
use crate::worker::{Failure, JobInfo};

/// Name of the scene for new files.
pub(super) fn scene_name(app: &App) -> String {
    app.state.scene.as_ref().map_or_else(|| "scene".to_owned(), |s| s.name.clone())
}

/// Returns true if a view is on screen; else tells the user.
pub(super) fn has_view(app: &mut App) -> bool {
    let has_view = app.viewport.picture().is_some();
    if !has_view {
        app.state.toast(Tone::Warning, "Nothing to save yet: open a scene first.");
    }
    has_view
}

pub(super) fn is_saved(app: &mut App, path: PathBuf) {
    app.state.result(format!("Saved to {}", path.display()));
}

/// Writes every object and part into a folder, and their masks in the photos, if there are any.
pub(in crate::ui) fn all_objects(app: &mut App) {
    app.choose(FileRequest::new_folder(FileKind::Objects, "Empty folder for objects and parts"), |app, folder| {
        let Some(SceneContext { cloud, map: Some(map), settings, scene, .. }) = SceneContext::new(app) else {
            return app.state.toast(Tone::Warning, "Find objects first: there is nothing to export yet.");
        };
        let photos = scene.dataset.iter().flat_map(|d| &d.photos);
        let views = photos.map(|p| (p.name.clone(), p.camera.clone())).collect();
        let (masks, format) = (MaskFormat::ALL.to_vec(), SplatFormat::Ply);
        let info = JobInfo::long(format!("Writing {}", file_name(&folder))).pausable().phases(phases::EXPORT_ALL);
        let (cloud, map) = (Arc::clone(&cloud), Arc::clone(&map));
        let request = ExportAllRequest { cloud, map, settings, views, format, masks, folder };
        app.start(info, move |observer| export_all::run(&request, observer).map(|done| done.folder), is_saved);
    });
}

/// Writes the scene as a page, with the camera path of the pane and those in its folder.
pub(in crate::ui) fn page(app: &mut App) {
    if !has_view(app) {
        return;
    }
    let formats = vec![FileFormat::new("Page (.html)", &page_job::ENDINGS)];
    let request = FileRequest::save(FileKind::Pages, "Export page", &scene_name(app), formats);
    app.choose(request, |app, out| {
        let Some(SceneContext { scene, cloud, map, settings, cameras, .. }) = SceneContext::new(app) else { return };
        if let Err(e) = export::check(&out, &page_job::ENDINGS, &[&scene.path]) {
            return app.state.fail("Exporting the page", Failure::of(&e, ""));
        }
        let mut paths = page_job::paths_in(&scene.out);
        let own = &app.camera.path;
        // What is stored may be an earlier state.
        paths.retain(|(name, _)| name != page_job::KEPT_PATH);
        if !own.keys.is_empty() && paths.iter().all(|(_, path)| path != own) {
            paths.insert(0, (page_job::KEPT_PATH.to_owned(), own.clone()));
        }
        let info = JobInfo::long(format!("Writing {}", file_name(&out))).pausable();
        let request = PageRequest {
            title: scene.name.clone(),
            cloud: Arc::clone(&cloud),
            map: map.as_deref().map(Arc::clone),
            cameras,
            home: scene.home.clone(),
            meters: scene.meters_per_unit(),
            settings,
            paths,
            out,
        };
        app.start(info, move |observer| page_job::run(&request, observer).map(|_| request.out), is_saved);
    });
}

/// Writes the frame of the active view.
pub(in crate::ui) fn screenshot(app: &mut App) {
    if !has_view(app) {
        return;
    }
    let formats = vec![FileFormat::new("PNG (.png)", &[".png"])];
    let request = FileRequest::save(FileKind::Pictures, "Save view", &scene_name(app), formats);
    app.choose(request, |app, path| match app.viewport.pixels() {
        Ok(Some(pixels)) => {
            let info = JobInfo::short(format!("Writing {}", file_name(&path)));
            app.start(info, move |_| export::picture(&path, &pixels).map(|()| path), is_saved);
        }
        Ok(None) => {}
        Err(e) => app.state.fail("Saving the picture", Failure::of(&e, "Try again once the view rests.")),
    });
}

pub(in crate::ui) fn camera_path(app: &mut App) {
    let own = FileFormat::new("Camera path (.json)", &[".json"]);
    let formats = vec![own, FileFormat::new("nerfstudio (.nerfstudio.json)", &[".nerfstudio.json"])];
    let request = FileRequest::save(FileKind::Paths, "Save camera path", &format!("{}-path", scene_name(app)), formats);
    app.choose(request, |app, path| match camera::write(&path, &app.camera.path, app.viewport.aspect()) {
        Ok(()) => is_saved(app, path),
        Err(message) => app.state.fail("Saving the camera path", Failure::new(message, "")),
    });
}

/// Opens the dialog for a video of the loaded flight or path.
pub(in crate::ui) fn video(app: &mut App) {
    if app.camera.length().is_none() {
        let text = "Nothing to export: add keyframes, or fly to an object first.";
        return app.state.toast(Tone::Warning, text);
    }
    app.asks_for_video = has_view(app);
}

/// Shows the dialog for a video, and continues with the user's decision.
pub(in crate::ui) fn show_video_dialog(app: &mut App, ctx: &egui::Context) {
    let Some((frames, secs)) = app.camera.length().filter(|_| app.asks_for_video) else { return };
    let facts = VideoFacts { view_px: view_px(app), frames, secs };
    let decision = video_dialog::show(ctx, &mut app.layout.video, &mut app.camera.path.fps, &facts);
    app.asks_for_video = decision.is_none();
    if decision == Some(true) {
        save_video(app);
    }
}

/// Size of the frame on screen, px.
fn view_px(app: &App) -> [u32; 2] {
    app.viewport.picture().map_or([1280, 720], |p| [p.camera.width_px, p.camera.height_px])
}

/// Asks for a file, and renders the video.
fn save_video(app: &mut App) {
    let choice = app.layout.video;
    let formats = VideoFile::VARIANTS.iter().map(|f| FileFormat::new(f.title(), &[f.ending()])).collect();
    let format = VideoFile::VARIANTS.iter().position(|file| *file == choice.file).unwrap_or(0);
    let request = FileRequest::save(FileKind::Videos, "Export video", &scene_name(app), formats).with_format(format);
    app.choose(request, move |app, out| {
        let Some(SceneContext { cloud, map, settings: draw, .. }) = SceneContext::new(app) else { return };
        let size_px = choice.size_px(view_px(app));
        let Some((cameras, settings)) = app.camera.video(&out, size_px, choice.quality) else { return };
        let found = app.viewport.queries.found();
        let marked = map.filter(|_| choice.mark).map(|map| (Arc::clone(&map), found));
        let info = JobInfo::long(format!("Rendering {}", file_name(&out))).pausable();
        let (cloud, backend) = (Arc::clone(&cloud), BackendChoice::Auto);
        let request = VideoRequest { cloud, draw, cameras, marked, out, settings, backend };
        app.start(info, move |observer| video_job::run(request, observer).map(|video| video.summary.path), is_saved);
    });
}

/// Writes the conversation with the agent.
pub(in crate::ui) fn conversation(app: &mut App) {
    let formats = vec![FileFormat::new("Markdown (.md)", &[".md"]), FileFormat::new("JSON (.json)", &[".json"])];
    let name = format!("{}-conversation", scene_name(app));
    let request = FileRequest::save(FileKind::Conversations, "Save conversation", &name, formats);
    app.choose(request, |app, path| {
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = app.chat.transcript(json).map(str::to_owned) else { return };
        match export::text(&path, &text) {
            Ok(()) => is_saved(app, path),
            Err(e) => app.state.fail("Saving the conversation", Failure::of(&e, "")),
        }
    });
}
