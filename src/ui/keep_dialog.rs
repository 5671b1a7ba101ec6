//! The question whether objects and parts that the user edited are kept when objects are found anew.

use std::collections::VecDeque;
use std::path::PathBuf;

use super::theme;
use crate::jobs::find_objects::listed;

/// A search that has not begun.
#[derive(Default)]
pub(super) struct PlannedSearch {
    /// Path of masks to use in place of the photos' own.
    pub(super) masks: Option<PathBuf>,
    /// Models to download first.
    pub(super) missing: VecDeque<String>,
    /// True if objects and parts that the user edited are replaced, too.
    pub(super) replace_all: bool,
}

/// The question, and the search that waits for its answer.
pub(super) struct KeepDialog {
    /// Full names of the objects and parts that the user edited.
    pub(super) by_hand: Vec<String>,
    pub(super) search: PlannedSearch,
}

/// The user's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KeepAnswer {
    Keep,
    ReplaceAll,
    Cancel,
}

impl KeepDialog {
    /// Shows the dialog; returns the answer, once there is one.
    pub(super) fn show(&self, ctx: &egui::Context) -> Option<KeepAnswer> {
        let response = theme::dialog("keep").show(ctx, |ui| {
            ui.set_width(440.0);
            ui.heading(match self.by_hand.len() {
                1 => "Keep the one that you named or made?".to_owned(),
                n => format!("Keep the {n} that you named or made?"),
            });
            ui.add_space(6.0);
            ui.label(listed(&self.by_hand));
            ui.add_space(6.0);
            let text = "The search replaces all others. Those that you keep stay as they are, with their parts and \
                        their wholes. Undo restores the present objects and parts either way.";
            ui.label(egui::RichText::new(text).color(theme::weak()));
            ui.add_space(12.0);
            let buttons = |ui: &mut egui::Ui| {
                let keeps = ui.add(theme::primary_button("Keep them")).clicked();
                let replaces = ui.button("Replace all").clicked();
                let cancels = ui.button("Cancel").clicked();
                let answers =
                    [(keeps, KeepAnswer::Keep), (replaces, KeepAnswer::ReplaceAll), (cancels, KeepAnswer::Cancel)];
                answers.into_iter().find(|(clicked, _)| *clicked).map(|(_, answer)| answer)
            };
            ui.horizontal(buttons).inner
        });
        response.inner.or_else(|| response.should_close().then_some(KeepAnswer::Cancel))
    }
}
