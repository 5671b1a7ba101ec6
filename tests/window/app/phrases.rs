//! Lists of phrases and true masks, in a window that knows its objects.

use std::path::Path;

use fmlgs::ui::actions::{Action, Pane};

use super::Window;

/// Asks phrases of the view, writes their masks, and compares answers with one of them.
pub fn are_listed_exported_and_compared(w: &mut Window, folder: &Path) {
    // A list of phrases in this view, then against a true mask: here the answer's own.
    // The pane takes its room from the view: masks are of the view beside it.
    w.ask(Action::TogglePane(Pane::Phrases));
    w.harness.run_steps(4);
    w.until("what the pixels belong to", |a| {
        let seen = a.viewport.picture().map(|p| p.camera.limited_to(1008).height_px as usize);
        a.viewport.queries.maps().is_some_and(|m| seen == Some(m.identities.height_px))
    });
    w.harness.state_mut().phrases.text = "the table\ngiraffe\n".into();
    w.ask(Action::RunPhrases(Some(folder.join("masks"))));
    w.until("the answers", |a| a.state.phrases.rows.len() == 2);
    assert!(w.shows("1 of 2 questions answered") && w.app().state.phrases.rows.iter().all(|r| r.iou.is_none()));
    let table_mask = folder.join("masks/masks/this_view/the_table.png");
    w.ask(Action::Ask("table".into()));
    // Beside the pane the view is small.
    w.click("Unfold the answer");
    w.ask(Action::TrueMask(Some(table_mask)));
    w.harness.run_steps(4);
    assert!(w.shows("IoU 0.9") || w.shows("IoU 1.0"), "drawn twice, it is the same but for its edge");
    // The control: a part of the scene is not the table.
    w.ask(Action::Ask("red controller".into()));
    w.harness.run_steps(4);
    assert!(w.shows("IoU 0.0") && w.shows(" missed"), "nothing of it is met");
    w.ask(Action::RunPhrases(None));
    w.until("IoU in the table", |a| a.state.phrases.rows.iter().any(|r| r.iou.is_some_and(|v| v > 0.9)));
    w.ask(Action::TrueMask(None));
    w.harness.run_steps(4);
    assert!(!w.shows(" missed"), "shown plainly again");
    w.ask(Action::TogglePane(Pane::Phrases));
}
