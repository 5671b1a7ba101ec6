//! Keyboard, mouse and files: what has the keyboard keeps it, what is drawn is in the window.

use egui::accesskit::{Role, Toggled};
use egui::{Key, Rect};
use egui_kittest::kittest::{NodeT, Queryable};
use glam::DVec3;

use fmlgs::scene::{Bounds, CropBox};
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::edits::window;
use super::{Window, write_splat};

#[test]
fn the_chat_box_keeps_the_keyboard_while_an_answer_runs() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let center = |a: &App| a.viewport.picture().expect("drawn").camera.center;
    let home = center(w.app());
    w.press(Key::Enter);
    for sentence in ["where was box 0", "what was seen", "describe box 1"] {
        w.types(sentence);
        // No step in between: the answer before is still under way.
        w.harness.key_press(Key::Enter);
        w.harness.step();
    }
    w.types("wasd");
    w.until("the answers", |a| a.conversation().is_some_and(|talk| talk.contains("describe box 1")));
    let talk = w.app().conversation().expect("it was said").to_owned();
    assert!(talk.contains("where was box 0") && talk.contains("what was seen"), "{talk}");
    assert_eq!(center(w.app()), home, "no letter flew the camera");
    assert!(w.shows(" step"), "steps are folded once they are answered");
    assert_eq!(w.harness.get_by_role_and_label(Role::TextInput, "Chat box").value().as_deref(), Some("wasd"));
}

#[test]
fn letters_are_no_shortcuts_where_a_field_was_just_used() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let cameras = |w: &Window| w.app().layout.cameras;
    w.press(Key::Slash);
    w.types("vo");
    // The field loses the keyboard while it is typed into.
    w.harness.ctx.memory_mut(|m| m.stop_text_input());
    w.types("vvv");
    assert!(cameras(&w), "V goes on what was typed");
    // A click somewhere else ends typing.
    w.harness.get_by_label("Viewport").click();
    w.harness.run_steps(2);
    w.press(Key::V);
    assert!(!cameras(&w), "now it is a shortcut");
}

#[test]
fn the_query_box_has_tab_and_arrows() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.press(Key::Slash);
    w.types("bo");
    w.press(Key::Tab);
    let typed = |w: &Window| w.harness.get_by_role_and_label(Role::TextInput, "Query").value().unwrap_or_default();
    let first = typed(&w);
    assert!(first.starts_with("box"), "{first}");
    w.types("x");
    assert_eq!(typed(&w), format!("{first}x"), "the cursor is behind it, and in the box");
    w.press(Key::Enter);
    w.types("lamp");
    assert_eq!(typed(&w), "lamp", "what was asked stays, and what is typed takes its place");
    w.press(Key::Enter);
    w.press(Key::ArrowUp);
    w.types("s");
    assert_eq!(typed(&w), format!("{first}xs"), "the cursor is behind it after going back, too");
}

/// Rectangle of the area of this name on screen.
pub(crate) fn area(w: &Window, name: &'static str) -> Rect {
    w.harness.ctx.memory(|m| m.area_rect(egui::Id::unique(name))).expect("on screen")
}

#[test]
fn cards_lie_beside_each_other_and_inside_the_view() {
    let folder = tempfile::tempdir().expect("folder");
    for size in [[800.0, 600.0], [1200.0, 800.0], [1440.0, 900.0]] {
        let mut w = window(folder.path());
        w.harness.set_size(size.into());
        w.ask(Action::NextPhoto);
        w.ask(Action::Ask("box 1".into()));
        w.until("maps", |a| a.viewport.queries.maps().is_some());
        w.harness.run_steps(4);
        let (card, screen) = (area(&w, "question"), w.harness.ctx.content_rect());
        assert!(screen.contains_rect(card), "{size:?}: {card}");
        for other in ["photo", "modes"].map(|name| area(&w, name)) {
            assert!(!card.intersects(other), "{size:?}: {card} covers {other}");
        }
        w.press(Key::F1);
        w.harness.run_steps(3);
        let close = w.harness.get_by_label("Close").rect();
        assert!(screen.contains_rect(close), "{size:?}: the sheet ends at {close}");
        let heading = w.harness.get_by_label("Keyboard and mouse").rect();
        assert!(screen.contains_rect(heading), "{size:?}: the sheet begins at {heading}");
    }
}

#[test]
fn what_a_card_covers_is_not_under_the_cursor() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.harness.set_size([800.0, 600.0].into());
    w.ask(Action::Ask("box 1".into()));
    w.click("Unfold the answer");
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    w.harness.run_steps(4);
    let (card, view) = (area(&w, "question"), w.harness.get_by_label("Viewport").rect());
    let maps = w.app().viewport.queries.maps().cloned().expect("maps");
    let (cols, rows) = (maps.identities.width_px, maps.identities.height_px);
    let at = |i: usize| {
        let (x, y) = ((i % cols) as f32 + 0.5, (i / cols) as f32 + 0.5);
        view.min + egui::vec2(x / cols as f32 * view.width(), y / rows as f32 * view.height())
    };
    let places: Vec<egui::Pos2> = (0..cols * rows).filter(|i| maps.identities.identity[*i] != 0).map(at).collect();
    let hovered = |w: &mut Window, pos: Option<&egui::Pos2>| {
        w.harness.hover_at(*pos.expect("a box is there"));
        w.harness.run_steps(3);
        w.app().viewport.picking.hovered()
    };
    let photo = area(&w, "photo");
    let free = places
        .iter()
        .find(|p| view.shrink(60.0).contains(**p) && !card.expand(9.0).contains(**p) && p.y > photo.bottom() + 9.0);
    assert!(hovered(&mut w, free).is_some());
    let covered = places.iter().find(|p| card.shrink(9.0).contains(**p));
    assert_eq!(hovered(&mut w, covered), None);
}

#[test]
fn enter_goes_to_the_chat_whatever_has_the_focus() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.harness.query_all_by_label("Objects").next().expect("a header").focus();
    w.harness.run_steps(2);
    w.press(Key::Enter);
    w.harness.run_steps(3);
    assert!(w.harness.query_by_role_and_label(Role::CheckBox, "box 0 is visible").is_some(), "it is not folded");
    assert!(w.harness.get_by_role_and_label(Role::TextInput, "Chat box").accesskit_node().is_focused());
}

#[test]
fn without_a_dialog_of_the_system_files_are_chosen_in_the_window() {
    let folder = tempfile::tempdir().expect("folder");
    let splat = write_splat(folder.path());
    let mut w = Window::new(Some(Action::Open(splat.clone())));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.ask(Action::ExportPly);
    w.click("Save\u{2026}");
    w.until("a dialog", |a| a.chooses_file());
    assert!(w.shows("Export Gaussians"));
    let field = |w: &Window| w.harness.query_all_by_role(Role::TextInput).filter_map(|n| n.value()).collect::<Vec<_>>();
    assert!(field(&w).iter().any(|v| v == "dots.ply"), "a name is proposed: {:?}", field(&w));
    assert!(field(&w).iter().any(|v| std::path::Path::new(v) == folder.path()), "in the last folder");
    // It is there already: it was opened.
    let before = std::fs::read(&splat).expect("there");
    w.click("Save");
    w.harness.run_steps(3);
    assert!(w.shows("already exists. Replace it?"));
    w.click("Choose another name");
    assert!(w.app().chooses_file(), "it goes on");
    assert_eq!(std::fs::read(&splat).expect("there"), before);
    w.click("Save");
    w.harness.run_steps(3);
    w.click("Replace");
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with("Saved to ")));
    assert!(!w.app().chooses_file());

    w.ask(Action::OpenFile);
    w.until("a dialog", |a| a.chooses_file());
    w.press(Key::Escape);
    w.until("it is closed", |a| !a.chooses_file());
    assert!(w.app().state.error.is_none());
}

#[test]
fn a_page_is_exported_where_the_dialog_says() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::new(Some(Action::Open(write_splat(folder.path()))));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.ask(Action::ExportPage);
    w.until("a dialog", |a| a.chooses_file());
    assert!(w.shows("Export page"));
    w.click("Save");
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with("Saved to ")));
    let page = std::fs::read_to_string(folder.path().join("dots.html")).expect("there");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<title>dots</title>"));
}

#[test]
fn the_palette_and_the_shortcut_sheet_list_the_actions() {
    let mut w = Window::new(None);
    w.ask(Action::Palette);
    assert!(w.shows("Start training"));
    w.harness.get_by_label("Search actions").type_text("scene plan");
    w.harness.run_steps(2);
    assert!(!w.shows("Start training"));
    w.press(egui::Key::Enter);
    assert!(w.app().layout.shows(Pane::Plan), "what is asked to be shown stays");
    w.ask(Action::Palette);
    w.types("hide scene plan");
    w.press(egui::Key::Enter);
    assert!(!w.app().layout.shows(Pane::Plan), "the found action was run");
    w.harness.key_press(egui::Key::F1);
    w.harness.run_steps(3);
    assert!(w.shows("Keyboard and mouse") && w.shows("Ctrl+P"));
}

#[test]
fn what_is_typed_takes_the_place_of_the_query_before() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Ask("box 0".into()));
    assert_eq!(w.app().viewport.queries.found(), [1]);
    w.press(Key::Slash);
    w.harness.run_steps(2);
    w.types("box 1");
    w.harness.run_steps(2);
    assert_eq!(w.app().viewport.queries.found(), [2], "not \"box 0box 1\"");
}

#[test]
fn escape_closes_an_open_menu_and_nothing_else() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Select(Some(1)));
    w.ask(Action::Hide(1));
    w.click("Edit");
    assert!(w.shows("Undo: hid box 0"), "the menu says what is undone");
    w.press(Key::Escape);
    w.click("View");
    assert!(w.shows("Frame the selection"));
    w.press(Key::Escape);
    w.harness.run_steps(3);
    assert!(!w.shows("Frame the selection"), "the menu is closed");
    assert_eq!(w.app().viewport.picking.selected(), Some(1), "what was selected stays");
    w.press(Key::Escape);
    assert_eq!(w.app().viewport.picking.selected(), None, "without a menu it deselects");
}

#[test]
fn an_answer_says_why_nothing_of_it_is_drawn() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Ask("box 0".into()));
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    assert!(!w.shows("It is "), "it is in view");
    w.ask(Action::Hide(1));
    w.until("maps without it", |a| a.viewport.queries.maps().is_some());
    w.harness.run_steps(4);
    assert!(w.shows("It is hidden."));
    w.click("Show it");
    w.harness.run_steps(4);
    assert!(!w.shows("It is hidden."));
    let nowhere = Bounds { min: DVec3::splat(1e3), max: DVec3::splat(2e3) };
    w.ask(Action::SetCrop(Some(CropBox { bounds: nowhere, outside: false })));
    w.harness.run_steps(4);
    assert!(w.shows("It is outside the crop box.") && w.shows("cropped"));
    w.ask(Action::SetCrop(None));
    w.until("maps with it", |a| a.viewport.queries.maps().is_some());
    w.harness.run_steps(4);
    assert!(!w.shows("outside the crop box") && !w.shows("cropped"));
}

#[test]
fn the_chat_asks_by_buttons_and_says_where_another_scene_begins() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let say = |w: &mut Window, text: &str| {
        w.press(Key::Enter);
        w.types(text);
        w.press(Key::Enter);
    };
    let name = |a: &App| a.state.semantics.as_ref().map(|m| m.identities.name(1)).unwrap_or_default();
    assert!(!w.shows("Yes"));
    let top = |w: &Window| w.harness.get_by_role_and_label(Role::TextInput, "Chat box").rect().top();
    let (before, place) = (name(w.app()), top(&w));
    say(&mut w, "rename box 0 to crate");
    w.until("a question", |a| a.conversation().is_some_and(|talk| talk.contains("(yes or no)")));
    w.harness.run_steps(2);
    assert!(!w.shows("(yes or no)"), "there are buttons");
    assert!((top(&w) - place).abs() < 1.0, "the box is where it was: {} {place}", top(&w));
    w.click("No");
    w.until("an answer", |a| a.conversation().is_some_and(|talk| talk.contains("leave it as it is")));
    w.harness.run_steps(2);
    assert_eq!(name(w.app()), before);
    assert!(w.harness.query_by_label("Yes").is_none(), "it is answered");
    say(&mut w, "rename box 0 to crate");
    w.until("the question again", |a| a.conversation().is_some_and(|talk| talk.matches("(yes or no)").count() == 4));
    w.harness.run_steps(2);
    w.click("Yes");
    w.until("another name", |a| name(a) == "crate");
    assert!(!w.shows("opened"));
    w.ask(Action::Open(write_splat(folder.path())));
    w.until("another scene", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    w.harness.run_steps(2);
    assert!(w.shows("dots opened"));
}

#[test]
fn the_palette_says_that_an_object_is_to_be_selected_first() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    for selected in [false, true] {
        if selected {
            w.ask(Action::Select(Some(1)));
        }
        w.ask(Action::Palette);
        w.types("recolor");
        w.harness.run_steps(2);
        assert_eq!(w.shows("select an object first"), !selected);
        w.press(Key::Enter);
        w.harness.run_steps(3);
        assert_eq!(w.shows("Select an object first: click it"), !selected, "it says so");
        assert_eq!(w.shows("Apply to a copy"), selected, "the tool");
        if !selected {
            w.press(Key::Escape);
            w.harness.run_steps(3);
        }
    }
}

#[test]
fn one_sentence_of_the_chat_is_one_step_of_undo() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let say = |w: &mut Window, text: &str, answer: &'static str| {
        w.press(Key::Enter);
        w.types(text);
        w.press(Key::Enter);
        w.until(answer, |a| a.conversation().is_some_and(|talk| talk.contains(answer)));
        w.harness.run_steps(3);
    };
    let shown = |w: &Window| {
        ["box 0", "box 1", "box 2"].map(|name| {
            let label = format!("{name} is visible");
            let row = w.harness.get_by_role_and_label(Role::CheckBox, &label);
            row.accesskit_node().toggled() == Some(Toggled::True)
        })
    };
    say(&mut w, "hide box 0", "hide box 0");
    assert_eq!(shown(&w), [false, true, true]);
    say(&mut w, "show only box 1 and box 2", "box 2 are drawn now");
    assert_eq!(shown(&w), [false, true, true]);
    w.ask(Action::Undo);
    assert_eq!(shown(&w), [false, true, true], "what is around the boxes alone");
    say(&mut w, "show only box 0 and box 2", "box 0 and the box 2 are drawn now");
    assert_eq!(shown(&w), [true, false, true]);
    say(&mut w, "undo", "showing only box 0 and box 2");
    assert_eq!(shown(&w), [false, true, true], "by the chat");
    w.ask(Action::Redo);
    assert_eq!(shown(&w), [true, false, true]);
    w.ask(Action::Undo);
    assert_eq!(shown(&w), [false, true, true], "by the key");
    // The control: the sentence before is a step of its own.
    w.ask(Action::Undo);
    assert_eq!(shown(&w), [true; 3]);
}
