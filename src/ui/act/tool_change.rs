//! Actions that would end a tool with unfinished work: the user is asked first.

use super::edit;
use crate::jobs::locate::is_picture;
use crate::measure::is_report;
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};

/// Returns the action, or asks first if it would drop unfinished work of the tool in use.
pub(super) fn checked(action: Action, app: &mut App) -> Option<Action> {
    let Some(work) = app.viewport.unfinished().filter(|_| ends_tool(&action, app)) else { return Some(action) };
    let name = action.text();
    let text = format!("The {work} is not kept yet. \u{201c}{}\u{201d} ends it.", name.trim_end_matches('\u{2026}'));
    let keep = app.viewport.can_keep().then_some("Keep it");
    let question = Question { text, yes: "Discard it", other: keep, no: "Go back", deletes: true };
    app.put_question(question, |app, answer| {
        match answer {
            DialogAnswer::No => return,
            DialogAnswer::Yes => app.viewport.end_tool(),
            DialogAnswer::Other if app.viewport.is_selecting() => edit::add_segment(app),
            DialogAnswer::Other => edit::apply_transform(app),
        }
        app.ask(action);
    });
    None
}

/// True if an action begins another tool, or opens another scene.
fn ends_tool(action: &Action, app: &App) -> bool {
    match action {
        Action::Measure
        | Action::Crop
        | Action::Inspect
        | Action::PaintTrueMask
        | Action::RefineChosen
        | Action::SegmentNew(Some(_))
        | Action::Correct(_)
        | Action::Transform(_)
        | Action::OpenDemo
        | Action::TrainDemo
        | Action::FindPoses(_)
        | Action::Connect(_) => true,
        Action::SelectBy(_) => !app.viewport.is_selecting(),
        // Reports, settings and photos are no scenes.
        Action::Open(path) => {
            !is_report(path) && !is_picture(path) && path.extension().is_none_or(|ending| ending != "toml")
        }
        _ => false,
    }
}
