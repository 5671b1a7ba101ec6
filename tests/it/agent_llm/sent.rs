//! All that is sent to a chat model, compared with what the guide says is sent.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use fmlgs::agent::llm::SENT;
use fmlgs::agent::scene::{AgentScene, SceneWorld};
use fmlgs::navigate::Pose;
use fmlgs::render::RenderSettings;
use fmlgs::scene::{Camera, GaussianCloud, Identities, Level, NO_IDENTITY, SemanticMap};
use glam::{DMat3, DVec2, DVec3};
use serde_json::{Value, json};

use super::{KEY, calls, session, text};
use crate::agent_common::server::Server;

/// A kettle with a handle before a camera, in a scene whose exports go to `exports`.
fn kettle(exports: &Path) -> SceneWorld {
    let mut identities = Identities::default();
    let kettle = identities.add(Level::Object, NO_IDENTITY, vec!["kettle".into(), "pot".into()]);
    let handle = identities.add(Level::Part, kettle, vec!["handle".into()]);
    let of: Vec<u32> = (0..64).map(|i| if i % 4 == 0 { handle } else { kettle }).collect();
    let place = |i: usize| [(i % 4) as f32 * 0.1, (i / 4 % 4) as f32 * 0.1, 3.0 + (i / 16) as f32 * 0.1];
    let cloud =
        GaussianCloud { sh: vec![[1.0; 3]; 64], ..GaussianCloud::isotropic((0..64).map(place).collect(), -2.5, 4.0) };
    let camera = Camera {
        width_px: 64,
        height_px: 48,
        focal_px: DVec2::splat(60.0),
        principal_px: DVec2::new(32.0, 24.0),
        world_from_camera: DMat3::IDENTITY,
        center: DVec3::ZERO,
    };
    let parts = AgentScene {
        cloud: Arc::new(cloud),
        settings: RenderSettings::default(),
        map: Arc::new(SemanticMap::from_identities(identities, of, vec![1.0; 64], Vec::new())),
        cameras: vec![camera.clone()],
        up: DVec3::NEG_Y,
        meters: Some(1.0),
        exports: exports.into(),
        folder: None,
        recipe: Default::default(),
        explored: None,
    };
    SceneWorld::new(parts, Pose::of(&camera), 4.0 / 3.0, Box::new(|_| {})).expect("a world")
}

/// Absolute paths in a text: two names or more after a slash that begins a word.
fn absolute_paths(text: &str) -> Vec<String> {
    let apart = |c: char| c.is_whitespace() || "\"'(),;=\\".contains(c);
    let is_path =
        |w: &&str| w.strip_prefix('/').is_some_and(|r| r.starts_with(char::is_alphanumeric) && r.contains('/'));
    text.split(apart).filter(is_path).map(str::to_owned).collect()
}

/// All keys of objects in a value.
fn keys(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| {
            found.insert(key.clone());
            keys(value, found);
        }),
        Value::Array(list) => list.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn what_is_sent_is_what_the_readme_says() {
    let folder = tempfile::tempdir().expect("folder");
    let exports = folder.path().join("exports");
    let at = folder.path().to_str().expect("a path").to_owned();
    let all = ["export", "measure", "describe", "look_at", "hide"].map(|n| (n, json!({ "target": "kettle" })));
    let script = vec![
        calls(&all),
        text("Done."),
        calls(&[("export", json!({ "target": "handle" })), ("undo", json!({})), ("undo", json!({}))]),
        calls(&[("undo", json!({}))]),
        text("It failed."),
        text("I see."),
    ];
    let server = Server::new(script);
    let (mut session, mut world) = (session(&server), kettle(&exports));
    let mut say =
        |world: &mut SceneWorld, text: &str| session.say(world, text, &mut |_| {}, &AtomicBool::new(false)).text;
    // It is written, and the user hears where: the model does not.
    let told = say(&mut world, "save the kettle and tell me how large it is");
    assert!(std::fs::read_dir(&exports).expect("written").count() == 1 && told.contains(&at), "{told}");
    // It cannot be written, and the user hears why: the model does not.
    std::fs::remove_dir_all(&exports).expect("removed");
    std::fs::write(&exports, "no folder").expect("written");
    let told = say(&mut world, "save the handle");
    assert!(told.contains(&at) && told.contains("It failed."), "{told}");

    let seen = server.seen.lock().expect("log").clone();
    let traffic: Vec<String> = seen.iter().map(|s| format!("{}\n{}", s.head[1..].join("\n"), s.body)).collect();
    assert!(traffic.len() >= 4);
    for text in &traffic {
        assert_eq!(absolute_paths(text), Vec::<String>::new(), "{text}");
        assert!(!text.contains(&at) && !text.contains("exports"), "{text}");
    }
    // The key is in its header, once, and nowhere else.
    for (seen, text) in seen.iter().zip(&traffic) {
        assert_eq!((text.matches(KEY).count(), seen.body.contains(KEY)), (1, false));
        assert_eq!(seen.authorization.as_deref(), Some(&*format!("Bearer {KEY}")));
        let headers: BTreeSet<String> =
            seen.head[1..].iter().filter_map(|h| Some(h.split_once(':')?.0.to_ascii_lowercase())).collect();
        let usual =
            ["accept", "accept-encoding", "authorization", "content-length", "content-type", "host", "user-agent"];
        assert!(headers.iter().all(|h| usual.contains(&h.as_str())), "{headers:?}");
        assert_eq!(seen.head[0], "POST /v1/chat/completions HTTP/1.1");
    }
    // What was asked for came through, and no more of the scene than is said to.
    assert!(traffic[1].contains("on its longer side") && traffic[1].contains("written to a file"), "{}", traffic[1]);
    let last = seen.last().expect("a request").json();
    let mut outer: Vec<&String> = last.as_object().expect("an object").keys().collect();
    outer.sort();
    assert_eq!(outer, ["messages", "model", "stream", "temperature", "tool_choice", "tools"]);
    for message in last["messages"].as_array().expect("messages") {
        let content = message["content"].as_str().unwrap_or_default();
        let mut names = BTreeSet::new();
        let known: &[&str] = match message["role"].as_str() {
            Some("user") => {
                let json = content.lines().nth(1).expect("the scene");
                keys(&serde_json::from_str(json).expect("JSON"), &mut names);
                &[
                    "hidden",
                    "id",
                    "identities",
                    "in_view",
                    "left_out",
                    "meters_are_known",
                    "names",
                    "part_of",
                    "spoken_of_last",
                ]
            }
            Some("tool") => {
                keys(&serde_json::from_str(content).expect("JSON"), &mut names);
                &["done", "error", "ids", "result"]
            }
            _ => &[],
        };
        assert!(names.iter().all(|n| known.contains(&n.as_str())), "{names:?}");
    }
    let scene = last["messages"][1]["content"].as_str().expect("a text");
    assert!(scene.contains("\"in_view\":true") && !scene.contains("\"in_view\":0"), "{scene}");
    // The control: what the user writes does go there, and the search sees a path when there is one.
    say(&mut world, "what is in /home/someone/notes.txt");
    let last = server.seen.lock().expect("log").last().expect("a request").body.clone();
    assert_eq!(absolute_paths(&last), ["/home/someone/notes.txt"]);
    assert_eq!(absolute_paths("{\"a\":\"see (/tmp/a/b.ply); and/or 1/2 //x / /a\"}"), ["/tmp/a/b.ply"]);

    let flat = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(flat(include_str!("../../../docs/guide.md")).contains(&flat(SENT)), "the guide does not say: {SENT}");
}
