//! Contents of the dock's places.

use egui::{Frame, Margin, ScrollArea, Ui};

use super::App;
use crate::ui::actions::{Action, Pane};
use crate::ui::dock::{DockContents, Place};
use crate::ui::theme;

impl DockContents for App {
    fn has(&self, place: Place) -> bool {
        let Place::Pane(pane) = place else { return true };
        let scene = self.state.scene.as_ref();
        let has_photos = scene.is_some_and(|s| s.dataset.is_some());
        let has_objects = self.state.semantics.is_some();
        self.layout.shows(pane)
            && match pane {
                Pane::Report | Pane::Log => true,
                Pane::Dataset | Pane::Training => has_photos,
                Pane::Objects => has_photos || has_objects,
                Pane::Phrases => has_objects,
                _ => scene.is_some(),
            }
    }

    fn show(&mut self, ui: &mut Ui, place: Place) {
        let Place::Pane(pane) = place else { return self.show_view(ui) };
        Frame::new().fill(theme::panel()).inner_margin(Margin::same(12)).show(ui, |ui| {
            ui.set_min_size(ui.available_size());
            if matches!(pane, Pane::Training | Pane::Query | Pane::Plan | Pane::Models | Pane::Clean) {
                ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| self.show_pane(ui, pane));
            } else {
                self.show_pane(ui, pane);
            }
        });
    }

    fn hide(&mut self, pane: Pane) {
        self.actions.push(Action::TogglePane(pane));
    }
}
