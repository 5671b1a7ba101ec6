//! Gaussians that are cleaned away, and boxes that are moved, doubled and recolored: the scene that was opened stays as
//! it is, and everything can be undone.

use std::path::Path;

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use egui_kittest::kittest::Queryable;
use rand::{RngExt, SeedableRng};

use fmlgs::pipeline::semantics::lifting::edit::Edit;
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
    w.until("they are marked", |a| a.viewport.full_picture().is_some() && picture(a) != plain);
    assert!(w.shows("Delete"));
    w.ask(Action::DeleteChosen);
    let edited = folder.path().join("scene-edited");
    w.until("it is stored", |a| a.state.scene.as_ref().is_some_and(|s| s.out == edited));
    w.until("less is shown", |a| a.viewport.cloud().is_some_and(|c| c.len() < before.len()));
    assert_eq!(stored(&edited), cloud(w.app()).len());
    let said = |text: &str| w.app().state.log.iter().filter(|line| line.text.contains(text)).count();
    assert_eq!(said("Changes go to a copy, "), 1, "the message of the edit says it");
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
        assert_eq!(w.app().viewport.picking.selected(), Some(id), "what is moved is outlined");
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
fn enter_applies_what_the_card_shows_and_escape_leaves_it() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let before = cloud(w.app());
    for (key, applies) in [(Key::Escape, false), (Key::Enter, true)] {
        w.ask(Action::Transform(1));
        w.harness.run_steps(2);
        tick(&mut w, "Color");
        w.press(key);
        if applies {
            w.until("it is changed", |a| a.viewport.cloud().is_some_and(|c| ***c != before));
        } else {
            assert!(!w.shows("drag an arrow or type values") && cloud(w.app()) == before, "the control");
        }
    }
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
fn undo_beyond_the_first_copy_reaches_the_scene_that_it_was_made_of() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let (scene, edited) = (folder.path().join("scene"), folder.path().join("scene-edited"));
    let name = |a: &App| a.state.semantics.as_ref().map(|map| map.identities.name(1)).unwrap_or_default();
    let stored_name = || {
        let mut w = Window::new(Some(Action::Open(scene.clone())));
        w.until("its objects", |a| a.state.semantics.is_some());
        name(w.app())
    };
    let before = name(w.app());
    w.ask(Action::Change(Edit::Rename(1, "crate".into())));
    w.until("the name", |a| name(a) == "crate");
    w.ask(Action::Transform(2));
    w.harness.run_steps(4);
    tick(&mut w, "Color");
    tick(&mut w, "Apply to a copy");
    w.ask(Action::ApplyTransform);
    w.until("the copy", |a| a.state.scene.as_ref().is_some_and(|s| s.out == edited));
    w.ask(Action::Undo);
    w.until("one box less", |a| a.viewport.cloud().is_some_and(|c| c.len() == stored(&scene)));
    assert_eq!((stored_name().as_str(), name(w.app()).as_str()), ("crate", "crate"), "the control");
    w.ask(Action::Undo);
    w.until("the old name", |a| name(a) == before);
    assert_eq!(stored_name(), before, "not only in the copy");
    w.ask(Action::Redo);
    w.until("the new name", |a| name(a) == "crate");
    assert_eq!(stored_name(), "crate");
}

#[test]
fn all_of_it_moves_the_whole_and_selects_it() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let count = |a: &App| a.state.semantics.as_ref().map_or(0, |m| m.identities.len());
    let gaussians = {
        let map = w.app().state.semantics.clone().expect("objects");
        (0..map.identity_of.len() as u32).filter(|i| map.identity_of[*i as usize] == 1).step_by(2).collect()
    };
    w.ask(Action::Change(Edit::AddPiece { of: 1, name: "lid".into(), gaussians }));
    w.until("a part", |a| count(a) == 4 && a.viewport.picking.selected() == Some(4));
    w.ask(Action::Transform(4));
    w.harness.run_steps(4);
    assert!(w.shows("Move \u{201c}lid"));
    w.click("All of it");
    w.harness.run_steps(4);
    assert!(w.shows("Move \u{201c}box 0") && !w.shows("Move \u{201c}lid"));
    assert_eq!(w.app().viewport.picking.selected(), Some(1), "outline and list follow");
}
