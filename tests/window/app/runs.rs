//! Training runs of a data set, in the list under the photos and on the first page.

use std::path::PathBuf;

use egui::Key;
use egui::accesskit::Toggled;
use egui_kittest::kittest::{NodeT, Queryable};

use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

use super::{Window, photos, write_splat};

fn out(app: &App) -> PathBuf {
    app.state.scene.as_ref().map(|s| s.out.clone()).unwrap_or_default()
}

fn runs(app: &App) -> Vec<&str> {
    app.state.scene.iter().flat_map(|s| &s.runs).map(|run| run.name.as_str()).collect()
}

fn said(app: &App, text: &str) -> bool {
    app.state.log.iter().any(|line| line.text.contains(text))
}

/// Returns whether the row of a run is marked as open.
fn is_marked(w: &Window, row: &str) -> bool {
    let row = w.harness.query_all_by_label_contains(row).next().expect("its row");
    row.accesskit_node().toggled() == Some(Toggled::True)
}

/// Photos that were trained twice.
fn trained_twice(data: PathBuf) -> Window {
    let mut w = Window::keeping(data, Some(Action::Open(photos())));
    w.until("the photos", |a| a.state.scene.is_some());
    let layout = &mut w.harness.state_mut().layout;
    (layout.config.steps, layout.finding.encoder) = (100, Some("none".into()));
    w.click("Training");
    assert!(w.shows("Start training") && !w.shows("Saved in"));
    w.ask(Action::StartTraining);
    w.until("objects after training", |a| a.state.semantics.is_some() && a.state.job.is_none());
    w.ask(Action::TrainAnew);
    w.until("another", |a| out(a).ends_with("run-2") && a.state.job.is_none());
    w.until("the list", |a| runs(a) == ["run-1", "run-2"]);
    w.harness.run_steps(2);
    w
}

#[test]
fn trainings_of_a_data_set_are_listed_opened_renamed_and_deleted() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = trained_twice(folder.path().join("data"));
    let second = out(w.app());
    w.click("Training");
    assert!(w.shows("Query an object") && w.shows("Continue training") && w.shows("Saved in"));
    assert!(!is_marked(&w, "run-1: 100 steps") && is_marked(&w, "run-2: 100 steps"));
    w.harness.query_all_by_label_contains("run-1: 100 steps").next().expect("its row").click();
    w.until("the first", |a| out(a).ends_with("run-1") && a.viewport.picture().is_some());
    let first = out(w.app());
    w.harness.run_steps(2);
    assert!(is_marked(&w, "run-1: 100 steps") && !is_marked(&w, "run-2: 100 steps"));
    w.until("pictures", |_| folder.path().join("data/pictures").read_dir().is_ok_and(|all| all.count() > 1));

    // A name is typed in its row, and the folder stays.
    w.harness.query_all_by_label("\u{2026}").next().expect("a menu").click();
    w.harness.run_steps(3);
    w.click("Rename\u{2026}");
    w.harness.run_steps(3);
    w.types("sharp");
    w.press(Key::Enter);
    w.until("the name", |a| runs(a) == ["sharp", "run-2"]);
    assert_eq!(out(w.app()), first);

    // Deleting asks; one that is being trained stays.
    w.ask(Action::DeleteRun(second.clone()));
    assert!(w.shows("Delete the training run-2 (100 steps"));
    w.click("Cancel");
    assert!(second.exists() && runs(w.app()).len() == 2);
    w.harness.state_mut().layout.config.steps = 50_000;
    w.ask(Action::TrainAnew);
    w.until("a third training", |a| a.state.is_training() && a.state.history.steps.len() > 2);
    w.until("its row", |a| runs(a) == ["sharp", "run-2", "run-3"]);
    w.harness.run_steps(2);
    assert!(is_marked(&w, "run-3") && !is_marked(&w, "sharp: 100 steps"));
    let third = first.with_file_name("run-3");
    w.ask(Action::DeleteRun(third.clone()));
    w.click("Delete");
    w.until("an error", |a| a.state.error.is_some());
    assert!(third.exists(), "it is written to, or not a scene yet");
    w.click("Close");
    w.ask(Action::DeleteRun(first.clone()));
    assert!(said(w.app(), "This training is being worked on") && first.exists());
    w.ask(Action::Cancel);
    w.until("its end", |a| a.state.job.is_none());

    w.ask(Action::DeleteRun(second.clone()));
    w.click("Delete");
    w.until("two are left", |a| runs(a) == ["sharp", "run-3"]);
    assert_eq!([&first, &second, &third].map(|run| run.exists()), [true, false, true]);
    // It is open already, so only the number of the scene tells that it was opened again.
    let number = w.app().state.scene_number;
    w.ask(Action::Open(third.clone()));
    w.until("the canceled one", |a| a.state.scene_number > number && out(a) == third && a.state.job.is_none());
    // Without the open one, another is shown.
    w.ask(Action::DeleteRun(third.clone()));
    w.click("Delete");
    w.until("the last one", |a| runs(a) == ["sharp"] && out(a) == first && a.state.job.is_none());
    assert!(!third.exists() && photos().is_dir());
}

#[test]
fn a_training_near_its_photos_stays_in_their_list_with_view_and_query() {
    // Scenes refer to photos in the same part of the disk by a path from their own folder.
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("folder");
    let mut w = trained_twice(folder.path().join("data"));
    let center = |a: &App| a.viewport.pose().center;
    let asked = |a: &App| a.viewport.queries.all().count();
    w.until("a picture", |a| a.viewport.picture().is_some());
    let home = center(w.app());
    w.harness.key_down(Key::W);
    w.until("a nearer view", |a| center(a).distance(home) > 1e-3);
    w.harness.key_up(Key::W);
    w.harness.run_steps(20);
    w.ask(Action::Ask("table".into()));
    w.harness.run_steps(2);
    assert_eq!(asked(w.app()), 1);
    let place = center(w.app());
    for name in ["run-1", "run-2"] {
        let run = out(w.app()).with_file_name(name);
        w.ask(Action::Open(run.clone()));
        w.until("it is open", |a| out(a) == run && a.state.job.is_none());
        w.until("its picture", |a| a.viewport.picture().is_some());
        assert_eq!(runs(w.app()), ["run-1", "run-2"]);
        assert!(center(w.app()).distance(place) < 1e-6, "the same view");
        assert_eq!(asked(w.app()), 1, "the same query");
        assert_eq!(w.app().state.recent.len(), 1, "the same photos: {:?}", w.app().state.recent);
    }
    // The control: another scene has its own view, and no trainings.
    w.ask(Action::Open(write_splat(folder.path())));
    w.until("the splat", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    w.harness.run_steps(2);
    assert!(runs(w.app()).is_empty() && asked(w.app()) == 0 && w.app().state.recent.len() == 2);
    assert!(center(w.app()).distance(place) > 1e-6);
}

#[test]
fn enter_on_the_first_page_opens_what_was_open_last() {
    let folder = tempfile::tempdir().expect("folder");
    let mut w = Window::keeping(folder.path().join("data"), None);
    w.press(Key::Enter);
    w.harness.run_steps(5);
    assert!(said(w.app(), "No scene was open before.") && w.app().state.job.is_none());
    let splat = write_splat(folder.path());
    w.harness.state_mut().state.recent = vec![splat, photos()];
    w.until("names", |a| a.state.recent_scenes.len() == 2);
    let names: Vec<_> = w.app().state.recent_scenes.iter().map(|known| known.name.as_str()).collect();
    assert_eq!(names, ["dots", "table"], "without the ending of the file");
    w.press(Key::Enter);
    w.until("the splat", |a| a.state.scene.as_ref().is_some_and(|s| s.name == "dots"));
    // With a scene the key belongs to the chat again.
    w.press(Key::Enter);
    w.harness.run_steps(3);
    assert!(w.app().state.scene.as_ref().is_some_and(|s| s.name == "dots") && w.app().state.job.is_none());
    w.ask(Action::SaveCopy);
    assert!(said(w.app(), "a scene is copied once it is trained") && !w.app().chooses_file());
}
