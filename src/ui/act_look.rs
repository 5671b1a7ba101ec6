//! Actions on what the view shows.

use super::actions::Action;
use super::app::App;
use super::color_by::ColorBy;
use super::state::Tone;
use crate::worker::{Command, ViewMode};

impl App {
    /// Changes what the view shows; of two views, the active one.
    pub(super) fn look(&mut self, action: Action, ctx: &egui::Context) {
        match action {
            Action::Show(mode) => {
                *self.layout.mode_of(self.viewport.queries.is_second()) = mode;
                // The rendered image is shown without a tint.
                if mode == ViewMode::Rgb {
                    self.viewport.queries.tint(ColorBy::Masks);
                }
            }
            Action::Tint(by) => self.viewport.queries.tint(by),
            Action::ToggleTimes => self.layout.times = !self.layout.times,
            Action::ToggleCompare => {
                self.layout.compare = !self.layout.compare;
                if self.layout.compare && self.viewport.photo_index().is_none() {
                    self.view(&Action::NextPhoto, ctx);
                }
            }
            Action::ToggleSplit => {
                self.layout.split_view = !self.layout.split_view;
                self.viewport.queries.work_in(self.layout.split_view);
            }
            Action::OtherView if self.layout.split_view => {
                self.viewport.queries.work_in(!self.viewport.queries.is_second());
            }
            Action::OtherView => self.state.toast(Tone::Info, "There is one view: split it first (8)."),
            Action::OpenBeside(None) => self.state.beside = None,
            Action::OpenBeside(Some(path)) => {
                self.layout.split_view = true;
                self.submit(Command::OpenBeside { path });
            }
            Action::ToggleDim => self.layout.dim = !self.layout.dim,
            Action::ToggleCameras => self.layout.cameras = !self.layout.cameras,
            _ => {}
        }
    }
}
