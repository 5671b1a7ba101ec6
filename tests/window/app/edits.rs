//! Edits of objects by the user, and undoing them.

use std::path::{Path, PathBuf};

use egui::accesskit::{Role, Toggled};
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;
use fmlgs::worker::ViewMode;

use super::Window;
use crate::cli_support::first_version;

/// Three boxes and their photos, trained for a moment by the first version.
pub(crate) fn boxes(folder: &Path) -> PathBuf {
    first_version(folder);
    folder.join("scene")
}

/// A window with the boxes, drawn.
pub(crate) fn window(folder: &Path) -> Window {
    let mut w = Window::new(Some(Action::Open(boxes(folder))));
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.state_mut().layout.hidden.extend([Pane::Training, Pane::Plan, Pane::Models, Pane::Dataset]);
    w.harness.run_steps(2);
    w
}

fn name(app: &App, id: u32) -> String {
    app.state.semantics.as_ref().expect("objects").identities.name(id)
}

/// Returns whether the window has shown this message: messages go away by themselves, the log has them all.
fn said(app: &App, text: &str) -> bool {
    app.state.log.iter().any(|line| line.text.contains(text))
}

/// Returns whether the check box of a row is set; `None` if it is in between.
fn tick(w: &Window, name: &str) -> Option<bool> {
    let label = format!("{name} is visible");
    match w.harness.get_by_role_and_label(Role::CheckBox, &label).accesskit_node().toggled() {
        Some(Toggled::True) => Some(true),
        Some(Toggled::False) => Some(false),
        _ => None,
    }
}

fn undo(w: &mut Window) {
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    w.harness.run_steps(3);
}

#[test]
fn a_name_is_typed_in_its_row() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let center = |a: &App| a.viewport.picture().expect("drawn").camera.center;
    let home = center(w.app());
    let row = w.harness.get_by_role_and_label(Role::Button, "box 0").rect().center();
    w.double_click(row);
    assert!(w.shows("New name"), "a double click makes the name a field");
    // All of it is selected, so the first letter takes its place.
    w.types("wade");
    w.press(Key::Enter);
    w.until("the new name", |a| name(a, 1) == "wade");
    assert!(said(w.app(), "Renamed box 0 to wade") && !w.shows("New name"));
    assert_eq!(center(w.app()), home, "letters are no flight");

    let menus = |w: &Window| w.harness.query_all_by_role_and_label(Role::Button, "\u{2026}").count();
    w.harness.hover_at(egui::pos2(5.0, 5.0));
    w.harness.run_steps(2);
    assert_eq!(menus(&w), 1, "the menu of what is selected, for the keyboard; names have their room");
    w.press(Key::F2);
    assert!(w.shows("New name"), "F2 renames what was chosen last");
    w.types("no");
    w.press(Key::Escape);
    w.harness.run_steps(3);
    assert_eq!(name(w.app(), 1), "wade", "Escape leaves it");
    assert!(!w.shows("New name"));
    // A name of letters that no font of the window has: drawing it would fail the test.
    w.ask(Action::Change(Edit::Rename(1, "\u{6c34}\u{58f6}".into())));
    w.until("the Chinese name", |a| name(a, 1) == "\u{6c34}\u{58f6}");
    assert!(!said(w.app(), "to no"), "what was left by Escape is not taken over later");
    assert!(w.is_drawn());
}

#[test]
fn one_history_takes_everything_back_in_order() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Isolate(Some(2)));
    assert_eq!([1, 2, 3].map(|i| tick(&w, &format!("box {}", i - 1))), [Some(false), Some(true), Some(false)]);
    assert!(said(w.app(), "Showed only box 1"), "it says what it did");
    w.ask(Action::Hide(3));
    assert_eq!(tick(&w, "box 2"), Some(true), "a tick adds to what is isolated");
    w.ask(Action::Change(Edit::Rename(1, "crate".into())));
    w.until("the new name", |a| name(a, 1) == "crate");
    w.ask(Action::AddKey);
    w.ask(Action::Show(ViewMode::Depth));
    w.ask(Action::Change(Edit::Merge(1, 2)));
    w.until("one object less", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 2));
    assert_eq!((tick(&w, "box 1"), tick(&w, "box 2")), (Some(true), Some(true)), "under their new numbers");

    undo(&mut w);
    w.until("both objects", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 3));
    assert!(said(w.app(), "Undone: merged crate into box 1"));
    assert_eq!(tick(&w, "crate"), Some(false), "hidden as before");
    undo(&mut w);
    assert_eq!(w.app().layout.mode, ViewMode::Rgb);
    undo(&mut w);
    assert!(said(w.app(), "Undone: added a keyframe") && w.shows("No keyframes yet"));
    undo(&mut w);
    w.until("the old name", |a| name(a, 1) == "box 0");
    undo(&mut w);
    assert_eq!(tick(&w, "box 2"), Some(false));
    undo(&mut w);
    assert_eq!(tick(&w, "box 0"), Some(true), "all of it is shown");
    undo(&mut w);
    assert!(said(w.app(), "Nothing to undo."));
    for _ in 0..6 {
        w.ask(Action::Redo);
        w.harness.run_steps(3);
    }
    w.until("all of it again", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 2));
    assert_eq!(w.app().layout.mode, ViewMode::Depth);
    w.ask(Action::Redo);
    assert!(said(w.app(), "Nothing to redo.") && w.app().state.error.is_none());
}

#[test]
fn what_cannot_be_done_says_the_true_reason_in_one_line() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let add = |of, gaussians| Action::Change(Edit::AddPiece { of, name: "crumb".into(), gaussians });
    w.ask(add(1, (0..196).collect()));
    w.until("a part", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 4));
    let warned = |a: &App, text: &str| a.state.log.iter().filter(|l| l.text.contains(text)).count() == 1;
    let elsewhere = w.app().state.semantics.as_ref().and_then(|m| m.identity_of.iter().position(|id| *id == 3));
    for (action, reason) in [
        (Action::Change(Edit::Split(1)), "consists of its parts: only 0 of its"),
        (add(2, Vec::new()), "nothing is selected"),
        (add(2, vec![elsewhere.expect("a Gaussian of a box") as u32]), "is not a piece of 'box 1'"),
        (Action::Change(Edit::Merge(4, 4)), "cannot become one"),
    ] {
        w.ask(action);
        w.until(reason, |a| warned(a, reason));
        assert!(w.app().state.error.is_none(), "no box");
    }
    undo(&mut w);
    w.until("no part", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 3));
}

#[test]
fn one_more_photo_is_segmented_and_that_is_taken_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let layout = &mut w.harness.state_mut().layout;
    (layout.finding.max_seeds, layout.finding.encoder) = (1, Some("none".into()));
    w.ask(Action::FindObjects);
    w.until("objects", |a| said(a, " found"));
    w.ask(Action::Change(Edit::Rename(1, "crate".into())));
    w.until("the name", |a| name(a, 1) == "crate");
    w.ask(Action::SegmentPhoto);
    w.until("one more photo", |a| said(a, "Added objects from "));
    assert!(said(w.app(), "were nobody's before"), "what came to be known is told");
    assert_eq!(name(w.app(), 1), "crate", "what was done by hand stays");
    w.ask(Action::Undo);
    w.until("undone", |a| said(a, "Undone: added objects from "));
    assert_eq!(name(w.app(), 1), "crate");
    w.ask(Action::Undo);
    w.until("the old name", |a| name(a, 1) != "crate");
}

#[test]
fn photos_without_labels_offer_masks_from_files_beside_networks() {
    let folder = tempfile::tempdir().expect("folder");
    boxes(folder.path());
    for labels in ["object_ids", "part_ids"] {
        std::fs::remove_dir_all(folder.path().join("photos").join(labels)).expect("removed");
    }
    std::fs::remove_file(folder.path().join("photos/identities.json")).expect("removed");
    let mut w = Window::new(Some(Action::Open(folder.path().join("scene"))));
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.ask(Action::FindObjects);
    w.harness.run_steps(3);
    assert!(w.shows("Find objects and parts"));
    let start = std::time::Instant::now();
    while !w.shows("Masks from files") {
        assert!(start.elapsed() < std::time::Duration::from_secs(60), "the models are listed");
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    w.click("Masks from files\u{2026}");
    w.until("a choice of a folder", |a| a.chooses_file());
    w.harness.run_steps(3);
    assert!(w.shows("Folder with masks") && !w.shows("Masks from files"), "in place of the dialog");
}
