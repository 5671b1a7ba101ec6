//! Removing a thing: the scene without it appears beside, can be made anew and gone on with; the first one stays.

use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

use fmlgs::ui::actions::Action;

use super::edits::{boxes, window};

#[test]
fn a_scene_without_a_box_is_seen_beside_and_opened() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let before = std::fs::read(folder.path().join("scene/point_cloud.ply")).expect("the scene");
    w.ask(Action::Remove(2));
    w.until("the scene without it", |a| !a.state.beside.is_empty());
    w.until("both views", |a| a.viewport.picture().is_some_and(|p| p.second().is_some()));
    assert!(w.shows("without box 1") && w.app().layout.split_view);
    let made = folder.path().join("scene-without-box-1");
    assert!(made.join("scene.json").is_file());

    // Another fill is another scene; none replaces one that is there.
    // The card stays within its half of the window: what has no room is in its menu.
    let view = w.harness.get_by_label("without box 1").rect();
    assert!(view.left() >= 0.0 && w.harness.get_by_role_and_label(Role::Button, "Options").rect().right() < 1200.0);
    w.click("Options");
    w.harness.run_steps(3);
    w.click("Another fill");
    let again = folder.path().join("scene-without-box-1-2");
    w.until("another one", |_| again.join("scene.json").is_file());
    w.until("it is shown", |a| a.state.beside.first().is_some_and(|b| b.path == again));
    w.harness.run_steps(2);
    // Both are found again, below the scene that is open.
    let scene = folder.path().join("scene");
    assert_eq!(w.app().state.recent, [scene.clone(), again.clone(), made.clone()]);

    // One that is not wanted is deleted, once that is said twice, but not with what others put there.
    let other = again.join("notes.txt");
    std::fs::write(&other, "mine").expect("a file");
    let answer = |w: &mut super::Window, answer: &str| {
        w.click("Options");
        w.harness.run_steps(3);
        w.click("Delete this copy\u{2026}");
        w.harness.run_steps(3);
        w.click(answer);
        w.harness.run_steps(3);
    };
    answer(&mut w, "Delete");
    assert!(again.join("scene.json").is_file());
    assert!(w.app().state.log.iter().any(|line| line.text.contains("holds more than the scene")));
    std::fs::remove_file(&other).expect("removed");
    answer(&mut w, "Cancel");
    assert!(again.join("scene.json").is_file() && !w.app().state.beside.is_empty());
    answer(&mut w, "Delete");
    assert!(!again.exists() && made.join("scene.json").is_file() && w.app().state.beside.is_empty());
    assert_eq!(w.app().state.recent, [scene, made.clone()], "what is gone is not offered");
    w.ask(Action::Remove(2));
    w.until("it is made once more", |a| a.state.beside.first().is_some_and(|b| b.path == again));
    w.harness.run_steps(2);

    w.harness.get_by_role_and_label(Role::Button, "Open").click();
    w.until("two boxes", |a| a.state.semantics.as_ref().is_some_and(|m| m.identities.len() == 2));
    assert!(w.app().state.beside.is_empty());
    assert_eq!(std::fs::read(folder.path().join("scene/point_cloud.ply")).expect("the scene"), before);
    // What is shown now is the second one, from which more can be removed.
    w.ask(Action::Remove(1));
    let third = folder.path().join("scene-without-box-1-2-without-box-0");
    w.until("less again", |a| third.join("scene.json").is_file() && !a.state.beside.is_empty());

    // The one beside is deleted first, then the open one; the next in the list of recent scenes takes its place.
    for gone in [&third, &again] {
        w.ask(Action::DeleteRemoved);
        w.harness.run_steps(2);
        w.click("Delete");
        w.until("it is gone", |a| !gone.exists() && a.state.job.is_none());
    }
    let first = folder.path().join("scene");
    w.until("the first one", |a| a.state.scene.as_ref().is_some_and(|s| s.out == first) && a.state.job.is_none());
    assert!(!w.app().state.recent.contains(&third) && w.app().state.recent.contains(&made));
    assert!(made.join("scene.json").is_file(), "the others stay");
}

#[test]
fn photos_alone_have_nothing_to_remove() {
    let folder = tempfile::tempdir().expect("folder");
    boxes(folder.path());
    let mut w = super::Window::new(Some(Action::Open(folder.path().join("photos"))));
    w.until("the photos", |a| a.state.scene.is_some());
    w.ask(Action::Remove(1));
    assert!(w.app().state.log.iter().any(|line| line.text.contains("Only from a trained scene")));
}
