//! Downloads before a search, with mock jobs.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use super::*;
use crate::jobs::OpenedScene;
use crate::jobs::find_objects::FindSettings;
use crate::jobs::models::{ModelList, ModelState};
use crate::models::catalog;
use crate::navigate::testing::cloud_of_wall;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::build_map::Carry;
use crate::pipeline::semantics::recipe::Recipe;
use crate::scene::{Dataset, Preparation, SemanticMap};
use crate::ui::actions::Action;
use crate::ui::find_dialog::FindDialog;
use crate::worker::Outcome;
use crate::worker::{Command, Jobs};
use crate::worker::{Failure, Stop};

/// Jobs that only record their commands, in order; the download named in `fails` fails.
#[derive(Clone, Default)]
struct Told {
    said: Arc<Mutex<Vec<String>>>,
    fails: Option<&'static str>,
}

impl Told {
    fn so_far(&self) -> Vec<String> {
        self.said.lock().expect("not poisoned").clone()
    }
}

impl Jobs for Told {
    fn run(&self, command: Command, _: &mut dyn Observer) -> Result<Outcome, Stop> {
        let say = |text: String| self.said.lock().expect("not poisoned").push(text);
        Ok(match command {
            Command::Open { path } => Outcome::Opened(Box::new(OpenedScene {
                name: "photos".into(),
                out: path.clone(),
                path,
                dataset: Some(Arc::new(Dataset::default())),
                cloud: Some(Arc::new(cloud_of_wall(2.0))),
                trained: true,
                ..OpenedScene::default()
            })),
            Command::ListModels => {
                let state = |e: &catalog::ModelEntry| match e.built_in {
                    true => ModelState::BuiltIn,
                    false => ModelState::Missing(Vec::new()),
                };
                let models = catalog::entries().expect("the list").into_iter().map(|e| (e.clone(), state(&e)));
                let models = models.collect();
                Outcome::Models(Arc::new(ModelList {
                    engine: None,
                    is_fast: true,
                    is_settled: true,
                    cores: 2,
                    note: None,
                    folder: "models".into(),
                    models,
                    arrived: [("clip-vit-b16".to_owned(), 200)].into(),
                }))
            }
            Command::InstallModel { id, .. } => {
                say(format!("download {id}"));
                if self.fails == Some(id.as_str()) {
                    let message = "no network".into();
                    return Err(Stop::Failed(Failure { message, remedy: String::new() }));
                }
                Outcome::ModelInstalled(id)
            }
            Command::FindObjects(request) => {
                let named = |of: Option<String>| of.unwrap_or_default();
                say(format!("find by {} and {}", named(request.with.segmenter), named(request.with.encoder)));
                Outcome::Objects(Arc::new(SemanticMap::default()))
            }
            _ => return Err(Stop::Cancelled),
        })
    }
}

/// The window with unlabeled photos and the dialog with the methods open.
fn asked(told: Told) -> Harness<'static, App> {
    let mut harness = Harness::builder()
        .with_size([1200.0, 800.0])
        .with_max_steps(20)
        .wgpu()
        .build_eframe(|cc| App::new(cc, told, Some(Action::Open("photos".into()))).expect("threads"));
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
    assert_eq!(said[2], format!("find by {first} and {second}"), "with what was proposed and nothing else");
}

#[test]
fn what_has_arrived_of_a_download_is_said_and_need_not_come_again() {
    let harness = asked(Told::default());
    assert!(harness.query_by_label_contains("399 MB more, 200 MB are here already").is_some());
    assert!(harness.query_by_label_contains("Download 440 MB.").is_some(), "with MobileSAM's 41");
}

#[test]
fn the_next_search_follows_the_recipe_on_screen_once_that_is_changed() {
    let (mut dialog, mut finding) = (FindDialog::default(), FindSettings::default());
    finding.preparation.part_weight = 0.4;
    dialog.follow_recipe(Preparation::default(), &mut finding);
    assert_eq!(finding.preparation.part_weight, 0.4, "nobody has changed the recipe");
    let paper = Recipe::paper().preparation;
    dialog.follow_recipe(paper, &mut finding);
    assert_eq!((finding.preparation, finding.carry), (paper, Carry::Sam2));
    finding.carry = Carry::Both;
    dialog.follow_recipe(Preparation { part_weight: 0.5, ..paper }, &mut finding);
    assert_eq!((finding.preparation.part_weight, finding.carry), (0.5, Carry::Both));
    dialog.follow_recipe(Preparation::default(), &mut finding);
    assert_eq!((finding.preparation, finding.carry), (Preparation::default(), Carry::Gaussians));
}

#[test]
fn a_download_that_fails_ends_it_and_nothing_else_takes_its_place() {
    let told = Told { fails: Some("clip-vit-b16"), ..Told::default() };
    let mut harness = asked(told.clone());
    click(&mut harness, "Download, then find");
    assert!(told.so_far().iter().all(|s| s.starts_with("download")), "{:?}", told.so_far());
    assert!(harness.state().state.error.is_some());
    assert!(harness.state().awaited.is_none());
}

#[test]
fn built_in_means_need_no_download_and_say_what_they_cannot() {
    let told = Told::default();
    let mut harness = asked(told.clone());
    click(&mut harness, "Uniform color regions (built in)");
    click(&mut harness, "Only names that you give");
    assert!(harness.query_by_label_contains("Words find nothing until you name things").is_some());
    click(&mut harness, "Find objects");
    assert_eq!(told.so_far(), ["find by regions and none"]);
}
