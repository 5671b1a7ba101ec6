//! Pinned queries: they stay on screen, each in its color, beside new ones.

use egui::{Button, Color32, Sense, Ui, vec2};

use super::Queries;
use crate::scene::{SemanticMap, text};
use crate::ui::theme;

/// Largest number of characters shown of a query.
const LETTERS: usize = 28;

/// Draws the pin switch.
pub(super) fn show_switch(ui: &mut Ui, queries: &mut Queries) {
    let side = queries.side();
    let found = side.live.as_ref().filter(|q| !q.shown(&side.settings).is_empty());
    let is_pinned = found.is_some_and(|q| side.pinned.iter().any(|p| p.text == q.text));
    let pin = ui.add_enabled(found.is_some(), Button::new("Pin").selected(is_pinned));
    if pin.on_hover_text("Keep this answer on screen while you ask for other things.").clicked() {
        queries.pin();
        queries.start_typing();
    }
}

/// Draws the pinned queries: a click runs one again.
pub(super) fn show(ui: &mut Ui, queries: &mut Queries, semantics: &SemanticMap) {
    let side = queries.side();
    if side.pinned.is_empty() {
        return;
    }
    let (mut gone, mut wanted) = (None, None);
    ui.horizontal_wrapped(|ui| {
        for (k, query) in side.pinned.iter().enumerate() {
            ui.spacing_mut().item_spacing.x = 4.0;
            swatch(ui, queries.color_of(query));
            let name = egui::RichText::new(text::elided(&query.text, LETTERS)).small();
            let is_found = !query.shown(&side.settings).is_empty();
            let name = if is_found { name } else { name.weak().strikethrough() };
            let chip = ui.add(Button::selectable(side.is_live(&query.text), name));
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
        queries.ask(&text, semantics);
        queries.start_typing();
    }
    if let Some(k) = gone {
        queries.side_mut().pinned.remove(k);
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
