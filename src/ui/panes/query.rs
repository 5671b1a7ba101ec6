//! The full answer to the newest query, drawn by the view that holds it.

use egui::Ui;

use super::super::ctx::Ctx;
use super::super::viewport::Viewport;
use super::PaneContents;

/// The pane.
pub(crate) struct QueryPane;

impl PaneContents for QueryPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        view.show_query(ui, cx);
    }

    fn scrolls(&self) -> bool {
        true
    }
}
