//! The window itself: its panes, its theme and the full view.

use std::path::PathBuf;

use egui::{Context, ThemePreference, ViewportCommand};

use super::{edits, query};
use crate::measure::is_report;
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::dock::Dock;
use crate::ui::keys;
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

/// Takes keys and dropped files, before anything is drawn.
pub(in crate::ui) fn take_input(app: &mut App, ctx: &Context) {
    keys::watch_typing(ctx);
    let has_dialog = app.state.error.is_some()
        || app.state.unposed.is_some()
        || app.question.is_some()
        || app.find_dialog.is_open()
        || app.keep_dialog.is_some()
        || app.dialogs.is_own_open();
    // An open menu takes the keys; Escape closes only the menu.
    let has_menu = egui::Popup::is_any_open(ctx);
    if has_menu && ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)) {
        egui::Popup::close_all(ctx);
    }
    query::follow_vain_query(app, ctx);
    if !app.palette.is_open() && !has_dialog && !app.sheet && !has_menu {
        for action in keys::pressed(ctx) {
            if keys::opens_field(&action) {
                // Before drawing: text typed in this frame belongs to the field.
                keys::begin_typing(ctx);
                edits::settle(app, false);
                action.act(app, ctx);
            } else {
                app.actions.push(action);
            }
        }
    }
    let dropped: Vec<PathBuf> =
        ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).take(2).collect());
    match dropped.as_slice() {
        [one, other] if is_report(one) && is_report(other) => {
            app.actions.extend([Action::OpenReport(one.clone()), Action::CompareReport(other.clone())]);
        }
        all => app.actions.extend(all.first().cloned().map(Action::Open)),
    }
}
