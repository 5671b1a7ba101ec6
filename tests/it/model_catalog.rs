//! The catalog: what is here, bringing files, fetching them from a folder on a server, and refusing
//! what is not what it should be. With the reduced networks of the fixtures in place of real ones.
#![allow(clippy::disallowed_methods)] // A server for a second needs no name.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::time::Duration;

use fmlgs::math::stats;
use fmlgs::models::catalog::{self, InstallError, ModelEntry, ModelState};
use fmlgs::models::fetch::{FetchError, Timeouts};

use crate::common::NOBODY;

fn fixtures() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks")
}

/// The reduced CLIP as if it were listed.
fn reduced() -> ModelEntry {
    let file = |name: &str| serde_json::json!({ "name": name, "megabytes": 1 });
    serde_json::from_value(serde_json::json!({
        "id": "reduced", "role": "encoder", "title": "Reduced", "adds": "Nothing.", "license": "MIT", "source": "here",
        "description": "clip.json", "file": [file("clip_image.onnx"), file("clip_text.onnx")],
    }))
    .expect("an entry")
}

/// Serves the files of a folder.
fn server(folder: &Path) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("http://{}/models", listener.local_addr().expect("bound"));
    let folder = folder.to_path_buf();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let mut lines = BufReader::new(&stream).lines();
            let first = lines.next().and_then(Result::ok).unwrap_or_default();
            while lines.next().and_then(Result::ok).is_some_and(|l| !l.is_empty()) {}
            let name = first.split(' ').nth(1).and_then(|p| p.strip_prefix("/models/")).unwrap_or_default().to_owned();
            let mut stream = &stream;
            // Whoever called may have gone.
            let _ = match fs::read(folder.join(name)) {
                Ok(bytes) => {
                    write!(stream, "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", bytes.len())
                        .and_then(|()| stream.write_all(&bytes))
                }
                Err(_) => write!(stream, "HTTP/1.1 404 No\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
            };
        }
    });
    url
}

fn impatient() -> Timeouts {
    Timeouts { stall: Duration::from_secs(5), attempts: 2, pause: Duration::from_millis(5) }
}

#[test]
fn the_list_is_sound() {
    let all = catalog::entries().expect("the list");
    let ids: Vec<&str> = all.iter().map(|e| &*e.id).collect();
    for id in ["sam-vit-h", "mobile-sam", "sam2.1-small", "sam2.1-base-plus", "sam2.1-large"] {
        assert!(ids.contains(&id), "{id}");
    }
    for e in &all {
        assert!(!e.title.is_empty() && e.adds.ends_with('.') && !e.license.is_empty(), "{}", e.id);
        assert_eq!(e.built_in, e.description.is_empty(), "{}", e.id);
        assert_eq!(e.built_in, e.file.is_empty(), "{}", e.id);
        assert!(e.speed.ends_with('.') || e.id == "onnxruntime", "{}", e.id);
        if e.id == "onnxruntime" {
            // Not made of anything, and for this machine.
            let archive = e.checkpoint.as_ref().expect("listed for this machine alone");
            assert!(e.export.is_empty() && archive.url.contains("/v1.24.4/") && e.file.len() == 1);
        } else if e.checkpoint.as_ref().is_some_and(|c| c.url.ends_with(".onnx")) {
            // Ready as it is; only its checksum says that it is the right one.
            assert!(e.export.is_empty() && e.file.len() == 1, "{}", e.id);
            assert!(e.checkpoint.as_ref().is_some_and(|c| c.sha256.is_some()), "{}", e.id);
        } else if !e.built_in {
            // The export tool that it names is there.
            let tool = e.export.split(' ').next().expect("a tool");
            assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/export").join(tool).is_file(), "{tool}");
            assert!(e.export.contains(&format!("--name {}", e.id)), "{}", e.export);
            assert!(e.megabytes() >= 40 && e.description == format!("{}.json", e.id));
        }
    }
    assert!(matches!(catalog::entry("no-such-model"), Err(InstallError::Unknown(_))));
    assert!(matches!(catalog::entry("demo").expect("listed").state(Path::new("/nowhere")), ModelState::BuiltIn));
}

#[test]
fn files_that_somebody_brings_are_checked_and_copied() {
    let (here, entry) = (tempfile::tempdir().expect("folder"), reduced());
    let folder = here.path().join("models");
    assert!(matches!(entry.state(&folder), ModelState::Missing(files) if files.len() == 3));
    entry.add(&folder, &fixtures()).expect("added");
    assert_eq!(entry.state(&folder), ModelState::Here);
    entry.verify(&folder).expect("right");

    // A swapped file of the same size, which only its content tells.
    let image = folder.join("clip_image.onnx");
    let mut bytes = fs::read(&image).expect("read");
    bytes[1000] ^= 1;
    fs::write(&image, &bytes).expect("written");
    assert_eq!(entry.state(&folder), ModelState::Here);
    let error = entry.verify(&folder).expect_err("swapped").to_string();
    assert!(error.contains("clip_image.onnx") && error.contains("refused"), "{error}");
    // One of another size is seen at once.
    bytes.pop();
    fs::write(&image, &bytes).expect("written");
    assert!(matches!(entry.state(&folder), ModelState::Broken(problem) if problem.contains("clip_image.onnx")));

    // What is wrong where it comes from changes nothing here.
    let other = here.path().join("other");
    entry.add(&other, &fixtures()).expect("added");
    let error = entry.add(&other, &folder).expect_err("broken there").to_string();
    assert!(error.contains("clip_image.onnx"), "{error}");
    entry.verify(&other).expect("untouched");
    let error = entry.add(&other, here.path()).expect_err("nothing there").to_string();
    assert!(error.contains("clip.json"), "{error}");
}

#[test]
fn a_model_is_fetched_from_a_folder_on_a_server() {
    let (here, entry) = (tempfile::tempdir().expect("folder"), reduced());
    let error = entry.fetch(here.path(), None, impatient(), &mut |_, _, _| true).expect_err("nobody hosts it");
    assert!(matches!(&error, InstallError::NoAddress { id, .. } if id == "reduced"));
    assert!(error.to_string().contains("--from"), "{error}");

    let url = server(&fixtures());
    let mut names = Vec::new();
    entry
        .fetch(here.path(), Some(&url), impatient(), &mut |name, _, _| {
            if names.last().is_none_or(|last| last != name) {
                names.push(name.to_owned());
            }
            true
        })
        .expect("fetched");
    assert_eq!(names, ["clip.json", "clip_image.onnx", "clip_text.onnx"]);
    assert_eq!(entry.state(here.path()), ModelState::Here);
    // What is here is not fetched again; what is broken is.
    fs::write(here.path().join("clip_text.onnx"), "broken").expect("written");
    names.clear();
    let mut told = |name: &str, _, _| {
        names.push(name.to_owned());
        true
    };
    entry.fetch(here.path(), Some(&url), impatient(), &mut told).expect("fetched");
    assert!(names.iter().all(|n| n == "clip_text.onnx") && !names.is_empty(), "{names:?}");

    // A server whose graphs are not those of its description.
    let wrong = tempfile::tempdir().expect("folder");
    for name in ["clip.json", "clip_image.onnx"] {
        fs::copy(fixtures().join(name), wrong.path().join(name)).expect("copied");
    }
    fs::copy(fixtures().join("clip_image.onnx"), wrong.path().join("clip_text.onnx")).expect("copied");
    let fresh = tempfile::tempdir().expect("folder");
    let error = entry.fetch(fresh.path(), Some(&server(wrong.path())), impatient(), &mut |_, _, _| true);
    let error = error.expect_err("another graph");
    assert!(matches!(error, InstallError::Fetch(FetchError::OtherSize { .. })), "{error}");
    assert!(matches!(entry.state(fresh.path()), ModelState::Missing(files) if files == ["clip_text.onnx"]));
}

#[test]
fn a_description_cannot_reach_out_of_its_folder() {
    let (here, entry) = (tempfile::tempdir().expect("folder"), reduced());
    let text = fs::read_to_string(fixtures().join("clip.json")).expect("read");
    fs::write(here.path().join("clip.json"), text.replace("clip_text.onnx", "../clip_text.onnx")).expect("written");
    for name in ["clip_image.onnx", "clip_text.onnx"] {
        fs::copy(fixtures().join(name), here.path().join(name)).expect("copied");
    }
    let error = entry.verify(here.path()).expect_err("a path").to_string();
    assert!(error.contains("no file name"), "{error}");
}

#[test]
fn the_command_line_says_what_is_here_and_what_to_do() {
    let folder = crate::cli_support::folder();
    let run = |arguments: &[&str]| -> crate::cli_support::Done {
        let mut command = crate::cli_support::command(arguments);
        command.env("FMLGS_MODELS", folder.path()).env("FMLGS_ONNXRUNTIME", "none").output().expect("runs").into()
    };
    let list = run(&["models", "--json"]).ok().json();
    let state = |id: &str| {
        let models = list["models"].as_array().expect("models");
        models.iter().find(|m| m["id"] == id).expect("listed")["state"].clone()
    };
    assert_eq!(state("demo"), "built_in");
    assert!(state("clip-vit-b16")["missing"].as_array().is_some_and(|files| files.len() == 3));
    assert!(list["engine"].as_str().is_some_and(|e| e.contains("built in")) && list["device"] == "processor");
    let text = run(&["models"]).ok().stdout;
    assert!(text.contains("sam2.1-tiny") && text.contains("not here") && text.contains("models fetch"), "{text}");
    // A checkpoint of another model is refused by the name of a tensor, whatever way it comes.
    let other = fixtures().join("tiny.pt");
    let error = run(&["-q", "models", "add", "clip-vit-b16", &other.display().to_string()]).fails_with(1).stderr;
    assert!(error.contains("tiny.pt") && error.contains("tensor '") && error.contains("missing"), "{error}");
    let error = run(&["models", "fetch", "no-such-model"]).fails_with(1).stderr;
    assert!(error.contains("no-such-model"), "{error}");
    let error = run(&["models", "add", "clip-vit-b16", "/nowhere"]).fails_with(1).stderr;
    assert!(error.contains("clip-vit-b16.json"), "{error}");
    // The description of exported files stands for their folder.
    let error = run(&["models", "add", "sam-vit-b", "/nowhere/exported.json"]).fails_with(1).stderr;
    assert!(error.contains("/nowhere lacks sam-vit-b.json"), "{error}");
    assert!(run(&["models", "check"]).ok().stdout.contains("demo: right"));
    // Of one model, what it answers too.
    assert!(run(&["models", "check", "demo"]).ok().stdout.contains("no answer of it is known"));
    let error = run(&["models", "check", "clip-vit-b32"]).fails_with(1).stderr;
    assert!(error.contains("clip-vit-b32.json"), "{error}");
    run(&["models", "check", "--picture", "x.png"]).fails_with(2);
    // An air-gapped machine: the address cannot be reached.
    let offline = run(&["-q", "models", "fetch", "sam2.1-tiny", "--from", NOBODY]).fails_with(1).stderr;
    assert!(offline.contains("cannot be reached") && offline.contains("bring the file yourself"), "{offline}");
}

/// The archive of a release, with the library that the tests' setup fetched.
#[cfg(target_os = "linux")]
fn release(library: &Path) -> Vec<u8> {
    let mut archive = tar::Builder::new(flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()));
    let mut link = tar::Header::new_gnu();
    link.set_entry_type(tar::EntryType::Symlink);
    link.set_size(0);
    let name = library.file_name().expect("a name");
    archive.append_link(&mut link, "onnxruntime-linux/lib/libonnxruntime.so", name).expect("appended");
    let to = Path::new("onnxruntime-linux/lib").join(name);
    archive.append_path_with_name(library, to).expect("appended");
    archive.into_inner().expect("a file").finish().expect("finished")
}

#[cfg(target_os = "linux")]
#[test]
fn the_fetched_engine_is_the_one_that_runs() {
    let capi = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/onnxruntime/onnxruntime/capi");
    let files = fs::read_dir(&capi).into_iter().flatten().flatten().map(|e| e.path());
    let is_library = |p: &PathBuf| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libonnxruntime.so"));
    let Some(library) = files.into_iter().find(is_library) else {
        println!("skipped: no ONNX Runtime library in {}", capi.display());
        return;
    };
    let (here, models) = (tempfile::tempdir().expect("folder"), tempfile::tempdir().expect("folder"));
    fs::write(here.path().join("engine.tgz"), release(&library)).expect("written");
    fs::write(here.path().join("other.tgz"), "another archive").expect("written");
    let base = server(here.path());
    let [url, other] = ["engine", "other"].map(|name| format!("{base}/{name}.tgz"));
    let run = |arguments: &[&str]| -> crate::cli_support::Done {
        let mut command = crate::cli_support::command(arguments);
        command.env_remove("FMLGS_ONNXRUNTIME").env_remove("ORT_DYLIB_PATH").env_remove("VIRTUAL_ENV");
        command.env("FMLGS_MODELS", models.path()).env("FMLGS_DEVICE", "cpu").output().expect("runs").into()
    };
    // Of the listed release another archive is told by its checksum, and nothing is left of it.
    let error = run(&["-q", "models", "fetch", "onnxruntime", "--from", &other]).fails_with(1).stderr;
    assert!(error.contains("SHA-256") && error.contains("refused"), "{error}");
    assert_eq!(fs::read_dir(models.path()).expect("listed").count(), 0);
    assert!(!run(&["models", "--json"]).ok().json()["engine"].as_str().expect("an engine").contains(".tgz"));
    // The same entry, of a release without a published one.
    let entry: ModelEntry = serde_json::from_value(serde_json::json!({
        "id": "onnxruntime", "role": "engine", "title": "Engine", "adds": "Speed.", "license": "MIT", "source": "here",
        "description": "onnxruntime.json", "file": [{ "name": "libonnxruntime.so", "megabytes": 22 }],
        "checkpoint": { "url": url, "megabytes": 200 },
    }))
    .expect("an entry");
    entry.fetch(models.path(), None, impatient(), &mut |_, _, _| true).expect("fetched");
    assert_eq!(entry.state(models.path()), ModelState::Here);
    let list = run(&["models", "--json"]).ok().json();
    let fetched = models.path().join("libonnxruntime.so");
    assert_eq!(list["engine"], format!("ONNX Runtime ({})", fetched.display()));
    let answers = run(&["models", "bench", "--json"]).ok().json();
    assert_eq!(answers["models"][0]["id"], "demo", "it runs networks");
    // A library that is not what was fetched is not opened.
    let mut bytes = fs::read(&fetched).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&fetched, bytes).expect("written");
    let list = run(&["models", "--json"]).ok().json();
    assert!(list["engine"].as_str().is_some_and(|e| e.contains("built in")), "{list}");
    assert!(list["note"].as_str().is_some_and(|n| n.contains("refused") && n.contains("fetch it")), "{list}");
}

/// `models bench` times the models themselves; a test of the library checks that the engines agree.
#[test]
fn the_shipped_models_are_timed() {
    let folder = crate::cli_support::folder();
    let mut command = crate::cli_support::command(&["models", "bench", "--json"]);
    command.env("FMLGS_MODELS", folder.path()).env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_DEVICE", "cpu");
    let timed = crate::cli_support::Done::from(command.output().expect("runs")).ok().json();
    assert!(timed["engine"].as_str().is_some_and(|e| e.contains("built in")));
    let model = &timed["models"][0];
    let vector = |what: &str| -> Vec<f64> {
        model[what].as_array().expect("a vector").iter().map(|x| x.as_f64().expect("a number")).collect()
    };
    let mut encoder = fmlgs::models::encoder("demo").expect("shipped");
    let mut far = |text: &str| stats::worst_difference(&vector("phrase"), &encoder.text(text).expect("known words"));
    assert!(far("a red wooden chair") < 1e-4, "{:e}", far("a red wooden chair"));
    assert!(far("a blue mug") > 1e-2, "the control: another phrase");
    assert!(stats::worst_difference(&vector("picture"), &vector("phrase")) > 1e-2, "a picture is no phrase");
    for what in ["load_ms", "picture_ms", "phrase_ms"] {
        assert!(model[what].as_f64().expect("ms") > 0.0, "{what}");
    }
}
