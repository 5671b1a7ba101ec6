//! The card over the view: the query field and its answer; in small views one line that unfolds.

use egui::{Align, Align2, Area, Context, Id, LayerId, Layout, Order, Rect, RichText, ScrollArea, Ui, Vec2, vec2};

use super::pins::swatch;
use super::{Queries, SearchedScene, bar, card, pins};
use crate::ui::actions::{Action, Pane};
use crate::ui::ctx::Ctx;
use crate::ui::state::AppState;
use crate::ui::theme;

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

/// Least width of the card beside the view's own cards, points.
const NARROWEST: f32 = 320.0;

/// Width of the card in a view, points.
pub(super) fn width_in(view: Rect) -> f32 {
    (view.width() - 410.0).clamp(300.0, 380.0).min(view.width() - 40.0)
}

/// Form of the card: in a small view, one line that unfolds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Folding {
    Never,
    Folded,
    Unfolded,
}

/// Draws the field, the answer, and the pinned queries. Returns true if the field has the focus. The card avoids the
/// other cards of the `first` view, and has the same place in the second.
pub(crate) fn show(
    ui: &Ui,
    queries: &mut Queries,
    rect: Rect,
    first: Rect,
    scene: SearchedScene<'_>,
    cx: &mut Ctx<'_>,
) -> bool {
    let is_small = rect.width() < SMALL.x || rect.height() < SMALL.y;
    let folding = match (is_small, queries.side().unfolded) {
        (false, _) => Folding::Never,
        (true, true) => Folding::Unfolded,
        (true, false) => Folding::Folded,
    };
    // In the corner, as the target is mostly in the middle.
    let mut at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(MARGIN));
    let mut width = width_in(rect);
    for card in ["modes", "photo"].into_iter().filter_map(|name| on_screen(ui.ctx(), name)) {
        let card = card.translate(rect.min - first.min);
        let room = at.x - card.right() - 3.0 * MARGIN;
        if !rect.intersects(card) || room >= width {
            continue;
        }
        // Beside the view's own cards, a little narrower; below them if they reach too far.
        match room >= NARROWEST.min(width) {
            true => width = room,
            false => at.y = at.y.max(card.bottom() + 0.5 * MARGIN),
        }
    }
    let name = if queries.is_second() { "second question" } else { "question" };
    let area = Area::new(Id::unique(name)).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
    let shown = theme::card(ui.ctx(), area.constrain_to(rect), |ui| {
        ui.set_width(width);
        let height = (rect.bottom() - at.y - 2.5 * MARGIN).max(60.0);
        let scrolled = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        scrolled.show(ui, |ui| contents(ui, queries, folding, scene, cx)).inner
    });
    shown.inner
}

fn contents(ui: &mut Ui, queries: &mut Queries, folding: Folding, scene: SearchedScene<'_>, cx: &mut Ctx<'_>) -> bool {
    let is_folded = folding == Folding::Folded;
    let row = vec2(ui.available_width(), ui.spacing().interact_size.y);
    let (focused, offered) = ui
        .allocate_ui_with_layout(row, Layout::right_to_left(Align::Center), |ui| {
            if folding != Folding::Never {
                let (symbol, text) = match is_folded {
                    true => ("\u{23f7}", "Unfold the answer"),
                    false => ("\u{23f6}", "Fold the answer"),
                };
                if ui.button(symbol).on_hover_text(text).accessible_name(text).clicked() {
                    queries.side_mut().unfolded = is_folded;
                }
            }
            if is_folded {
                show_in_short(ui, queries, scene, cx.state);
            } else {
                let details = ui.button("Details");
                if details.on_hover_text("Full answer, search and overlay settings").clicked() {
                    cx.ask(Action::TogglePane(Pane::Query));
                }
                pins::show_switch(ui, queries);
            }
            let width = ui.available_width();
            bar::show(ui, queries, width, scene.semantics)
        })
        .inner;
    if focused {
        bar::show_offered(ui, queries, &offered, scene.semantics);
    }
    if !is_folded {
        card::show(ui, queries, scene, cx);
        pins::show(ui, queries, scene.semantics);
        ui.add_space(3.0);
    }
    focused
}

/// Draws the answer in a word, and the colors of pinned queries, from the right.
fn show_in_short(ui: &mut Ui, queries: &mut Queries, scene: SearchedScene<'_>, state: &AppState) {
    ui.spacing_mut().item_spacing.x = 5.0;
    let side = queries.side();
    for query in side.pinned.iter().rev().filter(|q| !side.is_live(&q.text)) {
        swatch(ui, queries.color_of(query)).on_hover_text(&query.text);
    }
    if let Some((text, color, more)) = card::in_short(ui, queries, scene, state) {
        ui.colored_label(color, RichText::new(text).small()).on_hover_text(more);
        let color = queries.side().live.as_ref().and_then(|q| queries.color_of(q));
        swatch(ui, color);
    }
}
