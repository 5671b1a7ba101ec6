//! Keys and files dropped onto the window, taken before anything is drawn.

use std::path::PathBuf;

use super::App;
use crate::measure::is_report;
use crate::ui::actions::Action;
use crate::ui::keys;

impl App {
    pub(super) fn keys_and_drops(&mut self, ctx: &egui::Context) {
        keys::watch_typing(ctx);
        let has_dialog = self.state.error.is_some()
            || self.state.unposed.is_some()
            || self.question.is_some()
            || self.find_dialog.is_open()
            || self.keep_dialog.is_some()
            || self.dialogs.is_own_open();
        // An open menu takes the keys; Escape closes only the menu.
        let has_menu = egui::Popup::is_any_open(ctx);
        if has_menu && ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)) {
            egui::Popup::close_all(ctx);
        }
        self.follow_vain_query(ctx);
        if !self.palette.is_open() && !has_dialog && !self.sheet && !has_menu {
            for action in keys::pressed(ctx) {
                if keys::opens_field(&action) {
                    // Before drawing: text typed in this frame belongs to the field.
                    keys::begin_typing(ctx);
                    self.settle(false);
                    self.act(action, ctx);
                } else {
                    self.actions.push(action);
                }
            }
        }
        let dropped: Vec<PathBuf> =
            ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).take(2).collect());
        match dropped.as_slice() {
            [one, other] if is_report(one) && is_report(other) => {
                self.actions.extend([Action::OpenReport(one.clone()), Action::CompareReport(other.clone())]);
            }
            all => self.actions.extend(all.first().cloned().map(Action::Open)),
        }
    }
}
