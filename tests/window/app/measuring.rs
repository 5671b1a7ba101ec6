//! Measurements of the user, and camera paths made in one click.

use std::path::Path;

use egui::accesskit::Toggled;
use egui::{Event, Key, Modifiers, PointerButton};
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::edits::window;
use super::{Window, write_splat};

fn names(app: &App) -> Vec<String> {
    app.viewport.measurements.iter().map(|m| m.name.clone()).collect()
}

/// What is stored with the scene.
fn stored(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("scene/measurements.json")).unwrap_or_default()
}

fn undo(w: &mut Window) {
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    w.harness.run_steps(3);
}

/// Clicks in the view, a share of its size from its middle.
fn click_view(w: &mut Window, share: [f32; 2]) {
    let view = w.harness.get_by_label("Viewport").rect();
    let pos = view.center() + egui::Vec2::from(share) * view.size();
    let button =
        |pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE };
    w.harness.hover_at(pos);
    w.harness.step();
    w.harness.event(button(true));
    w.harness.step();
    w.harness.event(button(false));
    w.harness.run_steps(3);
}

#[test]
fn measurements_are_kept_with_the_scene_undone_and_exported() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Select(Some(1)));
    w.press(Key::M);
    assert!(w.shows("Click the first point on a surface"));
    w.press(Key::Enter);
    assert!(names(w.app()).is_empty(), "there is nothing to keep");
    w.press(Key::Escape);
    w.press(Key::Escape);
    w.ask(Action::Select(Some(1)));
    w.press(Key::M);
    w.click("Box");
    assert!(w.shows("volume of the box"), "of what is selected");
    w.press(Key::Enter);
    w.until("it is stored", |_| stored(folder.path()).contains("Box of box 0"));
    assert_eq!(names(w.app()), ["Box of box 0"]);
    w.harness.query_by_label("Name of measurement 1").expect("its name is a field");

    w.click("Delete Box of box 0");
    w.until("it is gone from the file, too", |_| !stored(folder.path()).contains("Box of box 0"));
    undo(&mut w);
    w.until("it is stored again", |_| stored(folder.path()).contains("Box of box 0"));

    // Another window stores one meanwhile; this one hides its own.
    let other =
        "\"measurements\": [{\"id\": 5, \"name\": \"theirs\", \"kind\": \"length\", \"points\": [[0,0,0],[1,0,0]]},";
    let path = folder.path().join("scene/measurements.json");
    std::fs::write(&path, stored(folder.path()).replacen("\"measurements\": [", other, 1)).expect("written");
    w.click("Box of box 0 is visible");
    w.until("both are stored", |_| stored(folder.path()).contains("\"hidden\": true"));
    assert!(stored(folder.path()).contains("theirs"));

    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.ask(Action::ExportMeasurements);
    w.until("a dialog", |a| a.chooses_file());
    w.click("Save");
    w.until("it is written", |a| a.state.log.iter().any(|l| l.text.starts_with("Saved to ")));
    let files = std::fs::read_dir(folder.path()).expect("folder").map(|f| f.expect("file").path());
    let table = files.into_iter().find(|f| f.extension().is_some_and(|e| e == "csv")).expect("a table");
    let rows = std::fs::read_to_string(table).expect("text");
    assert!(rows.contains("\"Box of box 0\",box_volume,") && !rows.contains("theirs"), "{rows}");

    let mut again = Window::keeping(folder.path().join("data"), Some(Action::Open(folder.path().join("scene"))));
    again.until("both measurements", |a| names(a) == ["theirs", "Box of box 0"]);
    again.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    again.press(Key::M);
    assert!(again.shows("Delete theirs") && again.is_drawn());
}

#[test]
fn points_are_put_taken_back_and_left() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let disabled = |w: &Window| w.harness.get_by_label("Undo point").accesskit_node().is_disabled();
    w.press(Key::M);
    assert!(disabled(&w));
    // Somewhere near the middle there are boxes.
    let mut hit = Vec::new();
    for share in (-4..=4).flat_map(|x| (-3..=2).map(move |y| [0.08 * x as f32, 0.08 * y as f32])) {
        click_view(&mut w, share);
        if !disabled(&w) {
            hit.push(share);
            w.press(Key::Backspace);
        }
    }
    assert!(hit.len() > 1 && disabled(&w), "each was taken back: {hit:?}");
    let (first, last) = (hit[hit.len() / 3], hit[2 * hit.len() / 3]);
    w.until("a picture at rest", |a| a.viewport.picture().is_some_and(|p| p.full && p.median_depth.is_some()));
    click_view(&mut w, first);
    assert!(w.shows("Click the next point"));
    click_view(&mut w, last);
    assert!(w.shows("True length"));
    w.press(Key::Enter);
    assert_eq!(names(w.app()), ["Length 1"]);
    assert!(disabled(&w) && w.app().state.log.iter().any(|l| l.text == "Measured Length 1"));
    click_view(&mut w, first);
    w.press(Key::Escape);
    assert!(!w.shows("Undo point") && names(w.app()).len() == 1, "Escape leaves what is not finished");
}

#[test]
fn the_camera_path_stays_with_its_scene_and_a_damaged_one_is_left_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let (scene, file) = (folder.path().join("scene"), folder.path().join("scene/camera_path.json"));
    let text = || std::fs::read_to_string(&file).unwrap_or_default();
    let stored = || text().matches("\"center\"").count();
    let keys = |w: &Window, n: usize| {
        let has = |i: usize| w.harness.query_by_label(&format!("Keyframe {i}")).is_some();
        (n == 0 || has(n)) && !has(n + 1)
    };
    w.ask(Action::AddKey);
    w.ask(Action::AddKey);
    w.until("both are stored", |_| stored() == 2);
    undo(&mut w);
    w.until("what is undone is stored, too", |_| stored() == 1);
    w.ask(Action::AddKey);
    w.until("again", |_| stored() == 2);
    w.ask(Action::Open(write_splat(folder.path())));
    w.until("another scene", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    w.harness.run_steps(3);
    assert!(keys(&w, 0), "control: the path is not that of every scene");
    w.ask(Action::Open(scene.clone()));
    w.until("the boxes", |a| a.state.scene.as_ref().is_some_and(|s| s.out == scene));
    w.harness.run_steps(3);
    assert!(keys(&w, 2), "opening the scene brings it back");
    drop(w);

    std::fs::write(&file, "{").expect("written");
    let says = |a: &App, text: &str| a.state.log.iter().any(|line| line.text.contains(text));
    let mut again = Window::keeping(folder.path().join("data"), Some(Action::Open(scene)));
    again.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    assert!(says(again.app(), "The camera path is not shown"));
    again.ask(Action::AddKey);
    again.until("it is told", |a| says(a, "kept in this window only"));
    assert_eq!(text(), "{", "never replaced");
}

#[test]
fn a_turntable_plays_at_once_and_keys_go_in_at_the_playhead() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let keys =
        |w: &Window| (1..99).find(|i| w.harness.query_by_label(&format!("Keyframe {i}")).is_none()).unwrap_or(1) - 1;
    let center = |a: &App| a.viewport.pose().center;
    w.ask(Action::AddKey);
    assert_eq!(keys(&w), 1);
    let home = center(w.app());
    w.ask(Action::Turntable(Some(2)));
    w.harness.run_steps(3);
    assert_eq!(keys(&w), 12);
    w.until("it plays", |a| center(a).distance(home) > 1e-3);
    let loops = |w: &Window| w.harness.get_by_label("Loop").accesskit_node().toggled() == Some(Toggled::True);
    assert!(loops(&w), "again and again");
    w.ask(Action::PlayPath);
    w.ask(Action::StepForward);
    let here = center(w.app());
    w.ask(Action::AddKey);
    w.harness.run_steps(3);
    assert_eq!(keys(&w), 13);
    assert!(w.app().state.log.iter().any(|l| l.text.contains("Inserted keyframe")), "between two keys");
    assert_eq!(center(w.app()), here, "the view stays");
    undo(&mut w);
    assert_eq!(keys(&w), 12);
    undo(&mut w);
    assert_eq!(keys(&w), 1, "one step brings the earlier path back");
    assert!(!loops(&w), "which was not repeated");
}
