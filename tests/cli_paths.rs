//! The real binary moves about: flights to photos and targets, films of them, and the agent.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cli_support;

use cli_support::{Done, command, folder, tiny_dataset};

#[test]
fn a_scene_is_flown_through_filmed_and_talked_to() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let run = |arguments: &[&str]| -> Done {
        command(arguments).env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_MODELS", at("models")).output().unwrap().into()
    };
    let (photos, scene) = (photos.to_str().unwrap(), at("scene"));
    let train = ["train", photos, "--out", &scene, "--steps", "150", "--backend", "cpu", "--eval-every", "0"];
    run(&[&train[..], &["--max-side", "64", "-q"]].concat()).ok();
    run(&["preprocess", &scene, "--masks", photos, "--encoder", "none", "-q"]).ok();

    // To a photo, the paper's interpolation beside it.
    let (path, film) = (at("path.json"), at("film.gif"));
    let flight = run(&["path", &scene, "--from", "0", "--to-photo", "5", "--frames", "40", "--out", &path, "--json"]);
    let flight = flight.ok().json();
    assert_eq!(flight["frames"], 40);
    assert!(flight["length"].as_f64().unwrap() > 0.0);
    assert!(flight["smoothness"]["rotation_error"].as_f64().unwrap() < 1e-9);
    let drawn = run(&["render", &scene, "--path", &path, "--fps", "10", "--size", "48x32", "--out", &film, "--json"]);
    let drawn = drawn.ok().json();
    let frames = drawn["frames"].as_u64().unwrap();
    assert!((20..=41).contains(&frames), "two to four seconds at ten pictures a second: {frames}");
    assert!(std::fs::read(&film).unwrap().starts_with(b"GIF89a"));
    run(&["path", &scene, "--to-photo", "nowhere"]).fails_with(1);
    run(&["path", &scene]).fails_with(2);
    run(&["render", &scene, "--path", &at("missing.json")]).fails_with(1);

    // To an object, by its name; and to one that is not there.
    let name = "box 1".to_owned();
    let flight = run(&["path", &scene, "--to", &name, "--json"]).ok().json();
    assert_eq!(flight["target"].as_str().unwrap(), name);
    run(&["path", &scene, "--to", "a giraffe"]).fails_with(1);
    let survey = run(&["path", &scene, "--survey", "10", "--cameras", "8", "--frames", "30", "--json"]).ok().json();
    let survey = &survey.as_array().unwrap()[0];
    let flown = survey["ours"]["flights"].as_u64().unwrap() + survey["no_way"].as_u64().unwrap();
    assert_eq!(flown, 10);

    // The agent: a flight, a movement, a refusal, something that is not there.
    let transcript = at("talk.md");
    let go = format!("go to the {name}");
    let talk = run(&["agent", &scene, &go, "step back", "--transcript", &transcript, "--json"]).ok().json();
    let requests = talk["requests"].as_array().unwrap();
    assert_eq!(requests.len(), 2);
    for request in requests {
        let flies = request["deeds"].as_array().unwrap().iter().any(|d| d.as_str().unwrap().starts_with("flies"));
        assert!(flies, "{request}");
    }
    assert!(std::fs::read_to_string(&transcript).unwrap().contains(&go));
    let refused = run(&["agent", &scene, "pour the water over the laptop", "--json"]);
    assert!(refused.stdout.contains("Hazard"), "{}", refused.stdout);
    refused.fails_with(1);
    run(&["agent", &scene, "go to the giraffe"]).fails_with(1);
    run(&["agent", &scene, "--planner", "llm", "hello"]).fails_with(2);
}
