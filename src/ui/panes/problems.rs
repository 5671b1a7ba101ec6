//! Problems of the open scene, over the view: each with its reason and remedy.

use egui::{Button, Frame, Margin, Panel, RichText, Ui};

use super::super::state::{AppState, Tone};
use super::super::theme;

/// Largest number of problems on screen; the log has all.
const MOST: usize = 3;

/// Draws a line for each problem, until it is dismissed.
pub(crate) fn show(ui: &mut Ui, state: &mut AppState) {
    if state.problems.is_empty() {
        return;
    }
    let bar =
        Frame::new().fill(theme::panel().lerp_to_gamma(theme::warning(), 0.16)).inner_margin(Margin::symmetric(10, 6));
    let (mut dismissed, mut all) = (None, false);
    Panel::top("problems").frame(bar).show(ui, |ui| {
        for (i, (_, text)) in state.problems.iter().enumerate().take(MOST) {
            ui.horizontal(|ui| {
                theme::mark(ui, Tone::Warning, 18.0);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.add(Button::new("Dismiss").small()).clicked() {
                        dismissed = Some(i);
                    }
                    let rest = egui::Layout::left_to_right(egui::Align::Center);
                    ui.with_layout(rest, |ui| ui.add(egui::Label::new(text).wrap()));
                });
            });
        }
        let more = state.problems.len().saturating_sub(MOST);
        if more > 0 {
            ui.horizontal(|ui| {
                ui.label(RichText::new(format!("{more} more in the log")).small().color(theme::weak()));
                all = ui.add(Button::new("Dismiss all").small()).clicked();
            });
        }
    });
    if let Some(i) = dismissed {
        state.problems.remove(i);
    }
    if all {
        state.problems.clear();
    }
}
