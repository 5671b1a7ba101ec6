//! What is left out for this scene, why, and what that saves.

use egui::{RichText, Ui};

use super::super::theme;
use crate::scene::ScenePlan;

/// Draws the plan, one decision after another.
pub fn show(ui: &mut Ui, plan: &ScenePlan) {
    for line in &plan.lines {
        egui::Frame::new().inner_margin(egui::Margin::symmetric(0, 2)).show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            ui.horizontal(|ui| {
                ui.label(RichText::new(&line.subject).color(theme::WEAK));
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.add(egui::Label::new(RichText::new(&line.choice).strong()).truncate());
                });
            });
            ui.label(RichText::new(&line.reason).small().color(theme::WEAK));
            if !line.saving.is_empty() {
                ui.label(RichText::new(format!("Saves {}", line.saving)).small().color(theme::GOOD));
            }
        });
        ui.separator();
    }
}
