//! The bar over compared views: the phrase, the scale of relevancy, the rule of masks, and the legend.

use egui::{ComboBox, Event, Id, Key, RichText, Slider, TextEdit, Ui};

use super::super::legend;
use super::{COLORS, Compared};
use crate::jobs::compare::cell::ShownRelevancy;
use crate::jobs::models::ModelRole;
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::paired::paired;
use crate::ui::text_field::take_keyboard;
use crate::ui::theme;

/// Width of the field, and of the buttons beside it, points.
const FIELD_PT: f32 = 260.0;
const BUTTONS_PT: f32 = 240.0;

/// Scales with their names and what they show.
const SCALES: [(ShownRelevancy, &str, &str); 3] = [
    (ShownRelevancy::Raw, "Raw", "Relevancy as it is, with one range for all views."),
    (ShownRelevancy::Lerf, "LERF's", "From 0.5 to the largest relevancy of each view."),
    (ShownRelevancy::Own, "Own", "The values that each method's own rule cuts."),
];

impl Compared {
    /// Draws the bar.
    pub(in crate::ui::viewport) fn bar(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        // Two rows, so that nothing moves as a point is chosen.
        ui.horizontal_wrapped(|ui| {
            self.field(ui, cx.state.beside.len() + 1);
            actions(ui, cx);
            self.pointed(ui);
        });
        ui.horizontal_wrapped(|ui| {
            self.scale(ui);
            self.rule(ui);
            self.encoder(ui, cx);
            ui.spacing_mut().slider_width = 70.0;
            let opacity = Slider::new(&mut self.choices.opacity, 0.0..=1.0).show_value(false);
            paired(ui, RichText::new("Opacity").small(), 70.0, |ui, label| {
                ui.add(opacity).on_hover_text("Opacity of relevancy").labelled_by(label);
            });
            legend::bar(ui, COLORS, self.range().map(|v| format!("{v:.2}")));
            if let Some(why) = &self.problem {
                ui.colored_label(theme::error(), why);
            }
        });
    }

    fn field(&mut self, ui: &mut Ui, scenes: usize) {
        let id = Id::unique("phrase for all");
        // Taken before the field, which would move its cursor.
        if self.focus > 0 {
            self.focus -= 1;
            ui.input_mut(|i| i.events.retain(|e| !matches!(e, Event::Text(text) if text == "/")));
            take_keyboard(ui.ctx(), id, &mut self.typed);
        }
        let hint = match scenes {
            1 => "A phrase ( / ), or click a thing".to_owned(),
            _ => format!("A phrase for all {scenes} ( / ), or click a thing"),
        };
        let width = FIELD_PT.min((ui.available_width() - BUTTONS_PT).max(0.5 * FIELD_PT));
        let edit = TextEdit::singleline(&mut self.typed).id(id).hint_text(hint).char_limit(2_000).desired_width(width);
        let response = ui.add(edit).accessible_name("Phrase");
        if response.changed() {
            self.point_at(None);
        }
        if response.has_focus() && ui.input(|i| i.key_pressed(Key::Escape)) {
            response.surrender_focus();
        }
    }

    /// Draws what a click has chosen, and what it means.
    fn pointed(&mut self, ui: &mut Ui) {
        if self.point.is_none() {
            return;
        }
        ui.separator();
        ui.label("Point").on_hover_text("Clicked: what each scene says that it belongs to.");
        ui.spacing_mut().slider_width = 70.0;
        let slider = |ui: &mut Ui, name: &str, value: &mut f32, tip: &str| {
            let label = ui.label(RichText::new(name).small()).id;
            ui.add(Slider::new(value, 0.0..=1.0).fixed_decimals(2)).on_hover_text(tip).labelled_by(label);
        };
        slider(
            ui,
            "Size",
            &mut self.choices.size,
            "From details (a part) to the largest things (an object), where a scene has both.",
        );
        slider(
            ui,
            "Threshold",
            &mut self.choices.threshold,
            "Score from which a pixel belongs to the point, where a method has scores (SAGA).",
        );
        let leave = ui.button("\u{d7}").on_hover_text("Ask the phrase again");
        if leave.accessible_name("Ask the phrase again").clicked() {
            self.point_at(None);
        }
    }

    fn scale(&mut self, ui: &mut Ui) {
        let chosen = SCALES.iter().find(|scale| scale.0 == self.choices.scale).map_or("", |scale| scale.1);
        let choice = ComboBox::from_id_salt("scale").selected_text(format!("Scale: {chosen}")).width(104.0);
        let choice = choice.show_ui(ui, |ui| {
            for (scale, name, tip) in SCALES {
                ui.selectable_value(&mut self.choices.scale, scale, name).on_hover_text(tip);
            }
        });
        choice.response.on_hover_text("Scale of relevancy, one for all views").accessible_name("Scale of relevancy");
    }

    /// Draws the choice of the text encoder, if a scene is asked by one.
    fn encoder(&mut self, ui: &mut Ui, cx: &Ctx<'_>) {
        let own: Vec<&str> = self.scenes.iter().flatten().filter_map(|scene| scene.encoder()).collect();
        let Some(models) = cx.state.models.as_ref().filter(|_| !own.is_empty()) else { return };
        let all = models.of(ModelRole::Encoder).filter(|(_, state)| state.is_usable());
        let usable: Vec<String> = all.map(|(entry, _)| entry.id.clone()).collect();
        let chosen = self.choices.encoder.clone().unwrap_or_else(|| "its own".into());
        let choice = ComboBox::from_id_salt("encoder").selected_text(format!("Encoder: {chosen}")).width(150.0);
        let choice = choice.show_ui(ui, |ui| {
            ui.selectable_value(&mut self.choices.encoder, None, "its own").on_hover_text(own.join(", "));
            for id in usable {
                ui.selectable_value(&mut self.choices.encoder, Some(id.clone()), id);
            }
        });
        let tip = "Text encoder of phrases for results that know language: that of their authors, or the one that they were trained with";
        choice.response.on_hover_text(tip).accessible_name("Encoder");
    }

    fn rule(&mut self, ui: &mut Ui) {
        let rules = [(false, "own rule"), (true, "common rule")];
        let chosen = rules[usize::from(self.choices.by_common_rule)].1;
        let choice = ComboBox::from_id_salt("rule").selected_text(format!("Masks: {chosen}")).width(150.0);
        let choice = choice.show_ui(ui, |ui| {
            for (by_common_rule, name) in rules {
                ui.selectable_value(&mut self.choices.by_common_rule, by_common_rule, name);
            }
        });
        let tip =
            "Outlined: the mask by each method's own rule (the common one where it has none), or by one rule for all";
        choice.response.on_hover_text(tip).accessible_name("Masks");
    }
}

/// Draws the buttons for all that is compared, or for a result alone.
fn actions(ui: &mut Ui, cx: &mut Ctx<'_>) {
    let state = cx.state;
    let mut button = |ui: &mut Ui, text: &str, action: Action| {
        let button = ui.button(text).on_hover_text(action.tooltip());
        if button.accessible_name(action.text()).clicked() {
            cx.ask(action);
        }
    };
    let is_alone = state.beside.is_empty();
    if is_alone && state.scene.as_ref().is_some_and(|scene| scene.method.is_some()) {
        button(ui, "Import\u{2026}", Action::ChooseImport);
    }
    if is_alone {
        return button(ui, "Compare\u{2026}", Action::ChooseComparison);
    }
    button(ui, "Save sheet\u{2026}", Action::ChooseSheetFolder);
    button(ui, "Add\u{2026}", Action::ChooseComparison);
    button(ui, "End", Action::CloseComparison(None));
}
