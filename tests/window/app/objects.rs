//! From photos to objects that are asked for, renamed, hidden and stored, in one window.

use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::ui::actions::{Action, Pane};
use fmlgs::ui::app::App;

use super::{Window, photos, phrases};

#[test]
fn objects_are_found_asked_for_renamed_hidden_and_undone() {
    // A folder of its own: what is trained goes with it.
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::keeping(folder.path().join("data"), Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.key_press(egui::Key::Slash);
    w.harness.run_steps(3);
    assert!(w.shows("find objects first"), "asking needs objects");
    w.harness.state_mut().layout.config.steps = 60;
    w.ask(Action::StartTraining);
    w.until("objects after training", |a| a.state.semantics.is_some());
    assert!(w.shows("parts, from the masks of"), "the pane counts them");
    let map = w.app().state.semantics.clone().expect("found");
    assert!(map.identities.iter().any(|(_, i)| i.names.iter().any(|n| n == "red controller")));
    assert!(map.language.as_ref().is_some_and(|l| l.is_valid(&map.identities)), "the encoder has looked");

    w.ask(Action::Ask("the red controller".into()));
    let red = w.app().viewport.queries.all().last().expect("asked").answered.chosen(1);
    assert_eq!(red.iter().map(|id| map.identities.name(*id)).collect::<Vec<_>>(), ["red controller"]);
    assert!(w.shows("Go there") && w.shows("certain") && !w.shows("Isolate"), "one line over the view");
    w.click("Details");
    assert!(w.shows("Isolate") && w.shows("Tolerance"), "all of it in a pane");
    w.ask(Action::TogglePane(Pane::Query));
    assert!(!w.shows("Isolate"));
    w.ask(Action::Ask("buton of teh red contoller".into()));
    assert!(w.shows("Read \"buton\" as \"button\""), "what was mended is said");
    w.ask(Action::Ask("red controller wheel".into()));
    w.until("an answer", |a| a.viewport.queries.all().last().is_some_and(|q| !q.pending));
    assert!(w.shows("No match for \u{201c}wheel\u{201d}") && w.shows("Did you mean"), "the object is an offer");
    assert!(!w.shows("Ignored") && w.app().viewport.queries.found().is_empty(), "and nothing is outlined");
    w.until("what the pixels belong to", |a| a.viewport.queries.maps().is_some());
    w.ask(Action::Ask("giraffe".into()));
    w.until("an answer", |a| a.viewport.queries.all().last().is_some_and(|q| !q.pending));
    assert!(w.shows("No match"), "not found is an answer");
    w.ask(Action::Ask("x".repeat(10_000)));
    w.ask(Action::Ask(String::new()));
    assert!(w.app().state.error.is_none());

    phrases::are_listed_exported_and_compared(&mut w, folder.path());

    // The table is seen from everywhere.
    let table = map.identities.iter().find(|(_, i)| i.names == ["table"]).map(|(id, _)| id).expect("a table");
    let drawn = |a: &App| a.viewport.queries.maps().map(|m| m.identities.mask(&map.identities, table).area());
    w.until("it is in view", |a| drawn(a).is_some_and(|n| n > 0));
    w.ask(Action::Hide(table));
    w.until("it is gone from the view", |a| drawn(a) == Some(0));
    w.ask(Action::Isolate(None));
    w.until("it is back", |a| drawn(a).is_some_and(|n| n > 0));

    let name = |a: &App| a.state.semantics.as_ref().map(|m| m.identities.name(red[0]));
    w.ask(Action::Change(Edit::Rename(red[0], "Rosa".into())));
    w.until("the new name", |a| name(a).as_deref() == Some("Rosa"));
    w.harness.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::Z);
    w.until("the old name", |a| name(a).as_deref() == Some("red controller"));
    w.ask(Action::Redo);
    w.until("the new name again", |a| name(a).as_deref() == Some("Rosa"));
    // It is stored: opened again, it has the new name.
    let out = w.app().state.scene.as_ref().expect("open").out.clone();
    let scene = fmlgs::io::trained::load(&out).expect("stored");
    let stored = fmlgs::io::semantic_map::load(&out, scene.state.as_deref(), &scene.cloud);
    let stored = stored.expect("readable").expect("there");
    assert_eq!(stored.identities.name(red[0]), "Rosa");
}
