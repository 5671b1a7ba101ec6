//! Queries in the view: which stay on screen, their messages and their times, and how much of the view they cover.

use egui::accesskit::Role;
use egui::{Key, Rect};
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::ui::actions::{Action, Pane};

use super::Window;
use super::edits::window;
use super::hands::area;

fn typed(w: &Window) -> String {
    w.harness.get_by_role_and_label(Role::TextInput, "Query").value().unwrap_or_default()
}

fn asks(w: &mut Window, text: &str) {
    w.types(text);
    w.press(Key::Enter);
    answered(w);
}

/// Waits for the encoder, which has a thread of its own.
fn answered(w: &mut Window) {
    w.until("an answer", |a| a.viewport.queries.all().last().is_none_or(|q| !q.pending));
}

#[test]
fn a_query_takes_the_place_of_the_one_before_unless_that_is_pinned() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::TogglePane(Pane::Objects));
    let found = |w: &Window| w.app().viewport.queries.found();
    w.press(Key::Slash);
    asks(&mut w, "box 0");
    assert_eq!((typed(&w), found(&w)), ("box 0".into(), vec![1]));
    asks(&mut w, "box 1");
    assert_eq!((typed(&w), found(&w)), ("box 1".into(), vec![2]), "the new text and the new answer, alone");
    w.click("Pin");
    asks(&mut w, "box 2");
    assert_eq!(found(&w), [2, 3]);
    asks(&mut w, "giraffe");
    assert_eq!(found(&w), [2], "what is pinned stays");
    assert!(w.shows("No match for \u{201c}giraffe\u{201d}") && w.shows("3 names, e.g."));
    assert!(w.harness.get_by_label("Pin").accesskit_node().is_disabled(), "there is nothing to keep");
    w.click("box 0");
    assert_eq!((typed(&w), found(&w)), ("box 0".into(), vec![2, 1]), "a name that is offered is asked for");
    w.click("box 1");
    assert_eq!((typed(&w), found(&w)), ("box 1".into(), vec![2]), "what is pinned is asked again, and is there once");
    w.click("Unpin box 1");
    w.harness.run_steps(8);
    w.press(Key::Slash);
    asks(&mut w, "box 2");
    assert_eq!(found(&w), [3]);
}

#[test]
fn nothing_is_said_to_be_missing_while_it_is_typed() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.press(Key::Slash);
    w.types("gi");
    w.harness.run_steps(20);
    assert!(!w.shows("No match"), "two letters are no word");
    w.types("ra");
    assert!(!w.shows("No match"), "it is being typed");
    w.harness.run_steps(20);
    answered(&mut w);
    assert!(w.shows("No match"), "after a pause");
    w.types("f");
    assert!(!w.shows("No match"), "typed on");
    w.press(Key::Enter);
    answered(&mut w);
    assert!(w.shows("No match"), "Enter ends it at once");
}

#[test]
fn several_that_fit_stand_in_a_column() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::TogglePane(Pane::Objects));
    w.ask(Action::Ask("box".into()));
    assert!(w.shows("Which one?") && w.shows("3 fit equally"));
    let rects: Vec<Rect> = (0..3).map(|i| w.harness.get_by_label(&format!("box {i}")).rect()).collect();
    assert!(rects.windows(2).all(|r| r[0].left() == r[1].left() && r[0].bottom() <= r[1].top()), "{rects:?}");
    w.click("box 1");
    assert!(w.app().viewport.queries.found() == [2] && !w.shows("Which one?"));
}

/// The share of a view that a card covers.
fn share(w: &Window, card: &'static str, view: Rect) -> f32 {
    area(w, card).intersect(view).area() / view.area()
}

#[test]
fn an_answer_in_a_small_view_is_a_line_that_unfolds() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    for (size, split) in [([800.0, 600.0], false), ([800.0, 600.0], true), ([1200.0, 800.0], true)] {
        w.harness.set_size(size.into());
        w.harness.state_mut().layout.split_view = split;
        w.ask(Action::Ask("box 1".into()));
        w.until("maps", |a| a.viewport.queries.maps().is_some());
        w.harness.run_steps(4);
        let whole = w.harness.get_by_label("Viewport").rect();
        let wide = whole.width() > whole.height();
        let parts =
            if wide { whole.split_left_right_at_fraction(0.5) } else { whole.split_top_bottom_at_fraction(0.5) };
        let (first, second) = if split { parts } else { (whole, whole) };
        let folded = share(&w, "question", first);
        assert!(folded < 0.13 && w.shows("certain") && !w.shows("Go there"), "{size:?}: {folded}");
        let is_firsts = |button: &egui_kittest::Node<'_>| first.contains_rect(button.rect());
        w.harness.query_all_by_label("Unfold the answer").find(is_firsts).expect("a button").click();
        w.harness.run_steps(4);
        assert!(w.shows("Go there") && share(&w, "question", first) > folded, "{size:?}: all of it");
        w.click("Fold the answer");
        if split {
            let down =
                [("question", first), ("second question", second)].map(|(name, v)| area(&w, name).top() - v.top());
            assert!((down[0] - down[1]).abs() < 3.0, "{size:?}: both at the same height, {down:?}");
        }
    }
    // The control: there is room for all of it in a large view.
    w.harness.state_mut().layout.split_view = false;
    w.harness.set_size([1440.0, 900.0].into());
    w.harness.run_steps(4);
    assert!(w.shows("Go there") && !w.shows("Unfold the answer"));
}

#[test]
fn a_flight_is_told_from_the_path() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::ShowPane(Pane::Camera));
    w.ask(Action::PlayPath);
    assert!(w.shows("Nothing to play: add keyframes"), "a key without effect says why");
    let disabled = |w: &Window, label: &str| w.harness.get_by_label(label).accesskit_node().is_disabled();
    assert!(disabled(&w, "Save\u{2026}") && disabled(&w, "Export video\u{2026}") && disabled(&w, "Show reach"));
    w.ask(Action::Ask("box 1".into()));
    w.press(Key::G);
    w.until("the flight", |a| a.state.explored.is_some());
    w.harness.run_steps(4);
    assert!(w.shows("Export flight as video") && disabled(&w, "Save\u{2026}") && !disabled(&w, "Show reach"));
    w.ask(Action::AddKey);
    w.harness.run_steps(3);
    assert!(!disabled(&w, "Save\u{2026}"));
}
