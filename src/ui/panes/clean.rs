//! Cleaning: what was measured of the Gaussians, a choice among them that is seen in the view, and a button that
//! deletes it.

use std::sync::Arc;

use egui::{Button, Checkbox, ComboBox, DragValue, RichText, Ui};
use strum::VariantArray;

use super::super::state::AppState;
use super::super::theme;
use super::super::viewport::chosen::ChosenSplats;
use super::histogram::Histogram;
use crate::jobs::clean::{self, CleanRule, CloudMeasures, MeasuredCloud, SplatMeasure};
use crate::math::format;
use crate::scene::GaussianCloud;
use crate::ui::actions::Action;
use crate::worker::JobKind;

/// The pane.
#[derive(Default)]
pub(crate) struct CleanPane {
    measured: Option<Arc<MeasuredCloud>>,
    /// How many each rule means, and whether it is chosen.
    rules: Vec<(CleanRule, usize, bool)>,
    /// The measure whose values are shown, and the range of them that is chosen.
    measure: Option<SplatMeasure>,
    histogram: Histogram,
    range: Option<[f32; 2]>,
    /// Whether what is chosen is left out of the view; else it is marked.
    hide: bool,
    chosen: Option<Arc<ChosenSplats>>,
    /// What was deleted last, until the Gaussians without it are on screen.
    deleted: Option<Arc<ChosenSplats>>,
}

impl CleanPane {
    /// Takes over new measures, and follows the Gaussians on screen. What is to be seen as chosen.
    pub(crate) fn update(
        &mut self,
        state: &mut AppState,
        cloud: Option<&Arc<GaussianCloud>>,
        is_shown: bool,
    ) -> Option<Arc<ChosenSplats>> {
        if let Some(measured) = state.splats_measured.take() {
            self.take(measured);
        }
        let is_of = |m: &Arc<MeasuredCloud>| cloud.is_some_and(|c| Arc::ptr_eq(c, &m.cloud));
        if let (Some(measured), Some(cloud)) = (self.measured.take_if(|m| !is_of(m)), cloud) {
            // What is left of them is known; pieces and distances are as they were.
            let deleted = self.deleted.take().filter(|d| d.of.len() - d.count == cloud.len());
            (self.chosen, self.rules, self.measure) = (None, Vec::new(), None);
            if let Some(deleted) = deleted {
                let measures = measured.measures.without(&deleted.of);
                self.take(Arc::new(MeasuredCloud { cloud: Arc::clone(cloud), measures }));
            }
        }
        self.chosen.clone().filter(|_| is_shown)
    }

    /// What is chosen, to be deleted.
    pub(crate) fn take_chosen(&mut self) -> Option<Vec<bool>> {
        self.deleted = self.chosen.clone().filter(|c| c.count > 0);
        self.deleted.as_ref().map(|c| c.of.clone())
    }

    fn take(&mut self, measured: Arc<MeasuredCloud>) {
        let count = |rule: CleanRule| {
            let chosen = rule.choose(&measured.measures).ok()?;
            Some((rule, chosen.iter().filter(|c| **c).count(), false))
        };
        self.rules = CleanRule::NAMED.into_iter().filter_map(count).collect();
        (self.measured, self.measure, self.range, self.chosen) = (Some(measured), None, None, None);
    }

    /// Draws the pane.
    pub(crate) fn show(&mut self, ui: &mut Ui, state: &AppState, actions: &mut Vec<Action>) {
        if !state.is_trained() {
            ui.weak("Trained Gaussians can be cleaned: open a trained scene or a splat, or train one.");
            return;
        }
        let running = state.job.as_ref().is_some_and(|j| j.kind == JobKind::Clean);
        let Some(measured) = self.measured.clone() else {
            ui.label("Floaters, needles and haze are found by what the photos show of each Gaussian.");
            ui.add_space(6.0);
            let button = theme::primary_button(if running { "Measuring\u{2026}" } else { "Measure Gaussians" });
            if ui.add_enabled(state.job.is_none(), button).on_hover_text(Action::MeasureSplats.tooltip()).clicked() {
                actions.push(Action::MeasureSplats);
            }
            return;
        };
        let before = (self.rules.clone(), self.range, self.measure, self.hide);
        theme::section(ui, "Suspects");
        for (rule, count, chosen) in &mut self.rules {
            ui.horizontal(|ui| {
                let (name, enabled) = (title(rule), *count > 0);
                ui.add_enabled(enabled, Checkbox::new(chosen, name)).on_hover_text(rule.meaning());
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.label(RichText::new(format::count(*count as u64)).color(theme::weak()));
                });
            });
        }
        if measured.measures.get(SplatMeasure::Weight).is_none() {
            ui.weak("The photos are not known, so nothing is known of what they show.");
        }
        theme::section(ui, "By a measure");
        self.show_measure(ui, &measured.measures);
        theme::section(ui, "Chosen");
        if before != (self.rules.clone(), self.range, self.measure, self.hide) {
            self.choose(&measured);
        }
        let (count, all) = (self.chosen.as_ref().map_or(0, |c| c.count), measured.cloud.len());
        let share = format::number(100.0 * count as f64 / all.max(1) as f64);
        ui.label(format!("{} of {} Gaussians ({share} %)", format::count(count as u64), format::count(all as u64)));
        ui.horizontal(|ui| {
            ui.radio_value(&mut self.hide, false, "Mark").on_hover_text("Show them in magenta.");
            ui.radio_value(&mut self.hide, true, "Hide").on_hover_text("Show the scene without them.");
        });
        if before.3 != self.hide {
            self.choose(&measured);
        }
        ui.horizontal(|ui| {
            let delete = Action::DeleteChosen;
            let is_some = count > 0 && count < all;
            let button = ui.add_enabled(is_some, theme::primary_button("Delete"));
            if button.on_hover_text(delete.tooltip()).clicked() {
                actions.push(delete);
            }
            if ui.add_enabled(count > 0, Button::new("Choose none")).clicked() {
                self.rules.iter_mut().for_each(|r| r.2 = false);
                (self.range, self.chosen) = (None, None);
            }
        });
    }

    fn show_measure(&mut self, ui: &mut Ui, of: &CloudMeasures) {
        let chosen = self.measure.map_or("none", SplatMeasure::word);
        ComboBox::from_id_salt("measure").selected_text(chosen).show_ui(ui, |ui| {
            for &measure in SplatMeasure::VARIANTS {
                let Some(values) = of.get(measure) else { continue };
                let row = ui.selectable_label(self.measure == Some(measure), measure.word());
                if row.on_hover_text(measure.meaning()).clicked() {
                    (self.measure, self.range) = (Some(measure), None);
                    self.histogram = Histogram::new(values, measure.is_logarithmic());
                }
            }
        });
        let Some(measure) = self.measure else {
            ui.weak("Choose a measure, and drag over its histogram.");
            return;
        };
        ui.weak(measure.meaning());
        self.histogram.show(ui, &mut self.range);
        ui.horizontal(|ui| {
            let mut ends = self.range.unwrap_or(self.histogram.ends());
            let before = ends;
            let speed = (self.histogram.ends()[1] - self.histogram.ends()[0]).abs() / 500.0;
            for (end, name) in ends.iter_mut().zip(["From", "To"]) {
                ui.label(name);
                ui.add(DragValue::new(end).speed(speed).max_decimals(4)).accessible_name(name);
            }
            if ends != before && ends.iter().all(|v| v.is_finite()) {
                self.range = Some([ends[0].min(ends[1]), ends[0].max(ends[1])]);
            }
        });
    }

    /// Chooses what rules and range mean.
    fn choose(&mut self, measured: &MeasuredCloud) {
        let mut rules: Vec<CleanRule> = self.rules.iter().filter(|r| r.2).map(|r| r.0).collect();
        rules.extend(self.measure.zip(self.range).map(|(m, [from, to])| CleanRule::Range(m, from, to)));
        let chosen = clean::choose(&rules, &measured.measures).ok().filter(|c| !c.is_empty());
        self.chosen = chosen.map(|of| Arc::new(ChosenSplats::new(of, self.hide)));
    }
}

/// A rule as a user sees it.
fn title(rule: &CleanRule) -> String {
    super::super::edits::sentence(&rule.to_string())
}
