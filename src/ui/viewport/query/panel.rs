//! The box over the view: what is typed, and how it is answered.

use egui::{Align2, Area, Context, Id, LayerId, Order, Rect, ScrollArea, Ui};

use super::super::super::theme;
use super::Queries;
use crate::scene::{GaussianCloud, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::state::AppState;
use crate::worker::Versioned;

/// Around cards, points.
const MARGIN: f32 = 12.0;

/// Where a card of the view is on screen.
fn on_screen(ctx: &Context, name: &'static str) -> Option<Rect> {
    let id = Id::unique(name);
    let is_shown = |m: &egui::Memory| m.areas().visible_last_frame(&LayerId::new(Order::Middle, id));
    ctx.memory(|m| m.area_rect(id).filter(|_| is_shown(m)))
}

impl Queries {
    /// The box, the answers, and the queries that are kept. Whether the box has the keyboard.
    pub(crate) fn show(
        &mut self,
        ui: &Ui,
        rect: Rect,
        state: &AppState,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
        actions: &mut Vec<Action>,
    ) -> bool {
        // In the corner: what is looked for is mostly in the middle.
        let mut at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(MARGIN));
        let width = (rect.width() - 410.0).clamp(300.0, 380.0).min(rect.width() - 40.0);
        let (name, others) = match self.is_second() {
            true => ("second question", ["second modes", "photo"]),
            false => ("question", ["modes", "photo"]),
        };
        for card in
            others.into_iter().filter_map(|name| on_screen(ui.ctx(), name)).filter(|card| rect.intersects(*card))
        {
            // Below the view's own cards where they reach that far.
            if card.right() + MARGIN > at.x - width - 2.0 * MARGIN {
                at.y = at.y.max(card.bottom() + 0.5 * MARGIN);
            }
        }
        let area = Area::new(Id::unique(name)).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
        let shown = area.constrain_to(rect).show(ui.ctx(), |ui| {
            let frame = theme::overlay().show(ui, |ui| {
                ui.set_width(width);
                let height = (rect.bottom() - at.y - 2.5 * MARGIN).max(60.0);
                let scrolled = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
                let shown = scrolled.show(ui, |ui| {
                    let focused = self.show_bar(ui, semantics, actions);
                    self.show_answer(ui, state, semantics, cloud, actions);
                    self.show_kept(ui);
                    focused
                });
                shown.inner
            });
            frame.inner
        });
        shown.inner
    }
}
