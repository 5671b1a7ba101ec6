//! Selecting by clicks and strokes, naming what is selected, and correcting what was found.

use std::path::Path;

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect};
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::Window;
use super::edits::window;

fn click(w: &mut Window, at: Pos2, modifiers: Modifiers) {
    let button = |pressed| Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers };
    w.harness.event(Event::ModifiersChanged(modifiers));
    w.harness.hover_at(at);
    w.harness.step();
    w.harness.event(button(true));
    w.harness.step();
    w.harness.event(button(false));
    w.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    w.harness.run_steps(3);
}

fn view(w: &Window) -> Rect {
    w.harness.get_by_label("Viewport").rect()
}

/// The middle of an identity's pixels in the window.
fn middle_of(w: &Window, id: u32) -> Pos2 {
    let app = w.app();
    let maps = app.viewport.queries.maps().expect("maps");
    let map = &maps.identities;
    let at: Vec<(usize, usize)> = (0..map.identity.len())
        .filter(|i| map.identity[*i] == id)
        .map(|i| (i % map.width_px, i / map.width_px))
        .collect();
    let mean = |of: &dyn Fn(&(usize, usize)) -> usize| at.iter().map(of).sum::<usize>() as f32 / at.len() as f32 + 0.5;
    let share = egui::vec2(mean(&|p| p.0) / map.width_px as f32, mean(&|p| p.1) / map.height_px as f32);
    let rect = view(w);
    rect.min + share * rect.size()
}

/// Gaussians of an identity.
fn size_of(app: &App, id: u32) -> usize {
    app.state.semantics.as_ref().expect("objects").identity_of.iter().filter(|of| **of == id).count()
}

fn at_rest(a: &App) -> bool {
    a.viewport.picture().is_some_and(|p| p.full) && a.viewport.queries.maps().is_some()
}

/// The boxes, one of them asked for, once it is known whose each pixel is; without the cameras in the way.
fn asked(folder: &Path) -> Window {
    let mut w = window(folder);
    w.harness.state_mut().layout.cameras = false;
    w.ask(Action::Ask("box 0".into()));
    w.until("maps", at_rest);
    w
}

#[test]
fn a_click_selects_and_a_name_is_kept_and_asked_for() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let before = w.app().state.semantics.as_ref().expect("objects").identities.len();
    let box_1 = middle_of(&w, 2);
    w.ask(Action::SegmentNew(Some(0)));
    assert!(w.shows("New object: click on it"), "the tool says what to do");
    w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
    click(&mut w, box_1, Modifiers::NONE);
    w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
    let selected = w.app().viewport.selection().expect("something");
    // A second click there, as not belonging to it, leaves less; taking it back leaves what was.
    w.until("a picture at rest", at_rest);
    click(&mut w, box_1, Modifiers::SHIFT);
    w.until("less", |a| a.viewport.selection().is_some_and(|n| n < selected));
    w.press(Key::Backspace);
    w.until("the stroke is taken back", |a| a.viewport.selection() == Some(selected));
    w.harness.get_by_label("Name of what is selected").click();
    w.harness.run_steps(2);
    w.types("crate");
    w.harness.get_by_label("Keep").click();
    w.until("it is kept", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == before + 1));
    let map = w.app().state.semantics.clone().expect("objects");
    let new = before as u32 + 1;
    assert_eq!((map.identities.name(new), size_of(w.app(), new)), ("crate".into(), selected));
    w.ask(Action::Ask("crate".into()));
    w.until("found", |a| a.viewport.queries.found() == [before as u32 + 1]);
    w.ask(Action::Undo);
    w.until("undone", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == before));

    // Kept by Enter after its name, or with the tool ready for the next one.
    for (name, next) in [("tub", false), ("vat", true)] {
        w.ask(Action::SegmentNew(Some(0)));
        w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
        click(&mut w, box_1, Modifiers::NONE);
        w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
        w.harness.get_by_label("Name of what is selected").click();
        w.harness.run_steps(2);
        w.types(name);
        match next {
            true => w.harness.get_by_label("Keep and next").click(),
            false => w.press(Key::Enter),
        }
        let known =
            |a: &App| a.state.semantics.as_ref().is_some_and(|m| m.identities.iter().any(|(_, i)| i.names == [name]));
        w.until("it is kept", known);
        w.harness.run_steps(2);
        assert_eq!(w.shows("New object: click on it"), next);
        let newest = w.app().state.semantics.as_ref().map(|m| m.identities.len() as u32);
        assert_eq!(w.app().viewport.picking.selected() == newest, !next, "what was kept is selected");
    }
}

#[test]
fn what_was_found_is_corrected_and_nothing_is_kept_by_cancel() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let size = size_of(w.app(), 1);
    let box_1 = middle_of(&w, 2);
    for keep in [false, true] {
        w.ask(Action::Correct(1));
        w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
        click(&mut w, box_1, Modifiers::NONE);
        w.until("more", |a| a.viewport.selection().is_some_and(|n| n > size));
        assert!(!w.shows("Keep as"), "it has a name");
        w.harness.get_by_label(if keep { "Keep" } else { "Cancel" }).click();
        w.harness.run_steps(20);
        if !keep {
            assert_eq!(size_of(w.app(), 1), size, "nothing is kept");
        }
    }
    w.until("it is larger", |a| size_of(a, 1) > size);
}

#[test]
fn a_scene_is_prepared_once_and_as_soon_as_the_tool_opens() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let box_1 = middle_of(&w, 2);
    assert_eq!(w.app().viewport.times_prepared(), 0);
    w.ask(Action::SegmentNew(Some(0)));
    w.until("prepared before anybody clicks", |a| a.viewport.times_prepared() == 1);
    assert_eq!(w.app().viewport.selection(), None);
    for action in
        [Action::SegmentNew(Some(0)), Action::Correct(1), Action::SegmentNew(Some(1)), Action::SegmentNew(Some(0))]
    {
        w.ask(Action::SegmentNew(None));
        w.ask(action);
        w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
        click(&mut w, box_1, Modifiers::NONE);
        w.until("an answer", |a| a.viewport.lines_drawn() == 0);
    }
    w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
    w.harness.get_by_label("Keep").click();
    w.until("kept", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 4));
    w.ask(Action::SegmentNew(Some(0)));
    click(&mut w, box_1, Modifiers::NONE);
    w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
    assert_eq!(w.app().viewport.times_prepared(), 1, "once for all of them");
}

#[test]
fn a_scene_that_was_prepared_is_ready_when_it_is_opened_again() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let box_1 = middle_of(&w, 2);
    let select = |w: &mut Window| {
        w.ask(Action::SegmentNew(Some(0)));
        w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
        click(w, box_1, Modifiers::NONE);
        w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
        (w.app().viewport.selection(), w.app().viewport.times_prepared())
    };
    let (first, times) = select(&mut w);
    assert_eq!(times, 1);
    drop(w);
    let scene = folder.path().join("scene");
    let open = |scene: &Path| {
        let mut w = Window::new(Some(Action::Open(scene.into())));
        w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full));
        w.harness.state_mut().layout.hidden.extend([Pane::Training, Pane::Plan, Pane::Models, Pane::Dataset]);
        w.harness.run_steps(2);
        w.harness.state_mut().layout.cameras = false;
        w.ask(Action::Ask("box 0".into()));
        w.until("maps", at_rest);
        w
    };
    let mut w = open(&scene);
    assert_eq!(select(&mut w), (first, 0), "the same, without preparing it again");
    drop(w);
    // The control: a damaged file is made anew.
    std::fs::write(scene.join("selection_tree.safetensors"), b"damaged").expect("written");
    let mut w = open(&scene);
    assert_eq!(select(&mut w), (first, 1));
}

#[test]
fn strokes_drawn_while_it_is_prepared_are_all_taken_in() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let places = [middle_of(&w, 2), middle_of(&w, 3)];
    // What one click selects, each for itself.
    let mut each = Vec::new();
    for at in places {
        w.ask(Action::SegmentNew(Some(0)));
        click(&mut w, at, Modifiers::NONE);
        w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
        each.push(w.app().viewport.selection().expect("something"));
        w.ask(Action::SegmentNew(None));
    }
    drop(w);
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    // Both in the frame after the tool opened, before anything can be ready.
    w.harness.state_mut().ask(Action::SegmentNew(Some(0)));
    w.harness.step();
    for at in places {
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        w.harness.hover_at(at);
        w.harness.step();
        w.harness.event(button(true));
        w.harness.step();
        w.harness.event(button(false));
        w.harness.step();
    }
    w.until("both are taken in", |a| a.viewport.lines_drawn() == 0 && a.viewport.selection().is_some());
    let both = w.app().viewport.selection().expect("something");
    assert!(both > each[0].max(each[1]), "{both} of {each:?}");
    assert_eq!(w.app().viewport.times_prepared(), 1);
}

#[test]
fn the_result_of_a_canceled_selection_is_not_that_of_the_next() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let places = [middle_of(&w, 2), middle_of(&w, 3)];
    w.ask(Action::SegmentNew(Some(0)));
    w.until("prepared", |a| a.viewport.times_prepared() == 1);
    let button = |pos, pressed| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    w.harness.hover_at(places[0]);
    w.harness.step();
    w.harness.event(button(places[0], true));
    w.harness.step();
    w.harness.event(button(places[0], false));
    w.harness.step();
    // It is handed on in the frame in which the tool is canceled and another one opens.
    w.harness.state_mut().ask(Action::SegmentNew(None));
    w.harness.state_mut().ask(Action::SegmentNew(Some(0)));
    w.harness.step();
    std::thread::sleep(std::time::Duration::from_millis(300));
    w.harness.run_steps(20);
    assert_eq!(w.app().viewport.selection(), None, "nothing was drawn in this one");
    click(&mut w, places[1], Modifiers::NONE);
    w.until("its own answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
    w.harness.get_by_label("Keep").click();
    w.until("kept", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 4));
    let map = w.app().state.semantics.clone().expect("objects");
    let left = |id: u32| map.identity_of.iter().filter(|of| **of == id).count();
    assert!(left(3) < left(2), "what was clicked on is taken from box 2, nothing from box 1");
}

#[test]
fn another_tool_does_not_drop_a_selection_or_a_change_unasked() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let box_1 = middle_of(&w, 2);
    // The control: a selection without a click is nothing to lose.
    w.ask(Action::SegmentNew(Some(0)));
    w.ask(Action::Measure);
    assert!(!w.shows("not kept yet") && w.app().viewport.selection().is_none());
    w.ask(Action::Measure);
    w.ask(Action::SegmentNew(Some(0)));
    w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
    click(&mut w, box_1, Modifiers::NONE);
    w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
    let selected = w.app().viewport.selection();
    for key in [Key::M, Key::X, Key::B] {
        w.press(key);
        w.harness.run_steps(3);
        assert!(w.shows("The selection is not kept yet"), "{key:?}");
        // The safe answer has the keyboard.
        w.press(Key::Enter);
        w.harness.run_steps(3);
        assert!(!w.shows("not kept yet") && w.app().viewport.selection() == selected, "{key:?}");
    }
    // Another shape goes on with the same selection.
    w.ask(Action::SelectBy(fmlgs::ui::select_shape::SelectShape::Brush));
    assert!(!w.shows("not kept yet") && w.app().viewport.selection() == selected);
    w.press(Key::M);
    w.harness.run_steps(3);
    w.click("Keep it");
    w.until("it is an object", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 4));
    w.harness.run_steps(5);
    assert!(w.app().viewport.selection().is_none() && !w.shows("Keep as"), "the other tool is in use");
    w.ask(Action::Measure);
    w.ask(Action::Transform(1));
    w.harness.run_steps(3);
    w.harness.get_by_role_and_label(egui::accesskit::Role::CheckBox, "Apply to a copy").click();
    w.harness.run_steps(3);
    w.press(Key::X);
    w.harness.run_steps(3);
    assert!(w.shows("The change is not kept yet"));
    w.click("Discard it");
    w.harness.run_steps(3);
    assert!(!w.shows("Apply to a copy"), "the other tool is in use");
    let objects = w.app().state.semantics.as_ref().map(|m| m.identities.len());
    assert_eq!(objects, Some(4), "nothing was copied");
}

#[test]
fn keys_make_lines_thinner_and_wider_while_something_is_selected() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = asked(folder.path());
    let box_1 = middle_of(&w, 2);
    // The control: without the tool, the keys do nothing.
    w.press(Key::Equals);
    assert_eq!(w.app().viewport.line_width_px(), None);
    for (key, width) in [(Key::Minus, 1.0), (Key::Equals, 64.0)] {
        w.ask(Action::SegmentNew(Some(0)));
        w.until("a picture for it", |a| a.viewport.picture().is_some_and(|p| p.full));
        assert_eq!(w.app().viewport.line_width_px(), Some(10.0));
        let eye = w.app().viewport.pose();
        for _ in 0..20 {
            w.press(key);
        }
        w.harness.run_steps(2);
        assert_eq!((w.app().viewport.line_width_px(), w.app().viewport.pose()), (Some(width), eye));
        click(&mut w, box_1, Modifiers::NONE);
        w.until("an answer", |a| a.viewport.selection().is_some_and(|n| n > 0));
        w.ask(Action::SegmentNew(None));
    }
}
