//! The window itself: its panes, its theme and the full view.

use egui::{Context, ThemePreference, ViewportCommand};

use super::remote;
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::dock::Dock;
use crate::ui::layout::Layout;
use crate::ui::state::{RunningJob, Tone};
use crate::worker::Makes;

/// Asks once before the window closes while a job runs; waits while a camera path or measurements are stored. A job on
/// another computer goes on there.
pub(in crate::ui) fn watch_close(app: &mut App, ctx: &Context) {
    let is_storing = app.stored_path.is_storing || app.measured.is_storing;
    if app.quits && !is_storing {
        return ctx.send_viewport_cmd(ViewportCommand::Close);
    }
    let is_here = |job: &&RunningJob| !remote::is_remote(job.id) && !job.canceling && job.info.makes != Makes::Scene;
    if !ctx.input(|i| i.viewport().close_requested()) {
        return;
    }
    let Some(job) = app.state.job.as_ref().filter(is_here).filter(|_| !app.quits) else {
        // What was changed last is stored in a moment.
        if is_storing {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            app.quits = true;
        }
        return;
    };
    ctx.send_viewport_cmd(ViewportCommand::CancelClose);
    let unsaved = if app.stored_path.waits { " The camera path is stored once it has ended." } else { "" };
    let text = format!("{} is still running. {}{unsaved}", job.info.title, job.leaves());
    let question = Question { text, yes: "Quit", other: None, no: "Keep running", deletes: false };
    app.put_question(question, |app, answer| app.quits = answer == DialogAnswer::Yes);
}

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
