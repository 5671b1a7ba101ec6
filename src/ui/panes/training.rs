//! Settings, progress and plots of training.

use egui::{ComboBox, DragValue, Grid, RichText, Slider, Ui};

use super::super::ctx::Ctx;
use super::super::layout::Layout;
use super::super::next_step::next_step;
use super::super::state::{AppState, RunningJob};
use super::super::viewport::Viewport;
use super::super::{keys, theme};
use super::PaneContents;
use super::plots::{self, PsnrCurve};
use crate::jobs::presets;
use crate::math::format;
use crate::pipeline::train::TrainConfig;
use crate::scene::{AlphaUse, text};
use crate::ui::actions::Action;
use crate::worker::Makes;

/// The pane.
#[derive(Default)]
pub(crate) struct TrainingPane {
    /// Curves of a report, drawn beside those of this training.
    pub(crate) curves: Vec<PsnrCurve>,
}

impl PaneContents for TrainingPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, _: &mut Viewport) {
        let state = cx.state;
        let Some(scene) = &state.scene else { return };
        let Some(dataset) = &scene.dataset else {
            ui.add_space(6.0);
            ui.weak(
                "This scene has no photos, so there is nothing to train on. Open a folder of posed photos to train.",
            );
            return;
        };
        let job = state.shown_training();
        match job {
            Some(job) => running(ui, job, cx),
            None if scene.remote.is_some() => {
                let host = scene.remote.as_ref().map_or("", |origin| &origin.host);
                ui.weak(format!("The scene is on {host}. To train there: fmlgs train PHOTOS --serve"));
            }
            None => {
                let largest =
                    dataset.photos.iter().map(|p| p.camera.width_px.max(p.camera.height_px)).max().unwrap_or(1);
                settings(ui, &mut cx.layout.config, largest);
                start(ui, cx);
                place(ui, cx);
            }
        }
        if !state.history.steps.is_empty() || !state.history.evaluations.is_empty() {
            facts(ui, state, job);
            plots::show(ui, [&state.history, &state.previous], &self.curves, &mut cx.layout.plots);
        } else if job.is_none() {
            ui.add_space(4.0);
            ui.weak("Loss and PSNR appear here once training runs.");
        }
    }

    fn scrolls(&self) -> bool {
        true
    }
}

fn start(ui: &mut Ui, cx: &mut Ctx<'_>) {
    let state = cx.state;
    ui.add_space(2.0);
    let (busy, next) = (state.job.is_some(), next_step(state));
    ui.horizontal_wrapped(|ui| {
        let after = match &next {
            Some(Action::FindObjects) if state.scene.as_ref().is_some_and(|s| s.masks.is_none()) => {
                "Find objects\u{2026}"
            }
            Some(Action::FindObjects) => "Find objects",
            Some(Action::TypeQuery) => "Query an object",
            _ => "",
        };
        if let Some(action) = next.as_ref().filter(|_| !after.is_empty()) {
            let tip = format!("{}  {}", action.tooltip(), keys::label(ui.ctx(), action));
            if ui.add(theme::primary_button(after).min_size(egui::vec2(120.0, 30.0))).on_hover_text(tip).clicked() {
                cx.ask(action.clone());
            }
        }
        let tip = format!("{}  {}", Action::StartTraining.tooltip(), keys::label(ui.ctx(), &Action::StartTraining));
        let config = state.next_training(&cx.layout.config);
        let steps = format::count(config.steps);
        let before = state.resumable.as_ref().filter(|(before, _)| before.is_same_but_for_steps(&config));
        let is_done = before.is_some_and(|(_, step)| *step >= config.steps);
        let text = match state.continues_at(&config) {
            Some(step) if before.is_some_and(|(before, _)| before.steps == config.steps) => {
                format!("Continue ({} of {steps})", format::count(step))
            }
            Some(step) => format!("Go on from {} steps", format::count(step)),
            None if is_done => "Continue training".to_owned(),
            None => "Start training".to_owned(),
        };
        let is_next = next == Some(Action::StartTraining);
        let button = if is_next { theme::primary_button(&text) } else { egui::Button::new(text) };
        let why = match busy {
            true => "Another job is running.".to_owned(),
            false => format!("All {steps} steps are done: raise Steps to go on, or begin anew."),
        };
        let button = ui.add_enabled(!busy && !is_done, button.min_size(egui::vec2(110.0, 30.0)));
        if button.on_hover_text(tip).on_disabled_hover_text(why).clicked() {
            cx.ask(Action::StartTraining);
        }
        if state.can_begin_anew() {
            let anew = ui.add_enabled(!busy, egui::Button::new("Begin anew").min_size(egui::vec2(90.0, 30.0)));
            if anew.on_hover_text(Action::TrainAnew.tooltip()).clicked() {
                cx.ask(Action::TrainAnew);
            }
        }
        let trained = state.training_job.is_some() || state.scene.as_ref().is_some_and(|s| s.trained);
        let can_measure = trained && !busy;
        let measure = ui.add_enabled(can_measure, egui::Button::new("Evaluate").min_size(egui::vec2(80.0, 30.0)));
        if measure
            .on_hover_text(Action::Evaluate.tooltip())
            .on_disabled_hover_text("Needs trained Gaussians.")
            .clicked()
        {
            cx.ask(Action::Evaluate);
        }
    });
}

/// Place of the scene, with what can be done there.
fn place(ui: &mut Ui, cx: &mut Ctx<'_>) {
    let state = cx.state;
    let Some(scene) = state.scene.as_ref().filter(|s| state.is_trained() && s.is_stored()) else { return };
    ui.add_space(2.0);
    let place = format!("Saved in {}", text::elided(&scene.out.to_string_lossy(), 44));
    ui.label(RichText::new(place).small().color(theme::weak())).on_hover_text(text::path(&scene.out));
    ui.horizontal(|ui| {
        for (name, action) in [("Show in folder", Action::ShowFolder(None)), ("Save a copy\u{2026}", Action::SaveCopy)]
        {
            let button = ui.add_enabled(state.job.is_none(), egui::Button::new(name).small());
            if button.on_hover_text(action.tooltip()).on_disabled_hover_text("Another job is running.").clicked() {
                cx.ask(action);
            }
        }
    });
}

fn settings(ui: &mut Ui, config: &mut TrainConfig, largest_px: u32) {
    Grid::new("settings").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        let label = |ui: &mut Ui, text: &str, tip: &str| ui.label(text).on_hover_text(tip).id;
        let id = label(ui, "Steps", "Total optimizer steps; every schedule scales with it.");
        ui.add(DragValue::new(&mut config.steps).range(100..=100_000).speed(50)).labelled_by(id);
        ui.end_row();
        let id = label(ui, "Longest side", "Size of the training images; photos are never enlarged.");
        // Small photos limit the range shown here, not the stored setting.
        let range = 64..=largest_px.clamp(65, 4096);
        let mut side = config.max_side_px.clamp(64, *range.end());
        if ui.add(Slider::new(&mut side, range).suffix(" px")).labelled_by(id).changed() {
            config.max_side_px = side;
        }
        ui.end_row();
        let id = label(ui, "Color", "Highest spherical-harmonics degree; 0 = view-independent color.");
        ui.add(Slider::new(&mut config.sh_degree, 0..=3).prefix("SH degree ")).labelled_by(id);
        ui.end_row();
        let id = label(ui, "Holdout", "Photos kept for evaluation. Datasets that mark test photos use those.");
        let shown = |n: f64, _: std::ops::RangeInclusive<usize>| match n as u64 {
            0 => "none".to_owned(),
            n => format!("1 of {n}"),
        };
        ui.add(DragValue::new(&mut config.holdout_every).range(0..=100).speed(0.1).custom_formatter(shown))
            .labelled_by(id);
        ui.end_row();
        let id = label(ui, "Gaussians", "Adds Gaussians where detail is missing; removes transparent ones.");
        ui.checkbox(&mut config.densify, "densify and prune").labelled_by(id);
        ui.end_row();
    });
    ui.collapsing("Advanced", |ui| {
        ui.checkbox(&mut config.antialias, "Anti-aliasing (2-D filter of Mip-Splatting)");
        let tip = "For poses that are a little off, as those of phones and of video are. The drift is told at the end; on \
                   the CPU.";
        ui.checkbox(&mut config.refine_poses, "Refine the photos' poses").on_hover_text(tip);
        let tip = "For photos that differ in brightness or white balance; on the CPU.";
        ui.checkbox(&mut config.exposure, "Learn the photos' exposures").on_hover_text(tip);
        ui.horizontal(|ui| {
            let tip = "Meaning of the photos' transparent pixels: ignored, empty space around a cut-out object, or the \
                       background's color.";
            let id = ui.label("Transparent pixels").on_hover_text(tip).id;
            let all = [None, Some(AlphaUse::Ignore), Some(AlphaUse::Empty), Some(AlphaUse::Background)];
            let name = |alpha: Option<AlphaUse>| alpha.map_or("by the photos", AlphaUse::word);
            let list = ComboBox::from_id_salt("alpha").selected_text(name(config.alpha));
            let shown = list.show_ui(ui, |ui| {
                all.into_iter().for_each(|alpha| drop(ui.selectable_value(&mut config.alpha, alpha, name(alpha))));
            });
            shown.response.labelled_by(id);
        });
        let mut limited = config.max_gaussians.is_some();
        ui.horizontal(|ui| {
            if ui.checkbox(&mut limited, "Limit Gaussians to").changed() {
                config.max_gaussians = limited.then_some(200_000);
            }
            if let Some(n) = &mut config.max_gaussians {
                ui.add(DragValue::new(n).range(1_000..=6_000_000).speed(1000)).accessible_name("Maximum Gaussians");
            } else {
                ui.weak("automatic: by photo size and free memory");
            }
        });
        ui.horizontal(|ui| {
            let id = ui.label("Evaluate every").id;
            ui.add(DragValue::new(&mut config.eval_every).range(0..=100_000).speed(10).suffix(" steps"))
                .labelled_by(id);
        });
        ui.horizontal(|ui| {
            let id = ui.label("Seed").id;
            ui.add(DragValue::new(&mut config.seed)).labelled_by(id);
        });
        ui.horizontal(|ui| {
            let tip = "A trained scene keeps them as training.toml; drop such a file onto the window to use them.";
            if ui.button("Copy settings as TOML").on_hover_text(tip).clicked() {
                ui.ctx().copy_text(presets::text(config));
            }
            if ui.button("Defaults").on_hover_text("Reset all training settings.").clicked() {
                *config = Layout::default().config;
            }
        });
    });
}

fn running(ui: &mut Ui, job: &RunningJob, cx: &mut Ctx<'_>) {
    if job.info.makes == Makes::SceneBeside {
        ui.label(RichText::new(&job.info.title).color(theme::weak()));
    }
    let done = job.fraction().unwrap_or(0.0);
    let text = job.progress.as_ref().map_or_else(
        || "starting".to_owned(),
        |p| format!("{}  {} of {}", p.stage, format::count(p.done), format::count(p.total)),
    );
    ui.label(RichText::new(if job.paused { format!("{text}  (paused)") } else { text }).strong());
    ui.add(egui::ProgressBar::new(done).desired_height(6.0).fill(if job.paused {
        theme::warning()
    } else {
        theme::accent()
    }));
    ui.horizontal(|ui| {
        let pause = if job.paused { "Resume" } else { "Pause" };
        let size = egui::vec2(92.0, 28.0);
        let tip = format!("{}  T", Action::PauseJob.tooltip());
        let button = if job.paused { theme::primary_button(pause) } else { egui::Button::new(pause) };
        if ui.add(button.min_size(size)).on_hover_text(tip).clicked() {
            cx.ask(Action::PauseJob);
        }
        let stop = Action::Cancel;
        let button = ui.add(egui::Button::new("Stop").min_size(size)).accessible_name(stop.text());
        if button.on_hover_text(format!("{}  Esc", stop.tooltip())).clicked() {
            cx.ask(stop);
        }
    });
}

/// Draws the current figures of the training.
fn facts(ui: &mut Ui, state: &AppState, job: Option<&RunningJob>) {
    ui.add_space(4.0);
    let last = state.history.steps.last();
    let held = state.history.evaluations.last();
    let progress = job.and_then(|j| j.progress.as_ref());
    let dash = || "–".to_owned();
    let best = state.history.evaluations.iter().map(|e| e.psnr).fold(f64::NAN, f64::max);
    let left = [
        ("Held-out PSNR", held.map_or_else(dash, |e| format::decibel(e.psnr))),
        ("Held-out SSIM", held.map_or_else(dash, |e| format!("{:.3}", e.ssim))),
        ("Best PSNR", format::decibel(best)),
        (
            "Gaussians",
            last.map(|m| m.gaussians).or(held.map(|e| e.gaussians)).map_or_else(dash, |n| format::count(n as u64)),
        ),
    ];
    let right = [
        ("Loss", last.map_or_else(dash, |m| format!("{:.4}", m.loss))),
        ("Rate", progress.map_or_else(dash, |p| format::rate(p.rate, "steps"))),
        ("Elapsed", last.map(|m| m.secs).or(held.map(|e| e.secs)).map_or_else(dash, format::duration)),
        ("Remaining", job.and_then(|j| j.left_secs).map_or_else(dash, format::about)),
    ];
    egui::Frame::new().fill(theme::surface()).corner_radius(8).inner_margin(10).show(ui, |ui| {
        ui.columns_const(|[a, b]| {
            for (ui, rows) in [(a, &left), (b, &right)] {
                ui.spacing_mut().item_spacing.y = 3.0;
                for (name, value) in rows {
                    ui.horizontal(|ui| {
                        ui.label(RichText::new(*name).small().color(theme::weak()));
                        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                            ui.label(RichText::new(value).strong());
                        });
                    });
                }
            }
        });
    });
}
