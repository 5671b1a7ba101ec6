//! The bar at the top (menus, name of the scene) and the bar at the bottom (the running job).

use std::time::{Duration, Instant};

use egui::{Align, Button, Layout, Response, RichText, Stroke, Ui, vec2};
use strum::VariantArray;

use super::super::ctx::Ctx;
use super::super::short_names::short_path;
use super::super::state::RunningJob;
use super::super::toasts::{self, ToastClick};
use super::super::viewport::Viewport;
use super::super::{keys, theme};
use crate::remote::LinkStatus;
use crate::scene::{NO_IDENTITY, text};
use crate::ui::actions::{Action, Axis, Face, Pane, THEMES};
use crate::ui::select_shape::SelectShape;
use crate::worker::ViewMode;

/// Indent of entries in a menu with switches.
const INDENT: &str = "     ";

/// Least room for a job's progress beside a message, points.
const CROWDED_PT: f32 = 800.0;

/// Least room for the name of the device that draws, points.
const DRAWN_BY_PT: f32 = 130.0;

/// Width of the pause and resume button, points.
const PAUSE_PT: f32 = 62.0;

/// Draws the bar at the top.
pub(crate) fn top(ui: &mut Ui, cx: &mut Ctx<'_>, view: &Viewport) {
    let (state, second) = (cx.state, view.queries.is_second());
    ui.horizontal(|ui| {
        let has_scene = state.scene.is_some();
        let has_photos = state.scene.as_ref().is_some_and(|s| s.dataset.is_some());
        let has_any_photos = has_photos || !state.located.is_empty();
        ui.menu_button("File", |ui| {
            ui.set_min_width(260.0);
            for action in
                [Action::OpenDemo, Action::TrainDemo, Action::OpenFolder, Action::OpenFile, Action::ChooseReport]
            {
                item(ui, true, None, action, cx);
            }
            ui.menu_button("Open recent", |ui| {
                if state.recent.is_empty() {
                    ui.weak("Nothing yet");
                }
                for path in &state.recent {
                    let known = state.recent_scenes.iter().find(|known| known.path == *path);
                    let name = known.map_or_else(|| text::path(path), |known| known.name.clone());
                    let place = short_path(path, &state.recent, 48);
                    let button = ui.add(Button::new(text::elided(&name, 56)).shortcut_text(place));
                    if button.on_hover_text(text::path(path)).clicked() {
                        cx.ask(Action::Open(path.clone()));
                    }
                    for run in known.map_or(&[][..], |known| &known.runs) {
                        if ui.button(format!("{INDENT}{}", run.text())).clicked() {
                            cx.ask(Action::Open(run.folder.clone()));
                        }
                    }
                }
            });
            ui.separator();
            item(ui, has_scene, None, Action::ExportPly, cx);
            item(ui, has_scene, None, Action::ExportCrop, cx);
            item(ui, state.semantics.is_some(), None, Action::ExportAll, cx);
            item(ui, has_scene, None, Action::ExportPage, cx);
            item(ui, has_scene, None, Action::Screenshot, cx);
            ui.separator();
            let is_result = state.scene.as_ref().is_some_and(|scene| scene.method.is_some());
            if is_result {
                item(ui, true, None, Action::ChooseImport, cx);
            }
            let why = state.why_no_added_photos();
            for action in [Action::AddFolder, Action::AddPhoto] {
                let shown = entry(ui, why.is_none(), None, &action.text(), action, cx);
                shown.on_disabled_hover_text(why.as_deref().unwrap_or_default());
            }
            item(ui, has_scene, None, Action::SaveCopy, cx);
            item(ui, has_scene, None, Action::ShowFolder(None), cx);
            item(ui, has_scene, None, Action::DeleteRemoved, cx);
            ui.separator();
            item(ui, true, None, Action::Quit, cx);
        });
        ui.menu_button("Edit", |ui| {
            ui.set_min_width(260.0);
            for (action, what) in [(Action::Undo, state.changes.last()), (Action::Redo, state.changes.next())] {
                let text = what.map_or_else(|| action.text(), |what| format!("{}: {what}", action.text()));
                entry(ui, what.is_some(), None, &text, action, cx);
            }
            ui.separator();
            item(ui, state.semantics.is_some(), None, Action::Rename, cx);
            item(ui, state.semantics.is_some(), None, Action::Isolate(None), cx);
        });
        ui.menu_button("View", |ui| {
            ui.set_min_width(280.0);
            ui.menu_button(format!("{INDENT}Show"), |ui| {
                for &mode in ViewMode::VARIANTS {
                    item(ui, has_scene, Some(*cx.layout.mode_of(second) == mode), Action::Show(mode), cx);
                }
            });
            ui.separator();
            item(ui, has_any_photos, Some(cx.layout.cameras), Action::ToggleCameras, cx);
            let has_measured = !view.measurements.is_empty();
            item(ui, has_measured, Some(cx.layout.measurements), Action::ToggleMeasurements, cx);
            item(ui, has_any_photos, Some(cx.layout.compare), Action::ToggleCompare, cx);
            item(ui, has_scene, Some(false), Action::ChoosePhoto, cx);
            item(ui, has_scene, Some(cx.layout.split_view), Action::ToggleSplit, cx);
            item(ui, cx.layout.split_view, Some(false), Action::OtherView, cx);
            item(ui, has_scene, Some(false), Action::ChooseComparison, cx);
            item(ui, !state.beside.is_empty(), Some(false), Action::CloseComparison(None), cx);
            item(ui, state.semantics.is_some(), Some(cx.layout.dim), Action::ToggleDim, cx);
            item(ui, has_scene, Some(cx.layout.times), Action::ToggleTimes, cx);
            ui.separator();
            for action in [Action::FrameScene, Action::ResetView] {
                item(ui, has_scene, Some(false), action, cx);
            }
            item(ui, has_scene, Some(view.is_orthographic()), Action::Orthographic, cx);
            ui.menu_button(format!("{INDENT}Look from"), |ui| {
                for &face in Face::VARIANTS {
                    item(ui, has_scene, Some(false), Action::LookFrom(face), cx);
                }
            });
            ui.menu_button(format!("{INDENT}Up direction"), |ui| {
                for &axis in Axis::VARIANTS {
                    item(ui, has_scene, Some(false), Action::TurnUp(axis), cx);
                }
            });
            for action in [Action::PreviousPhoto, Action::NextPhoto] {
                item(ui, has_any_photos, Some(false), action, cx);
            }
            ui.separator();
            item(ui, has_scene, Some(false), Action::FillWindow, cx);
            ui.menu_button(format!("{INDENT}Panes"), |ui| {
                for &pane in Pane::VARIANTS {
                    item(ui, true, Some(cx.layout.shows(pane)), Action::TogglePane(pane), cx);
                }
                ui.separator();
                item(ui, true, Some(false), Action::ResetPanes, cx);
            });
            ui.menu_button(format!("{INDENT}Theme and text size"), |ui| {
                for theme in THEMES {
                    item(ui, true, Some(cx.layout.theme == theme), Action::UseTheme(theme), cx);
                }
                ui.separator();
                for action in [Action::LargerText, Action::SmallerText, Action::NormalText] {
                    item(ui, true, Some(false), action, cx);
                }
            });
        });
        ui.menu_button("Tools", |ui| {
            ui.set_min_width(220.0);
            for action in [Action::Measure, Action::Crop, Action::Inspect, Action::SegmentNew(Some(NO_IDENTITY))] {
                item(ui, has_scene, None, action, cx);
            }
            ui.menu_button("Select Gaussians", |ui| {
                for shape in SelectShape::VARIANTS {
                    item(ui, has_scene, None, Action::SelectBy(*shape), cx);
                }
            });
            item(ui, state.is_trained() && state.job.is_none(), None, Action::MeasureSplats, cx);
        });
        ui.menu_button("Train", |ui| {
            ui.set_min_width(260.0);
            let trains_here = has_photos && state.scene.as_ref().is_some_and(|s| s.remote.is_none());
            item(ui, trains_here && state.job.is_none(), None, Action::StartTraining, cx);
            item(ui, trains_here && state.job.is_none() && state.can_begin_anew(), None, Action::TrainAnew, cx);
            item(ui, state.job.as_ref().is_some_and(|j| j.info.can_pause), None, Action::PauseJob, cx);
            item(ui, state.job.is_some(), None, Action::Cancel, cx);
            item(ui, trains_here && state.job.is_none(), None, Action::Evaluate, cx);
        });
        ui.menu_button("Help", |ui| {
            ui.set_min_width(240.0);
            for action in [Action::Guide, Action::Shortcuts, Action::Palette] {
                item(ui, true, None, action, cx);
            }
            ui.separator();
            for action in [Action::News, Action::About] {
                item(ui, true, None, action, cx);
            }
        });
        if let Some(scene) = &state.scene {
            ui.separator();
            ui.label(RichText::new(&scene.name).strong()).on_hover_text(text::path(scene.stored()));
            if let Some(origin) = &scene.remote {
                ui.label(RichText::new(format!("on {}", origin.host)).color(theme::weak()));
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let search = Button::new(RichText::new("Search actions").color(theme::weak()))
                .shortcut_text(keys::label(ui.ctx(), &Action::Palette));
            if ui.add(search).on_hover_text(Action::Palette.tooltip()).clicked() {
                cx.ask(Action::Palette);
            }
        });
    });
}

/// A menu entry; `on` is the state of a switch, which is named by its target.
fn item(ui: &mut Ui, enabled: bool, on: Option<bool>, action: Action, cx: &mut Ctx<'_>) {
    let text = match &action {
        Action::ToggleCameras => "Cameras".to_owned(),
        Action::ToggleMeasurements => "Measurements".to_owned(),
        Action::ToggleTimes => "Frame times".to_owned(),
        Action::TogglePane(pane) => pane.text().to_owned(),
        other => other.text(),
    };
    entry(ui, enabled, on, &text, action, cx);
}

fn entry(ui: &mut Ui, enabled: bool, on: Option<bool>, text: &str, action: Action, cx: &mut Ctx<'_>) -> Response {
    // All entries of a menu with switches leave room for the check mark.
    let text = if on.is_some() { format!("{INDENT}{text}") } else { text.to_owned() };
    let button = Button::new(text).shortcut_text(keys::label(ui.ctx(), &action));
    let shown = ui.add_enabled(enabled, button).on_hover_text(action.tooltip());
    if on == Some(true) {
        let at = shown.rect.left_center() + vec2(12.0, 0.0);
        let check = [vec2(-4.5, 0.0), vec2(-1.5, 3.5), vec2(4.5, -4.0)].map(|v| at + v);
        ui.painter().line(check.to_vec(), Stroke::new(1.8, theme::accent()));
    }
    if shown.clicked() {
        cx.ask(action);
    }
    shown
}

/// Draws the bar at the bottom; returns the click on its message.
pub(crate) fn status(ui: &mut Ui, cx: &mut Ctx<'_>, view: &Viewport) -> Option<ToastClick> {
    let (state, mut clicked) = (cx.state, None);
    let has_view = state.scene.is_some() || view.shows_growth();
    ui.horizontal(|ui| {
        match &state.job {
            Some(job) => {
                dot(ui, if job.paused { theme::warning() } else { theme::accent() });
                // The training pane and the first page have their own buttons.
                let is_in_pane = state.shown_training().is_some() && cx.layout.shows(Pane::Training);
                if !job.canceling && has_view && !is_in_pane {
                    job_buttons(ui, job, cx);
                }
                ui.label(RichText::new(job.text()).strong());
                // A message goes first where there is no room for both.
                let has_room = state.toasts.is_empty() || ui.available_width() > CROWDED_PT;
                let shown = has_room && has_view && !job.canceling;
                if job.progress.is_some() && shown {
                    progress(ui, job);
                }
            }
            None if !state.toasts.is_empty() => {}
            None => {
                ui.label(
                    RichText::new(if state.scene.is_some() { "Ready" } else { "Nothing open" }).color(theme::weak()),
                );
            }
        }
        if let Some(link) = &state.link {
            connection(ui, link);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let log = ui.selectable_label(cx.layout.shows(Pane::Log), "Log");
            if log.on_hover_text("Show or hide the log").clicked() {
                cx.ask(Action::TogglePane(Pane::Log));
            }
            if let Some(p) = view.picture().filter(|_| ui.available_width() > DRAWN_BY_PT) {
                let text = RichText::new(format!("Rendered on {}", p.drawn_by)).small();
                match &p.instead_of_gpu {
                    Some(why) => ui.label(text.color(theme::warning())).on_hover_text(why),
                    None => ui.label(text.color(theme::weak())),
                };
            }
            let row = Layout::left_to_right(Align::Center);
            clicked = ui.with_layout(row, |ui| toasts::show(ui, &state.toasts)).inner;
        });
    });
    clicked
}

/// State of the connection to another computer.
fn connection(ui: &mut Ui, link: &LinkStatus) {
    let host = &link.host;
    let (color, text) = match (link.connected, link.retry_at) {
        (true, _) => (theme::good(), format!("Connected to {host}")),
        (false, Some(at)) => {
            let secs = at.saturating_duration_since(Instant::now()).as_secs_f64().ceil();
            ui.ctx().request_repaint_after(Duration::from_secs(1));
            (theme::warning(), format!("No connection to {host}, trying again in {secs} s"))
        }
        (false, None) if link.problem.is_some() => (theme::warning(), format!("Not connected to {host}")),
        (false, None) => return,
    };
    ui.add_space(8.0);
    dot(ui, color);
    let shown = ui.label(RichText::new(text).color(if link.connected { theme::weak() } else { color }));
    shown.on_hover_text(match &link.problem {
        Some(problem) => format!("{problem}\nThe scene on screen stays."),
        None => "The scene comes from there; it is rendered and queried here.".into(),
    });
}

/// The buttons stand before all texts, which change width, so that neither moves under the pointer.
fn job_buttons(ui: &mut Ui, job: &RunningJob, cx: &mut Ctx<'_>) {
    if job.info.can_pause {
        let pause = Button::new(if job.paused { "Resume" } else { "Pause" }).small();
        if ui.add(pause.min_size(vec2(PAUSE_PT, 0.0))).on_hover_text("T").clicked() {
            cx.ask(Action::PauseJob);
        }
    }
    if ui.small_button("Stop").accessible_name(Action::Cancel.text()).on_hover_text("Esc").clicked() {
        cx.ask(Action::Cancel);
    }
}

/// A small disc as a sign of a running job.
fn dot(ui: &mut Ui, color: egui::Color32) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
    ui.painter().circle_filled(rect.center(), 4.0, color);
}

fn progress(ui: &mut Ui, job: &RunningJob) {
    match job.fraction() {
        None if job.paused => {}
        None => drop(ui.add(egui::Spinner::new().size(12.0))),
        Some(fraction) => {
            let fill = if job.paused { theme::warning() } else { theme::accent() };
            ui.add(egui::ProgressBar::new(fraction).desired_width(140.0).desired_height(6.0).fill(fill));
        }
    }
    ui.label(RichText::new(job.stage_text()).color(theme::weak()));
}
