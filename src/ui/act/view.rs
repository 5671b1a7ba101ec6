//! The view: its camera, its colors, and the selection.

use std::collections::BTreeSet;
use std::sync::Arc;

use egui::Context;
use glam::DVec3;

use super::{remote, window};
use crate::jobs::JobError;
use crate::jobs::go_to::{self, ApproachRequest, Approached};
use crate::navigate::FRAMES;
use crate::navigate::target::{Side, ViewPreference};
use crate::pipeline::observer::Observer;
use crate::scene::{Camera, CameraPath, CropBox, Identities, IdentityId, NO_IDENTITY, SemanticMap};
use crate::ui::actions::{Face, Pane};
use crate::ui::app::App;
use crate::ui::color_by::ColorBy;
use crate::ui::context::SceneContext;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::labels;
use crate::ui::state::Tone;
use crate::worker::{JobInfo, Versioned, ViewMode};

fn now(ctx: &Context) -> f64 {
    ctx.input(|i| i.time)
}

pub(in crate::ui) fn frame(app: &mut App, ctx: &Context) {
    app.viewport.frame(&app.state, now(ctx));
}

pub(in crate::ui) fn reset(app: &mut App, ctx: &Context) {
    app.viewport.reset_view(&app.state, now(ctx));
}

pub(in crate::ui) fn look_from(app: &mut App, ctx: &Context, face: Face) {
    app.viewport.look_from(face, &app.state, now(ctx));
}

pub(in crate::ui) fn toggle_orthographic(app: &mut App, ctx: &Context) {
    app.viewport.toggle_orthographic(now(ctx));
}

pub(in crate::ui) fn turn_up(app: &mut App, ctx: &Context, up: DVec3) {
    if app.state.scene.is_some() {
        app.viewport.turn_up(up, now(ctx));
    }
}

pub(in crate::ui) fn set_crop(app: &mut App, crop: Option<CropBox>) {
    if app.state.scene.is_some() {
        app.viewport.set_crop(crop);
    }
}

/// Looks through the next photo's camera, or through the one `by` photos on.
pub(in crate::ui) fn step_photo(app: &mut App, ctx: &Context, by: isize) {
    app.viewport.step_photo(by, &app.state, &app.tasks, now(ctx));
}

pub(in crate::ui) fn go_to_photo(app: &mut App, ctx: &Context, index: usize) {
    app.viewport.look_through(index, &app.state, &app.tasks, now(ctx));
}

/// Chooses what the active view shows, without a tint; with Shift, a tint stays over it. A difference from a photo needs
/// the nearest one.
pub(in crate::ui) fn show(app: &mut App, ctx: &Context, mode: ViewMode) {
    *app.layout.mode_of(app.viewport.queries.is_second()) = mode;
    if mode == ViewMode::Rgb || !ctx.input(|i| i.modifiers.shift) {
        app.viewport.queries.tint(ColorBy::Masks);
    }
    if mode.needs_photo() && app.viewport.photo_index().is_none() {
        visit_photo(app, ctx, app.layout.compare);
    }
}

/// Looks through the camera of the nearest photo until nothing needs it; `compared` tells whether the comparison was on
/// before.
fn visit_photo(app: &mut App, ctx: &Context, compared: bool) {
    if let Some(photo) = nearest_photo(app, &BTreeSet::new()) {
        app.viewport.visit_photo(photo, &app.state, &app.tasks, compared, now(ctx));
    }
}

/// Tints the rendered image of the active view, or ends that; with Shift, whatever the view shows.
pub(in crate::ui) fn tint(app: &mut App, ctx: &Context, by: ColorBy) {
    if !ctx.input(|i| i.modifiers.shift) {
        *app.layout.mode_of(app.viewport.queries.is_second()) = ViewMode::Rgb;
    }
    app.viewport.queries.tint(by);
}

/// Photo that looks most like the view, by place and direction, without those to be `left_out`.
pub(in crate::ui) fn nearest_photo(app: &App, left_out: &BTreeSet<usize>) -> Option<usize> {
    let photos = &app.state.scene.as_ref()?.dataset.as_ref()?.photos;
    let all: Vec<usize> = (0..photos.len()).filter(|i| !left_out.contains(i)).collect();
    nearest_camera(app, all.iter().map(|i| &photos[*i].camera)).map(|k| all[k])
}

/// Place of the camera that looks most like the view, by place and direction.
pub(super) fn nearest_camera<'a>(app: &App, cameras: impl Iterator<Item = &'a Camera>) -> Option<usize> {
    let (size, eye) = (app.state.scene.as_ref()?.home.bounds.radius(), app.viewport.pose());
    let away = |camera: &Camera| {
        let turn = 1.0 - (camera.world_from_camera * DVec3::Z).dot(eye.world_from_camera * DVec3::Z);
        camera.center.distance(eye.center) / size + turn
    };
    cameras.map(away).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

/// Shows the photo beside the rendering, or not.
pub(in crate::ui) fn toggle_compare(app: &mut App, ctx: &Context) {
    app.layout.compare = !app.layout.compare;
    if app.layout.compare && app.viewport.photo_index().is_none() {
        visit_photo(app, ctx, false);
    }
}

/// Splits the view in two, or ends that. What is asked for or selected, and seen, stays in view.
pub(in crate::ui) fn toggle_split(app: &mut App) {
    if let Some(bounds) = chosen_identity(app).and_then(|id| app.viewport.bounds_of(id, &app.state))
        && app.viewport.sees(&bounds)
    {
        app.viewport.ask_for(bounds);
    }
    app.layout.split_view = !app.layout.split_view;
    app.viewport.queries.work_in(app.layout.split_view);
}

/// Makes the other one of two views active.
pub(in crate::ui) fn other_view(app: &mut App) {
    match app.layout.split_view {
        true => app.viewport.queries.work_in(!app.viewport.queries.is_second()),
        false => app.state.toast(Tone::Info, "There is one view: split it first (8)."),
    }
}

/// Ends the first of these that is there: the tool, the selection, the full view, the running job.
pub(in crate::ui) fn dismiss(app: &mut App, ctx: &Context) {
    if app.viewport.has_tool() {
        app.viewport.end_tool();
    } else if app.viewport.picking.selected().is_some() {
        app.viewport.picking.select(None);
    } else if app.full_view {
        window::fill(app, ctx);
    } else if let Some(job) = app.state.job.as_ref().filter(|job| !job.canceling) {
        let text = job.stop_question();
        let question = Question { text, yes: "Stop", other: None, no: "Keep running", deletes: false };
        app.put_question(question, |app, answer| {
            if answer == DialogAnswer::Yes {
                remote::cancel_job(app);
            }
        });
    }
}

/// Returns true, with a message, if an identity has no Gaussians.
pub(super) fn is_empty(app: &mut App, id: IdentityId) -> bool {
    let Some(map) = app.state.semantics.as_ref().filter(|_| app.state.is_empty(id)) else { return false };
    let name = app.state.labels.full_name(&map.identities, id);
    app.state.toast(Tone::Warning, format!("{name} is empty: no Gaussians belong to it."));
    true
}

/// Selected identity, or else the first answer to the query.
pub(in crate::ui) fn chosen_identity(app: &App) -> Option<IdentityId> {
    app.viewport.picking.selected().or_else(|| app.viewport.queries.found().first().copied())
}

/// Does this to the selected identity, if there is one.
fn with_selected(app: &mut App, act: impl FnOnce(&mut App, IdentityId)) {
    match chosen_identity(app) {
        Some(id) => act(app, id),
        None => app.state.toast(Tone::Info, "Nothing is selected: click an object in the view, or press N."),
    }
}

pub(in crate::ui) fn isolate_selected(app: &mut App) {
    with_selected(app, |app, id| {
        let only = Some(id).filter(|_| !app.viewport.visibility.is_isolated());
        isolate(app, only);
    });
}

pub(in crate::ui) fn hide_selected(app: &mut App) {
    with_selected(app, hide);
}

pub(in crate::ui) fn go_to_selected(app: &mut App) {
    with_selected(app, |app, id| go_to(app, id, Side::Best));
}

/// Shows only an identity, or everything.
pub(in crate::ui) fn isolate(app: &mut App, only: Option<IdentityId>) {
    if only.is_some_and(|id| is_empty(app, id)) {
        return;
    }
    if let Some(map) = &app.state.semantics {
        app.viewport.visibility.isolate(&map.identities, only);
    }
}

/// Hides an identity, or shows it again.
pub(in crate::ui) fn hide(app: &mut App, id: IdentityId) {
    if let Some(map) = &app.state.semantics {
        app.viewport.visibility.toggle(&map.identities, id);
    }
}

/// The objects and parts, or a message that there are none.
fn objects(app: &mut App) -> Option<Versioned<SemanticMap>> {
    let map = app.state.semantics.clone();
    if map.is_none() {
        app.state.toast(Tone::Info, "There are no objects yet: find them first (Ctrl+P, Find objects and parts).");
    }
    map
}

/// Selects the next object or part among its siblings, in the order of the list, or the previous one.
pub(in crate::ui) fn select_sibling(app: &mut App, back: bool) {
    let Some(map) = objects(app) else { return };
    let selected = app.viewport.picking.selected();
    let parent = selected.and_then(|id| map.identities.get(id)).map_or(NO_IDENTITY, |i| i.parent);
    let list = listed(&map.identities, &app.state.sizes, parent);
    let at = selected.and_then(|id| list.iter().position(|i| *i == id));
    let step = if back { list.len().saturating_sub(1) } else { 1 };
    let first = if back { list.last() } else { list.first() };
    if let Some(next) = at.map_or(first, |at| list.get((at + step) % list.len())) {
        app.viewport.picking.select(Some(*next));
    }
}

/// Selects the first part of the selection.
pub(in crate::ui) fn select_part(app: &mut App) {
    let Some(map) = objects(app) else { return };
    let Some(whole) = chosen_identity(app) else {
        return app.state.toast(Tone::Info, "Nothing is selected: press N first.");
    };
    match listed(&map.identities, &app.state.sizes, whole).first() {
        Some(part) => app.viewport.picking.select(Some(*part)),
        None => {
            let name = app.state.labels.full_name(&map.identities, whole);
            app.state.toast(Tone::Info, format!("{name} has no parts."));
        }
    }
}

/// Selects the whole that the selection is a part of.
pub(in crate::ui) fn select_whole(app: &mut App) {
    let Some(map) = objects(app) else { return };
    match chosen_identity(app) {
        Some(part) => app.viewport.picking.select(map.identities.ancestors(part).nth(1).or(Some(part))),
        None => app.state.toast(Tone::Info, "Nothing is selected: press N first."),
    }
}

/// Parts of an identity, or all objects, in the order of the list.
fn listed(all: &Identities, sizes: &[usize], of: IdentityId) -> Vec<IdentityId> {
    let ids = all.iter().filter(|(_, i)| i.parent == of).map(|(id, _)| id).collect();
    let (mut shown, mut tiny) = labels::listed(all, sizes, ids);
    shown.append(&mut tiny);
    shown
}

/// Searches a flight to an identity, and begins it when it is found.
pub(in crate::ui) fn go_to(app: &mut App, id: IdentityId, side: Side) {
    if is_empty(app, id) {
        return;
    }
    let Some(SceneContext { cloud, map: Some(map), settings, cameras, up, eye, aspect, explored, .. }) =
        SceneContext::new(app)
    else {
        return;
    };
    let title = format!("Planning the flight to {}", map.identities.full_name(id));
    let (cloud, map, from, frames) = (Arc::clone(&cloud), Arc::clone(&map), eye, FRAMES);
    let preference = ViewPreference { side, ..ViewPreference::default() };
    let request = ApproachRequest { explored, cloud, cameras, up, settings, map, id, preference, from, aspect, frames };
    let search = move |_: &mut dyn Observer| Ok::<_, JobError>(go_to::visit(request));
    app.start_in_scene(JobInfo::short(title), search, |app, found| {
        if let Some((explored, approached)) = found {
            app.state.explored = Some(explored);
            begin_flight(app, approached);
        }
    });
}

/// Begins the flight that was found, or reports why there is none.
fn begin_flight(app: &mut App, Approached { name, flight, problem }: Approached) {
    match (&problem, &flight) {
        (Some(problem), Some(_)) => {
            app.state.toast(Tone::Warning, format!("{name}: {problem}. Going to the nearest place instead."));
        }
        (Some(problem), None) => app.state.toast(Tone::Warning, format!("{name}: {problem}.")),
        (None, _) => {}
    }
    if let Some(visit) = flight {
        app.viewport.turn_about(visit.target);
        app.camera.play_flight(visit.flight, name);
    }
}

/// True if there is a flight or a path to play; else tells the user.
fn has_clip(app: &mut App) -> bool {
    let has_clip = app.camera.has_clip();
    if !has_clip {
        app.state.toast(Tone::Info, "Nothing to play: add keyframes (K), or go to an object first.");
    }
    has_clip
}

pub(in crate::ui) fn play_path(app: &mut App) {
    if has_clip(app) {
        app.camera.toggle();
    }
}

/// Moves along the camera path by some frames.
pub(in crate::ui) fn step_in_time(app: &mut App, ctx: &Context, frames: f64) {
    if has_clip(app)
        && let Some(pose) = app.camera.step(frames)
    {
        app.viewport.stand(&pose, &app.state, now(ctx));
    }
}

pub(in crate::ui) fn add_key(app: &mut App) {
    if let (number, Some(time)) = app.camera.record(&app.viewport.pose()) {
        app.state.toast(Tone::Info, format!("Inserted keyframe {number} at the playhead, {time:.2} s."));
    }
    app.layout.show(Pane::Camera);
}

/// Replaces the camera path by a turn around an identity, or else the selection, or else the scene, and plays it.
pub(in crate::ui) fn turntable(app: &mut App, id: Option<IdentityId>) {
    let Some(scene) = app.state.scene.clone() else {
        return app.state.toast(Tone::Info, "There is nothing to turn around: open a scene first.");
    };
    let of = id.or_else(|| chosen_identity(app));
    if of.is_some_and(|id| is_empty(app, id)) {
        return;
    }
    let bounds = of.and_then(|id| app.viewport.bounds_of(id, &app.state)).unwrap_or(scene.home.bounds);
    let Some(path) = app.viewport.pose().turntable(&bounds, app.viewport.up(&scene)) else {
        return app.state.toast(Tone::Warning, "There is no way around it from here: move the view first.");
    };
    if !app.camera.path.keys.is_empty() {
        app.state.toast(Tone::Info, "The turntable replaces the camera path; undo brings it back.");
    }
    app.viewport.turn_about(bounds.center());
    app.camera.repeat(CameraPath { fps: app.camera.path.fps, ..path });
    app.layout.show(Pane::Camera);
}

/// Moves the camera along the flight or path that plays.
pub(in crate::ui) fn play(app: &mut App, ctx: &Context) {
    let step = now(ctx) - std::mem::replace(&mut app.last_frame, now(ctx));
    if let Some(pose) = app.camera.tick(step) {
        app.viewport.stand(&pose, &app.state, now(ctx));
        ctx.request_repaint();
    }
    if app.viewport.take_new_picture() && app.camera.player.playing {
        app.camera.player.count(now(ctx));
    }
}
