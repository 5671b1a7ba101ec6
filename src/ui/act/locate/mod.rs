//! Photos that nobody posed: where they were taken, and how they are compared with the scene.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Context;

use crate::jobs::JobError;
use crate::jobs::go_to::{self, FlightRequest};
use crate::jobs::locate::kept::PhotoLocator;
use crate::jobs::locate::{LocatedPhoto, PICTURES, file_name, write};
use crate::math::format;
use crate::navigate::{FRAMES, Pose};
use crate::pipeline::observer::Observer;
use crate::ui::app::App;
use crate::ui::arrival::PhotoArrival;
use crate::ui::color_by::ColorBy;
use crate::ui::context::SceneContext;
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::{Failure, JobInfo, ViewMode};

pub(in crate::ui) fn choose(app: &mut App) {
    if app.state.scene.is_none() {
        return app.state.toast(Tone::Info, "Open a scene first: photos are located in it.");
    }
    let formats = vec![FileFormat::new("Photos", &PICTURES)];
    app.choose(FileRequest::file(FileKind::Pictures, "Locate a photo", formats), |app, path| start(app, vec![path]));
}

/// Locates in the Gaussians on screen; the error says why that is impossible.
pub(in crate::ui) fn locator(app: &mut App) -> Result<PhotoLocator, &'static str> {
    let context = SceneContext::new(app).filter(|_| app.state.is_trained());
    let Some(SceneContext { scene, cloud, settings, .. }) = context else {
        return Err("the scene is not trained yet");
    };
    let number = app.state.scene_number;
    if let Some((of, known)) = &app.locator
        && *of == number
        && known.is_of(&cloud, &settings)
    {
        return Ok(known.clone());
    }
    let new = PhotoLocator::of_opened(&scene, Arc::clone(&cloud), settings, app.layout.config.holdout_every)
        .ok_or("no photo or camera of this scene is known; open it with its photos")?;
    app.locator = Some((number, new.clone()));
    Ok(new)
}

/// Locates photos, and shows the first that shows the scene.
pub(in crate::ui) fn start(app: &mut App, paths: Vec<PathBuf>) {
    let mut paths: Vec<PathBuf> =
        paths.iter().map(|path| path.canonicalize().unwrap_or_else(|_| path.into())).collect();
    paths.retain(|path| !app.state.located.running.contains(path));
    let title = match paths.as_slice() {
        [] => return app.state.toast(Tone::Info, "It is being located already."),
        [one] => format!("Locating {}", file_name(one)),
        all => format!("Locating {} photos", all.len()),
    };
    let locator = match locator(app) {
        Ok(locator) => locator,
        Err(why) => {
            let what = if let [one] = paths.as_slice() { file_name(one) } else { format::things(paths.len(), "photo") };
            return app.state.toast(Tone::Warning, format!("{what} cannot be located: {why}."));
        }
    };
    app.state.located.running.extend(paths.iter().cloned());
    paths.iter().rev().for_each(|path| app.state.located.give(path.clone()));
    let (scene, files, never_begun) = (app.state.scene_number, paths.clone(), paths.clone());
    let work = move |observer: &mut dyn Observer| locate_all(&locator, &paths, observer);
    let is_begun = app.start_to_end(JobInfo::urgent(title), work, move |app, _, found| {
        if scene != app.state.scene_number {
            return;
        }
        ended(app, &files);
        found.into_iter().flatten().enumerate().for_each(|(i, photo)| take(app, photo, i == 0));
    });
    match app.state.job.as_ref().map(|job| job.info.title.clone()) {
        _ if !is_begun => ended(app, &never_begun),
        Some(running) => app.state.toast(Tone::Info, format!("It begins once \u{201c}{running}\u{201d} has ended.")),
        None => {}
    }
}

/// Locates photos one after another, those that show the scene first in the result. If it is stopped, what was found
/// before stays.
fn locate_all(
    locator: &PhotoLocator,
    paths: &[PathBuf],
    observer: &mut dyn Observer,
) -> Result<Vec<LocatedPhoto>, JobError> {
    let mut found: Vec<LocatedPhoto> = Vec::with_capacity(paths.len());
    for path in paths {
        match locator.locate(path, observer) {
            Ok(photo) => found.push(photo),
            Err(error) if error.is_cancelled() && !found.is_empty() => break,
            Err(error) => return Err(error),
        }
    }
    found.sort_by_key(|photo| !photo.located);
    Ok(found)
}

/// Forgets that files are being located.
fn ended(app: &mut App, files: &[PathBuf]) {
    app.state.located.running.retain(|path| !files.contains(path));
}

/// Takes over what was found of a photo; goes there if `goes` and it was located.
fn take(app: &mut App, found: LocatedPhoto, goes: bool) {
    if !found.located {
        return app.state.toast(Tone::Warning, found.refusal_text());
    }
    if !goes {
        app.state.located.add(found);
        return;
    }
    let Some(place) = &found.place else { return };
    let Some(SceneContext { cloud, cameras, up, eye, explored, .. }) = SceneContext::new(app) else { return };
    let (name, to) = (found.name(), Pose::of(&place.camera));
    let request = FlightRequest { explored, cloud: Arc::clone(&cloud), cameras, up, from: eye, to, frames: FRAMES };
    let search = move |_: &mut dyn Observer| Ok::<_, JobError>(go_to::fly_to_pose(request));
    let info = JobInfo::short(format!("Planning the flight to {name}"));
    app.start_in_scene(info, search, |app, flown| {
        let Some((explored, flight)) = flown else { return };
        app.state.explored = Some(explored);
        if let Some(flight) = flight {
            app.camera.play_flight(flight, name);
        }
        show(app, found, false);
    });
}

/// Shows a located photo once the camera is there: beside the rendering, or as a difference.
pub(in crate::ui) fn show(app: &mut App, found: LocatedPhoto, differs: bool) {
    let photo = found.photo.clone();
    app.state.located.give(photo.clone());
    if app.state.located.add(found).is_some() {
        app.arrival = Some(PhotoArrival { scene: app.state.scene_number, photo, differs });
    }
}

/// Looks through the photo that the camera has flown to, and forgets what belongs to a scene that is closed.
pub(in crate::ui) fn keep_up(app: &mut App, ctx: &Context) {
    let scene = app.state.scene_number;
    app.locator.take_if(|(of, _)| *of != scene);
    app.arrival.take_if(|arrival| arrival.scene != scene);
    if app.camera.is_on_way() {
        return;
    }
    let Some(arrival) = app.arrival.take() else { return };
    let Some(index) = app.state.located.place_of(&arrival.photo).map(|at| app.state.own_photos() + at) else { return };
    let now = ctx.input(|i| i.time);
    app.viewport.look_through(index, &app.state, &app.tasks, now);
    app.viewport.queries.tint(ColorBy::Masks);
    let mode = &mut app.layout.mode;
    match (arrival.differs, *mode) {
        (true, _) => *mode = ViewMode::Difference,
        // A photo beside itself compares nothing.
        (false, ViewMode::Photo) => *mode = ViewMode::Rgb,
        (false, _) => {}
    }
    app.layout.compare |= !arrival.differs;
    ctx.request_repaint();
}

/// Index among the located photos of the one that is looked through, or else of the latest.
fn current(app: &mut App) -> Option<usize> {
    let own = app.state.own_photos();
    let shown = app.viewport.photo_index().and_then(|index| index.checked_sub(own));
    let current = shown.or(app.state.located.len().checked_sub(1));
    if current.is_none() {
        app.state.toast(Tone::Info, "No photo was located in this scene yet: drop one on the view.");
    }
    current
}

/// Takes a photo off the list, and ends its comparison.
pub(in crate::ui) fn forget(app: &mut App) {
    let Some(at) = current(app) else { return };
    if app.viewport.photo_index() == Some(app.state.own_photos() + at) {
        app.viewport.leave_photo();
        app.layout.compare = false;
        if app.layout.mode.needs_photo() {
            app.layout.mode = ViewMode::Rgb;
        }
    }
    if let Some(removed) = app.state.located.remove(at) {
        let name = removed.found.name();
        app.state.toast(Tone::Info, format!("{name} is off the list; its file stays."));
    }
}

/// Writes the pose of a located photo.
pub(in crate::ui) fn save_pose(app: &mut App) {
    let Some(at) = current(app) else { return };
    let Some(found) = app.state.placed(app.state.own_photos() + at).map(|placed| placed.found.clone()) else { return };
    let formats = vec![FileFormat::new("Poses (.json)", &[".json"])];
    let folder = found.photo.parent().map(Path::to_path_buf);
    let request = FileRequest::save(FileKind::Photos, "Save its pose beside the photo", "transforms", formats);
    app.choose(request.within(folder), move |app, out| {
        let reads: Vec<PathBuf> =
            app.state.scene.iter().flat_map(|scene| scene.reads()).map(Path::to_path_buf).collect();
        let mut reads: Vec<&Path> = reads.iter().map(PathBuf::as_path).collect();
        reads.push(&found.photo);
        let done = write::check(&out, std::slice::from_ref(&found.photo), &reads)
            .and_then(|()| write::transforms(&out, std::slice::from_ref(&found)));
        match done {
            Ok(()) => app.state.result(format!("Saved to {}", out.display())),
            Err(e) => app.state.fail("Saving the pose", Failure::of(&e, "")),
        }
    });
}

#[cfg(test)]
mod tests;
