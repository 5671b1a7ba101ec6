//! Keys belong to the field that is open, from the very frame in which it opens, and to the view only while they are
//! pressed for it.

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::{Window, edits, photos, write_splat};

fn key(key: Key, pressed: bool, modifiers: Modifiers) -> Event {
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }
}

/// Events of a keyboard for these letters.
fn letters(text: &str) -> Vec<Event> {
    let of = |letter: char| {
        let pressed = Key::from_name(&letter.to_uppercase().to_string());
        let down = pressed.map(|k| key(k, true, Modifiers::NONE));
        let up = pressed.map(|k| key(k, false, Modifiers::NONE));
        down.into_iter().chain([Event::Text(letter.into())]).chain(up).collect::<Vec<_>>()
    };
    text.chars().flat_map(of).collect()
}

fn slash() -> Vec<Event> {
    vec![key(Key::Slash, true, Modifiers::NONE), Event::Text("/".into()), key(Key::Slash, false, Modifiers::NONE)]
}

/// All of it in one frame, as a slow machine has it.
fn at_once(w: &mut Window, events: impl IntoIterator<Item = Vec<Event>>) {
    w.harness.input_mut().events.extend(events.into_iter().flatten());
    w.harness.run_steps(4);
}

fn said(app: &App, text: &str) -> bool {
    app.state.log.iter().any(|line| line.text.contains(text))
}

fn center(w: &Window) -> glam::DVec3 {
    w.app().viewport.pose().center
}

fn typed(w: &Window) -> Option<String> {
    let field = w.harness.query_by_role_and_label(Role::TextInput, "Query")?;
    field.accesskit_node().value()
}

#[test]
fn a_key_that_was_pressed_with_control_does_not_fly_until_it_is_released() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some());
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    let home = center(&w);
    // Of W nothing comes; E exports, S saves a picture: each opens a dialog.
    let opens_file = |held| held == Key::S;
    for held in [Key::W, Key::E, Key::S] {
        w.harness.event(Event::ModifiersChanged(Modifiers::COMMAND));
        w.harness.event(key(held, true, Modifiers::COMMAND));
        w.harness.run_steps(2);
        w.harness.event(Event::ModifiersChanged(Modifiers::NONE));
        w.harness.run_steps(4);
        if opens_file(held) {
            w.until("a dialog", |a| a.chooses_file());
        }
        if held != Key::W {
            w.press(Key::Escape);
        }
        assert!(!w.app().chooses_file());
        // The keyboard repeats what is held.
        w.harness.event(Event::Key {
            key: held,
            physical_key: None,
            pressed: true,
            repeat: true,
            modifiers: Modifiers::NONE,
        });
        w.harness.run_steps(6);
        assert_eq!(center(&w), home, "{held:?}");
        w.harness.event(key(held, false, Modifiers::NONE));
        w.harness.run_steps(2);
    }
    // The control: pressed by itself, it flies; and no more once a dialog has come and gone over it.
    w.harness.key_down(Key::W);
    w.harness.run_steps(4);
    assert_ne!(center(&w), home);
    w.ask(Action::Palette);
    w.press(Key::Escape);
    w.harness.run_steps(2);
    let there = center(&w);
    w.harness.run_steps(6);
    assert_eq!(center(&w), there, "what is held was pressed before the dialog");
    w.harness.key_up(Key::W);
}

#[test]
fn a_slash_opens_the_query_at_once_and_types_nothing_itself() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = edits::window(folder.path());
    let home = center(&w);
    at_once(&mut w, [slash(), letters("box 2")]);
    assert_eq!(typed(&w).as_deref(), Some("box 2"), "in the frame of the slash");
    w.until("the answer", |a| a.viewport.queries.found() == [3]);
    // Its text is selected: what comes takes its place, also in one frame, and however often the slash is pressed.
    w.press(Key::Escape);
    at_once(&mut w, [slash(), slash(), letters("box 1")]);
    assert_eq!(typed(&w).as_deref(), Some("box 1"));
    w.press(Key::Escape);
    w.harness.input_mut().events.extend(slash());
    w.harness.step();
    w.harness.input_mut().events.extend(slash());
    w.harness.step();
    w.types("box");
    assert_eq!(typed(&w).as_deref(), Some("box"), "letter by letter");
    w.types("/0");
    assert_eq!(typed(&w).as_deref(), Some("box/0"), "within a text it is a letter");
    assert_eq!(center(&w), home, "no letter was a command or flew");
    assert!(!said(w.app(), "Cropped") && !said(w.app(), "Showed"));
}

#[test]
fn letters_before_a_slash_are_commands_and_those_after_it_are_not() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = edits::window(folder.path());
    at_once(&mut w, [letters("v"), slash(), letters("v")]);
    assert!(said(w.app(), "Hid the cameras") && !said(w.app(), "Showed the cameras"));
    assert_eq!(typed(&w).as_deref(), Some("v"));
}

#[test]
fn where_nothing_can_be_asked_the_field_says_why_and_takes_all_letters() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(None);
    w.harness.run_steps(2);
    at_once(&mut w, [slash(), letters("box")]);
    assert!(w.shows("open a scene first"), "on the first page");
    w.press(Key::Escape);
    assert!(!w.shows("Nothing to query"));
    w.ask(Action::Open(write_splat(folder.path())));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    let home = center(&w);
    for in_one_frame in [true, false] {
        if in_one_frame {
            at_once(&mut w, [slash(), letters("plush doll boots")]);
        } else {
            at_once(&mut w, [slash()]);
            w.types("plush doll boots");
        }
        let field = w.harness.get_by_role_and_label(Role::TextInput, "Query");
        assert!(field.accesskit_node().is_disabled() && w.shows("Nothing to query yet"));
        assert_eq!(center(&w), home, "nothing flies");
        assert!(!w.shows("Fit scene"), "B is a letter");
        w.press(Key::Escape);
        assert!(!w.shows("Nothing to query yet"));
    }
    // The control: without the field they are commands.
    w.press(Key::B);
    w.harness.run_steps(2);
    assert!(w.shows("Fit scene"), "the crop box");
}

#[test]
fn while_training_runs_no_letter_pauses_it() {
    let data = tempfile::tempdir().expect("folder");
    let mut w = Window::keeping(data.path().join("data"), Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::StartTraining);
    w.until("training", |a| a.state.history.steps.len() > 2);
    at_once(&mut w, [slash(), letters("top of the table")]);
    assert!(w.shows("Nothing to query while training runs"));
    w.harness.run_steps(4);
    assert!(w.app().state.job.as_ref().is_some_and(|j| !j.paused), "T is a letter");
    w.press(Key::Escape);
    assert!(w.app().state.is_training(), "Escape closes the field, not the training");
    w.press(Key::T);
    w.until("the pause", |a| a.state.job.as_ref().is_some_and(|j| j.paused));
    w.ask(Action::Cancel);
    w.until("the end", |a| a.state.job.is_none());
}

#[test]
fn while_a_question_is_open_no_letter_acts_and_no_sentence_answers_it() {
    let data = tempfile::tempdir().expect("folder");
    let mut w = Window::keeping(data.path().join("data"), Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::StartTraining);
    w.until("training", |a| a.state.history.steps.len() > 2);
    w.press(Key::Escape);
    assert!(w.shows("Keep running"), "it asks");
    let home = center(&w);
    let enter = vec![key(Key::Enter, true, Modifiers::NONE), key(Key::Enter, false, Modifiers::NONE)];
    at_once(&mut w, [slash(), letters("what is bigger than the top"), enter.clone(), letters("one two")]);
    assert!(w.shows("Keep running"), "its spaces and Enter press nothing");
    w.types("/both of two");
    at_once(&mut w, [enter.clone()]);
    assert!(w.shows("Keep running"), "letter by letter");
    assert!(!w.shows("Fit scene") && !w.app().viewport.is_orthographic() && center(&w) == home);
    assert!(w.app().state.job.as_ref().is_some_and(|j| !j.paused));
    let chat = w.harness.query_by_role_and_label(Role::TextInput, "Chat box");
    assert!(chat.is_none_or(|field| field.accesskit_node().value().is_none_or(|text| text.is_empty())));
    // The control: once it is closed they act, and Enter alone answers a question.
    w.press(Key::Escape);
    assert!(!w.shows("Keep running"));
    w.press(Key::B);
    w.harness.run_steps(2);
    assert!(w.shows("Fit scene"), "the crop box");
    w.press(Key::Escape);
    w.press(Key::Escape);
    assert!(w.shows("Keep running"));
    at_once(&mut w, [enter]);
    assert!(!w.shows("Keep running") && w.app().state.is_training());
    w.ask(Action::Cancel);
    w.until("the end", |a| a.state.job.is_none());
}

#[test]
fn what_is_typed_in_the_frame_of_its_key_is_for_the_palette_the_name_and_the_chat() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = edits::window(folder.path());
    let palette = vec![key(Key::P, true, Modifiers::COMMAND), key(Key::P, false, Modifiers::COMMAND)];
    let enter = vec![key(Key::Enter, true, Modifiers::NONE), key(Key::Enter, false, Modifiers::NONE)];
    at_once(&mut w, [palette, letters("show the log pane"), enter.clone()]);
    assert!(w.app().layout.shows(Pane::Log), "what was typed is what is done");

    w.ask(Action::Select(Some(1)));
    let rename = vec![key(Key::F2, true, Modifiers::NONE), key(Key::F2, false, Modifiers::NONE)];
    at_once(&mut w, [rename, letters("tub")]);
    w.press(Key::Enter);
    w.until("the new name", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.name(1) == "tub"));
    // A name is over: Enter is the chat's again, once keys do not belong to the name any more.
    w.press(Key::Escape);
    at_once(&mut w, [enter, letters("hb")]);
    let field = w.harness.get_by_role_and_label(Role::TextInput, "Chat box").accesskit_node().value();
    assert_eq!(field.as_deref(), Some("hb"));
    assert!(!said(w.app(), "Cropped the view") && !said(w.app(), "Hid tub"));
}
