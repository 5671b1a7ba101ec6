//! Results of other methods in the window: their classes are objects, and the first edit makes a scene.

use std::path::Path;

use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::Window;
use crate::cli_support::copy;

/// A copy of a sample.
pub(crate) fn sample(name: &str, folder: &Path) -> std::path::PathBuf {
    let run = folder.join("run");
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results").join(name), &run);
    run
}

fn name(app: &App, id: u32) -> Option<String> {
    app.state.semantics.as_ref().map(|map| map.identities.name(id))
}

fn splat(run: &Path) -> Vec<u8> {
    std::fs::read(run.join("point_cloud/iteration_30000/point_cloud.ply")).expect("there")
}

#[test]
fn classes_are_objects_and_the_first_name_makes_a_scene() {
    let folder = tempfile::tempdir().expect("folder");
    let run = sample("gaussian_grouping", folder.path());
    let before = splat(&run);
    let mut w = Window::new(Some(Action::Open(run.clone())));
    w.until("its classes", |a| name(a, 1).is_some());
    assert_eq!(name(w.app(), 1).as_deref(), Some("class 3"));
    assert!(w.app().state.log.iter().any(|line| line.text.contains("is a result of Gaussian Grouping")));
    w.ask(Action::Change(Edit::Rename(1, "kettle".into())));
    let edited = folder.path().join("run-edited");
    w.until("a scene of its own", |a| a.state.scene.as_ref().is_some_and(|s| s.out == edited));
    assert_eq!(name(w.app(), 1).as_deref(), Some("kettle"));
    // What follows is stored there, and can be undone.
    w.ask(Action::Change(Edit::Rename(2, "cup".into())));
    w.until("the second name", |a| name(a, 2).as_deref() == Some("cup"));
    w.ask(Action::Undo);
    w.until("it is undone", |a| name(a, 2).as_deref() == Some("class 7"));
    drop(w);
    let mut w = Window::new(Some(Action::Open(edited)));
    w.until("what was stored", |a| name(a, 1).is_some());
    assert_eq!([1, 2].map(|id| name(w.app(), id)), [Some("kettle".to_owned()), Some("class 7".to_owned())]);
    assert!(splat(&run) == before, "the result stays as it is");
}

#[test]
fn gaussians_with_embeddings_alone_open_without_objects() {
    let folder = tempfile::tempdir().expect("folder");
    let run = sample("langsplat/output", folder.path());
    let mut w = Window::new(Some(Action::Open(run)));
    w.until("its Gaussians", |a| a.viewport.cloud().is_some_and(|c| c.len() == 32));
    assert_eq!(name(w.app(), 1), None, "the control");
    assert!(w.app().state.log.iter().any(|line| line.text.contains("is a result of LangSplat")));
}
