//! Edits of Gaussians: measuring, deleting, and arranging of objects and parts.

use std::sync::Arc;

use super::app::App;
use super::history::EditStep;
use super::state::Tone;
use crate::jobs::clean::MeasureRequest;
use crate::jobs::rearrange::SplatEdit;
use crate::ui::actions::Pane;
use crate::worker::Command;

impl App {
    /// Measures the Gaussians on screen.
    pub(super) fn measure_splats(&mut self) {
        let Some((scene, cloud)) = self.state.scene.clone().zip(self.viewport.cloud().cloned()) else { return };
        if !self.state.is_trained() {
            return self.state.toast(Tone::Warning, "Only trained Gaussians can be cleaned.");
        }
        self.layout.show(Pane::Clean);
        let path = scene.stored().to_path_buf();
        self.submit(Command::MeasureSplats(Box::new(MeasureRequest { path, cloud: Arc::clone(&cloud) })));
    }

    /// Applies the arrangement that the view previews.
    pub(super) fn keep_arranged(&mut self) {
        if let Some(tool) = self.viewport.arrange.take() {
            self.edit(EditStep::Rearrange(SplatEdit::Arrange(tool.arrangement())));
        }
    }

    /// Deletes the chosen Gaussians.
    pub(super) fn delete_chosen(&mut self) {
        match self.clean.take_chosen() {
            Some(gone) => self.edit(EditStep::Rearrange(SplatEdit::Delete(gone))),
            None => self.state.toast(Tone::Info, "No Gaussians are chosen: measure them in the Clean pane."),
        }
    }
}
