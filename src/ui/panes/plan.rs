//! Decisions on what is left out for this scene, their reasons and savings, and the user's overrides.

use egui::{ComboBox, RichText, Ui};

use super::super::ctx::Ctx;
use super::super::theme;
use super::super::viewport::Viewport;
use super::PaneContents;
use crate::scene::Overrides;
use crate::scene::plan::{PlanLine, PlanOverride};

/// Label of the plan's own choice.
const AUTO: &str = "auto";

/// The plan, one decision after another.
pub(crate) struct PlanPane;

impl PaneContents for PlanPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, _: &mut Viewport) {
        for line in &cx.state.plan.lines {
            let overrides = &mut cx.layout.plan;
            egui::Frame::new().inner_margin(egui::Margin::symmetric(0, 2)).show(ui, |ui| {
                ui.spacing_mut().item_spacing.y = 2.0;
                ui.horizontal(|ui| {
                    ui.label(RichText::new(line.subject).strong());
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| choose(ui, line, overrides));
                });
                if !line.overridden {
                    ui.label(&line.choice);
                }
                ui.label(RichText::new(&line.reason).small().color(theme::weak()));
                if !line.saving.is_empty() {
                    let (word, color) =
                        if line.overridden { ("Costs", theme::warning()) } else { ("Saves", theme::good()) };
                    ui.label(RichText::new(format!("{word} {}", line.saving)).small().color(color));
                }
            });
            ui.separator();
        }
    }

    fn scrolls(&self) -> bool {
        true
    }
}

/// The choice between the decision from the data and its alternative, if there is one.
fn choose(ui: &mut Ui, line: &PlanLine, overrides: &mut Overrides) {
    let Some(item) = line.overridable else { return };
    let mut instead = line.overridden;
    let shown = if instead { item.alternative() } else { AUTO };
    let combo = ComboBox::from_id_salt(("plan", line.item)).selected_text(shown).width(76.0).show_ui(ui, |ui| {
        ui.selectable_value(&mut instead, false, AUTO);
        ui.selectable_value(&mut instead, true, item.alternative());
    });
    let label = || format!("{}: choice", line.subject);
    combo.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, label()));
    if instead != line.overridden {
        overrides.set(PlanOverride { item, instead });
    }
}
