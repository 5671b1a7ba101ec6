//! Times of a query: a thin bar in the colors of its stages, with their numbers.

use egui::{Color32, Label, Rect, RichText, Sense, Ui, pos2, vec2};

use crate::math::format::millis;
use crate::pipeline::semantics::query::timing::{STAGES, StagesMs};
use crate::ui::theme;

/// Colors of the stages, in their order.
const COLORS: [Color32; 5] = [
    Color32::from_rgb(0x56, 0xb4, 0xe9),
    Color32::from_rgb(0xe6, 0x9f, 0x00),
    Color32::from_rgb(0x00, 0x9e, 0x73),
    Color32::from_rgb(0xcc, 0x79, 0xa7),
    Color32::from_rgb(0x9a, 0xa0, 0xac),
];

/// Meaning of each stage, for the user.
const MEANING: &str = "encode: text to embeddings (cached)\n\
    relevancy: score every object and part\n\
    localize: choose the matches\n\
    mask: find their pixels in this view\n\
    draw: paint the overlay";

/// Draws the bar with its numbers.
pub(crate) fn show(ui: &mut Ui, basis: &str, stages: &StagesMs) {
    let (rect, bar) = ui.allocate_exact_size(vec2(ui.available_width(), 5.0), Sense::hover());
    for (color, [from, to]) in COLORS.into_iter().zip(shares(stages)) {
        let at = |share: f64| rect.left() + rect.width() * share as f32;
        let part = Rect::from_min_max(pos2(at(from), rect.top()), pos2(at(to), rect.bottom()));
        ui.painter().rect_filled(part, 1.0, color);
    }
    let numbers = ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(6.0, 0.0);
        // A line break stands between two of them, not within one.
        let mut show = |text: String, color| ui.add(Label::new(RichText::new(text).small().color(color)).extend());
        show(format!("{basis} in {}", millis(stages.whole() / 1e3)), theme::text());
        for (name, (color, ms)) in STAGES.into_iter().zip(COLORS.into_iter().zip(stages.values())) {
            show(format!("{name} {}", millis(ms / 1e3)), color);
        }
    });
    bar.union(numbers.response).on_hover_text(MEANING);
}

/// Start and end of each stage, as shares of the total; zeros if the total is zero.
fn shares(stages: &StagesMs) -> [[f64; 2]; 5] {
    let (whole, mut end) = (stages.whole().max(f64::MIN_POSITIVE), 0.0);
    stages.values().map(|ms| {
        let from = end;
        end += ms / whole;
        [from, end]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_follow_each_other_and_fill_the_bar() {
        let parts = shares(&StagesMs::of([6.0, 1.0, 0.0, 2.0, 1.0]));
        assert_eq!(parts[0], [0.0, 0.6]);
        assert!(parts.windows(2).all(|p| p[0][1] == p[1][0]), "no gap");
        assert!((parts[4][1] - 1.0).abs() < 1e-12);
        assert_eq!(shares(&StagesMs::default()), [[0.0; 2]; 5]);
    }
}
