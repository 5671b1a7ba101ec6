//! Writing: Gaussians, pages, pictures, videos, camera paths and the conversation.

use std::path::PathBuf;
use std::sync::Arc;

use super::open::file_name;
use crate::io::splat_format::SplatFormat;
use crate::jobs::export_all::{ExportAllRequest, MaskFormat};
use crate::jobs::export_splat::{self, LossViews};
use crate::jobs::page::PageRequest;
use crate::jobs::video::VideoRequest;
use crate::jobs::{export, export_all, page as page_job, video as video_job};
use crate::pipeline::observer::Observer;
use crate::render::BackendChoice;
use crate::scene::{GaussianCloud, IdentityId};
use crate::ui::app::App;
use crate::ui::camera;
use crate::ui::context::SceneContext;
use crate::ui::file_dialogs::FileRequest;
use crate::ui::state::Tone;
use crate::worker::{Failure, JobInfo};

/// Name of the scene for new files.
pub(super) fn scene_name(app: &App) -> String {
    app.state.scene.as_ref().map_or_else(|| "scene".to_owned(), |s| s.name.clone())
}

/// Returns true if a view is on screen; else tells the user.
fn has_view(app: &mut App) -> bool {
    let has_view = app.viewport.picture().is_some();
    if !has_view {
        app.state.toast(Tone::Warning, "Nothing to save yet: open a scene first.");
    }
    has_view
}

pub(super) fn is_saved(app: &mut App, path: PathBuf) {
    app.state.toast(Tone::Good, format!("Saved to {}", path.display()));
}

/// Asks for a file, and writes the Gaussians that `of` selects in its format.
fn gaussians(app: &mut App, name: &str, of: impl FnOnce(&mut App) -> Option<Arc<GaussianCloud>> + 'static) {
    let title = "Export Gaussians";
    app.choose(FileRequest::save(title, format!("{name}.ply")), |app, path| {
        let Some(cloud) = of(app) else { return };
        let info = JobInfo::short(format!("Writing {}", file_name(&path)));
        let write = move |observer: &mut dyn Observer| {
            let views = LossViews::of_cloud(&cloud);
            export_splat::run(&cloud, &path, Some(&views), observer)?.tell_loss(observer);
            Ok::<_, crate::jobs::JobError>(path)
        };
        app.start(info, write, is_saved);
    });
}

pub(in crate::ui) fn all_gaussians(app: &mut App) {
    let name = scene_name(app);
    if has_view(app) {
        gaussians(app, &name, |app| app.viewport.cloud().map(|cloud| Arc::clone(cloud)));
    }
}

/// Exports the Gaussians of an identity.
pub(in crate::ui) fn identity(app: &mut App, id: IdentityId) {
    let Some(map) = app.state.semantics.clone() else { return };
    if super::view::is_empty(app, id) || !has_view(app) {
        return;
    }
    gaussians(app, &export::identity_name(&map.identities, id), move |app| {
        let map = app.state.semantics.as_ref()?;
        Some(Arc::new(app.viewport.cloud()?.select(&map.members(id))))
    });
}

/// Exports the Gaussians that the tool selects.
pub(in crate::ui) fn selection(app: &mut App) {
    let selected = app.viewport.selected_gaussians().map(|of| of.iter().map(|i| *i as usize).collect::<Vec<_>>());
    let Some((selected, cloud)) = selected.zip(app.viewport.cloud()) else {
        return app.state.toast(Tone::Info, "No Gaussians are selected: choose 'Select Gaussians by…' first.");
    };
    let (of, name) = (Arc::new(cloud.select(&selected)), format!("{}-selection", scene_name(app)));
    gaussians(app, &name, |_| Some(of));
}

/// Exports the Gaussians that the crop box keeps.
pub(in crate::ui) fn crop(app: &mut App) {
    if !has_view(app) {
        return;
    }
    if app.viewport.visibility.crop().is_none() {
        return app.state.toast(Tone::Info, "There is no crop box yet: press B.");
    }
    let name = format!("{}-cropped", scene_name(app));
    gaussians(app, &name, |app| {
        let kept = export::cropped(app.viewport.cloud()?, &app.viewport.visibility.crop()?);
        kept.map_err(|e| app.state.toast(Tone::Warning, format!("Nothing is exported: {e}."))).ok().map(Arc::new)
    });
}

/// Writes every object and part into a folder, and their masks in the photos, if there are any.
pub(in crate::ui) fn all_objects(app: &mut App) {
    app.choose(FileRequest::folder("Choose an empty folder for all objects and parts"), |app, folder| {
        let Some(SceneContext { cloud, map: Some(map), settings, scene, .. }) = SceneContext::new(app) else {
            return app.state.toast(Tone::Warning, "Find objects first: there is nothing to export yet.");
        };
        let photos = scene.dataset.iter().flat_map(|d| &d.photos);
        let views = photos.map(|p| (p.name.clone(), p.camera.clone())).collect();
        let (masks, format) = (MaskFormat::ALL.to_vec(), SplatFormat::Ply);
        let info = JobInfo::long(format!("Writing {}", file_name(&folder))).pausable();
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
    let request = FileRequest::save("Export page", format!("{}.html", scene_name(app)));
    app.choose(request, |app, out| {
        let Some(SceneContext { scene, cloud, map, settings, cameras, .. }) = SceneContext::new(app) else { return };
        if let Err(e) = export::check(&out, &page_job::ENDINGS, &[&scene.path]) {
            return app.state.fail("Exporting the page", Failure::of(&e, ""));
        }
        let mut paths = page_job::paths_in(&scene.out);
        let own = &app.camera.path;
        if !own.keys.is_empty() && paths.iter().all(|(_, path)| path != own) {
            paths.insert(0, ("Camera path".to_owned(), own.clone()));
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
    let request = FileRequest::save("Save the view", format!("{}.png", scene_name(app)));
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
    let request = FileRequest::save("Save the camera path", format!("{}-path.json", scene_name(app)));
    app.choose(request, |app, path| match camera::write(&path, &app.camera.path, app.viewport.aspect()) {
        Ok(()) => is_saved(app, path),
        Err(message) => app.state.fail("Saving the camera path", Failure::new(message, "")),
    });
}

/// Exports a video of the loaded flight or path.
pub(in crate::ui) fn video(app: &mut App) {
    let request = FileRequest::save("Export video", format!("{}.mp4", scene_name(app)));
    app.choose(request, |app, out| {
        let Some(SceneContext { cloud, map, settings: draw, aspect, .. }) = SceneContext::new(app) else { return };
        let Some((cameras, settings)) = app.camera.video(&out, aspect) else {
            let text = "Nothing to export: add keyframes, or fly to an object first.";
            return app.state.toast(Tone::Warning, text);
        };
        let found = app.viewport.queries.found();
        let marked = map.filter(|_| app.camera.mark).map(|map| (Arc::clone(&map), found));
        let info = JobInfo::long(format!("Rendering {}", file_name(&out))).pausable();
        let (cloud, backend) = (Arc::clone(&cloud), BackendChoice::Auto);
        let request = VideoRequest { cloud, draw, cameras, marked, out, settings, backend };
        app.start(info, move |observer| video_job::run(request, observer).map(|video| video.summary.path), is_saved);
    });
}

/// Writes the conversation with the agent.
pub(in crate::ui) fn conversation(app: &mut App) {
    let request = FileRequest::save("Save the conversation", format!("{}-conversation.md", scene_name(app)));
    app.choose(request, |app, path| {
        let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let Some(text) = app.chat.transcript(json).map(str::to_owned) else { return };
        match export::text(&path, &text) {
            Ok(()) => is_saved(app, path),
            Err(e) => app.state.fail("Saving the conversation", Failure::of(&e, "")),
        }
    });
}
