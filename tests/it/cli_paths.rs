//! The real binary moves about: flights to photos and targets, videos of them, and the agent.

use std::path::Path;

use crate::cli_support::{Done, Server, acts, command, first_version, fmlgs, folder, tiny_dataset};

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
    let transcript = at("conversation.md");
    let go = format!("go to the {name}");
    let talk = run(&["agent", &scene, &go, "step back", "--transcript", &transcript, "--json"]).ok().json();
    let requests = talk["requests"].as_array().unwrap();
    assert_eq!(requests.len(), 2);
    for request in requests {
        let flies = request["effects"].as_array().unwrap().iter().any(|d| d.as_str().unwrap().starts_with("flies"));
        assert!(flies, "{request}");
    }
    assert!(std::fs::read_to_string(&transcript).unwrap().contains(&go));
    let refused = run(&["agent", &scene, "pour the water over the laptop", "--json"]);
    assert!(refused.stdout.contains("Unclear"), "{}", refused.stdout);
    refused.fails_with(1);
    run(&["agent", &scene, "go to the giraffe"]).fails_with(1);
    run(&["agent", &scene, "--planner", "llm", "hello"]).fails_with(2);
    run(&["agent"]).fails_with(2);
    let tested = run(&["agent", "--test-model", "--url", "http://127.0.0.1:9/v1", "--model", "m"]).fails_with(1);
    assert!(tested.stderr.contains("nothing answers"), "{}", tested.stderr);
    a_chat_model_is_asked(&scene);

    // Names that act on terminals, or are as long as books, are bounded and do neither.
    let list = std::path::Path::new(photos).join("identities.json");
    let mut named: serde_json::Value = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    let evil = format!("red\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}gnp\n{}", "e".repeat(70_000));
    named["identities"][0]["name"] = evil.clone().into();
    std::fs::write(&list, named.to_string()).unwrap();
    run(&["preprocess", &scene, "--masks", photos, "--encoder", "none", "-q"]).ok();
    for arguments in [&["query", &scene, "red"][..], &["agent", &scene, "list all objects"], &["info", &scene]] {
        let said = run(arguments);
        let all = format!("{}{}", said.stdout, said.stderr);
        assert!(!acts(&all) && !all.contains("panicked"), "{arguments:?}: {all:?}");
        assert!(all.lines().all(|l| l.chars().count() < 2000), "{arguments:?}");
    }
    let listed = run(&["agent", &scene, "list all objects", "--json"]).ok();
    assert!(!acts(&listed.stdout) && listed.stdout.contains("\u{2026}"), "{}", listed.stdout);
    assert!(acts(&evil), "the control");
}

/// A chat model on this machine: never through a proxy, its words cannot act on the terminal, and its silence
/// does not hold up Ctrl-C.
fn a_chat_model_is_asked(scene: &str) {
    use std::io::Write;
    const KEY: &str = "sk-test-0123456789";
    let reply = "\u{1b}[2J\u{1b}]0;owned\u{7}Hello \u{202e}there\nerror: all is lost";
    let body = serde_json::json!({ "choices": [{ "message": { "content": reply }, "finish_reason": "stop" }] });
    let speaking = Server::new(move |stream, _| {
        let body = body.to_string();
        let head = "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nConnection: close\r\n";
        // Whoever asked may have gone.
        let _ = write!(stream, "{head}Content-Length: {}\r\n\r\n{body}", body.len());
        std::thread::sleep(std::time::Duration::from_millis(200));
    });
    let proxy = Server::new(|_, _| {});
    let ask = |url: &str| {
        let mut ask = command(&["agent", scene, "--planner", "llm", "--url", url, "--model", "m", "hello there"]);
        ask.args(["--key-variable", "TEST_KEY"]).env("TEST_KEY", KEY).env("FMLGS_ONNXRUNTIME", "none");
        for name in ["HTTP_PROXY", "ALL_PROXY"] {
            ask.env(name, format!("http://{}", proxy.at));
        }
        ask.env_remove("NO_PROXY").env_remove("no_proxy");
        ask
    };
    let said = Done::from(ask(&format!("http://{}/v1", speaking.at)).output().unwrap()).ok();
    assert!(said.stdout.contains("there") && !acts(&said.stdout) && !acts(&said.stderr), "{:?}", said.stdout);
    assert!(speaking.seen.lock().unwrap()[0].contains(KEY) && proxy.requests() == 0);
    // A host that merely begins like this machine's is another: nothing is sent there, by no way.
    let refused = Done::from(ask("http://127.evil.example/v1").output().unwrap()).fails_with(1);
    assert!(refused.stderr.contains("without encryption") && proxy.requests() == 0, "{}", refused.stderr);
    // The control: without a key it is asked, through the proxy.
    let mut open =
        command(&["agent", scene, "--planner", "llm", "--url", "http://127.evil.example/v1", "--model", "m"]);
    open.arg("hello there").env("HTTP_PROXY", format!("http://{}", proxy.at)).env_remove("NO_PROXY");
    let mut open = open.spawn().unwrap();
    while proxy.requests() == 0 {
        assert!(open.try_wait().unwrap().is_none(), "it ended without asking the proxy");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    open.kill().unwrap();
    open.wait().unwrap();

    #[cfg(unix)]
    for signal in ["-INT", "-TERM"] {
        use std::time::{Duration, Instant};
        let silent = Server::new(|_, _| std::thread::sleep(Duration::from_secs(300)));
        let child = ask(&format!("http://{}/v1", silent.at)).stderr(std::process::Stdio::piped()).spawn().unwrap();
        let begin = Instant::now();
        while silent.requests() == 0 {
            assert!(begin.elapsed() < Duration::from_secs(60), "it did not ask");
            std::thread::sleep(Duration::from_millis(5));
        }
        let begin = Instant::now();
        assert!(std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        Done::from(child.wait_with_output().unwrap()).fails_with(130);
        println!("{signal}: ended after {:.0} ms", begin.elapsed().as_secs_f64() * 1e3);
        // Generous: the model's own patience is 45 s.
        assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
    }
}

/// Names of the files in a folder.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_request_that_ends_at_a_question_is_no_success() {
    let folder = folder();
    first_version(folder.path());
    let scene = folder.path().join("scene");
    let ask = |more: &[&str]| fmlgs(&[&["agent", scene.to_str().unwrap()], more].concat());
    let before = names_in(folder.path());
    let said = ask(&["remove box 1"]).fails_with(1).stderr;
    assert!(said.contains("waits for an answer, so it was not carried out (Make a copy "), "{said}");
    let told = ask(&["remove box 1", "--json"]).fails_with(1);
    assert_eq!(told.json()["requests"][0]["awaits"], "Confirmation");
    assert!(told.stderr.contains("waits for an answer"), "{}", told.stderr);
    // The controls: an answer ends it well, also a no, and so does what asks nothing.
    ask(&["remove box 1", "no"]).ok();
    ask(&["show me box 1"]).ok();
    assert_eq!(names_in(folder.path()), before, "something was removed");
    ask(&["remove box 1", "yes"]).ok();
    assert_eq!(names_in(folder.path()).len(), before.len() + 1);
}

#[test]
fn what_is_found_and_not_seen_is_said_to_be_so() {
    let folder = folder();
    first_version(folder.path());
    let scene = folder.path().join("scene");
    let info: serde_json::Value = serde_json::from_slice(&std::fs::read(scene.join("scene.json")).unwrap()).unwrap();
    // The first camera, turned around: rightwards and forward are the other way.
    let mut camera = info["cameras"][0]["camera"].clone();
    for k in [0_usize, 1, 2, 6, 7, 8] {
        let axis = &mut camera["world_from_camera"][k];
        *axis = (-axis.as_f64().unwrap()).into();
    }
    let away = folder.path().join("away.json");
    std::fs::write(&away, camera.to_string()).unwrap();
    let query = |camera: &str, more: &[&str]| {
        fmlgs(&[&["query", scene.to_str().unwrap(), "box 1", "--camera", camera], more].concat()).ok()
    };
    let away = away.to_str().unwrap();
    let found = query(away, &["--json"]).json();
    assert_eq!((&found["answer"], &found["hits"][0]["name"]), (&"found".into(), &"box 1".into()));
    assert_eq!((&found["pixels"], &found["in_view"], &found["empty"]), (&0.into(), &false.into(), &false.into()));
    let said = query(away, &[]).stdout;
    assert!(said.contains("not in this view (--camera looks from another photo)"), "{said}");
    // The control: from where it is seen.
    let seen = query("0", &["--json"]).json();
    assert!(seen["pixels"].as_u64().unwrap() > 100 && seen["in_view"] == true, "{seen}");
    assert!(query("0", &[]).stdout.contains("px in this view"));
}
