//! The demo that ships, and the pictures of recent scenes.

use super::*;

#[test]
fn the_shipped_demo_opens_answered_and_recent_scenes_have_pictures() {
    let data = tempfile::tempdir().expect("folder");
    let place = || data.path().join("data");
    let mut w = Window::keeping(place(), None);
    w.harness.run_steps(2);
    w.click("Open the demo");
    w.until("the answer", |a| !a.viewport.queries.found().is_empty());
    let app = w.app();
    let map = app.state.semantics.as_ref().expect("objects");
    let found: Vec<String> = app.viewport.queries.found().iter().map(|id| map.identities.full_name(*id)).collect();
    assert!(found.iter().all(|name| name.contains("button") && name.ends_with(" · red controller")), "{found:?}");
    assert!(app.state.scene.as_ref().is_some_and(|s| s.dataset.is_some()) && app.state.recent.is_empty());

    let splat = write_splat(data.path());
    w.ask(Action::Open(splat.clone()));
    w.until("the splat", |a| a.state.recent.contains(&splat));
    let kept = || std::fs::read_dir(place().join("pictures")).map_or(0, |all| all.count());
    w.until("its picture", |_| kept() == 1);
    let mut later = Window::keeping(place(), None);
    assert!(!later.shows("dots"));
    later.harness.state_mut().state.recent = vec![splat];
    later.harness.run_steps(2);
    assert!(later.shows("dots") && later.is_drawn());
}
