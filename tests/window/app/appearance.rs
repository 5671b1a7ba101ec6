//! Appearance of rows, tabs, messages and help, and the offers of the chat.

use egui::Key;
use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::{Window, write_splat};

fn rect(w: &Window, role: Role, label: &str) -> egui::Rect {
    w.harness.get_by_role_and_label(role, label).rect()
}

/// Says a sentence in the chat, and waits for the answer.
fn say(w: &mut Window, sentence: &str) {
    w.harness.get_by_role_and_label(Role::TextInput, "Chat box").focus();
    w.harness.run_steps(2);
    w.types(sentence);
    w.press(Key::Enter);
    w.harness.run_steps(2);
    w.until("the answer", |a| a.conversation().is_some());
    w.harness.run_steps(2);
}

#[test]
fn rows_keep_their_place_digits_their_room_and_the_chat_knows_where_things_are_done() {
    let mut w = Window::new(Some(Action::OpenDemo));
    w.until("objects", |a| a.state.semantics.is_some());
    w.harness.run_steps(4);
    let [name, count, edge] = ["teddy bear", "2,561", "Menu of Objects"];
    let before = rect(&w, Role::Button, name);
    let menus = |w: &Window| w.harness.query_all_by_label("\u{2026}").count();
    let without = menus(&w);
    w.harness.hover_at(before.center());
    w.harness.run_steps(3);
    assert_eq!(menus(&w), without + 1, "the menu of the row has come");
    assert_eq!(rect(&w, Role::Button, name), before, "the name has not moved");
    // The list scrolls: its bar stands beside the digits, which end 10 points from the menu in a list that fits.
    let (digits, pane) = (w.harness.get_by_label(count).rect(), rect(&w, Role::Button, edge));
    assert!(digits.right() < pane.right() - 18.0, "{digits} {pane}");

    w.ask(Action::ShowPane(Pane::Clean));
    w.ask(Action::ShowPane(Pane::Training));
    w.harness.run_steps(6);
    let is_whole = |w: &Window, front: Pane| {
        let menu = rect(w, Role::Button, &format!("Menu of {}", <&str>::from(front)));
        rect(w, Role::Button, "Scene plan").right() <= menu.left()
    };
    let fits = is_whole(&w, Pane::Training);
    w.ask(Action::ShowPane(Pane::Plan));
    w.harness.run_steps(8);
    assert!(is_whole(&w, Pane::Plan), "the tab in front shows all of its name");
    assert!(!fits, "control: behind others it is cut");

    let offers = "The chat does not do this";
    say(&mut w, "hide the kettle");
    assert!(w.shows("kettle is hidden") && !w.shows(offers), "a command is carried out as before");
    say(&mut w, "where is the video");
    assert!(!w.shows(offers), "a thing that is not there is no wish");
    say(&mut w, "make the red controller green");
    assert!(w.shows(offers) && w.shows("Move, turn or recolor: red controller"));
    say(&mut w, "take a screenshot and save it");
    w.harness.get_by_label_contains("Save the view as .png").click();
    w.until("the file dialog", App::chooses_file);
}

#[test]
fn one_message_at_a_time_stands_in_the_status_bar() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.ask(Action::Undo);
    w.harness.run_steps(2);
    assert!(w.shows("Nothing to undo"));
    w.ask(Action::ExportCrop);
    w.harness.run_steps(2);
    let message = w.harness.get_by_label_contains("no crop box yet").rect();
    assert!(message.top() >= rect(&w, Role::Image, "Viewport").bottom(), "it covers no card");
    assert!(!w.shows("Nothing to undo"), "the last one is replaced");
    assert!(w.app().state.log.iter().any(|l| l.text.contains("Nothing to undo")), "but it is in the log");
    w.click("Dismiss the message");
    assert!(!w.shows("no crop box yet") && w.shows("Ready"));
}

#[test]
fn help_is_read_without_a_network() {
    let mut w = Window::new(None);
    w.harness.run_steps(2);
    w.ask(Action::Guide);
    w.harness.run_steps(2);
    assert!(w.shows("Guide to the window") && w.shows("Training pane"));
    w.click("Close");
    assert!(!w.shows("Guide to the window"));
    w.ask(Action::About);
    w.harness.run_steps(2);
    assert!(w.shows(env!("CARGO_PKG_VERSION")) && w.shows("MIT OR Apache-2.0"));
    w.press(Key::Escape);
    assert!(!w.shows("MIT OR Apache-2.0"));
    w.ask(Action::News);
    w.harness.run_steps(2);
    assert!(w.shows("Changelog"));
}
