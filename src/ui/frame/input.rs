//! Keys and dropped files, taken before anything is drawn.

use std::path::PathBuf;

use egui::{Context, Key, Modifiers};

use crate::jobs::locate::is_picture;
use crate::measure::is_report;
use crate::ui::act::{act, edits, query};
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::keys;

/// Takes keys and dropped files, before anything is drawn.
pub(super) fn take(app: &mut App, ctx: &Context) {
    let has_other_dialog = app.state.error.is_some()
        || app.state.unposed.is_some()
        || app.question.is_some()
        || app.find_dialog.is_open()
        || app.export_dialog.is_some()
        || app.asks_for_video
        || app.keep_dialog.is_some();
    // The window's file dialog takes letters itself.
    let has_dialog = has_other_dialog || app.dialogs.is_own_open();
    keys::watch_typing(ctx, has_other_dialog && !app.dialogs.is_own_open());
    // An open menu takes the keys; Escape closes only the menu.
    let has_menu = egui::Popup::is_any_open(ctx);
    if has_menu && !app.dialogs.is_own_open() && ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape)) {
        egui::Popup::close_all(ctx);
    }
    query::follow_vain_query(app, ctx);
    if !app.palette.is_open() && !has_dialog && !app.sheet && app.help.is_none() && !has_menu {
        // Enter keeps what is measured, and applies what is moved.
        let is_free = !keys::is_typing(ctx) && ctx.memory(|m| m.focused()).is_none();
        if let Some(entered) = app.viewport.on_enter().filter(|_| is_free)
            && ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Enter))
        {
            app.actions.push(entered);
        }
        for action in keys::pressed(ctx) {
            // Without a scene there is nothing to talk about.
            let opens_last = action == Action::StartChat && app.state.scene.is_none() && app.state.job.is_none();
            let action = if opens_last { Action::OpenLast } else { action };
            if keys::opens_field(&action) {
                // Before drawing: text typed in this frame belongs to the field.
                keys::begin_typing(ctx);
                edits::settle(app, false);
                act(action, app, ctx);
            } else {
                app.actions.push(action);
            }
        }
    }
    let dropped: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_path_buf()).collect());
    match dropped.as_slice() {
        [one, other, ..] if is_report(one) && is_report(other) => {
            app.actions.extend([Action::OpenReport(one.clone()), Action::CompareReport(other.clone())]);
        }
        [first, _, ..] if app.state.scene.is_some() && is_picture(first) => {
            let photos = dropped.iter().filter(|path| is_picture(path)).cloned().collect();
            app.actions.push(Action::LocatePhotos(photos));
        }
        [first, ..] if first.is_dir() && app.state.why_no_added_photos().is_none() => {
            app.actions.push(Action::OfferPhotos(first.clone()));
        }
        all => app.actions.extend(all.first().cloned().map(Action::Open)),
    }
}
