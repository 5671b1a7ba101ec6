//! Everything by key presses alone, and a name for everything that can be reached by them.

use std::path::{Path, PathBuf};

use egui::accesskit::{Action as Ability, Role};
use egui::{Key, Modifiers};
use egui_kittest::kittest::NodeT;
use strum::VariantArray;

use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::{Window, edits, photos, report, write_splat};

/// The boxes, half of the first being its part "lid"; stored.
fn boxes_with_a_lid(folder: &Path) -> PathBuf {
    let mut w = edits::window(folder);
    let map = w.app().state.semantics.clone().expect("objects");
    let gaussians =
        (0..map.identity_of.len() as u32).filter(|i| map.identity_of[*i as usize] == 1).step_by(2).collect();
    w.ask(Action::Change(Edit::AddPiece { of: 1, name: "lid".into(), gaussians }));
    w.until("a part", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 4));
    folder.join("scene")
}

fn ctrl(w: &mut Window, key: Key) {
    w.harness.key_press_modifiers(Modifiers::COMMAND, key);
    w.harness.run_steps(3);
}

/// Runs an action of the palette by a part of its name, or opens a path.
fn palette(w: &mut Window, text: &str) {
    ctrl(w, Key::P);
    // One event: a path has keys that no keyboard has by that name.
    w.harness.event(egui::Event::Text(text.into()));
    w.harness.run_steps(2);
    w.press(Key::Enter);
    w.harness.run_steps(2);
}

/// Role and name of the node that has the keyboard.
fn focused(w: &Window) -> Option<(Role, String)> {
    let nodes = w.harness.root().children_recursive();
    let mut with = nodes.filter(|n| n.accesskit_node().is_focused());
    with.next().map(|n| (n.accesskit_node().role(), n.accesskit_node().label().unwrap_or_default()))
}

/// Presses Tab until something of this name has the keyboard.
fn tab_to(w: &mut Window, role: Role, name: &str) {
    let mut seen = Vec::new();
    for _ in 0..300 {
        if focused(w).is_some_and(|(r, n)| r == role && n == name) {
            return;
        }
        seen.push(focused(w));
        w.press(Key::Tab);
    }
    panic!("Tab never comes to {name}, but to {seen:?}");
}

fn name(app: &App, id: u32) -> String {
    app.state.semantics.as_ref().expect("objects").identities.name(id)
}

#[test]
fn all_of_a_session_is_done_by_keys_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = boxes_with_a_lid(folder.path());
    let mut w = Window::new(None);
    w.harness.run_steps(2);
    palette(&mut w, &scene.to_string_lossy());
    w.until("its objects", |a| a.state.semantics.is_some());
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    let selected = |w: &Window| w.app().viewport.picking.selected();

    // Ask, and go to the part that is meant.
    w.press(Key::Slash);
    w.types("lid of the box 0");
    w.press(Key::Enter);
    w.until("the answer", |a| a.viewport.queries.found() == [4]);
    w.press(Key::Escape);
    let home = w.app().viewport.pose().center;
    w.press(Key::G);
    w.until("the flight", |a| a.viewport.pose().center != home);

    // Through the objects and into one.
    let go = |w: &mut Window, key: Key| {
        w.press(key);
        selected(w)
    };
    assert_eq!([Key::N, Key::N, Key::P].map(|key| go(&mut w, key)), [Some(1), Some(2), Some(1)]);
    assert_eq!((go(&mut w, Key::P), go(&mut w, Key::N)), (Some(3), Some(1)), "around");
    assert_eq!((go(&mut w, Key::O), go(&mut w, Key::N)), (Some(4), Some(4)), "its only part");
    w.press(Key::O);
    assert!(w.shows("has no parts"));

    // Rename, hide, undo.
    w.press(Key::F2);
    w.types("cover");
    w.press(Key::Enter);
    w.until("the new name", |a| name(a, 4) == "cover");
    w.press(Key::H);
    let hidden = |a: &App| a.state.log.iter().any(|l| l.text.starts_with("Hid cover"));
    w.until("it is hidden", hidden);
    ctrl(&mut w, Key::Z);
    ctrl(&mut w, Key::Z);
    w.until("the old name", |a| name(a, 4) == "lid");
    w.press(Key::Escape);
    assert_eq!(selected(&w), None);

    // Export: the window's own dialog, as the system has none here.
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    ctrl(&mut w, Key::E);
    w.press(Key::Enter);
    w.until("a dialog", |a| a.chooses_file());
    w.press(Key::Enter);
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with("Saved to ")));

    // A setting of the next training.
    palette(&mut w, "show the training pane");
    assert!(w.app().layout.shows(Pane::Training));
    tab_to(&mut w, Role::SpinButton, "Steps");
    w.types("1234");
    w.press(Key::Enter);
    w.harness.run_steps(2);
    assert_eq!(w.app().layout.config.steps, 1_234);
    assert!(w.app().state.error.is_none());
}

#[test]
fn the_tools_of_the_view_are_used_by_keys_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = edits::window(folder.path());
    let press = |w: &mut Window, name: &str| {
        tab_to(w, Role::Button, name);
        // Enter goes to the chat, whatever has the focus.
        w.press(Key::Space);
        w.harness.run_steps(2);
    };
    palette(&mut w, "gaussians by brush");
    assert!(w.shows("New object: "));
    press(&mut w, "Lasso");
    assert!(w.shows("draw a loop"));
    press(&mut w, "Cancel");
    assert!(!w.shows("New object: "));

    // Every field of the card that moves a box is reached.
    w.press(Key::N);
    palette(&mut w, "move, turn or recolor");
    assert!(w.shows("drag an arrow or type values"));
    for name in ["Move along x, m", "Turn", "Scale", "Brightness", "Saturation"] {
        tab_to(&mut w, Role::SpinButton, name);
    }
    tab_to(&mut w, Role::CheckBox, "Apply to a copy");
    assert!(w.app().state.error.is_none());
}

/// Returns whether a node can have the keyboard or be clicked, and has no name.
fn is_nameless(node: &egui_kittest::Node<'_>) -> bool {
    let it = node.accesskit_node();
    let reachable = [Ability::Click, Ability::Focus].into_iter().any(|ability| it.data().supports_action(ability));
    // The name of a text is the text, and what is scrolled has a name, not the bar beside it.
    let is_own = matches!(it.role(), Role::Label | Role::ScrollBar);
    // Gaps and tab bars of the dock, which are dragged: its crate names the tabs alone.
    let is_dock = it.role() == Role::Unknown && {
        let size = node.rect().size();
        size.min_elem() <= 7.0 || (size.y == 28.0 && size.x > 100.0)
    };
    reachable && !is_own && !is_dock && it.label().is_none_or(|name| name.trim().is_empty())
}

fn nameless(w: &Window) -> Vec<String> {
    let without = w.harness.root().children_recursive().filter(is_nameless);
    without
        .map(|node| {
            format!("{:?} at {} {:?}", node.accesskit_node().role(), node.rect(), node.accesskit_node().value())
        })
        .collect()
}

fn named(w: &mut Window, state: &str) {
    w.harness.run_steps(3);
    let without = nameless(w);
    assert!(without.is_empty(), "{state}: {without:#?}");
}

#[test]
fn everything_that_can_be_reached_has_a_name() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(None);
    named(&mut w, "the first page");
    for (action, state) in [(Action::Palette, "the palette"), (Action::Shortcuts, "the sheet")] {
        w.ask(action.clone());
        named(&mut w, state);
        w.press(Key::Escape);
    }
    for menu in ["File", "Edit", "View", "Train", "Help"] {
        w.click(menu);
        named(&mut w, menu);
        w.press(Key::Escape);
    }
    w.ask(Action::Open("/no/such/scene".into()));
    w.until("the error", |a| a.state.error.is_some());
    named(&mut w, "an error");
    w.click("Close");

    w.ask(Action::Open(boxes_with_a_lid(folder.path())));
    w.until("its objects", |a| a.state.semantics.is_some());
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    named(&mut w, "a scene");
    w.ask(Action::Ask("box 1".into()));
    w.ask(Action::Select(Some(1)));
    named(&mut w, "an answer");
    for &pane in Pane::VARIANTS {
        let shown: Vec<Pane> = Pane::VARIANTS.iter().copied().filter(|p| *p != pane).collect();
        w.harness.state_mut().layout.hidden = shown.into_iter().collect();
        w.ask(Action::ShowPane(pane));
        named(&mut w, &format!("{pane:?}"));
    }
    w.harness.state_mut().layout.hidden = Pane::VARIANTS.iter().copied().filter(|p| *p != Pane::Objects).collect();
    for tool in [Action::Measure, Action::Crop, Action::Inspect, Action::SegmentNew(Some(0))] {
        w.ask(tool.clone());
        named(&mut w, &format!("{tool:?}"));
        w.press(Key::Escape);
    }
    w.ask(Action::Rename);
    named(&mut w, "a name that is typed");
    w.press(Key::Escape);
    w.ask(Action::AddKey);
    named(&mut w, "a keyframe");
    w.ask(Action::NextPhoto);
    w.ask(Action::ToggleCompare);
    named(&mut w, "a photo beside the rendering");
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.ask(Action::ExportPly);
    named(&mut w, "a dialog for Gaussians");
    w.press(Key::Enter);
    w.until("a dialog", |a| a.chooses_file());
    named(&mut w, "a dialog for files");
    w.press(Key::Escape);
    w.ask(Action::ExportVideo);
    assert!(w.shows("1280 \u{d7} 720 px"));
    named(&mut w, "a dialog for a video");
    w.press(Key::Escape);

    report::write_report(&folder.path().join("report"), 1.0, 2);
    w.ask(Action::OpenReport(folder.path().join("report")));
    w.until("the report", |a| a.state.report.is_some());
    named(&mut w, "a report");
    // Without objects there are other things on screen; while a job runs too.
    w.ask(Action::Open(photos()));
    w.until("the photos", |a| a.state.scene.as_ref().is_some_and(|s| s.name.contains("table")));
    w.harness.state_mut().layout.hidden.clear();
    w.harness.state_mut().layout.config.steps = 50_000;
    named(&mut w, "photos");
    w.ask(Action::StartTraining);
    w.until("training", |a| a.state.history.steps.len() > 2);
    named(&mut w, "training");
    w.ask(Action::Open(write_splat(folder.path())));
    named(&mut w, "a question");
    w.click("Stop and continue");
    w.until("the splat", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    named(&mut w, "a splat");
}

#[test]
fn what_has_no_name_is_found() {
    let builder = egui_kittest::Harness::builder().with_accessibility_check(false);
    let mut harness = builder.build_ui(|ui| {
        ui.label("a text");
        ui.button("named").clicked();
        let (_, response) = ui.allocate_exact_size(egui::vec2(20.0, 20.0), egui::Sense::click());
        response.clicked();
        ui.add(egui::TextEdit::singleline(&mut String::from("text"))).has_focus();
    });
    harness.run_steps(2);
    let count = harness.root().children_recursive().filter(is_nameless).count();
    assert_eq!(count, 2, "the bare area and the field, not the text and the button");
}
