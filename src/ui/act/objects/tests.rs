//! Downloads before a search, with mock jobs.

use std::any::Any;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::jobs::find_objects::{FindSettings, NO_ENCODER};
use crate::jobs::models::{ModelList, ModelState};
use crate::jobs::workspace::OpenedPath;
use crate::jobs::{Folders, OpenedScene, Scene};
use crate::models::catalog;
use crate::navigate::testing::cloud_of_wall;
use crate::pipeline::semantics::lifting::build_map::{MaskPropagation, REGIONS};
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{Dataset, Preparation, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::find_dialog::FindDialog;
use crate::worker::{Failure, Stop};

/// Jobs that only record their titles, in order; the download named in `fails` fails.
#[derive(Clone, Default)]
struct Told {
    said: Arc<Mutex<Vec<String>>>,
    fails: Option<&'static str>,
}

impl Told {
    fn so_far(&self) -> Vec<String> {
        self.said.lock().expect("not poisoned").clone()
    }

    /// Result in place of that of the job with this title.
    fn result(&self, info: &JobInfo) -> Result<Box<dyn Any + Send>, Stop> {
        let say = |text: &str| self.said.lock().expect("not poisoned").push(text.to_owned());
        if let Some(id) = info.title.strip_prefix("Installing the model ") {
            say(&format!("download {id}"));
            return match self.fails == Some(id) {
                true => Err(Stop::Failed(Failure::new("no network", ""))),
                false => Ok(Box::new(id.to_owned())),
            };
        }
        match info.title.as_str() {
            "Opening photos" => Ok(Box::new(OpenedPath::Scene(Box::new(OpenedScene {
                scene: Scene {
                    name: "photos".into(),
                    path: "photos".into(),
                    cloud: Arc::new(cloud_of_wall(2.0)),
                    ..Scene::default()
                },
                out: "photos".into(),
                dataset: Some(Arc::new(Dataset::default())),
                trained: true,
                ..OpenedScene::default()
            })))),
            "Listing models" => Ok(Box::new(list())),
            title if title.starts_with("Finding objects in") => {
                say("find");
                Ok(Box::new(Arc::new(SemanticMap::default())))
            }
            _ => Err(Stop::Cancelled),
        }
    }
}

/// All models of the catalog, none of them installed.
fn list() -> ModelList {
    let state = |e: &catalog::ModelEntry| match e.built_in {
        true => ModelState::BuiltIn,
        false => ModelState::Missing(Vec::new()),
    };
    let models = catalog::entries().expect("the list").into_iter().map(|e| (e.clone(), state(&e))).collect();
    ModelList {
        engine: None,
        is_fast: true,
        is_settled: true,
        cores: 2,
        note: None,
        folder: "models".into(),
        models,
        arrived: [("clip-vit-b16".to_owned(), 200)].into(),
    }
}

/// The chosen segmenter and encoder.
fn chosen(harness: &Harness<'static, App>) -> [String; 2] {
    let finding = &harness.state().layout.finding;
    [&finding.segmenter, &finding.encoder].map(|of| of.clone().unwrap_or_default())
}

/// The window with unlabeled photos and the dialog with the methods open.
fn asked(told: Told) -> Harness<'static, App> {
    let mut harness = Harness::builder().with_size([1200.0, 800.0]).with_max_steps(20).wgpu().build_eframe(|cc| {
        let data = tempfile::tempdir().expect("a folder");
        let folders = Folders { data: data.path().into() };
        let mut app = App::new(cc, folders, Some(Action::Open("photos".into()))).expect("threads");
        app.tasks.script = Some(Box::new(move |info| {
            // The folder stays as long as the window does.
            let _ = data.path();
            Some(told.result(info))
        }));
        app
    });
    let until = |harness: &mut Harness<'static, App>, done: &dyn Fn(&App) -> bool| {
        for _ in 0..2_000 {
            if done(harness.state()) {
                break;
            }
            harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(done(harness.state()), "{:#?}", harness.state().state.log);
    };
    until(&mut harness, &|a| a.state.scene.is_some() && a.viewport.cloud().is_some());
    harness.state_mut().ask(Action::FindObjects);
    until(&mut harness, &|a| a.find_dialog.is_open() && a.state.models.is_some());
    // The dialog is placed only after its size is known.
    harness.run_steps(10);
    harness
}

fn click(harness: &mut Harness<'static, App>, label: &str) {
    harness.get_by_label(label).click();
    for _ in 0..40 {
        harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn what_is_missing_is_downloaded_one_after_the_other_and_then_the_search_begins() {
    let told = Told::default();
    let mut harness = asked(told.clone());
    click(&mut harness, "Download, then find");
    // Jobs take longer on a loaded CPU.
    for _ in 0..2_000 {
        if told.so_far().len() >= 3 {
            break;
        }
        harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = told.so_far();
    assert_eq!(said.len(), 3, "{said:?}");
    let [first, second] = [0, 1].map(|i| said[i].strip_prefix("download ").expect("a download"));
    assert_eq!(said[2], "find");
    assert_eq!(chosen(&harness), [first, second], "with what was proposed and nothing else");
}

#[test]
fn what_has_arrived_of_a_download_is_said_and_need_not_come_again() {
    let harness = asked(Told::default());
    assert!(harness.query_by_label_contains("399 MB more, 200 MB are here already").is_some());
    assert!(harness.query_by_label_contains("Download 440 MB.").is_some(), "with MobileSAM's 41");
}

#[test]
fn the_dialog_opens_with_the_models_of_the_last_search() {
    let mut last = FindSettings::default();
    let mut dialog = FindDialog::default();
    dialog.open(&last);
    let best = dialog.means(&list());
    assert!(best.segmenter != REGIONS && best.encoder != NO_ENCODER, "{best:?}");
    // The program was closed since, and a network is gone from the list.
    (last.segmenter, last.encoder) = (Some(REGIONS.into()), Some("a network of before".into()));
    let mut dialog = FindDialog::default();
    dialog.open(&last);
    let means = dialog.means(&list());
    assert_eq!((means.segmenter.as_str(), means.encoder), (REGIONS, best.encoder));
}

#[test]
fn the_next_search_follows_the_recipe_on_screen_once_that_is_changed() {
    let (mut dialog, mut finding) = (FindDialog::default(), FindSettings::default());
    finding.preparation.part_weight = 0.4;
    dialog.follow_recipe(Preparation::default(), &mut finding);
    assert_eq!(finding.preparation.part_weight, 0.4, "nobody has changed the recipe");
    let paper = QueryConfig::paper().preparation;
    dialog.follow_recipe(paper, &mut finding);
    assert_eq!((finding.preparation, finding.carry), (paper, MaskPropagation::Sam2));
    finding.carry = MaskPropagation::Both;
    dialog.follow_recipe(Preparation { part_weight: 0.5, ..paper }, &mut finding);
    assert_eq!((finding.preparation.part_weight, finding.carry), (0.5, MaskPropagation::Both));
    dialog.follow_recipe(Preparation::default(), &mut finding);
    assert_eq!((finding.preparation, finding.carry), (Preparation::default(), MaskPropagation::Gaussians));
}

#[test]
fn a_download_that_fails_ends_it_and_nothing_else_takes_its_place() {
    let told = Told { fails: Some("clip-vit-b16"), ..Told::default() };
    let mut harness = asked(told.clone());
    click(&mut harness, "Download, then find");
    assert!(told.so_far().iter().all(|s| s.starts_with("download")), "{:?}", told.so_far());
    assert!(harness.state().state.error.is_some());
}

#[test]
fn built_in_means_need_no_download_and_say_what_they_cannot() {
    let told = Told::default();
    let mut harness = asked(told.clone());
    click(&mut harness, "Uniform color regions (built in)");
    click(&mut harness, "Only names that you give");
    assert!(harness.query_by_label_contains("Objects will be unnamed").is_some());
    click(&mut harness, "Find objects");
    assert_eq!(told.so_far(), ["find"]);
    assert_eq!(chosen(&harness), ["regions", "none"]);
}

#[test]
fn a_result_about_a_scene_that_is_no_longer_open_is_dropped() {
    let mut harness = asked(Told::default());
    let got = Arc::new(Mutex::new(Vec::new()));
    for another_is_opened in [false, true] {
        let app = harness.state_mut();
        app.tasks.script = None;
        let (given, before) = (Arc::clone(&got), got.lock().expect("not poisoned").len());
        let give = move |_: &mut App, result| given.lock().expect("not poisoned").push(result);
        assert!(app.start_in_scene(JobInfo::short("Testing"), |_| Ok::<_, Stop>(7), give));
        app.state.scene_number += u64::from(another_is_opened);
        for _ in 0..2_000 {
            if got.lock().expect("not poisoned").len() > before {
                break;
            }
            harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    assert_eq!(*got.lock().expect("not poisoned"), [Some(7), None]);
}

#[test]
fn what_was_measured_before_a_benchmark_was_canceled_is_shown() {
    let mut harness = asked(Told::default());
    let titles = Arc::new(Mutex::new(Vec::new()));
    let asked_for = Arc::clone(&titles);
    harness.state_mut().tasks.script = Some(Box::new(move |info| {
        asked_for.lock().expect("not poisoned").push(info.title.clone());
        Some(Err(Stop::Cancelled))
    }));
    harness.state_mut().ask(Action::BenchmarkRendering);
    let read = || titles.lock().expect("not poisoned").iter().any(|title| title.starts_with("Opening the report"));
    for _ in 0..2_000 {
        if read() {
            break;
        }
        harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(read(), "{titles:?}");
}
