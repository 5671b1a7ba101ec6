//! The camera of the view comes back, goes on and keeps what was asked for; cards of tools; what is drawn over a view.

use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::{Action, Face};
use fmlgs::ui::app::App;
use fmlgs::ui::select_shape::SelectShape;
use fmlgs::worker::ViewMode;

use super::edits::window;
use super::hands::area;
use super::split::drag;
use super::{Window, photos};

fn center(a: &App) -> glam::DVec3 {
    a.viewport.pose().center
}

fn view(w: &Window) -> Rect {
    w.harness.get_by_label("Viewport").rect()
}

/// Pixels of the view whose color is nearly this one.
fn colored(w: &mut Window, color: [u8; 3]) -> usize {
    let part = view(w);
    let image = w.harness.render().expect("the software adapter draws");
    let is_near = |p: &image::Rgba<u8>| (0..3).all(|c| p[c].abs_diff(color[c]) < 12);
    image.enumerate_pixels().filter(|(x, y, p)| part.contains(Pos2::new(*x as f32, *y as f32)) && is_near(p)).count()
}

/// Returns whether the window shows a text once the worker has got on.
pub(crate) fn shows_soon(w: &mut Window, text: &str) -> bool {
    for _ in 0..2_000 {
        if w.shows(text) {
            return true;
        }
        w.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    false
}

#[test]
fn a_mode_that_needs_a_photo_gives_the_camera_back_and_a_photo_that_was_chosen_stays() {
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.key_down(Key::W);
    w.harness.run_steps(4);
    w.harness.key_up(Key::W);
    w.harness.run_steps(3);
    let free = center(w.app());
    for key in [Key::Num6, Key::C] {
        w.press(key);
        assert!(w.app().viewport.photo_index().is_some() && center(w.app()) != free, "{key:?} goes to a photo");
        w.press(if key == Key::C { Key::C } else { Key::Num1 });
        w.harness.run_steps(2);
        assert_eq!((w.app().viewport.photo_index(), center(w.app())), (None, free), "{key:?}");
    }
    w.press(Key::Num6);
    w.ask(Action::Undo);
    w.harness.run_steps(3);
    assert!(w.app().layout.mode == ViewMode::Rgb && center(w.app()) == free, "undo comes back, too");
    // The control: at a photo of the user's choice, modes change nothing.
    w.ask(Action::GoToPhoto(2));
    w.press(Key::Num6);
    w.press(Key::Num1);
    w.harness.run_steps(2);
    assert_eq!(w.app().viewport.photo_index(), Some(2));
}

#[test]
fn before_a_training_a_photo_is_shown_itself() {
    let mut w = Window::new(Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.run_steps(3);
    assert!(!w.shows("there are no Gaussians yet"), "the free view");
    w.ask(Action::GoToPhoto(1));
    assert!(shows_soon(&mut w, "Photo: there are no Gaussians yet"));
    // The control: in a trained scene it is a rendering.
    let folder = tempfile::tempdir().expect("folder");
    let mut trained = window(folder.path());
    trained.ask(Action::GoToPhoto(1));
    trained.harness.run_steps(3);
    assert!(trained.app().viewport.photo_index() == Some(1) && !trained.shows("there are no Gaussians yet"));
}

#[test]
fn both_views_of_a_removal_show_its_place_and_opening_it_keeps_camera_and_query() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Ask("box 0".into()));
    assert_eq!(w.app().viewport.queries.found(), [1]);
    let cloud = (***w.app().viewport.cloud().expect("Gaussians")).clone();
    let of = &w.app().state.semantics.as_ref().expect("objects").identity_of;
    let own: Vec<usize> = (0..of.len()).filter(|i| of[*i] == 2).collect();
    let middle = own.iter().map(|i| cloud.world_position(*i)).sum::<glam::DVec3>() / own.len() as f64;
    w.harness.key_down(Key::D);
    let seen = |a: &App| {
        let camera = &a.viewport.picture().expect("drawn").camera;
        let p = camera.project(middle);
        p.is_some_and(|p| (0.0..f64::from(camera.width_px)).contains(&p.x))
    };
    w.until("it is out of sight", |a| !seen(a));
    w.harness.key_up(Key::D);
    w.ask(Action::Remove(2));
    w.until("both views of it", |a| {
        !a.state.beside.is_empty() && a.viewport.picture().is_some_and(|p| p.full && p.second().is_some()) && seen(a)
    });
    w.harness.run_steps(3);
    let place = center(w.app());
    w.harness.get_by_role_and_label(Role::Button, "Open").click();
    let made = folder.path().join("scene-without-box-1");
    w.until("the other scene", |a| a.state.scene.as_ref().is_some_and(|s| s.out == made));
    w.harness.run_steps(3);
    assert_eq!(center(w.app()), place);
    assert_eq!(w.app().viewport.queries.found(), [1], "box 0, as before");
    // The control: another place begins at its own first view, with nothing asked.
    w.ask(Action::Open(super::write_splat(folder.path())));
    w.until("dots", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    w.harness.run_steps(3);
    assert!(center(w.app()) != place && w.app().viewport.queries.found().is_empty());
}

#[test]
fn the_card_of_a_tool_is_moved_by_its_title_and_folded_in_a_low_view() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::SelectBy(SelectShape::Lasso));
    w.harness.run_steps(3);
    let title = |w: &Window| w.harness.get_by_label_contains("New object: ").rect();
    let (before, card, eye) = (title(&w), area(&w, "selecting"), center(w.app()));
    let from = before.left_center() + vec2(20.0, 0.0);
    drag(&mut w, [from, from + vec2(60.0, -90.0)], Modifiers::NONE);
    let moved = area(&w, "selecting");
    assert!((moved.min - card.min - vec2(60.0, -90.0)).length() < 12.0, "{card} {moved}");
    assert!(center(w.app()) == eye && w.app().viewport.lines_drawn() == 0, "nothing else is dragged");
    let from = title(&w).left_center() + vec2(20.0, 0.0);
    drag(&mut w, [from, from - vec2(3000.0, 3000.0)], Modifiers::NONE);
    assert!(view(&w).expand(1.0).contains_rect(area(&w, "selecting")), "it stays in the view");
    assert!(w.shows("Grow"), "control: there is room for all of it");

    w.harness.set_size([800.0, 600.0].into());
    w.harness.run_steps(4);
    assert!(w.shows("Brush") && !w.shows("Grow"));
    assert!(area(&w, "selecting").height() < 0.3 * view(&w).height());
    w.click("Show all of this card");
    w.harness.run_steps(3);
    assert!(w.shows("Grow") && view(&w).expand(1.0).contains_rect(area(&w, "selecting")));
}

#[test]
fn an_offered_crop_box_crops_nothing_until_it_is_accepted() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.press(Key::B);
    w.harness.run_steps(2);
    assert!(w.shows("Nothing is cropped yet") && !w.shows("Remove the crop box"));
    w.click("Crop");
    w.harness.run_steps(2);
    assert!(!w.shows("Nothing is cropped yet") && w.shows("Remove the crop box"));
    w.click("Remove box");
    w.harness.run_steps(2);
    assert!(w.shows("Nothing is cropped yet") && !w.shows("Remove the crop box"));
}

#[test]
fn kept_measurements_are_drawn_while_measuring_or_on_request() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::Select(Some(1)));
    w.press(Key::M);
    w.click("Box");
    w.press(Key::Enter);
    w.press(Key::Escape);
    w.ask(Action::Select(None));
    w.harness.run_steps(60);
    assert_eq!(w.app().viewport.measurements.len(), 1);
    let line = [0x6c, 0xb2, 0xf0];
    let plain = colored(&mut w, line);
    w.ask(Action::ToggleMeasurements);
    w.harness.run_steps(60);
    assert!(colored(&mut w, line) > plain + 100, "twelve edges");
    w.ask(Action::ToggleMeasurements);
    w.harness.run_steps(60);
    assert!(colored(&mut w, line) < plain + 20, "the control");
}

#[test]
fn an_orthographic_view_says_so_and_where_it_is_from() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    assert!(!w.shows("Orthographic"));
    w.ask(Action::LookFrom(Face::Top));
    w.press(Key::Num5);
    assert!(shows_soon(&mut w, "Orthographic \u{b7} Top"));
    assert!(shows_soon(&mut w, "Depth from the nearest point"));
    w.click("Perspective");
    w.harness.run_steps(3);
    assert!(!w.shows("Orthographic") && !w.shows("Depth from the nearest point"), "the control");
}
