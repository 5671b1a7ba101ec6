//! Problems of a scene are reported where the user looks.

use fmlgs::scene::{LanguageFeatures, ViewFeatures};
use fmlgs::ui::actions::Action;

use super::Window;
use super::edits::boxes;

const MAP: &str = "semantic_map.safetensors";

#[test]
fn a_damaged_map_is_said_over_the_view_until_it_is_dismissed() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = boxes(folder.path());
    let map = scene.join(MAP);
    let bytes = std::fs::read(&map).expect("a map");
    std::fs::write(&map, &bytes[..bytes.len() / 2]).expect("written");
    let mut w = Window::new(Some(Action::Open(scene.clone())));
    w.until("a picture", |a| a.viewport.picture().is_some());
    assert!(w.shows("objects cannot be loaded") && w.shows("Find them again"), "what is wrong and what to do");
    w.click("Dismiss");
    assert!(!w.shows("objects cannot be loaded"));

    std::fs::write(&map, &bytes).expect("written");
    w.ask(Action::Open(scene));
    w.until("its objects", |a| a.state.semantics.is_some());
    assert!(!w.shows("cannot be shown"));
}

#[test]
fn a_torn_scene_says_which_file_and_what_to_do() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = boxes(folder.path());
    let cloud = scene.join("point_cloud.ply");
    let bytes = std::fs::read(&cloud).expect("a cloud");
    std::fs::write(&cloud, &bytes[..bytes.len() / 2]).expect("written");
    let mut w = Window::new(Some(Action::Open(scene)));
    w.until("the error", |a| a.state.error.is_some());
    assert!(w.shows("point_cloud.ply"));
}

#[test]
fn an_encoder_that_fails_is_said_over_the_view() {
    let folder = tempfile::tempdir().expect("folder");
    let scene = boxes(folder.path());
    let loaded = fmlgs::io::trained::load(&scene).expect("a scene");
    let mut map = fmlgs::io::semantic_map::load(&scene, loaded.state.as_deref(), &loaded.cloud)
        .expect("readable")
        .expect("there");
    let by_identity = vec![ViewFeatures::default(); map.identities.len()];
    map.language = Some(LanguageFeatures { encoder: "nobody-has-it".into(), dimension: 4, by_identity });
    let path = scene.join(MAP);
    let bytes = fmlgs::io::semantic_map::encode(&map, loaded.state.as_deref(), &path).expect("encoded");
    std::fs::write(&path, bytes).expect("written");
    let mut w = Window::new(Some(Action::Open(scene)));
    w.until("its objects", |a| a.state.semantics.is_some());
    assert!(!w.shows("text encoder failed"), "nobody has asked for it yet");
    w.ask(Action::Ask("something red".into()));
    w.until("the reason", |a| a.state.problems.iter().any(|(_, text)| text.contains("nobody-has-it")));
    w.harness.run_steps(2);
    assert!(w.shows("text encoder failed") && w.shows("Models pane"));
}
