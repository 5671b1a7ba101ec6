//! The disabled query field with the reason why queries are impossible.

use egui::{Align2, Area, Id, Order, Rect, TextEdit, Ui};

use super::panel::{MARGIN, width_in};
use crate::ui::theme;

/// Draws the field in the view in `rect`.
pub(crate) fn show(ui: &Ui, rect: Rect, why: &str) {
    let at = Align2::RIGHT_TOP.pos_in_rect(&rect.shrink(MARGIN));
    let area = Area::new(Id::unique("closed question")).order(Order::Middle).pivot(Align2::RIGHT_TOP).fixed_pos(at);
    theme::card(ui.ctx(), area.constrain_to(rect), |ui| {
        ui.set_width(width_in(rect));
        let mut nothing = "";
        let field = TextEdit::singleline(&mut nothing).hint_text("Find an object or part").desired_width(f32::INFINITY);
        ui.add_enabled(false, field).accessible_name("Query");
        ui.colored_label(theme::warning(), why);
        ui.weak("Esc closes this.");
    });
}
