//! The shortcut of the query field, which works even if there is nothing to query.

use egui::{Key, Modifiers, Ui};

use super::app::App;
use super::keys;
use super::viewport::query::closed;

impl App {
    /// Focuses the query field. If queries are impossible, the field reports why and discards the text.
    pub(super) fn type_question(&mut self, ctx: &egui::Context) {
        self.asks_in_vain = self.state.why_no_query().is_some();
        keys::type_in_vain(ctx, self.asks_in_vain);
        if self.asks_in_vain {
            return;
        }
        // Queries do not go to another scene in the second view.
        if self.state.beside.is_some() {
            self.viewport.queries.work_in(false);
        }
        self.viewport.queries.start_typing();
    }

    /// Closes the disabled field on Escape, Enter, a click or the focus of another field. Opens the query field once
    /// queries are possible. Runs before other code takes keys.
    pub(super) fn follow_vain_query(&mut self, ctx: &egui::Context) {
        if !self.asks_in_vain {
            return;
        }
        if self.state.why_no_query().is_none() {
            return self.type_question(ctx);
        }
        let left = ctx.input_mut(|i| {
            let is_left = [Key::Escape, Key::Enter].map(|key| i.consume_key(Modifiers::NONE, key));
            is_left.contains(&true) || i.pointer.any_pressed()
        });
        self.asks_in_vain = !left && !ctx.text_edit_focused();
        keys::type_in_vain(ctx, self.asks_in_vain);
    }

    /// Draws the disabled query field over the view in `rect`, if it is open.
    pub(super) fn show_vain_query(&self, ui: &Ui, rect: egui::Rect) {
        if let Some(why) = self.state.why_no_query().filter(|_| self.asks_in_vain) {
            closed::show(ui, rect, &why);
        }
    }
}
