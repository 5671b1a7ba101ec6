//! The window itself: its panes, its theme and the full view.

use egui::{Context, ThemePreference, ViewportCommand};

use crate::ui::app::App;
use crate::ui::dock::Dock;
use crate::ui::layout::Layout;
use crate::ui::state::Tone;

/// Shows only the view, or everything again.
pub(in crate::ui) fn fill(app: &mut App, ctx: &Context) {
    app.full_view = !app.full_view;
    ctx.send_viewport_cmd(ViewportCommand::Fullscreen(app.full_view));
    if app.full_view {
        app.state.toast(Tone::Info, "Esc or F11 brings the panes back.");
    }
}

pub(in crate::ui) fn reset_panes(app: &mut App) {
    app.layout.dock = Dock::default();
    app.layout.hidden = Layout::default().hidden;
}

pub(in crate::ui) fn use_theme(app: &mut App, ctx: &Context, theme: ThemePreference) {
    app.layout.theme = theme;
    ctx.set_theme(theme);
}
