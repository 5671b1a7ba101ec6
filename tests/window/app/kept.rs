//! Work of the user is kept: objects found anew, a data set trained again, a selection that takes all Gaussians of
//! an object.

use egui::accesskit::Role;
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::scene::SemanticMap;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::{Window, edits, photos};

fn map(app: &App) -> &SemanticMap {
    app.state.semantics.as_ref().expect("objects")
}

/// Gaussians of the identity with this name; none if there is none.
fn own(map: &SemanticMap, name: &str) -> Vec<usize> {
    let id = map.identities.iter().find(|(_, i)| i.names.first().is_some_and(|n| n == name)).map(|(id, _)| id);
    id.map_or_else(Vec::new, |id| (0..map.identity_of.len()).filter(|i| map.identity_of[*i] == id).collect())
}

/// Finds objects, with this answer where there is a question, and waits for the end.
fn search(w: &mut Window, answer: Option<&str>) {
    let before = said(w.app(), "found");
    w.ask(Action::FindObjects);
    answer.into_iter().for_each(|answer| w.click(answer));
    w.until("the search", |a| a.state.job.is_some());
    w.until("its end", |a| a.state.job.is_none());
    assert!(said(w.app(), "found") > before && w.app().state.error.is_none());
}

fn said(app: &App, text: &str) -> usize {
    app.state.log.iter().filter(|line| line.text.contains(text)).count()
}

/// The boxes, one of them renamed and one with a part that was made by hand.
fn worked_on(folder: &std::path::Path) -> Window {
    let mut w = edits::window(folder);
    let layout = &mut w.harness.state_mut().layout;
    (layout.finding.max_seeds, layout.finding.encoder) = (1, Some("none".into()));
    w.ask(Action::Change(Edit::Rename(1, "crate".into())));
    w.until("the name", |a| map(a).identities.name(1) == "crate");
    let gaussians: Vec<u32> = own(map(w.app()), "box 1").into_iter().map(|i| i as u32).step_by(2).collect();
    assert!(gaussians.len() > 8);
    w.ask(Action::Change(Edit::AddPiece { of: 2, name: "lid".into(), gaussians }));
    w.until("a part", |a| map(a).identities.len() == 4);
    w
}

#[test]
fn finding_objects_anew_asks_what_is_kept_and_is_undone() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = worked_on(folder.path());
    let before = map(w.app()).clone();
    w.ask(Action::FindObjects);
    assert!(w.shows("Keep the 2 that you named or made?") && w.shows("crate, lid · box 1"));
    assert!(w.app().state.job.is_none(), "nothing begins before that is answered");
    w.harness.get_by_role_and_label(Role::Button, "Cancel").click();
    w.harness.run_steps(3);
    assert!(!w.shows("Keep the 2") && w.app().state.job.is_none() && *map(w.app()) == before);

    search(&mut w, Some("Keep them"));
    assert_eq!(said(w.app(), "Kept as it was"), 1, "what is kept is told");
    for name in ["crate", "lid", "box 1"] {
        assert_eq!(own(map(w.app()), name), own(&before, name), "{name}");
    }
    assert!(own(map(w.app()), "box 0").is_empty(), "the crate is no second time there under its old name");
    let kept = map(w.app()).clone();
    w.ask(Action::Undo);
    w.until("undone", |a| *map(a) == before);
    assert_eq!(said(w.app(), "Undone: found objects anew"), 1);
    w.ask(Action::Redo);
    w.until("again", |a| *map(a) == kept);

    search(&mut w, Some("Replace all"));
    assert!(own(map(w.app()), "crate").is_empty() && own(map(w.app()), "lid").is_empty());
    assert!(!own(map(w.app()), "box 0").is_empty());
    // Without a question: nothing was made by hand.
    search(&mut w, None);
    for _ in 0..2 {
        w.ask(Action::Undo);
        w.harness.run_steps(5);
    }
    w.until("the crate is back", |a| *map(a) == kept);
    // It is stored, too.
    let out = w.app().state.scene.as_ref().expect("open").out.clone();
    drop(w);
    let mut w = Window::new(Some(Action::Open(out)));
    w.until("the scene", |a| a.state.semantics.is_some());
    assert_eq!(own(map(w.app()), "crate"), own(&before, "crate"));
}

#[test]
fn what_was_added_merged_split_or_corrected_is_asked_about_too() {
    for edit in [
        Edit::Merge(3, 1),
        Edit::Split(2),
        Edit::Reshape { id: 2, gaussians: (0..150).collect() },
        Edit::AddPiece { of: 0, name: String::new(), gaussians: (0..60).collect() },
    ] {
        let folder = tempfile::tempdir().expect("folder");
        let mut w = edits::window(folder.path());
        let before = map(w.app()).clone();
        w.ask(Action::Change(edit.clone()));
        w.until("the edit", |a| *map(a) != before);
        w.ask(Action::FindObjects);
        assert!(w.shows("that you named or made?"), "{edit:?}");
    }
}

#[test]
fn a_second_training_goes_on_or_stands_beside_the_first_with_its_objects() {
    let folder = tempfile::tempdir().expect("folder");
    let data = folder.path().join("data");
    let mut w = Window::keeping(data.clone(), Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    let last = |a: &App| a.state.history.steps.last().map_or(0, |s| s.step);
    let layout = &mut w.harness.state_mut().layout;
    (layout.config.steps, layout.finding.encoder) = (100, Some("none".into()));
    w.ask(Action::StartTraining);
    w.until("objects after training", |a| a.state.semantics.is_some() && a.state.job.is_none());
    let out = |a: &App| a.state.scene.as_ref().expect("open").out.clone();
    let first = out(w.app());
    w.ask(Action::Change(Edit::Rename(1, "mine".into())));
    w.until("the name", |a| map(a).identities.name(1) == "mine");

    // More steps go on from those that were done.
    w.click("Training");
    w.harness.state_mut().layout.config.steps = 150;
    w.harness.run_steps(2);
    assert!(w.shows("Go on from 100 steps") && w.shows("Begin anew"));
    w.ask(Action::StartTraining);
    w.until("50 more steps", |a| a.state.job.is_none() && last(a) == 150);
    assert_eq!((out(w.app()), map(w.app()).identities.name(1)), (first.clone(), "mine".into()));
    assert!(w.app().state.history.steps.iter().any(|s| s.step <= 100), "it is one training");
    assert_eq!(said(w.app(), "Continuing at step 100 of 150"), 1);

    // One that begins anew stands beside it, with its objects.
    w.click("Training");
    w.click("Begin anew");
    w.until("another training", |a| a.state.job.is_none() && last(a) == 150 && out(a) != first);
    let second = out(w.app());
    assert_eq!(map(w.app()).identities.name(1), "mine", "objects came along");
    assert_eq!(said(w.app(), "were carried over to"), 1);
    assert_eq!(w.app().state.scene.as_ref().expect("open").runs.len(), 2);
    w.click("Training");
    assert!(w.shows("run-1: 150 steps"), "the other one is listed");

    // One that is canceled has them, too, and goes on where it was, not beside that.
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::TrainAnew);
    w.until("a third training", |a| a.state.is_training() && last(a) > 5 && last(a) != 150);
    w.ask(Action::Cancel);
    w.until("its end", |a| a.state.job.is_none());
    let third = out(w.app());
    assert!(third != first && third != second && map(w.app()).identities.name(1) == "mine");
    let reached = last(w.app());
    w.click("Training");
    w.harness.get_by_label_contains("Continue (").click();
    w.until("further steps", |a| a.state.is_training() && last(a) > reached);
    w.ask(Action::Cancel);
    w.until("its end", |a| a.state.job.is_none());
    assert_eq!(out(w.app()), third);

    // Whichever is used last is what the photos are opened with.
    w.ask(Action::Open(first.clone()));
    w.until("the first training", |a| out(a) == first);
    assert_eq!(w.app().state.recent, [photos()], "one entry for the photos");
    for used in [first, second, third] {
        w.ask(Action::Open(used.clone()));
        w.until("a training", |a| out(a) == used);
        drop(w);
        w = Window::keeping(data.clone(), Some(Action::Open(photos())));
        w.until("the photos", |a| a.state.scene.is_some());
        assert_eq!(out(w.app()), used);
        assert_eq!(map(w.app()).identities.name(1), "mine");
    }
    // One without objects says that there is one with them.
    let bare = out(w.app());
    drop(w);
    std::fs::remove_file(bare.join("semantic_map.safetensors")).expect("removed");
    let mut w = Window::keeping(data, Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    assert!(said(w.app(), "This training has no objects; an earlier one of these photos has (run-") > 0);
}

#[test]
fn the_first_page_lists_every_training_of_recent_photos() {
    let folder = tempfile::tempdir().expect("folder");
    let data = folder.path().join("data");
    let mut w = Window::keeping(data.clone(), Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    w.harness.state_mut().layout.config.steps = 100;
    w.harness.state_mut().layout.finding.encoder = Some("none".into());
    w.ask(Action::StartTraining);
    w.until("trained", |a| a.state.semantics.is_some() && a.state.job.is_none());
    w.harness.state_mut().layout.config.seed = 7;
    w.ask(Action::StartTraining);
    w.until("another", |a| a.state.scene.as_ref().is_some_and(|s| s.runs.len() == 2) && a.state.job.is_none());
    drop(w);
    let mut w = Window::keeping(data, None);
    w.harness.state_mut().state.recent = vec![photos()];
    w.until("the list", |a| !a.state.recent_scenes.is_empty());
    assert!(w.shows("was trained 2 times"));
    let link = w.harness.query_all_by_label_contains("run-1: 100 steps").next().expect("a link");
    link.click();
    w.until("the first", |a| a.state.scene.as_ref().is_some_and(|s| s.out.ends_with("run-1")));
}

#[test]
fn what_is_left_without_gaussians_says_so_and_undo_brings_it_back() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = edits::window(folder.path());
    let taken = own(map(w.app()), "box 0");
    let all = taken.iter().map(|i| *i as u32).collect();
    w.ask(Action::Ask("box 0".into()));
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    assert!(w.shows("certain") && w.shows("Go there"), "the control");
    w.ask(Action::Change(Edit::AddPiece { of: 0, name: "mouth".into(), gaussians: all }));
    w.until("the new object", |a| map(a).identities.len() == 4);
    assert_eq!(said(w.app(), "The new object took all Gaussians of box 0"), 1);
    w.until("maps", |a| a.viewport.queries.maps().is_some());
    w.harness.run_steps(3);
    assert!(w.shows("It is empty: no Gaussians belong to it") && !w.shows("not in this view"));
    assert!(w.harness.get_by_label("Go there").accesskit_node().is_disabled());
    assert!(w.harness.query_all_by_label("empty").next().is_some(), "in the list, too");
    for (action, reason) in [
        (Action::Change(Edit::Split(1)), "'box 0' is empty: "),
        (
            Action::Change(Edit::AddPiece { of: 1, name: "x".into(), gaussians: vec![taken[0] as u32] }),
            "'box 0' is empty: ",
        ),
        (Action::Isolate(Some(1)), "box 0 is empty: no Gaussians belong to it."),
        (Action::Transform(1), "box 0 is empty: no Gaussians belong to it."),
        (Action::ExportTarget(1), "box 0 is empty: no Gaussians belong to it."),
    ] {
        let before = said(w.app(), reason);
        w.ask(action);
        w.until(reason, |a| said(a, reason) > before);
    }
    assert!(w.app().state.error.is_none());
    w.ask(Action::Undo);
    w.until("it is back", |a| own(map(a), "box 0") == taken);
    assert!(!w.shows("It is empty"));
    // Merged, its name stays with what has its Gaussians.
    w.ask(Action::Redo);
    w.until("empty again", |a| own(map(a), "box 0").is_empty());
    w.ask(Action::Change(Edit::Merge(1, 4)));
    w.until("merged", |a| map(a).identities.len() == 3);
    w.ask(Action::Ask("box 0".into()));
    assert!(w.app().viewport.queries.found().len() == 1 && !w.shows("It is empty"));
}
