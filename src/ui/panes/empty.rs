//! What the window shows before anything is open.

use std::path::Path;

use egui::{Button, ProgressBar, RichText, Ui, vec2};

use super::super::state::{AppState, RunningJob};
use super::super::{keys, theme};
use crate::math::format;
use crate::scene::text;
use crate::ui::actions::Action;
use crate::worker::JobKind;

/// Draws the first page.
pub(crate) fn show(ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
    if let Some(job) = &state.job {
        return busy(ui, job, actions);
    }
    let recent = state.recent.len().min(6);
    let height = 330.0 + if recent > 0 { 40.0 + 30.0 * recent as f32 } else { 0.0 };
    ui.vertical_centered(|ui| {
        ui.add_space(((ui.available_height() - height) * 0.45).max(20.0));
        ui.set_max_width(460.0);
        ui.label(RichText::new("FMLGS").size(34.0).strong().color(theme::TEXT));
        ui.label(RichText::new("From posed photos to live 3D Gaussians").size(16.0).color(theme::WEAK));
        ui.add_space(26.0);
        let wide = vec2(300.0, 38.0);
        let button = |ui: &mut Ui, button: Button<'_>, action: Action, actions: &mut Vec<Action>| {
            let key = keys::label(ui.ctx(), &action);
            if ui.add(button.min_size(wide)).on_hover_text(format!("{}  {key}", action.tooltip())).clicked() {
                actions.push(action);
            }
        };
        button(ui, theme::primary_button("Try the demo"), Action::TryDemo, actions);
        button(ui, Button::new("Open folder…"), Action::OpenFolder, actions);
        button(ui, Button::new("Open file…"), Action::OpenFile, actions);
        ui.add_space(14.0);
        ui.label(RichText::new("or drop a folder or a file onto the window").color(theme::WEAK));
        ui.label(
            RichText::new("COLMAP  ·  transforms.json  ·  Blender  ·  LLFF  ·  splat .ply  ·  trained scene")
                .small()
                .color(theme::WEAK),
        );
        if recent > 0 {
            ui.add_space(22.0);
            ui.label(RichText::new("Recent").small().strong().color(theme::WEAK));
            for path in state.recent.iter().take(recent) {
                let name = text::path(path.file_name().map_or(path.as_path(), Path::new));
                let parent = path.parent().map(|p| text::elided(&p.to_string_lossy(), 36)).unwrap_or_default();
                let row = Button::new(RichText::new(name).strong())
                    .right_text(RichText::new(parent).small().color(theme::WEAK))
                    .frame_when_inactive(false)
                    .min_size(vec2(420.0, 26.0));
                if ui.add(row).on_hover_text(text::path(path)).clicked() {
                    actions.push(Action::Open(path.clone()));
                }
            }
        }
    });
}

/// The first page while the first scene is being read or made.
fn busy(ui: &mut Ui, job: &RunningJob, actions: &mut Vec<Action>) {
    ui.vertical_centered(|ui| {
        ui.add_space((ui.available_height() * 0.4).max(20.0));
        ui.set_max_width(380.0);
        ui.label(RichText::new(&job.title).size(20.0));
        ui.add_space(10.0);
        match &job.progress {
            Some(p) => {
                let fraction = p.done as f32 / p.total.max(1) as f32;
                ui.add(ProgressBar::new(fraction).desired_height(8.0).fill(theme::ACCENT));
                let left = p.eta_secs().map_or_else(String::new, |s| format!("  ·  {} left", format::duration(s)));
                let text = format!("{}  {} of {}{left}", p.stage, format::count(p.done), format::count(p.total));
                ui.label(RichText::new(text).color(theme::WEAK));
            }
            None => {
                ui.spinner();
            }
        }
        if job.kind == JobKind::Demo {
            ui.add_space(6.0);
            ui.label(RichText::new("The photos are rendered once; training then starts by itself.").color(theme::WEAK));
        }
        ui.add_space(14.0);
        if ui.add(Button::new("Cancel").min_size(vec2(110.0, 30.0))).clicked() {
            actions.push(Action::Cancel);
        }
    });
}
