//! Train there, look here: the real binary serves, others watch, and it is attacked, stalled and killed meanwhile.
//!
//! `FMLGS_KILLS=20 cargo test --test it serve -- --nocapture` kills either side 20 times.
#![cfg(unix)]

mod hostile;
mod kills;
mod served;

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::cli_support::{Server, files_in, first_version, fmlgs, folder, tiny_dataset, tiny_splat};
use fmlgs::io::{semantic_map, trained};
use served::Served;

/// A trained scene with objects, in `folder`.
fn scene(folder: &Path) -> PathBuf {
    first_version(folder);
    folder.join("scene")
}

/// Arguments of a training that takes some seconds, served at a free port.
fn training<'a>(photos: &'a str, out: &'a str, steps: &'a str) -> Vec<&'a str> {
    let mut all = vec!["train", photos, "--out", out, "--steps", steps, "--backend", "cpu", "--max-side", "64"];
    all.extend(["--eval-every", "0", "--checkpoint-secs", "0.2", "--no-densify", "--serve", "127.0.0.1:0"]);
    all
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_scene_at_rest_arrives_bit_for_bit() {
    let folder = folder();
    let (scene, got) = (scene(folder.path()), folder.path().join("got.ply"));
    let before = files_in(&scene);
    let server = Served::scene(text(&scene), &[]);
    let done = fmlgs(&["connect", &server.url, "--headless", "--save", text(&got), "--json"]).ok();
    assert_eq!(done.json()["end"], "at rest");
    let file = std::fs::read(scene.join(trained::CLOUD_FILE)).unwrap();
    assert!(std::fs::read(&got).unwrap() == file && files_in(&scene) == before);
    // Another scene is another.
    let splat = tiny_splat(&folder.path().join("three.ply"));
    let other = Served::scene(text(&splat), &[]);
    fmlgs(&["connect", &other.url, "--headless", "--save", text(&got), "-q"]).ok();
    assert!(std::fs::read(&got).unwrap() != file);
    let (a, b) = (fmlgs::io::open(&got).unwrap(), fmlgs::io::open(&splat).unwrap());
    assert!(matches!((a, b), (fmlgs::io::Opened::Cloud(a), fmlgs::io::Opened::Cloud(b)) if a == b));
    // The token of one is nothing to the other.
    let mixed = format!("http://{}/#{}", other.at, server.token);
    let refused = fmlgs(&["connect", &mixed, "--headless"]).fails_with(1);
    assert!(refused.stderr.contains("token"), "{}", refused.stderr);
}

#[test]
fn where_there_are_no_gaussians_none_are_said_to_be_saved() {
    let folder = folder();
    let got = folder.path().join("got.ply");
    // It says in order that nothing runs there, and that it has nothing to show.
    let empty = Server::new(|stream, head| {
        let news = r#"{"events":[],"next":0,"more":false,"progress":null,"generation":0}"#;
        let head = match head.contains("/snapshot") {
            true => "204 No Content\r\n".to_owned(),
            false => format!("200 OK\r\nContent-Length: {}\r\n", news.len()),
        };
        let body = if head.starts_with("204") { "" } else { news };
        // Whoever asked may have gone.
        let _ = write!(stream, "HTTP/1.1 {head}fmlgs-protocol: 1.0\r\nfmlgs-run: a\r\nConnection: close\r\n\r\n{body}");
    });
    let url = format!("http://{}/#{}", empty.at, "0".repeat(64));
    let done = fmlgs(&["connect", &url, "--headless", "--save", text(&got), "--json"]).fails_with(1);
    assert!(done.stderr.contains("has no Gaussians") && done.stderr.contains("got.ply"), "{}", done.stderr);
    assert!(done.stdout.is_empty() && !got.exists(), "{}", done.stdout);
    // The control: who wants none to be saved misses nothing.
    let done = fmlgs(&["connect", &url, "--headless", "--json"]).ok().json();
    assert_eq!((&done["end"], &done["saved"]), (&"at rest".into(), &serde_json::Value::Null));
}

#[test]
fn a_training_is_watched_to_its_end() {
    let folder = folder();
    let (photos, out, got) = (tiny_dataset(folder.path()), folder.path().join("out"), folder.path().join("got.ply"));
    let mut server = Served::start(&training(text(&photos), text(&out), "60"));
    let watch = ["connect", &server.url, "--headless", "--save", text(&got), "--json"];
    let done = fmlgs(&watch).ok().json();
    assert_eq!((done["end"].as_str(), done["out"].as_str()), (Some("finished"), out.to_str()));
    // Who has got everything is not waited for.
    assert_eq!(server.child.wait().unwrap().code(), Some(0));
    assert!(std::fs::read(&got).unwrap() == std::fs::read(out.join(trained::CLOUD_FILE)).unwrap());
}

#[test]
fn a_training_is_paused_and_canceled_from_afar() {
    let folder = folder();
    let (photos, out) = (tiny_dataset(folder.path()), folder.path().join("out"));
    let mut server = Served::start(&training(text(&photos), text(&out), "1000000"));
    let step = |news: &serde_json::Value| news["progress"]["done"].as_u64().unwrap_or(0);
    let tells = |news: &serde_json::Value, event: &serde_json::Value| {
        news["events"].as_array().is_some_and(|all| all.contains(event))
    };
    server.wait(|news| step(news) > 20);
    let (status, body) = server.get("/snapshot?since=0");
    assert!(status == 200 && body.starts_with(b"FMLGSNP1"));
    assert_eq!(server.ask(r#"{"Pause":true}"#).0, 204);
    server.wait(|news| tells(news, &serde_json::json!({"Paused": true})));
    let waiting = step(&server.news(0));
    std::thread::sleep(std::time::Duration::from_millis(400));
    assert_eq!(step(&server.news(0)), waiting, "it waits");
    assert_eq!(server.ask(r#"{"Pause":false}"#).0, 204);
    server.wait(|news| step(news) > waiting + 20);
    assert_eq!(server.ask(r#""Cancel""#).0, 204);
    assert_eq!(server.child.wait().unwrap().code(), Some(130));
    assert!(trained::load(&out).unwrap().info.history.steps.last().unwrap().step > waiting);
}

#[test]
fn objects_are_changed_only_where_that_is_allowed() {
    let folder = folder();
    let scene = scene(folder.path());
    let before = files_in(&scene);
    let name = || {
        let loaded = trained::load(&scene).unwrap();
        let map = semantic_map::load(&scene, loaded.state.as_deref(), &loaded.cloud).unwrap().unwrap();
        map.identities.name(1)
    };
    let rename = r#"{"Edit":{"Rename":[1,"the samovar"]}}"#;
    let server = Served::scene(text(&scene), &[]);
    assert_eq!(server.ask(rename).0, 403);
    assert!(files_in(&scene) == before);
    drop(server);
    let server = Served::scene(text(&scene), &["--allow-edit"]);
    let generation = server.news(0)["generation"].as_u64().unwrap();
    assert_eq!(server.ask(r#"{"Edit":{"Rename":[99,"nobody"]}}"#).0, 422, "there is no such object");
    assert!(files_in(&scene) == before && name() != "the samovar");
    assert_eq!(server.ask(rename).0, 204);
    assert_eq!(name(), "the samovar");
    assert_eq!(server.news(0)["generation"].as_u64().unwrap(), generation + 1);
    // What somebody else has stored meanwhile is not written over.
    let other = Served::scene(text(&scene), &["--allow-edit"]);
    assert_eq!(other.ask(r#"{"Edit":{"Rename":[1,"the urn"]}}"#).0, 204);
    let (status, why) = server.ask(rename);
    assert!(status == 422 && String::from_utf8_lossy(&why).contains("changed by another program"));
    assert_eq!(name(), "the urn");
}

#[test]
fn what_makes_no_sense_is_told_before_anything_is_done() {
    let folder = folder();
    let scene = scene(folder.path());
    let fails = |arguments: &[&str], code: i32, text: &str| {
        let done = fmlgs(arguments).fails_with(code);
        assert!(done.stderr.contains(text), "{}", done.stderr);
    };
    fails(&["serve", text(&scene), "0.0.0.0:0"], 1, "--bind-anywhere");
    fails(&["serve", text(&scene), "everywhere"], 2, "no address to listen at");
    fails(&["serve", text(&folder.path().join("photos"))], 1, "no Gaussians yet");
    fails(&["connect", "http://127.0.0.1:7070/"], 2, "'#' is missing");
    let token = "0".repeat(64);
    fails(&["connect", &format!("http://127.0.0.1:7070/#{token}"), "--save", "x.ply"], 2, "--headless");
    let server = Served::scene(text(&scene), &[]);
    fails(&["serve", text(&scene), &server.at], 1, "choose another port");
    let protected = scene.join(trained::CLOUD_FILE);
    fails(&["connect", &server.url, "--headless", "--save", text(&protected)], 1, "is not replaced");
}
