//! Cleaning: measures of the Gaussians, a choice among them that the view shows, and a button that deletes the chosen
//! ones.

use std::sync::Arc;

use egui::{Button, Checkbox, ComboBox, DragValue, RichText, Ui};
use strum::VariantArray;

use super::super::ctx::Ctx;
use super::super::labels::sentence;
use super::super::state::AppState;
use super::super::theme;
use super::super::viewport::Viewport;
use super::super::viewport::splat_selection::SplatSelection;
use super::PaneContents;
use super::histogram::Histogram;
use crate::jobs::clean::{self, CleanRule, CloudMeasures, MeasuredCloud, SplatMeasure};
use crate::math::format;
use crate::scene::{CropBox, GaussianCloud, IdentityId};
use crate::ui::actions::Action;

/// Initial color.
const FIRST_COLOR: [u8; 3] = [128; 3];

/// The pane.
#[derive(Default)]
pub(crate) struct CleanPane {
    /// True while Gaussians are measured; set by the window.
    pub(crate) measuring: bool,
    measured: Option<Arc<MeasuredCloud>>,
    /// Rules without numbers, with the number of Gaussians that each chooses.
    counts: Vec<(CleanRule, usize)>,
    histogram: Histogram,
    choice: SplatChoice,
    chosen: Option<Arc<SplatSelection>>,
    /// The Gaussians deleted last, until the cloud without them is on screen.
    deleted: Option<Arc<SplatSelection>>,
}

/// Choice of Gaussians, and its display.
#[derive(Clone, Debug, Default, PartialEq)]
struct SplatChoice {
    rules: Vec<CleanRule>,
    /// The measure of the histogram, and its chosen range.
    measure: Option<SplatMeasure>,
    range: Option<[f32; 2]>,
    /// Color of the Gaussians to choose.
    color: Option<[u8; 3]>,
    /// The crop box, if the Gaussians outside are chosen; the selected identity, if its Gaussians are.
    crop: Option<CropBox>,
    object: Option<IdentityId>,
    /// True if chosen Gaussians are hidden in the view; else they are marked.
    hide: bool,
}

impl CleanPane {
    /// Follows the cloud on screen. Returns the choice for the view.
    pub(crate) fn update(&mut self, cloud: Option<&Arc<GaussianCloud>>, is_shown: bool) -> Option<Arc<SplatSelection>> {
        let is_of = |m: &Arc<MeasuredCloud>| cloud.is_some_and(|c| Arc::ptr_eq(c, &m.cloud));
        if let (Some(measured), Some(cloud)) = (self.measured.take_if(|m| !is_of(m)), cloud) {
            // The measures of the remaining Gaussians stay valid; pieces and distances are kept as before.
            let deleted = self.deleted.take().filter(|d| d.of.len() - d.count == cloud.len());
            (self.chosen, self.choice) = (None, SplatChoice::default());
            if let Some(deleted) = deleted {
                let measures = measured.measures.without(&deleted.of);
                self.take(Arc::new(MeasuredCloud { cloud: Arc::clone(cloud), measures }));
            }
        }
        self.chosen.clone().filter(|_| is_shown)
    }

    /// Indices of the selected Gaussians, if there are any.
    pub(crate) fn chosen(&self) -> Option<Vec<u32>> {
        let chosen = self.chosen.as_ref().filter(|c| c.count > 0)?;
        Some((0..chosen.of.len() as u32).filter(|i| chosen.of[*i as usize]).collect())
    }

    /// Notes that these Gaussians will be deleted: the measures of the others stay.
    pub(crate) fn deletes(&mut self, gone: Arc<SplatSelection>) {
        self.deleted = Some(gone);
    }

    /// Takes over new measures.
    pub(crate) fn take(&mut self, measured: Arc<MeasuredCloud>) {
        let count = |rule: CleanRule| {
            let chosen = rule.choose(&measured.measures).ok()?;
            Some((rule, chosen.iter().filter(|c| **c).count()))
        };
        self.counts = CleanRule::NAMED.into_iter().filter_map(count).collect();
        (self.measured, self.choice, self.chosen) = (Some(measured), SplatChoice::default(), None);
    }

    fn choose(&mut self, measured: &MeasuredCloud, state: &AppState) {
        let of = self.choice.of(measured, state);
        self.chosen = of.map(|of| Arc::new(SplatSelection::new(of, self.choice.hide)));
    }

    /// Draws what is selected, and its uses; while the selection tool has them, only a word on that.
    fn show_chosen(&mut self, ui: &mut Ui, measured: &MeasuredCloud, is_selecting: bool, cx: &mut Ctx<'_>) {
        theme::section(ui, "Selected");
        let (count, all) = (self.chosen.as_ref().map_or(0, |c| c.count), measured.cloud.len());
        let share = format::percent(count as f64 / all.max(1) as f64);
        ui.label(format!("{} of {} Gaussians ({share})", format::count(count as u64), format::count(all as u64)));
        ui.horizontal(|ui| {
            theme::outlined(ui, |ui| {
                ui.radio_value(&mut self.choice.hide, false, "Mark").on_hover_text("Show them in magenta.");
                ui.radio_value(&mut self.choice.hide, true, "Hide").on_hover_text("Show the scene without them.");
            });
        });
        if is_selecting {
            ui.weak("The selection tool is in use: its card changes, keeps and deletes the selection.");
            return;
        }
        ui.horizontal(|ui| {
            let delete = Action::DeleteChosen;
            let button = ui.add_enabled(count > 0 && count < all, theme::primary_button("Delete"));
            if button.on_hover_text(delete.tooltip()).clicked() {
                cx.ask(delete);
            }
            let by_hand = Action::RefineChosen;
            if ui.button("By hand\u{2026}").on_hover_text(by_hand.tooltip()).clicked() {
                cx.ask(by_hand);
            }
            if ui.add_enabled(count > 0, Button::new("Select none")).clicked() {
                let SplatChoice { measure, hide, .. } = self.choice;
                (self.choice, self.chosen) = (SplatChoice { measure, hide, ..SplatChoice::default() }, None);
            }
        });
    }

    /// Content of the pane before anything is measured.
    fn offer(&self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        ui.label("Floaters, needles and haze are found by what the photos show of each Gaussian.");
        ui.add_space(6.0);
        let button = theme::primary_button(if self.measuring { "Measuring\u{2026}" } else { "Measure Gaussians" });
        if ui.add_enabled(cx.state.job.is_none(), button).on_hover_text(Action::MeasureSplats.tooltip()).clicked() {
            cx.ask(Action::MeasureSplats);
        }
    }

    fn show_measure(&mut self, ui: &mut Ui, of: &CloudMeasures) {
        let Self { choice, histogram, .. } = self;
        let shown = choice.measure.map_or("none", SplatMeasure::word);
        let list = ComboBox::from_id_salt("measure").selected_text(shown).show_ui(ui, |ui| {
            for &measure in SplatMeasure::VARIANTS {
                let Some(values) = of.get(measure) else { continue };
                let row = ui.selectable_label(choice.measure == Some(measure), measure.word());
                if row.on_hover_text(measure.meaning()).clicked() {
                    (choice.measure, choice.range) = (Some(measure), None);
                    *histogram = Histogram::new(values, measure.is_logarithmic());
                }
            }
        });
        list.response.accessible_name("Measure shown");
        let Some(measure) = choice.measure else {
            ui.weak("Choose a measure, and drag over its histogram.");
            return;
        };
        ui.weak(sentence(measure.meaning()) + ".");
        histogram.show(ui, &mut choice.range);
        ui.horizontal(|ui| {
            let mut ends = choice.range.unwrap_or(histogram.ends());
            let before = ends;
            let speed = (histogram.ends()[1] - histogram.ends()[0]).abs() / 500.0;
            for (end, name) in ends.iter_mut().zip(["From", "To"]) {
                ui.label(name);
                ui.add(DragValue::new(end).speed(speed).max_decimals(4)).accessible_name(name);
            }
            if ends != before && ends.iter().all(|v| v.is_finite()) {
                choice.range = Some([ends[0].min(ends[1]), ends[0].max(ends[1])]);
            }
        });
    }
}

impl PaneContents for CleanPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let state = cx.state;
        if !state.is_trained() {
            ui.weak("Trained Gaussians can be cleaned: open a trained scene or a splat, or train one.");
            return;
        }
        let Some(measured) = self.measured.clone() else { return self.offer(ui, cx) };
        let before = self.choice.clone();
        self.show_chosen(ui, &measured, view.is_selecting(), cx);
        theme::section(ui, "Suspects");
        for (rule, count) in &self.counts {
            self.choice.show_rule(ui, *rule, *count);
        }
        if measured.measures.get(SplatMeasure::Weight).is_none() {
            ui.weak("The photos are missing: measures that need them are left out.");
        }
        theme::section(ui, "By a measure");
        self.show_measure(ui, &measured.measures);
        theme::section(ui, "By color and place");
        self.choice.show_places(ui, view.picking.selected(), view.visibility.crop());
        if before != self.choice {
            self.choose(&measured, state);
        }
    }

    fn scrolls(&self) -> bool {
        true
    }
}

impl SplatChoice {
    fn show_rule(&mut self, ui: &mut Ui, rule: CleanRule, count: usize) {
        ui.horizontal(|ui| {
            let mut on = self.rules.contains(&rule);
            let row = ui.add_enabled(count > 0, Checkbox::new(&mut on, rule.title()));
            if row.on_hover_text(sentence(rule.meaning()) + ".").changed() {
                self.rules.retain(|other| *other != rule);
                self.rules.extend(on.then_some(rule));
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                // Room for the scroll bar.
                ui.add_space(8.0);
                ui.label(RichText::new(format::count(count as u64)).color(theme::weak()));
            });
        });
    }

    fn show_places(&mut self, ui: &mut Ui, selected: Option<IdentityId>, crop: Option<CropBox>) {
        ui.horizontal(|ui| {
            let mut on = self.color.is_some();
            if ui.checkbox(&mut on, "A color").on_hover_text("Gaussians of this color or a similar one.").changed() {
                self.color = on.then_some(FIRST_COLOR);
            }
            if let Some(color) = &mut self.color {
                ui.color_edit_button_srgb(color);
            }
        });
        let mut on = self.crop.is_some();
        let row = ui.add_enabled(crop.is_some(), Checkbox::new(&mut on, "Outside the crop box"));
        row.on_hover_text("Gaussians outside the crop box (B shows it).");
        self.crop = crop.filter(|_| on);
        let mut on = self.object.is_some();
        let row = ui.add_enabled(selected.is_some(), Checkbox::new(&mut on, "The selected object or part"));
        row.on_hover_text("Select one in the view first.");
        self.object = selected.filter(|_| on);
    }

    /// Mask of the chosen Gaussians; `None` without a choice.
    fn of(&self, measured: &MeasuredCloud, state: &AppState) -> Option<Vec<bool>> {
        let mut rules = self.rules.clone();
        rules.extend(self.measure.zip(self.range).map(|(m, [from, to])| CleanRule::Range(m, from, to)));
        rules.extend(self.color.map(CleanRule::Color));
        let mut of = clean::choose(&rules, &measured.measures).ok()?;
        of.resize(measured.cloud.len(), false);
        if let Some(crop) = self.crop {
            (0..of.len()).for_each(|i| of[i] |= !crop.keeps(measured.cloud.world_position(i)));
        }
        if let (Some(id), Some(map)) = (self.object, &state.semantics) {
            map.members(id).into_iter().for_each(|i| of.get_mut(i).into_iter().for_each(|of| *of = true));
        }
        of.contains(&true).then_some(of)
    }
}
