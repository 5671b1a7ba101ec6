//! Photos that are dropped on the window are located in a made-up scene, or refused.

use std::any::Any;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui::DroppedFile;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::jobs::locate::testing::{TestPlace, truth};
use crate::jobs::workspace::OpenedPath;
use crate::jobs::{Folders, OpenedScene};
use crate::ui::actions::Action;

/// Only a test that hangs takes this long.
const LONG: Duration = Duration::from_secs(300);

#[derive(Debug)]
struct TestFile(PathBuf);

impl DroppedFile for TestFile {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("only its path is read".into())
    }
}

/// A window with the scene.
struct PlaceWindow {
    harness: Harness<'static, App>,
    place: TestPlace,
}

impl PlaceWindow {
    fn new(trained: bool) -> Self {
        let place = TestPlace::new();
        let scene = place.scene();
        let mut harness = Harness::builder().with_size([1200.0, 800.0]).with_max_steps(20).wgpu().build_eframe(|cc| {
            let data = tempfile::tempdir().expect("a folder");
            let folders = Folders { data: data.path().into() };
            let mut app = App::new(cc, folders, Some(Action::Open("scene".into()))).expect("threads");
            app.tasks.script = Some(Box::new(move |info| {
                // The folder stays as long as the window does.
                let _ = data.path();
                let opens = info.title == "Opening scene";
                opens.then(|| {
                    Ok(Box::new(OpenedPath::Scene(Box::new(opened(scene.clone(), trained)))) as Box<dyn Any + Send>)
                })
            }));
            app
        });
        harness.run_steps(1);
        let mut window = Self { harness, place };
        window.until("the scene", |app| app.viewport.cloud().is_some());
        window
    }

    fn app(&self) -> &App {
        self.harness.state()
    }

    fn until(&mut self, what: &str, done: impl Fn(&App) -> bool) {
        let start = Instant::now();
        while !done(self.harness.state()) {
            assert!(start.elapsed() < LONG, "waited too long for {what}: {:#?}", self.harness.state().state.log);
            self.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        self.harness.run_steps(3);
    }

    fn drop_files(&mut self, paths: &[&Path]) {
        let files = paths.iter().map(|path| Arc::new(TestFile(path.to_path_buf())) as _);
        self.harness.input_mut().dropped_files.extend(files.collect::<Vec<_>>());
        self.harness.run_steps(3);
    }

    /// Waits until a photo was added to the list, and then until the camera is there.
    fn arrives(&mut self, before: u64) {
        self.until("a photo", |app| app.state.located.revision > before);
        self.until("the end of the flight", |app| app.arrival.is_none() && !app.camera.is_on_way());
    }

    /// Waits until a message was shown, and nothing is located any more.
    fn hears(&mut self, text: &str) {
        self.until(text, |app| {
            let is_said = app.state.log.iter().any(|line| line.text.contains(text));
            is_said && app.state.located.running.is_empty() && app.state.job.is_none()
        });
    }

    fn drops_and_arrives(&mut self, paths: &[&Path]) {
        let before = self.app().state.located.revision;
        self.drop_files(paths);
        self.arrives(before);
    }

    fn said(&self, text: &str) -> bool {
        self.app().state.log.iter().any(|line| line.text.contains(text))
    }

    fn copy(&self, name: &str) -> PathBuf {
        let to = self.place.photo.with_file_name(name);
        std::fs::copy(&self.place.photo, &to).expect("copied");
        to
    }
}

fn opened(scene: crate::jobs::Scene, trained: bool) -> OpenedScene {
    let home = scene.home();
    OpenedScene { out: scene.path.clone(), scene, trained, home, ..OpenedScene::default() }
}

#[test]
fn a_dropped_photo_is_flown_to_compared_shown_as_a_difference_and_removed() {
    let mut w = PlaceWindow::new(true);
    let photo = w.place.photo.clone();
    w.drops_and_arrives(&[&photo]);
    assert!(w.said("Locating photo.png") && w.app().viewport.photo_index() == Some(0));
    w.until("its pixels", |app| app.viewport.picture().is_some_and(|p| p.psnr.is_some() && p.full));
    assert!(w.app().viewport.pose().center.distance(truth().center) < 0.05, "the camera is there");
    assert!(w.app().layout.compare, "the slider is between them");
    assert!(w.harness.query_all_by_label_contains("located, ").next().is_some(), "how much is explained");
    // The same file again is the same photo.
    w.drops_and_arrives(&[&photo]);
    assert_eq!((w.app().state.located.len(), w.app().viewport.photo_index()), (1, Some(0)));
    let found = w.app().state.placed(0).expect("there").found.clone();
    let before = w.app().state.located.revision;
    show(w.harness.state_mut(), found, true);
    w.arrives(before);
    assert_eq!(w.app().layout.mode, ViewMode::Difference);
    w.harness.state_mut().ask(Action::ForgetPhoto);
    w.harness.run_steps(3);
    let app = w.app();
    assert!(app.state.located.is_empty() && app.viewport.photo_index().is_none() && photo.is_file());
    assert!(!app.layout.compare && app.layout.mode == ViewMode::Rgb, "nothing is compared any more");
}

#[test]
fn photos_of_other_things_files_that_are_none_and_scenes_that_are_none_yet_change_nothing() {
    let mut w = PlaceWindow::new(true);
    let (other, text) = (w.place.other_photo(), w.place.photo.with_file_name("text.jpg"));
    std::fs::write(&text, b"no picture").expect("written");
    let before = w.app().viewport.pose();
    w.drop_files(&[&other]);
    w.hears("No place was found for other.png: it does not show this scene");
    w.drop_files(&[&text]);
    w.hears("No place was found for text.jpg: ");
    let app = w.app();
    assert!(app.state.located.is_empty() && app.viewport.photo_index().is_none() && app.viewport.pose() == before);
    assert!(app.state.error.is_none() && !app.layout.compare);
    let mut untrained = PlaceWindow::new(false);
    let photo = untrained.place.photo.clone();
    untrained.drop_files(&[&photo]);
    assert!(untrained.said("photo.png cannot be located: the scene is not trained yet"));
}

#[test]
fn of_several_photos_the_first_that_shows_the_scene_is_shown_and_a_second_drop_waits() {
    let mut w = PlaceWindow::new(true);
    let (other, photo, later) = (w.place.other_photo(), w.place.photo.clone(), w.copy("later.png"));
    w.drop_files(&[&other, &photo]);
    w.drop_files(&[&photo]);
    assert!(w.said("It is being located already"), "once is enough");
    w.drop_files(&[&later]);
    assert_eq!(w.app().state.located.running.len(), 3);
    w.until("both", |app| app.state.located.len() == 2);
    w.arrives(0);
    let names: Vec<String> = (0..2).filter_map(|i| w.app().state.placed(i)).map(|p| p.found.name()).collect();
    assert_eq!(names, ["photo.png", "later.png"]);
    assert_eq!(w.app().viewport.photo_index(), Some(1), "the last one asked for");
    assert!(w.said("No place was found for other.png"));
}

#[test]
fn what_was_to_be_located_in_a_scene_that_is_closed_is_dropped_and_a_stop_leaves_nothing() {
    let mut w = PlaceWindow::new(true);
    let (photo, scene) = (w.place.photo.clone(), w.place.scene());
    w.drop_files(&[&photo]);
    w.until("the search", |app| app.state.job.is_some());
    w.harness.state_mut().state.opened(opened(scene, true), false);
    w.until("the end", |app| app.state.job.is_none());
    assert!(w.app().state.located.is_empty() && w.app().viewport.photo_index().is_none());
    w.drop_files(&[&photo]);
    w.until("the search", |app| app.state.job.is_some());
    w.harness.state_mut().ask(Action::Cancel);
    w.hears("Locating photo.png: stopped");
    assert!(w.app().state.located.is_empty());
    // The control: it is found when nobody stops it.
    w.drops_and_arrives(&[&photo]);
    assert_eq!(w.app().state.located.len(), 1);
}
