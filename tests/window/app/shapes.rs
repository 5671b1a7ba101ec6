//! Gaussians selected by brush, lasso, rectangle, ball, color and object; grown, shrunk, deleted.

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable;

use fmlgs::scene::GaussianCloud;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;
use fmlgs::ui::select_shape::SelectShape;

use super::Window;
use super::edits::window;
use super::split::drag;

fn cloud(app: &App) -> GaussianCloud {
    let cloud = app.viewport.cloud().expect("Gaussians");
    (***cloud).clone()
}

fn view(w: &Window) -> Rect {
    w.harness.get_by_role_and_label(Role::Image, "Viewport").rect()
}

/// Begins to select by a shape, once all is drawn.
fn select_by(w: &mut Window, shape: SelectShape) {
    w.ask(Action::SelectBy(shape));
    let height = |wide: u32, view: Rect| (wide as f32 * view.height() / view.width()).round() as u32;
    let rect = view(w);
    // The panes have just been closed, so the frame before has another shape.
    w.until("all is drawn", |a| {
        let fits = |c: &fmlgs::scene::Camera| c.height_px.abs_diff(height(c.width_px, rect)) < 3;
        a.viewport.picture().is_some_and(|p| p.full && p.median_depth.is_some() && fits(&p.camera))
    });
}

/// The number of selected Gaussians, once all is at rest.
fn selected(w: &mut Window) -> usize {
    w.until("an answer", |a| a.viewport.lines_drawn() == 0 && a.viewport.selection().is_some());
    w.app().viewport.selection().expect("an answer")
}

fn click(w: &mut Window, at: Pos2, modifiers: Modifiers) {
    let button = |pressed| Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers };
    w.harness.event(Event::ModifiersChanged(modifiers));
    w.harness.hover_at(at);
    w.harness.step();
    for pressed in [true, false] {
        w.harness.event(button(pressed));
        w.harness.step();
    }
    w.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    w.harness.run_steps(4);
}

/// The place in the window of the surface that is nearest to the eye, amid the view and above the card.
fn nearest(w: &Window) -> Pos2 {
    let picture = w.app().viewport.picture().expect("a picture");
    let depth = picture.median_depth.as_deref().expect("depths");
    let [wide, high] = [picture.camera.width_px, picture.camera.height_px].map(|side| side as usize);
    let is_surface = |at: usize| (at - 12..at + 12).all(|k| depth[k] > 0.0);
    let rows = high / 5..high / 2;
    let all = rows.flat_map(|y| (3 * wide / 10..7 * wide / 10).map(move |x| y * wide + x)).filter(|at| is_surface(*at));
    let at = all.min_by(|a, b| depth[*a].total_cmp(&depth[*b])).expect("a surface");
    view(w).min + vec2((at % wide) as f32, (at / wide) as f32) * (view(w).width() / wide as f32)
}

#[test]
fn gaussians_that_are_brushed_over_are_selected_and_with_shift_they_are_not() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    select_by(&mut w, SelectShape::Brush);
    assert!(w.shows("New object: drag over its Gaussians."));
    let (eye, at) = (w.app().viewport.pose(), nearest(&w));
    for shape in [SelectShape::Brush, SelectShape::Sphere] {
        w.ask(Action::SelectBy(shape));
        let stroke = [-12.0, 8.0].map(|x| at + vec2(x, 0.0));
        drag(&mut w, stroke, Modifiers::NONE);
        let some = selected(&mut w);
        assert!(some > 0 && some < cloud(w.app()).len(), "{some}");
        assert_eq!(w.app().viewport.pose(), eye, "the view does not turn");
        drag(&mut w, stroke, Modifiers::SHIFT);
        assert_eq!(selected(&mut w), 0, "the same stroke takes all of it out again");
    }
}

#[test]
fn a_rectangle_and_a_loop_take_what_they_enclose_and_the_selection_grows_shrinks_and_goes_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    select_by(&mut w, SelectShape::Rectangle);
    let rect = view(&w).shrink(4.0);
    let half = [rect.left_top(), rect.center_bottom()];
    click(&mut w, rect.center(), Modifiers::NONE);
    assert_eq!(w.app().viewport.selection(), None, "a click encloses nothing");
    drag(&mut w, half, Modifiers::NONE);
    let on_surface = selected(&mut w);
    w.harness.get_by_label("Through").click();
    w.harness.run_steps(2);
    drag(&mut w, half, Modifiers::NONE);
    let through = selected(&mut w);
    let all = cloud(w.app()).len();
    assert!(0 < on_surface && on_surface < through && through < all, "{on_surface} {through} {all}");
    // The other half, drawn around with a loop.
    w.ask(Action::SelectBy(SelectShape::Lasso));
    let corners = [rect.center_top(), rect.right_top(), rect.right_bottom(), rect.center_bottom()];
    let button = |pos, pressed| {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    };
    w.harness.hover_at(corners[0]);
    w.harness.step();
    w.harness.event(button(corners[0], true));
    w.harness.step();
    for pos in corners {
        w.harness.event(Event::PointerMoved(pos));
        w.harness.step();
    }
    w.harness.event(button(corners[3], false));
    w.harness.run_steps(3);
    let both = selected(&mut w);
    assert!(both > through, "{both} {through}");
    w.press(Key::Backspace);
    w.until("undone", |a| a.viewport.selection() == Some(through));
    for (name, is_more) in [("Grow", true), ("Shrink", false)] {
        w.harness.get_by_label(name).click();
        w.until("changed", |a| a.viewport.selection().is_some_and(|n| n != through));
        assert_eq!(selected(&mut w) > through, is_more, "{name}");
        w.harness.get_by_label("Undo").click();
        w.until("as before", |a| a.viewport.selection() == Some(through));
    }
    w.ask(Action::DeleteChosen);
    w.until("deleted", |a| a.viewport.cloud().is_some_and(|cloud| cloud.len() == all - through));
    w.ask(Action::Undo);
    w.until("brought back", |a| a.viewport.cloud().is_some_and(|cloud| cloud.len() == all));
    // The control: nothing is selected, so nothing is deleted.
    w.ask(Action::DeleteChosen);
    assert!(w.shows("No Gaussians are selected"));
    assert_eq!(cloud(w.app()).len(), all);
}

#[test]
fn a_click_on_a_color_selects_its_gaussians_and_with_shift_takes_them_out() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    select_by(&mut w, SelectShape::Color);
    let picture = w.app().viewport.picture().expect("drawn").clone();
    // The pixel whose color is nearest to that of a Gaussian.
    let all = cloud(w.app());
    let own: Vec<[f32; 3]> =
        (0..all.len()).map(|i| all.sh[i * all.sh_stride()].map(|v| (0.5 + 0.282_094_8 * v).clamp(0.0, 1.0))).collect();
    let distance = |p: &[u8; 3]| {
        let to = |c: &[f32; 3]| (0..3).map(|k| (c[k] - f32::from(p[k]) / 255.0).powi(2)).sum::<f32>();
        own.iter().map(to).fold(f32::INFINITY, f32::min)
    };
    let nearest =
        (0..picture.rgb.len()).min_by(|a, b| distance(&picture.rgb[*a]).total_cmp(&distance(&picture.rgb[*b])));
    let (place, wide) = (nearest.expect("pixels"), picture.camera.width_px as usize);
    let scale = view(&w).width() / wide as f32;
    let at = view(&w).min + vec2((place % wide) as f32 + 0.5, (place / wide) as f32 + 0.5) * scale;
    click(&mut w, at, Modifiers::NONE);
    assert!(selected(&mut w) > 0);
    click(&mut w, at, Modifiers::SHIFT);
    assert_eq!(selected(&mut w), 0);
}

#[test]
fn a_click_takes_a_whole_object_and_with_shift_it_is_taken_out_again() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    select_by(&mut w, SelectShape::Object);
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    let map = w.app().state.semantics.clone().expect("objects");
    let maps = w.app().viewport.queries.maps().expect("maps").identities.clone();
    let wide = maps.width_px;
    let inside = |i: usize| (0..9).all(|k| maps.identity.get(i + k % 3 + k / 3 * wide) == Some(&2));
    let place = (0..maps.identity.len()).find(|i| inside(*i)).expect("box 1") + wide + 1;
    let share = vec2((place % wide) as f32 / wide as f32, (place / wide) as f32 / maps.height_px as f32);
    let at = view(&w).min + share * view(&w).size();
    click(&mut w, at, Modifiers::NONE);
    let of_box = map.identity_of.iter().filter(|of| **of == 2).count();
    assert_eq!(selected(&mut w), of_box);
    w.until("drawn anew", |a| a.viewport.queries.maps().is_some() && a.viewport.picture().is_some_and(|p| p.full));
    click(&mut w, at, Modifiers::SHIFT);
    assert_eq!(selected(&mut w), 0);
}

#[test]
fn a_selection_of_the_clean_pane_goes_on_by_hand() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::MeasureSplats);
    w.until("measures", |a| a.state.log.iter().any(|line| line.text.contains("Gaussians measured")));
    w.harness.get_by_role_and_label(Role::CheckBox, "A color").click();
    w.harness.run_steps(4);
    let label = w.harness.get_by_label_contains(" Gaussians (").value().expect("how many are selected");
    let chosen = label.split(' ').next().and_then(|n| n.replace(',', "").parse::<usize>().ok()).expect("a number");
    let has_delete = |w: &Window| w.harness.query_by_role_and_label(Role::Button, "Delete").is_some();
    assert!(has_delete(&w) && !w.shows("Grow"), "changing a selection is left to the tool");
    w.harness.get_by_label("By hand\u{2026}").click();
    w.harness.run_steps(3);
    assert!(!has_delete(&w) && w.shows("Grow"), "now the tool has them");
    if chosen > 0 {
        assert_eq!(selected(&mut w), chosen);
    }
    select_by(&mut w, SelectShape::Rectangle);
    let rect = view(&w).shrink(4.0);
    drag(&mut w, [rect.left_top(), rect.right_bottom()], Modifiers::NONE);
    let more = selected(&mut w);
    assert!(more > chosen);
    let before = cloud(w.app()).len();
    w.ask(Action::DeleteChosen);
    w.until("deleted", |a| a.viewport.cloud().is_some_and(|cloud| cloud.len() == before - more));
    assert!(w.shows("Suspects"), "the measures of the others stay");
}
