//! Two views of one scene, dimming what is not asked for, true masks painted by hand, and the rate of frames.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;
use fmlgs::worker::ViewMode;

use super::edits::window;
use super::{Window, write_splat};

/// Colors of the first and the second phrase that is asked.
const COLORS: [[u8; 3]; 2] = [[255, 179, 0], [225, 90, 255]];

fn view(w: &Window) -> Rect {
    w.harness.get_by_label("Viewport").rect()
}

/// Pixels of a part of the window that are about of a color.
fn colored(w: &mut Window, part: Rect, color: [u8; 3]) -> usize {
    let image = w.harness.render().expect("the software adapter draws");
    let is_near = |p: &image::Rgba<u8>| (0..3).all(|c| p[c].abs_diff(color[c]) < 12);
    image.enumerate_pixels().filter(|(x, y, p)| part.contains(Pos2::new(*x as f32, *y as f32)) && is_near(p)).count()
}

fn brightness(w: &mut Window) -> f64 {
    let part = view(w);
    let image = w.harness.render().expect("the software adapter draws");
    let inside = image.enumerate_pixels().filter(|(x, y, _)| part.contains(Pos2::new(*x as f32, *y as f32)));
    inside.map(|(_, _, p)| p.0[..3].iter().map(|c| f64::from(*c)).sum::<f64>()).sum()
}

/// Presses the button, goes elsewhere, lets go.
pub(super) fn drag(w: &mut Window, [from, to]: [Pos2; 2], modifiers: Modifiers) {
    let button = |pos, pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
    w.harness.event(Event::ModifiersChanged(modifiers));
    w.harness.hover_at(from);
    w.harness.step();
    w.harness.event(button(from, true));
    w.harness.step();
    for share in [0.3, 0.6, 1.0] {
        w.harness.hover_at(from.lerp(to, share));
        w.harness.step();
    }
    w.harness.event(button(to, false));
    w.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    w.harness.run_steps(3);
}

fn at_rest(a: &App) -> bool {
    a.viewport.picture().is_some_and(|p| p.full) && a.viewport.queries.maps().is_some()
}

/// Identities found in the first and in the second view.
fn found(w: &mut Window) -> [Vec<u32>; 2] {
    let queries = &mut w.harness.state_mut().viewport.queries;
    [false, true].map(|second| queries.in_view(second, |q| q.found()))
}

#[test]
fn two_views_have_one_camera_and_their_own_queries_and_colors() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.harness.state_mut().layout.cameras = false;
    w.ask(Action::Ask("box 0".into()));
    w.until("maps", at_rest);
    let whole = w.app().viewport.picture().expect("drawn").camera.width_px;
    w.press(Key::Num8);
    assert!(w.app().layout.split_view && w.app().viewport.queries.is_second());
    w.press(Key::Slash);
    w.types("box 1");
    w.press(Key::Enter);
    w.harness.ctx.memory_mut(|m| m.stop_text_input());
    w.until("both views", |a| at_rest(a) && a.viewport.picture().is_some_and(|p| p.camera.width_px * 2 <= whole));
    assert_eq!(found(&mut w), [vec![1], vec![2]]);
    let (left, right) = view(&w).split_left_right_at_fraction(0.5);
    let masks = [left, right].map(|part| COLORS.map(|color| colored(&mut w, part, color)));
    assert!(masks[0][0] > 40 && masks[1][1] > 40 && masks[0][1] == 0 && masks[1][0] == 0, "{masks:?}");

    // Keys are about the view that is worked in; both are drawn from one frame.
    let click = |w: &mut Window, at: Pos2| drag(w, [at, at], Modifiers::NONE);
    click(&mut w, right.center_bottom() - vec2(0.0, 20.0));
    w.harness.run_steps(80);
    w.press(Key::Num5);
    assert_eq!((w.app().layout.mode, w.app().layout.second_mode), (ViewMode::Rgb, ViewMode::Depth));
    w.until("depths", |a| a.viewport.picture().is_some_and(|p| p.second().is_some_and(|s| s.rgb != p.rgb)));
    w.press(Key::Num0);
    assert!(!w.app().viewport.queries.is_second());
    click(&mut w, right.center_bottom() - vec2(0.0, 20.0));
    assert!(w.app().viewport.queries.is_second(), "it was pressed");
    w.until("rest", at_rest);

    // Dragging in one moves both.
    let before = w.app().viewport.picture().expect("drawn").camera.center;
    let at = left.center() + vec2(0.0, 150.0);
    drag(&mut w, [at, at + vec2(60.0, 0.0)], Modifiers::NONE);
    w.until("another picture of both", |a| {
        a.viewport.picture().is_some_and(|p| p.camera.center != before && p.second().is_some())
    });
    assert!(!w.app().viewport.queries.is_second());
    w.until("rest", at_rest);
    w.harness.run_steps(80);
    let ticket = |a: &App| a.viewport.picture().expect("drawn").ticket;
    let drawn = ticket(w.app());
    w.harness.run_steps(10);
    let repaints = w.harness.ctx.has_requested_repaint();
    assert!(ticket(w.app()) == drawn && !repaints, "nothing changed, so nothing is drawn anew: the window rests");
    w.harness.key_down(Key::A);
    w.harness.run_steps(2);
    assert!(w.harness.ctx.has_requested_repaint(), "the control");
    w.harness.key_up(Key::A);

    w.press(Key::Num8);
    w.until("one view", |a| a.viewport.picture().is_some_and(|p| p.full && p.camera.width_px == whole));
    assert!(!w.app().layout.split_view && w.app().viewport.picture().expect("drawn").second().is_none());
    assert_eq!(found(&mut w)[0], [1], "the first goes on");
    w.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    w.harness.run_steps(3);
    assert!(w.app().layout.split_view, "undone");
}

#[test]
fn the_rest_is_dimmed_where_something_is_found() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.harness.state_mut().layout.cameras = false;
    w.ask(Action::Ask("giraffe".into()));
    w.until("maps", at_rest);
    w.harness.run_steps(60);
    let plain = brightness(&mut w);
    w.press(Key::Num9);
    assert!(w.app().layout.dim);
    w.harness.run_steps(60);
    assert!((brightness(&mut w) / plain - 1.0).abs() < 0.02, "nothing is found, so there is no rest");
    w.ask(Action::Ask("box 0".into()));
    w.harness.run_steps(60);
    let dim = brightness(&mut w);
    assert!(dim < 0.8 * plain, "{dim} of {plain}");
    w.press(Key::Num9);
    w.harness.run_steps(60);
    assert!(brightness(&mut w) > 1.2 * dim);
}

#[test]
fn a_true_mask_is_painted_scored_saved_and_loaded() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.harness.state_mut().layout.cameras = false;
    w.harness.state_mut().layout.folder = Some(folder.path().to_path_buf());
    w.ask(Action::Ask("box 0".into()));
    w.until("maps", at_rest);
    w.ask(Action::SaveTrueMask);
    assert!(!w.app().chooses_file(), "there is none yet");
    w.ask(Action::PaintTrueMask);
    assert!(w.shows("Paint the true mask of this view") && !w.shows("IoU 0."));
    // The middle of the box.
    let map = &w.app().viewport.queries.maps().expect("drawn").identities;
    let (cols, view) = (map.width_px, view(&w));
    let own: Vec<usize> = (0..map.identity.len()).filter(|i| map.identity[*i] == 1).collect();
    let mean = |of: &dyn Fn(usize) -> usize| own.iter().map(|i| of(*i) as f32).sum::<f32>() / own.len() as f32;
    let share = vec2(mean(&|i| i % cols) / cols as f32, mean(&|i| i / cols) / map.height_px as f32);
    let middle = view.min + share * view.size();
    let stroke = [middle, middle + vec2(12.0, 4.0)];
    drag(&mut w, stroke, Modifiers::NONE);
    assert!(w.shows("IoU 0.") && !w.shows("IoU 0.000") && w.shows(" missed"), "some of it is met");
    w.ask(Action::SaveTrueMask);
    w.until("a dialog", |a| a.chooses_file());
    w.click("Save");
    let file = || {
        std::fs::read_dir(folder.path())
            .expect("there")
            .flatten()
            .find(|f| f.path().extension().is_some_and(|e| e == "png"))
    };
    w.until("the file", |_| file().is_some());
    let score = |w: &Window| {
        let all = w.harness.query_all_by_label_contains("IoU 0.").filter_map(|n| n.value());
        all.collect::<Vec<_>>().join(" ")
    };
    let painted = score(&w);
    // The control: erased, nothing is met.
    for _ in 0..4 {
        drag(&mut w, stroke, Modifiers::SHIFT);
    }
    let erased = score(&w);
    assert_ne!(painted, erased);
    w.click("Clear");
    w.click("Done");
    w.harness.run_steps(3);
    assert!(!w.shows("IoU 0.") && !w.shows("Paint the true mask"));
    w.ask(Action::TrueMask(Some(file().expect("written").path())));
    w.harness.run_steps(4);
    assert_eq!(score(&w), painted, "as it was painted");
}

#[test]
fn the_rate_is_shown_while_the_eye_moves() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    assert!(!w.shows(" fps"), "at rest");
    w.harness.key_down(Key::A);
    let mut steps = 0;
    while !w.shows(" fps") {
        steps += 1;
        assert!(steps < 3_000, "frames come");
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    w.harness.key_up(Key::A);
    w.until("rest", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.harness.run_steps(20);
    assert!(!w.shows(" fps"), "at rest again");
}

#[test]
fn another_scene_is_seen_beside_by_the_same_camera() {
    let folder = tempfile::tempdir().expect("folder");
    let splat = write_splat(folder.path());
    let mut other = fmlgs::io::splat_ply::read(&splat).expect("read");
    other.sh.iter_mut().for_each(|c| c.swap(0, 2));
    let path = folder.path().join("other.ply");
    fmlgs::io::splat_ply::write(&path, &other).expect("write");
    let mut w = Window::new(Some(Action::Open(splat.clone())));
    w.until("a picture", |a| a.viewport.picture().is_some_and(|p| p.full));
    w.ask(Action::OpenComparison(path));
    w.until("both", |a| a.viewport.picture().is_some_and(|p| p.full && p.second().is_some()));
    w.harness.run_steps(3);
    let name = w.app().state.beside.first().expect("open").name.clone();
    assert!(w.app().layout.split_view && name.starts_with("other") && w.shows(&name));
    let swapped = |a: &App| {
        let p = a.viewport.picture().expect("drawn");
        let second = &p.second().expect("two views").rgb;
        second.iter().zip(&p.rgb).all(|(b, a)| [b[2], b[1], b[0]] == *a)
    };
    assert!(swapped(w.app()), "red and blue are exchanged, all else is the same");
    let before = w.app().viewport.picture().expect("drawn").camera.center;
    w.harness.hover_at(view(&w).center());
    w.harness.key_down(Key::A);
    w.harness.run_steps(3);
    w.harness.key_up(Key::A);
    w.until("both from elsewhere", |a| a.viewport.picture().is_some_and(|p| p.full && p.camera.center != before));
    assert!(swapped(w.app()));
    // The control: beside itself it looks the same, so nothing is exchanged.
    w.ask(Action::CloseComparison(None));
    w.ask(Action::OpenComparison(splat));
    w.until("itself", |a| a.viewport.picture().is_some_and(|p| p.second().is_some_and(|s| s.rgb == p.rgb)));
    assert!(!swapped(w.app()));
    w.ask(Action::OpenComparison(folder.path().join("nothing.ply")));
    w.until("an error", |a| a.state.error.is_some());
    assert!(!w.app().state.beside.is_empty() && w.app().state.scene.is_some(), "nothing is lost");
    w.harness.state_mut().state.error = None;
    w.ask(Action::CloseComparison(None));
    w.until("one scene", |a| a.viewport.picture().is_some_and(|p| p.full && p.second().is_none()));
}
