//! The window on a scene that another process serves: looked at, asked and changed as one of its own; and what it says
//! where that cannot be, or the other side is gone.
#![cfg(unix)]

use std::path::Path;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::cli_support::{first_version, folder, tiny_dataset};
use crate::served_scene::Served;
use crate::ui_common::{ask, until};
use fmlgs::io::trained;
use fmlgs::jobs::Folders;
use fmlgs::pipeline::semantics::lifting::edit::Edit;
use fmlgs::ui::actions::Action;
use fmlgs::ui::app::App;

fn window(folder: &Path, url: &str) -> Harness<'static, App> {
    crate::ui_common::window(Folders { data: folder.join("data") }, Some(Action::Connect(url.into())))
}

fn shows(window: &Harness<'static, App>, text: &str) -> bool {
    window.query_all_by_label_contains(text).next().is_some()
}

fn name(app: &App, id: u32) -> String {
    app.state.semantics.as_ref().map(|map| map.identities.name(id)).unwrap_or_default()
}

#[test]
fn a_scene_elsewhere_is_asked_and_changed_as_one_of_its_own() {
    let folder = folder();
    first_version(folder.path());
    let scene = folder.path().join("scene");
    let token = folder.path().join("token");
    let keep = ["--token-file", token.to_str().unwrap()];
    let server = Served::scene(scene.to_str().unwrap(), &keep);
    let (url, at) = (server.url.clone(), server.at.clone());
    let mut w = window(folder.path(), &url);
    until(&mut w, "the scene", |a| a.state.semantics.is_some() && a.viewport.picture().is_some_and(|p| p.full));
    assert!(shows(&w, &format!("Connected to {at}")));
    // It is what an own copy is.
    let own = trained::load(&scene).unwrap();
    let scene_there = w.state().state.scene.clone().unwrap();
    assert_eq!(
        scene_there.dataset.as_ref().unwrap().cameras(),
        own.info.cameras.iter().map(|c| c.camera.clone()).collect::<Vec<_>>()
    );
    assert_eq!(w.state().viewport.cloud().unwrap().positions, own.cloud.positions);
    let first = name(w.state(), 1);
    ask(&mut w, Action::Ask(first.clone()));
    until(&mut w, "an answer", |a| a.viewport.queries.found() == [1]);
    // What needs the other computer's files is said to.
    ask(&mut w, Action::StartTraining);
    assert!(shows(&w, "fmlgs train --serve"), "{:#?}", w.state().state.log);
    ask(&mut w, Action::Change(Edit::Rename(1, "samovar".into())));
    assert!(shows(&w, "does not allow changes"));
    assert_eq!(name(w.state(), 1), first);
    // The server goes, and comes back at the same place with the same token, and now allows changes.
    drop(server);
    until(&mut w, "that it is gone", |_| true);
    until(&mut w, "that it is told", |a| a.state.log.iter().any(|l| l.text.contains("is lost")));
    assert!(shows(&w, "No connection to") && name(w.state(), 1) == first, "what is on screen stays");
    let _server = Served::start(&[&["serve", scene.to_str().unwrap(), &at, "--allow-edit"], &keep[..]].concat());
    until(&mut w, "that it is back", |a| a.state.scene.as_ref().unwrap().remote.as_ref().unwrap().allow_edit);
    ask(&mut w, Action::Change(Edit::Rename(1, "samovar".into())));
    until(&mut w, "the change", |a| name(a, 1) == "samovar");
    // Something else is opened: the connection ends.
    ask(&mut w, Action::Open(scene));
    until(&mut w, "the own copy", |a| a.state.scene.as_ref().is_some_and(|s| s.remote.is_none()));
    assert!(name(w.state(), 1) == "samovar" && !shows(&w, "Connected to"));
}

#[test]
fn a_training_elsewhere_is_seen_paused_and_canceled() {
    let folder = folder();
    let (photos, out) = (tiny_dataset(folder.path()), folder.path().join("out"));
    let (photos, folder_out) = (photos.to_str().unwrap(), out.to_str().unwrap());
    let mut arguments = vec!["train", photos, "--out", folder_out, "--steps", "1000000", "--backend", "cpu"];
    arguments.extend(["--max-side", "64", "--no-densify", "--serve", "127.0.0.1:0"]);
    let mut server = Served::start(&arguments);
    let mut w = window(folder.path(), &server.url);
    until(&mut w, "steps", |a| a.state.is_training() && a.state.history.steps.len() > 1);
    let seen = w.state().viewport.cloud().unwrap().generation();
    until(&mut w, "newer Gaussians", move |a| a.viewport.cloud().is_some_and(|c| c.generation() > seen));
    ask(&mut w, Action::PauseJob);
    until(&mut w, "that it waits", |a| a.state.job.as_ref().is_some_and(|j| j.paused));
    ask(&mut w, Action::PauseJob);
    until(&mut w, "that it goes on", |a| a.state.job.as_ref().is_some_and(|j| !j.paused));
    ask(&mut w, Action::Cancel);
    until(&mut w, "its end", |a| a.state.job.is_none());
    assert_eq!(server.child.wait().unwrap().code(), Some(130));
    // The last Gaussians are those that are stored.
    assert_eq!(w.state().viewport.cloud().unwrap().positions, trained::load(&out).unwrap().cloud.positions);
}

#[test]
fn an_address_that_leads_nowhere_is_told() {
    let folder = folder();
    first_version(folder.path());
    let server = Served::scene(folder.path().join("scene").to_str().unwrap(), &[]);
    let wrong = format!("http://{}/#{}", server.at, "0".repeat(64));
    let mut w = window(folder.path(), &wrong);
    until(&mut w, "a refusal", |a| a.state.error.is_some());
    assert!(shows(&w, "the token is missing or wrong"));
    ask(&mut w, Action::Connect("http://127.0.0.1/".into()));
    until(&mut w, "a refusal", |a| a.state.error.is_some());
}
