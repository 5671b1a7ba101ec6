//! Pinned queries: they stay on screen, each in its color, beside new ones.

use egui::{Button, Color32, Sense, Ui, vec2};

use super::{Asked, Queries};
use crate::jobs::phrases::colors::PhraseColors;
use crate::scene::{SemanticMap, text};
use crate::ui::theme;

/// Largest number of pinned queries.
const MOST: usize = 6;

/// Largest number of characters shown of a query.
const LETTERS: usize = 28;

impl Queries {
    /// Fixes the colors of these phrases; returns all fixed colors.
    pub(crate) fn colors_of(&mut self, phrases: &[String]) -> PhraseColors {
        self.colors.keep_all(phrases);
        self.colors.clone()
    }

    /// Pins only these queries in the first and the second view.
    pub(crate) fn pin_only(&mut self, texts: &[Vec<String>; 2], semantics: &SemanticMap) {
        for (second, texts) in [false, true].into_iter().zip(texts) {
            self.in_view(second, |all| {
                if all.side.pinned.iter().map(|q| &q.text).ne(texts) {
                    all.side.pinned = texts.iter().filter_map(|text| all.asked(text, semantics)).collect();
                }
            });
        }
    }

    /// Pins or unpins the query in the field.
    pub(super) fn pin(&mut self) {
        let Some(live) = self.side.live.clone() else { return };
        let before = self.side.pinned.len();
        self.side.pinned.retain(|q| q.text != live.text);
        if self.side.pinned.len() < before {
            return;
        }
        if before == MOST {
            self.side.pinned.remove(0);
        }
        self.colors.keep(&live.text);
        self.side.pinned.push(live);
    }

    /// Draws the pin switch.
    pub(super) fn show_pin(&mut self, ui: &mut Ui) {
        let found = self.side.live.as_ref().filter(|q| !q.shown(&self.side.settings).is_empty());
        let is_pinned = found.is_some_and(|q| self.side.pinned.iter().any(|p| p.text == q.text));
        let pin = ui.add_enabled(found.is_some(), Button::new("Pin").selected(is_pinned));
        if pin.on_hover_text("Keep this answer on screen while you ask for other things.").clicked() {
            self.pin();
            self.start_typing();
        }
    }

    /// Draws the pinned queries: a click runs one again.
    pub(super) fn show_pinned(&mut self, ui: &mut Ui, semantics: &SemanticMap) {
        if self.side.pinned.is_empty() {
            return;
        }
        let (mut gone, mut wanted) = (None, None);
        ui.horizontal_wrapped(|ui| {
            for (k, query) in self.side.pinned.iter().enumerate() {
                ui.spacing_mut().item_spacing.x = 4.0;
                swatch(ui, self.color_of(query));
                let name = egui::RichText::new(text::elided(&query.text, LETTERS)).small();
                let is_found = !query.shown(&self.side.settings).is_empty();
                let name = if is_found { name } else { name.weak().strikethrough() };
                let chip = ui.add(Button::selectable(self.side.is_live(&query.text), name));
                let tip = if is_found { "Show its answer" } else { "Nothing in this scene matches it" };
                if chip.on_hover_text(tip).clicked() {
                    wanted = Some(query.text.clone());
                }
                let close = ui.small_button("\u{d7}").on_hover_text("Unpin it");
                if close.accessible_name(format!("Unpin {}", query.text)).clicked() {
                    gone = Some(k);
                }
                ui.add_space(4.0);
            }
        });
        if let Some(text) = wanted {
            self.ask(&text, semantics);
            self.start_typing();
        }
        if let Some(k) = gone {
            self.side.pinned.remove(k);
        }
    }

    /// The color of a query's outline; `None` if nothing is outlined.
    pub(super) fn color_of(&self, query: &Asked) -> Option<Color32> {
        let [r, g, b] = self.colors.of(&query.text);
        (!query.shown(&self.side.settings).is_empty()).then_some(Color32::from_rgb(r, g, b))
    }
}

/// Draws a disc in the color of an outline; a ring without one.
pub(super) fn swatch(ui: &mut Ui, color: Option<Color32>) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
    match color {
        Some(color) => ui.painter().circle_filled(rect.center(), 4.5, color),
        None => ui.painter().circle_stroke(rect.center(), 4.0, egui::Stroke::new(1.0, theme::weak())),
    };
    response
}
