//! The box over the view: what is typed, and how it is answered.

use egui::{Align2, Area, Id, Order, Rect, Ui};

use super::super::super::theme;
use super::{Queries, settings};
use crate::scene::{GaussianCloud, SemanticMap};
use crate::ui::actions::Action;
use crate::worker::Versioned;

/// Views narrower than this have no room for the query beside the view's own buttons, points.
const BESIDE: f32 = 700.0;
/// How far it is below them then: both rows of them.
const BELOW: f32 = 92.0;

impl Queries {
    /// The box, the answers, and the queries that are kept.
    pub(crate) fn show(
        &mut self,
        ui: &Ui,
        rect: Rect,
        semantics: &Versioned<SemanticMap>,
        cloud: &GaussianCloud,
        actions: &mut Vec<Action>,
    ) {
        // In the corner: what is looked for is mostly in the middle.
        let mut at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(12.0));
        if rect.width() < BESIDE {
            at.y += BELOW;
        }
        let area = Area::new(Id::unique("question")).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
        area.constrain_to(rect).show(ui.ctx(), |ui| {
            theme::overlay().show(ui, |ui| {
                // Beside the view's own buttons, as long as there is room.
                ui.set_width((rect.width() - 410.0).clamp(300.0, 380.0).min(rect.width() - 40.0));
                self.show_bar(ui, semantics);
                if self.open {
                    let heat = (!self.heat.is_empty()).then_some(self.heat.as_slice());
                    if settings::show(ui, &mut self.settings, heat) {
                        self.ask_again(semantics);
                    }
                }
                self.show_answer(ui, semantics, cloud, actions);
                self.show_kept(ui);
            });
        });
    }
}
