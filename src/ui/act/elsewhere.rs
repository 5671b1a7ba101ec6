//! Changes that another program made to the open scene: seen when the window gets the focus.

use std::sync::Arc;

use crate::jobs::JobError;
use crate::jobs::workspace::ChangeElsewhere;
use crate::pipeline::observer::Observer;
use crate::ui::actions::Action;
use crate::ui::app::App;
use crate::ui::dialogs::{DialogAnswer, Question};
use crate::ui::state::Tone;
use crate::worker::JobInfo;

/// Compares the open scene with its folder when the window gets the focus.
pub(in crate::ui) fn watch(app: &mut App, ctx: &egui::Context) {
    if ctx.input(|i| i.events.contains(&egui::Event::WindowFocused(true))) {
        check(app);
    }
}

/// Compares the open scene with its folder. Asks whether to open it again if another program has changed it; each
/// change is asked about once.
pub(in crate::ui) fn check(app: &mut App) {
    let scene = app.state.scene.as_ref().filter(|s| s.is_stored() && s.remote.is_none());
    let Some(folder) = scene.filter(|_| app.state.job.is_none() && !app.is_editing()).map(|s| s.out.clone()) else {
        return;
    };
    let (workspace, number) = (Arc::clone(&app.workspace), app.state.scene_number);
    let look = move |_: &mut dyn Observer| Ok::<_, JobError>(workspace.changed_elsewhere(&folder));
    let info = JobInfo::short("Comparing the scene with its folder").aside();
    app.start(info, look, move |app, change| {
        let (Some(change), true) = (change, app.state.scene_number == number) else { return };
        if app.state.job.is_some() || app.is_editing() || app.seen_elsewhere == Some((number, change.clone())) {
            return;
        }
        let Some(scene) = &app.state.scene else { return };
        let (name, folder) = (scene.name.clone(), scene.out.clone());
        app.seen_elsewhere = Some((number, change.clone()));
        if change == ChangeElsewhere::Gone {
            let text = format!(
                "The folder of {name} was moved or deleted by another program: {}. What is shown here can still be \
                 exported (File > Export Gaussians).",
                folder.display()
            );
            return app.state.toast(Tone::Warning, text);
        }
        let text = format!(
            "{name} was changed by another program since it was opened here. Open it again? Without that, changes made \
             here are refused, so that nothing of the other program's is lost."
        );
        let question = Question { text, yes: "Open again", other: None, no: "Keep this view", deletes: false };
        app.put_question(question, |app, answer| {
            if answer == DialogAnswer::Yes {
                app.ask(Action::Open(folder));
            }
        });
    });
}
