//! The context menu of the view: of the thing under the cursor, or of the scene.

use egui::Ui;

use crate::scene::{Identities, IdentityId, NO_IDENTITY};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::object_menu;
use crate::ui::viewport::visible::Visibility;

/// Draws the menu of an identity, or of the view without one.
pub(super) fn show(ui: &mut Ui, all: &Identities, id: Option<IdentityId>, visibility: &Visibility, cx: &mut Ctx<'_>) {
    if let Some(id) = id.filter(|id| all.get(*id).is_some()) {
        let is_hidden = visibility.draws(all, id) == Some(false);
        return object_menu::show(ui, all, id, is_hidden, cx);
    }
    for (action, name) in [
        (Action::SegmentNew(Some(NO_IDENTITY)), "New object\u{2026}"),
        (Action::FrameScene, "Frame the scene"),
        (Action::ResetView, "Reset the view"),
        (Action::Isolate(None), "Show all objects"),
    ] {
        if ui.button(name).on_hover_text(action.tooltip()).clicked() {
            cx.ask(action);
            ui.close();
        }
    }
}
