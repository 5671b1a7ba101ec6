//! The context menu of the identity under the cursor.

use egui::{RichText, Ui};

use crate::navigate::target::Side;
use crate::scene::{Identities, IdentityId, NO_IDENTITY, text};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;

/// Draws the menu of an identity, or of the view without one.
pub(super) fn show(ui: &mut Ui, all: &Identities, id: Option<IdentityId>, cx: &mut Ctx<'_>) {
    let state = cx.state;
    let mut row = |ui: &mut Ui, action: Action, name: &str| {
        if ui.button(name).on_hover_text(action.tooltip()).clicked() {
            cx.ask(action);
            ui.close();
        }
    };
    let Some(id) = id.filter(|id| all.get(*id).is_some()) else {
        row(ui, Action::SegmentNew(Some(NO_IDENTITY)), "Select an object by clicks\u{2026}");
        row(ui, Action::FrameScene, "Frame the scene");
        row(ui, Action::ResetView, "Reset the view");
        row(ui, Action::Isolate(None), "Show all objects");
        return;
    };
    ui.label(RichText::new(text::elided(&state.labels.full_name(all, id), 48)).strong());
    ui.separator();
    row(ui, Action::GoToTarget(id, Side::Best), "Go there");
    row(ui, Action::Ask(all.full_name(id)), "Query this");
    row(ui, Action::Rename, "Rename\u{2026}");
    row(ui, Action::Isolate(Some(id)), "Isolate");
    row(ui, Action::Hide(id), "Hide");
    row(ui, Action::Isolate(None), "Show all objects");
    ui.separator();
    row(ui, Action::Correct(id), "Correct by clicks\u{2026}");
    row(ui, Action::SegmentNew(Some(id)), "Select a new part by clicks\u{2026}");
    row(ui, Action::Transform(id), "Transform\u{2026}");
    row(ui, Action::Remove(id), "Remove and fill");
    row(ui, Action::ExportTarget(id), "Export Gaussians\u{2026}");
}
