//! Gaussians that are cleaned away, and boxes that are moved, doubled and recolored: the scene that was opened stays as
//! it is, and everything can be undone.

use std::path::Path;

use egui::accesskit::Role;
use egui::{Event, Modifiers, PointerButton, Pos2};
use egui_kittest::kittest::Queryable;
use rand::{RngExt, SeedableRng};

use fmlgs::scene::GaussianCloud;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::Window;
use super::edits::window;

fn cloud(app: &App) -> GaussianCloud {
    let cloud = app.viewport.cloud().expect("Gaussians");
    (***cloud).clone()
}

/// The Gaussians that are stored in a scene's folder, by number.
fn stored(folder: &Path) -> usize {
    fmlgs::io::splat_ply::read(&folder.join("point_cloud.ply")).expect("a scene").len()
}

/// Drags along these places.
fn drag(w: &mut Window, places: [Pos2; 3]) {
    let button = |pos, pressed| {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        Event::PointerButton { pos, button, pressed, modifiers }
    };
    w.harness.event(Event::PointerMoved(places[0]));
    w.harness.event(button(places[0], true));
    w.harness.step();
    for pos in places {
        w.harness.event(Event::PointerMoved(pos));
        w.harness.step();
    }
    w.harness.event(button(places[2], false));
    w.harness.run_steps(3);
}

fn tick(w: &mut Window, name: &str) {
    w.harness.get_by_role_and_label(Role::CheckBox, name).click();
    w.harness.run_steps(4);
}

#[test]
fn what_no_photo_shows_is_measured_seen_deleted_and_brought_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let scene = folder.path().join("scene");
    let opened = std::fs::read(scene.join("point_cloud.ply")).expect("the scene");
    let before = cloud(w.app());
    w.ask(Action::MeasureSplats);
    w.harness.run_steps(4);
    w.until("measures", |a| a.state.log.iter().any(|line| line.text.contains("Gaussians measured")));
    assert!(w.shows("Suspects") && w.shows("By a measure"));
    let picture = |a: &App| a.viewport.picture().map(|p| p.rgb.clone());
    let plain = picture(w.app());
    w.click("Measure shown");
    w.click("opacity");
    let bars = w.harness.get_by_label("Histogram").rect();
    let at = |x: f32| bars.left_center() + egui::vec2(x * bars.width(), 0.0);
    drag(&mut w, [at(0.02), at(0.1), at(0.4)]);
    w.until("they are marked", |a| a.viewport.picture().is_some_and(|p| p.full) && picture(a) != plain);
    assert!(w.shows("Delete"));
    w.ask(Action::DeleteChosen);
    let edited = folder.path().join("scene-edited");
    w.until("it is stored", |a| a.state.scene.as_ref().is_some_and(|s| s.out == edited));
    w.until("less is shown", |a| a.viewport.cloud().is_some_and(|c| c.len() < before.len()));
    assert_eq!(stored(&edited), cloud(w.app()).len());
    assert!(w.shows("Suspects"), "what is left need not be measured again");
    assert_eq!(std::fs::read(scene.join("point_cloud.ply")).expect("the scene"), opened);
    w.ask(Action::Undo);
    w.until("all is back", |a| a.viewport.cloud().is_some_and(|c| c.len() == before.len()));
    assert!(cloud(w.app()) == before && stored(&edited) == before.len());
    // Objects are edited in the same place.
    w.ask(Action::Change(fmlgs::pipeline::semantics::lifting::edit::Edit::Rename(1, "crate".into())));
    w.until("a name", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.name(1) == "crate"));
    assert!(!scene.parent().expect("a folder").join("scene-edited-2").exists());
}

#[test]
fn a_box_is_recolored_and_doubled_and_a_hundred_steps_back_and_forth_lose_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let mut states = vec![cloud(w.app())];
    for (id, doubled) in [(1, false), (2, true), (3, false), (1, true)] {
        w.ask(Action::Transform(id));
        assert!(w.shows("Apply"));
        tick(&mut w, "Color");
        if doubled {
            tick(&mut w, "Apply to a copy");
        }
        w.click("Apply");
        let before = states.last().expect("one").clone();
        w.until("it is changed", |a| a.viewport.cloud().is_some_and(|c| ***c != before));
        w.harness.run_steps(3);
        states.push(cloud(w.app()));
    }
    assert_eq!(w.app().state.semantics.as_ref().expect("objects").identities.len(), 5);
    assert!(states[2].len() > states[1].len() && states[1].len() == states[0].len());
    let (mut rng, mut at) = (rand_pcg::Pcg64Mcg::seed_from_u64(5), 4_usize);
    let step = |w: &mut Window, back: bool, at: &mut usize| {
        w.ask(if back { Action::Undo } else { Action::Redo });
        *at = if back { at.saturating_sub(1) } else { (*at + 1).min(4) };
        let want = &states[*at];
        w.until("the state", |a| a.viewport.cloud().is_some_and(|c| ***c == *want));
        w.harness.run_steps(2);
    };
    for _ in 0..100 {
        step(&mut w, rng.random_bool(0.5), &mut at);
    }
    while at > 0 {
        step(&mut w, true, &mut at);
    }
    assert!(cloud(w.app()) == states[0], "bit for bit");
    assert_eq!(w.app().state.semantics.as_ref().expect("objects").identities.len(), 3);
}

#[test]
fn photos_alone_have_nothing_to_clean() {
    let folder = tempfile::tempdir().expect("folder");
    super::edits::boxes(folder.path());
    let mut w = Window::new(Some(Action::Open(folder.path().join("photos"))));
    w.until("the photos", |a| a.state.scene.is_some());
    w.ask(Action::MeasureSplats);
    assert!(w.app().state.log.iter().any(|line| line.text.contains("Only trained Gaussians can be cleaned")));
}

#[test]
fn gaussians_that_are_brushed_over_are_chosen_and_with_shift_they_are_not() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::MeasureSplats);
    w.until("measures", |a| a.state.log.iter().any(|line| line.text.contains("Gaussians measured")));
    w.ask(Action::BrushSplats);
    w.until("all is drawn", |a| a.viewport.picture().is_some_and(|p| p.full && p.median_depth.is_some()));
    assert!(w.shows("Brush over the Gaussians to choose: drag in any view."));
    let eye = w.app().viewport.pose();
    let viewport = w.harness.get_by_role_and_label(Role::Image, "Viewport").rect();
    // Over the center that is nearest to the eye.
    let camera = w.app().viewport.picture().expect("a picture").camera.clone();
    let all = cloud(w.app());
    let depth = |at: &glam::DVec3| camera.camera_from_world(*at).z;
    let size = glam::DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
    let amid = |at: glam::DVec2| at.cmpgt(0.3 * size).all() && at.cmplt(0.7 * size).all();
    let seen = (0..all.len()).map(|i| all.world_position(i)).filter(|at| camera.project(*at).is_some_and(amid));
    let nearest = seen.min_by(|a, b| depth(a).total_cmp(&depth(b))).expect("a Gaussian");
    let at =
        camera.project(nearest).expect("before the eye") * f64::from(viewport.width()) / f64::from(camera.width_px);
    let stroke = [-12.0, 8.0].map(|x| viewport.min + egui::vec2(at.x as f32 + x, at.y as f32));
    super::split::drag(&mut w, stroke, Modifiers::NONE);
    w.harness.run_steps(4);
    let chosen = |w: &Window| -> usize {
        let label = w.harness.get_by_label_contains(" Gaussians (").value().expect("how many are chosen");
        label.split(' ').next().and_then(|n| n.replace(',', "").parse().ok()).expect("a number")
    };
    let some = chosen(&w);
    assert!(some > 0 && some < cloud(w.app()).len(), "{some}");
    assert_eq!(w.app().viewport.pose(), eye, "the view does not turn");
    super::split::drag(&mut w, stroke, Modifiers::SHIFT);
    w.harness.run_steps(4);
    assert_eq!(chosen(&w), 0, "the same stroke takes all of it out again");
}

#[test]
fn a_click_on_a_color_chooses_its_gaussians_and_with_shift_takes_them_out() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    w.ask(Action::PickColor);
    assert!(w.shows("Measure the Gaussians first") && !w.shows("Click a color"), "there is nothing to choose among");
    w.ask(Action::MeasureSplats);
    w.until("measures", |a| a.state.log.iter().any(|line| line.text.contains("Gaussians measured")));
    w.ask(Action::PickColor);
    w.until("all is drawn", |a| a.viewport.picture().is_some_and(|p| p.full));
    assert!(w.shows("Click a color: all Gaussians of that color are chosen."));
    let viewport = w.harness.get_by_role_and_label(Role::Image, "Viewport").rect();
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
    let scale = viewport.width() / wide as f32;
    let at = viewport.min + egui::vec2((place % wide) as f32 + 0.5, (place / wide) as f32 + 0.5) * scale;
    let click = |w: &mut Window, modifiers| {
        let button = |pressed| Event::PointerButton { pos: at, button: PointerButton::Primary, pressed, modifiers };
        w.harness.event(Event::ModifiersChanged(modifiers));
        w.harness.hover_at(at);
        w.harness.step();
        [true, false].into_iter().for_each(|pressed| w.harness.event(button(pressed)));
        w.harness.event(Event::ModifiersChanged(Modifiers::NONE));
        w.harness.run_steps(4);
    };
    let chosen = |w: &Window| w.harness.get_by_label_contains(" Gaussians (").value().expect("how many are chosen");
    click(&mut w, Modifiers::NONE);
    assert!(!chosen(&w).starts_with("0 "), "{}", chosen(&w));
    click(&mut w, Modifiers::SHIFT);
    assert!(chosen(&w).starts_with("0 "), "{}", chosen(&w));
}
