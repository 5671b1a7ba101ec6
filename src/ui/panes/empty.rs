//! What the window shows before anything is open.

use egui::{Button, RichText, Ui, vec2};

use super::super::state::AppState;
use super::super::{format, keys, theme};
use crate::worker::Action;

/// Draws the first page.
pub fn show(ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
    let busy = state.job.is_some();
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
            if ui
                .add_enabled(!busy, button.min_size(wide))
                .on_hover_text(format!("{}  {key}", action.tooltip()))
                .clicked()
            {
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
                let name =
                    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
                let parent = path.parent().map(|p| format::shortened(&p.display().to_string(), 36)).unwrap_or_default();
                let row = Button::new(RichText::new(name).strong())
                    .right_text(RichText::new(parent).small().color(theme::WEAK))
                    .frame_when_inactive(false)
                    .min_size(vec2(420.0, 26.0));
                if ui.add_enabled(!busy, row).on_hover_text(path.display().to_string()).clicked() {
                    actions.push(Action::Open(path.clone()));
                }
            }
        }
    });
}
