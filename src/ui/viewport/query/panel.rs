//! The card over the view: the query field and its answer; in small views one line that unfolds.

use egui::{Align, Align2, Area, Context, Id, LayerId, Layout, Order, Rect, RichText, ScrollArea, Ui, Vec2, vec2};

use super::super::super::theme;
use super::super::visible::Visibility;
use super::Queries;
use super::pins::swatch;
use crate::scene::{GaussianCloud, SemanticMap};
use crate::ui::actions::{Action, Pane};
use crate::ui::state::AppState;
use crate::worker::Versioned;

/// Margin around cards, points.
pub(super) const MARGIN: f32 = 12.0;

/// Rectangle of a card on screen.
fn on_screen(ctx: &Context, name: &'static str) -> Option<Rect> {
    let id = Id::unique(name);
    let is_shown = |m: &egui::Memory| m.areas().visible_last_frame(&LayerId::new(Order::Middle, id));
    ctx.memory(|m| m.area_rect(id).filter(|_| is_shown(m)))
}

/// Size below which a view shows the answer as one word, points.
const SMALL: Vec2 = vec2(540.0, 420.0);

/// Width of the card in a view, points.
pub(super) fn width_in(view: Rect) -> f32 {
    (view.width() - 410.0).clamp(300.0, 380.0).min(view.width() - 40.0)
}

impl Queries {
    /// Draws the field, the answer, and the pinned queries. Returns whether the field has the focus. The card avoids
    /// the other cards of the `first` view, and has the same place in the second.
    pub(crate) fn show(
        &mut self,
        ui: &Ui,
        (rect, first): (Rect, Rect),
        state: &AppState,
        of: (&Versioned<SemanticMap>, &GaussianCloud, &Visibility),
        actions: &mut Vec<Action>,
    ) -> bool {
        let is_small = rect.width() < SMALL.x || rect.height() < SMALL.y;
        let is_folded = is_small && !self.side.unfolded;
        // In the corner, as the target is mostly in the middle.
        let mut at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(MARGIN));
        let width = width_in(rect);
        for card in ["modes", "photo"].into_iter().filter_map(|name| on_screen(ui.ctx(), name)) {
            let card = card.translate(rect.min - first.min);
            // Below the view's own cards if they reach that far.
            if rect.intersects(card) && card.right() + MARGIN > at.x - width - 2.0 * MARGIN {
                at.y = at.y.max(card.bottom() + 0.5 * MARGIN);
            }
        }
        let name = if self.is_second() { "second question" } else { "question" };
        let area = Area::new(Id::unique(name)).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
        let shown = theme::card(ui.ctx(), area.constrain_to(rect), |ui| {
            ui.set_width(width);
            let height = (rect.bottom() - at.y - 2.5 * MARGIN).max(60.0);
            let scrolled = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            scrolled.show(ui, |ui| self.card(ui, (is_small, is_folded), state, of, actions)).inner
        });
        shown.inner
    }

    fn card(
        &mut self,
        ui: &mut Ui,
        (is_small, is_folded): (bool, bool),
        state: &AppState,
        (semantics, cloud, visibility): (&Versioned<SemanticMap>, &GaussianCloud, &Visibility),
        actions: &mut Vec<Action>,
    ) -> bool {
        let row = vec2(ui.available_width(), ui.spacing().interact_size.y);
        let (focused, offered) = ui
            .allocate_ui_with_layout(row, Layout::right_to_left(Align::Center), |ui| {
                if is_small {
                    let (symbol, text) = match is_folded {
                        true => ("\u{23f7}", "Unfold the answer"),
                        false => ("\u{23f6}", "Fold the answer"),
                    };
                    if ui.button(symbol).on_hover_text(text).accessible_name(text).clicked() {
                        self.side.unfolded = is_folded;
                    }
                }
                if is_folded {
                    self.show_in_short(ui, state, semantics, visibility);
                } else {
                    let details = ui.button("Details");
                    if details.on_hover_text("Full answer, search and overlay settings").clicked() {
                        actions.push(Action::TogglePane(Pane::Query));
                    }
                    self.show_pin(ui);
                }
                self.show_field(ui, ui.available_width(), semantics)
            })
            .inner;
        if focused {
            self.show_offered(ui, &offered, semantics);
        }
        if !is_folded {
            self.show_answer(ui, state, (semantics, cloud, visibility), actions);
            self.show_pinned(ui, semantics);
        }
        focused
    }

    /// Draws the answer in a word, and the colors of pinned queries, from the right.
    fn show_in_short(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        semantics: &Versioned<SemanticMap>,
        visibility: &Visibility,
    ) {
        ui.spacing_mut().item_spacing.x = 5.0;
        for query in self.side.pinned.iter().rev().filter(|q| !self.side.is_live(&q.text)) {
            swatch(ui, self.color_of(query)).on_hover_text(&query.text);
        }
        if let Some((text, color, more)) = self.answer_in_short(ui, state, semantics, visibility) {
            ui.colored_label(color, RichText::new(text).small()).on_hover_text(more);
            let color = self.side.live.as_ref().and_then(|q| self.color_of(q));
            swatch(ui, color);
        }
    }
}
