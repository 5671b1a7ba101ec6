//! The log.

use egui::{RichText, ScrollArea, Ui};

use super::super::ctx::Ctx;
use super::super::state::LogLine;
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use crate::math::format;

/// The pane.
pub(crate) struct LogPane;

impl PaneContents for LogPane {
    /// Draws the log, newest line at the bottom.
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, _: &mut Viewport) {
        let state = cx.state;
        ui.horizontal(|ui| {
            ui.label(RichText::new("Log").strong());
            ui.weak(format::things(state.log.len(), "line"));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.small_button("Copy all").clicked() {
                    let lines: Vec<String> = state.log.iter().map(LogLine::dated).collect();
                    ui.ctx().copy_text(lines.join("\n"));
                }
            });
        });
        let height = ui.text_style_height(&egui::TextStyle::Monospace);
        ScrollArea::vertical().auto_shrink([false, false]).stick_to_bottom(true).show_rows(
            ui,
            height,
            state.log.len(),
            |ui, rows| {
                for line in state.log.range(rows) {
                    ui.label(RichText::new(line.dated()).monospace().color(theme::tone_color(line.tone)));
                }
            },
        );
    }
}
