//! The card of a tool: moved by its title within the view, and folded to its main rows.

use std::ops::RangeInclusive;

use egui::{Align2, Area, CursorIcon, Id, Label, Order, Pos2, Rect, RichText, Sense, Ui, Vec2, vec2};

use crate::ui::theme;

/// Size of a view below which a card begins folded: unfolded it would take more than a third of the height, points.
const LOW_PT: f32 = 700.0;
const NARROW_PT: f32 = 480.0;

/// Place and form of a card that the user chose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ChosenForm {
    /// Offset from its own place, points.
    moved: Vec2,
    /// True if it is unfolded; `None` before the user's choice.
    unfolded: Option<bool>,
}

/// A card over the view in `rect`.
pub(super) struct ToolCard {
    id: &'static str,
    title: String,
    rect: Rect,
    pivot: Align2,
    at: Pos2,
    order: Order,
    /// Width folded and unfolded.
    width: Option<[f32; 2]>,
    folds: bool,
}

impl ToolCard {
    /// A card in the corner above the facts about the frame.
    pub(super) fn in_corner(id: &'static str, title: impl Into<String>, rect: Rect) -> Self {
        let (pivot, order) = (Align2::LEFT_BOTTOM, Order::Middle);
        let at = pivot.pos_in_rect(&rect.shrink(12.0)) - vec2(0.0, 40.0);
        Self { id, title: title.into(), rect, pivot, at, order, width: None, folds: false }
    }

    /// A card in the middle of the bottom, as wide as fits, within `width`.
    pub(super) fn at_bottom(
        id: &'static str,
        title: impl Into<String>,
        rect: Rect,
        width: RangeInclusive<f32>,
    ) -> Self {
        let (pivot, order) = (Align2::CENTER_BOTTOM, Order::Foreground);
        let at = pivot.pos_in_rect(&rect.shrink(52.0));
        let width = Some([(rect.width() - 40.0).clamp(*width.start(), *width.end()); 2]);
        Self { id, title: title.into(), rect, pivot, at, order, width, folds: false }
    }

    /// A card that has a button to fold it, and begins folded in a small view; as wide as fits, up to these widths.
    pub(super) fn folding(self, folded_pt: f32, unfolded_pt: f32) -> Self {
        let room = (self.rect.width() - 40.0).max(200.0);
        Self { folds: true, width: Some([folded_pt.min(room), unfolded_pt.min(room)]), ..self }
    }

    /// A card in the corner on the right.
    pub(super) fn on_the_right(self) -> Self {
        let pivot = Align2::RIGHT_BOTTOM;
        Self { at: pivot.pos_in_rect(&self.rect.shrink(12.0)) - vec2(0.0, 40.0), pivot, ..self }
    }

    /// Draws it; `add` draws the rows below the title, and is told whether only the main ones are wanted.
    pub(super) fn show(self, ui: &Ui, add: impl FnOnce(&mut Ui, bool)) {
        let Self { id, title, rect, pivot, at, order, width, folds } = self;
        // What was moved on one side has its own place on the other.
        let key = Id::unique(id).with(("form", pivot == Align2::RIGHT_BOTTOM));
        let before = ui.data(|d| d.get_temp::<ChosenForm>(key)).unwrap_or_default();
        let mut form = before;
        let is_large = rect.height() >= LOW_PT && rect.width() >= NARROW_PT;
        let is_folded = folds && !form.unfolded.unwrap_or(is_large);
        let area = Area::new(Id::unique(id)).order(order).pivot(pivot).fixed_pos(at + form.moved);
        let drawn = theme::solid_card(ui.ctx(), area.constrain_to(rect), |ui| {
            width.into_iter().for_each(|width| ui.set_width(width[usize::from(!is_folded)]));
            let handle = ui.horizontal(|ui| {
                if folds {
                    let (symbol, text) = match is_folded {
                        true => ("\u{23f6}", "Show all of this card"),
                        false => ("\u{23f7}", "Show only the main rows of this card"),
                    };
                    if ui.small_button(symbol).on_hover_text(text).accessible_name(text).clicked() {
                        form.unfolded = Some(is_folded);
                    }
                }
                let label = Label::new(RichText::new(title).strong()).selectable(false);
                let label = if folds { label.wrap() } else { label.truncate() };
                // Not for the keyboard: only the place of the card is at stake.
                ui.add(label.sense(Sense::DRAG | Sense::CLICK))
            });
            add(ui, is_folded);
            handle.inner
        });
        let (card, handle) = (drawn.response.rect, drawn.inner);
        if handle.double_clicked() {
            form.moved = Vec2::ZERO;
        } else if handle.dragged() {
            let own = pivot.anchor_size(at, card.size());
            form.moved = within(card.translate(handle.drag_delta()), rect).min - own.min;
        }
        if form != before {
            ui.data_mut(|d| d.insert_temp(key, form));
            ui.ctx().request_repaint();
        }
        // A card that has grown is placed correctly in the next frame.
        if !rect.expand(1.0).contains_rect(card) {
            ui.ctx().request_repaint();
        }
        handle.on_hover_and_drag_cursor(CursorIcon::Grab).on_hover_text("Drag to move the card; double-click: back");
    }
}

/// A card moved as little as needed to lie in the view; of one that is too large, the upper left corner does.
fn within(card: Rect, view: Rect) -> Rect {
    let back = (view.max - card.max).min(Vec2::ZERO);
    let card = card.translate(back);
    card.translate((view.min - card.min).max(Vec2::ZERO))
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn a_moved_card_stays_in_the_view() {
        let view = Rect::from_min_size(pos2(100.0, 50.0), vec2(400.0, 300.0));
        let card = Rect::from_min_size(pos2(150.0, 80.0), vec2(200.0, 100.0));
        assert_eq!(within(card, view), card, "control: one inside is not moved");
        for far in [vec2(900.0, 0.0), vec2(-900.0, 700.0), vec2(0.0, -700.0)] {
            let moved = within(card.translate(far), view);
            assert!(view.contains_rect(moved) && moved.size() == card.size(), "{far:?}: {moved:?}");
        }
        let large = Rect::from_min_size(pos2(0.0, 0.0), vec2(900.0, 20.0));
        assert_eq!(within(large, view).min, view.min, "the title of a large one stays in reach");
    }
}
