//! The Report pane without a report: its purpose, and the ways to get one.

use egui::{RichText, Ui, vec2};

use super::super::super::ctx::Ctx;
use super::super::super::state::{AppState, RunningJob};
use super::super::super::theme;
use crate::scene::text;
use crate::ui::actions::Action;

/// Draws the pane without a report; `job` is the running benchmark, if there is one.
pub(crate) fn show(ui: &mut Ui, job: Option<&RunningJob>, cx: &mut Ctx<'_>) {
    let state = cx.state;
    ui.label(RichText::new("Error vs. run time").strong());
    ui.label(
        "A report holds measurements of every setting that trades accuracy for time. Click a point to apply its \
         setting.",
    );
    ui.add_space(6.0);
    if let Some(job) = job {
        ui.strong(&job.info.title);
        if let Some(p) = &job.progress {
            let share = p.done as f32 / p.total.max(1) as f32;
            ui.add(egui::ProgressBar::new(share).desired_width(320.0).desired_height(6.0).fill(theme::accent()));
            ui.weak(format!(
                "{} of {} measurements. Do not move the view: rendering distorts the times.",
                p.done, p.total
            ));
        } else {
            ui.weak("Rendering the exact reference images.");
        }
        let button = ui.add(egui::Button::new("Stop").min_size(vec2(92.0, 28.0)));
        if button.accessible_name(Action::Cancel.text()).clicked() {
            cx.ask(Action::Cancel);
        }
        return;
    }
    ui.horizontal_wrapped(|ui| {
        let size = vec2(0.0, 28.0);
        if state.is_trained() {
            let button = theme::primary_button("Benchmark rendering").min_size(size);
            let response = ui.add_enabled(state.job.is_none(), button);
            let disabled = "Another job is running; it would distort the times.";
            if response.on_hover_text(Action::BenchmarkRendering.tooltip()).on_disabled_hover_text(disabled).clicked() {
                cx.ask(Action::BenchmarkRendering);
            }
        }
        let open = ui.add(egui::Button::new("Open a report\u{2026}").min_size(size));
        if open.on_hover_text(Action::ChooseReport.tooltip()).clicked() {
            cx.ask(Action::ChooseReport);
        }
        for path in state.scene.iter().flat_map(|s| &s.reports) {
            let found = ui.add(egui::Button::new(format!("Open {}", text::path(path))).min_size(size));
            if found.on_hover_text("This report was found with the scene.").clicked() {
                cx.ask(Action::OpenReport(path.clone()));
            }
        }
    });
    ui.add_space(6.0);
    ui.weak("All stages (training, finding objects, queries, camera paths, depth) are measured on the command line:");
    ui.horizontal(|ui| {
        let command = command(state);
        ui.label(RichText::new(&command).monospace().color(theme::accent()));
        if ui.small_button("Copy").clicked() {
            ui.ctx().copy_text(command);
        }
    });
    ui.weak("Then drop the report folder onto the window.");
}

/// The command that measures the open scene.
fn command(state: &AppState) -> String {
    let trained = state.scene.as_ref().filter(|_| state.is_trained());
    // A scene that was trained here is its own folder; a splat is its own file.
    let scene = trained.map(|s| if s.out.as_os_str().is_empty() { &s.path } else { &s.out });
    let scene = scene.map_or_else(|| "SCENE".to_owned(), |path| text::shell_word(&path.display().to_string()));
    format!("fmlgs report {scene} --out report")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_pasted() {
        assert_eq!(command(&AppState::default()), "fmlgs report SCENE --out report");
    }
}
