//! Two programs on one scene: what the other one changed is seen when the window gets the focus.

use egui::Event;

use fmlgs::io::{SceneFolder, trained};
use fmlgs::ui::actions::Action;

use super::Window;
use super::edits::window;

/// Gives the window the focus and waits until the comparison is over.
fn focus(w: &mut Window) {
    w.harness.input_mut().events.push(Event::WindowFocused(true));
    w.harness.run_steps(3);
    std::thread::sleep(std::time::Duration::from_millis(300));
    w.harness.run_steps(5);
}

#[test]
fn a_scene_changed_by_another_program_is_opened_again_or_kept_and_a_deleted_one_is_told() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = window(folder.path());
    let scene = folder.path().join("scene");
    let question = "was changed by another program since it was opened here";
    focus(&mut w);
    assert!(!w.shows(question), "the control: nothing has changed");

    let save = || {
        let stored = trained::load(&scene).expect("loaded");
        let held = SceneFolder::hold(&scene, "a test").expect("held");
        held.save(&stored.info, &stored.cloud, None).expect("saved");
    };
    save();
    while !w.shows(question) {
        focus(&mut w);
    }
    w.click("Keep this view");
    focus(&mut w);
    assert!(!w.shows(question) && w.app().state.semantics.is_some(), "asked once a change");
    save();
    while !w.shows(question) {
        focus(&mut w);
    }
    w.click("Open again");
    w.until("the scene of now", |a| a.state.semantics.is_none() && a.state.job.is_none());
    focus(&mut w);
    assert!(!w.shows(question));

    std::fs::rename(&scene, folder.path().join("moved")).expect("moved");
    let told = |w: &Window| w.app().state.log.iter().filter(|l| l.text.contains("moved or deleted")).count();
    while told(&w) == 0 {
        focus(&mut w);
    }
    focus(&mut w);
    assert_eq!(told(&w), 1);
    w.ask(Action::FrameScene);
    assert!(w.app().viewport.cloud().is_some_and(|cloud| !cloud.is_empty()), "what is shown stays");
}
