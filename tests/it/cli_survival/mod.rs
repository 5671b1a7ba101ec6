//! Survival of: a kill, Ctrl-C, a second writer, an older version; ([`changed`]) other photos, a folder that goes away;
//! ([`disk`]) a disk that is full; and ([`places`]) what lies where results are put.
#![cfg(unix)]

mod changed;
mod disk;
mod places;

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use crate::cli_support::{Done, Server, command, files_in, first_version, fmlgs, folder, tiny_dataset};

/// Training that saves at every opportunity and takes long enough to be interrupted.
fn train_arguments<'a>(photos: &'a str, out: &'a str, steps: &'a str) -> Vec<&'a str> {
    let mut arguments = vec!["train", photos, "--out", out, "--steps", steps, "--backend", "cpu", "--max-side", "64"];
    arguments.extend(["--eval-every", "0", "--checkpoint-secs", "0.2", "--no-densify", "--json"]);
    arguments
}

fn start(arguments: &[&str]) -> Child {
    command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until `path` exists, then until it has been written anew `times` times.
fn wait_for_checkpoints(child: &mut Child, path: &Path, times: usize) {
    let deadline = Instant::now() + Duration::from_secs(120);
    let (mut seen, mut last) = (0, None);
    while seen < times {
        assert!(Instant::now() < deadline, "no checkpoint appeared at {}", path.display());
        assert!(child.try_wait().unwrap().is_none(), "training ended before it could be interrupted");
        let modified = std::fs::metadata(path).and_then(|m| m.modified()).ok();
        if modified.is_some() && modified != last {
            (seen, last) = (seen + 1, modified);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn send(child: &Child, signal: &str) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn a_killed_training_goes_on_from_its_last_checkpoint_to_the_same_result() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let photos = photos.to_str().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, straight) = (at("killed"), at("straight"));
    let steps = "1500";

    let mut child = start(&train_arguments(photos, &out, steps));
    wait_for_checkpoints(&mut child, &Path::new(&out).join("checkpoint.bin"), 2);
    send(&child, "-KILL");
    assert_eq!(child.wait().unwrap().code(), None, "the process was killed");

    let resumed = fmlgs(&train_arguments(photos, &out, steps)).ok();
    let note = resumed.stderr.lines().find(|l| l.contains("Continuing at step")).expect("it went on, not began anew");
    let at_step: u64 = note.split_whitespace().filter_map(|w| w.parse().ok()).next().expect("a step");
    assert!(at_step > 0 && at_step < 1500, "{note}");
    let resumed = resumed.json();
    assert_eq!((&resumed["end"], &resumed["steps"]), (&"finished".into(), &1500.into()));

    // The CPU backend is deterministic, so the interrupted run ends where a straight one does.
    fmlgs(&train_arguments(photos, &straight, steps)).ok();
    let cloud = |scene: &str| fmlgs::io::trained::load(Path::new(scene)).unwrap().cloud;
    assert!(cloud(&out) == cloud(&straight), "the resumed run ended elsewhere than the straight one");
    // What it told on the way is the same, also of the steps around the kill.
    let told = |scene: &str| {
        let steps = fmlgs::io::trained::load_info(Path::new(scene)).unwrap().history.steps;
        steps.iter().map(|s| (s.step, s.loss.to_bits(), s.train_psnr.to_bits(), s.gaussians)).collect::<Vec<_>>()
    };
    assert_eq!(told(&out), told(&straight));
    // Negative control: another seed must end elsewhere.
    let other = at("other");
    fmlgs(&[&train_arguments(photos, &other, steps)[..], &["--seed", "1"]].concat()).ok();
    let differs = cloud(&other) != cloud(&straight) && told(&other) != told(&straight);
    assert!(differs, "the comparison cannot tell runs apart");
}

#[test]
fn a_killed_training_keeps_refined_poses_and_exposures() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let photos = photos.to_str().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, straight, plain) = (at("killed"), at("straight"), at("plain"));
    let arguments =
        |out: &str| [&train_arguments(photos, out, "1200")[..], &["--refine-poses", "--exposure"]].concat().join(" ");
    let train = |line: &str| fmlgs(&line.split(' ').collect::<Vec<_>>()).ok();
    let mut child = start(&arguments(&out).split(' ').collect::<Vec<_>>());
    wait_for_checkpoints(&mut child, &Path::new(&out).join("checkpoint.bin"), 3);
    send(&child, "-KILL");
    child.wait().unwrap();
    assert!(train(&arguments(&out)).stderr.contains("Continuing at step"));
    let told = train(&arguments(&straight));
    assert!(told.stderr.contains("Refined poses moved by") && told.stderr.contains("Exposures:"), "{}", told.stderr);
    let load = |scene: &str| fmlgs::io::trained::load(Path::new(scene)).unwrap();
    let (resumed, whole) = (load(&out), load(&straight));
    assert!(resumed.cloud == whole.cloud && resumed.info.cameras == whole.info.cameras);
    assert_eq!(resumed.info.photo_fits, whole.info.photo_fits);
    // The controls: poses moved, and without the options nothing is stored of photos.
    fmlgs(&train_arguments(photos, &plain, "1200")).ok();
    let plain = load(&plain).info;
    assert!(plain.cameras != whole.info.cameras && plain.photo_fits.is_empty() && !whole.info.photo_fits.is_empty());
}

#[test]
fn ctrl_c_saves_and_exits_with_130() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    let arguments = train_arguments(photos.to_str().unwrap(), out.to_str().unwrap(), "1000000");
    for signal in ["-INT", "-TERM"] {
        let mut child = start(&arguments);
        wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 2);
        send(&child, signal);
        let done: Done = child.wait_with_output().unwrap().into();
        let done = done.fails_with(130);
        assert!(done.stderr.contains("canceled:") && done.stderr.contains("resumes"), "{}", done.stderr);
        assert_eq!(done.json()["end"], "cancelled");
        assert!(done.json()["steps"].as_u64().unwrap() > 0);
        // What was trained so far can be looked at.
        assert_eq!(fmlgs(&["info", out.to_str().unwrap(), "--json"]).ok().json()["kind"], "trained");
    }
}

/// Generous: an end takes milliseconds, what it must not wait for takes minutes.
const SOON: Duration = Duration::from_secs(10);

/// Ends a child and returns its output and the time that took.
fn end(child: Child, signal: &str) -> (Done, Duration) {
    let begin = Instant::now();
    send(&child, signal);
    let done = child.wait_with_output().unwrap().into();
    let took = begin.elapsed();
    println!("{signal}: ended after {:.0} ms", took.as_secs_f64() * 1e3);
    (done, took)
}

fn wait_until(child: &mut Child, ready: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !ready() {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none(), "it did not come so far");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_download_that_stalls_ends_when_asked_and_is_gone_on_with() {
    const FIRST: usize = 70_000;
    let content: Vec<u8> = (0..200_000_u32).map(|i| (i % 251) as u8).collect();
    let folder = folder();
    let whole = folder.path().join("whole");
    std::fs::write(&whole, &content).unwrap();
    let graph = serde_json::json!({ "file": "g.onnx", "bytes": content.len(),
        "sha256": fmlgs::models::fetch::sha256(&whole).unwrap() });
    let description = serde_json::json!({ "version": 1, "kind": "sam2", "graphs": { "a": graph } }).to_string();
    let served = content.clone();
    let server = Server::new(move |stream, head| {
        let range =
            head.lines().find_map(|l| l.to_lowercase().strip_prefix("range: bytes=")?.strip_suffix('-')?.parse().ok());
        let (line, body): (String, &[u8]) = match range {
            _ if head.contains(".json") => ("200 OK".into(), description.as_bytes()),
            Some(start) => (format!("206 Rest\r\nContent-Range: bytes {start}-199999/200000"), &served[start..]),
            None => ("200 OK".into(), &served),
        };
        let head =
            format!("HTTP/1.1 {line}\r\nETag: \"1\"\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
        let stalls = range.is_none() && body.len() > FIRST;
        // Whoever asked may have gone.
        let _ = stream.write_all(head.as_bytes());
        let _ = stream.write_all(if stalls { &body[..FIRST] } else { body });
        std::thread::sleep(if stalls { Duration::from_secs(300) } else { Duration::ZERO });
    });
    let silent = Server::new(|_, _| std::thread::sleep(Duration::from_secs(300)));
    let fetch = |at: &str, models: &Path| {
        let mut fetch = command(&["models", "fetch", "sam2.1-tiny", "--from", &format!("http://{at}")]);
        fetch.env("FMLGS_MODELS", models).stdout(Stdio::piped()).stderr(Stdio::piped());
        fetch
    };
    let names = |models: &Path| files_in(models).into_keys().map(|name| name.display().to_string()).collect::<Vec<_>>();
    for signal in ["-INT", "-TERM", "-KILL"] {
        let models = folder.path().join(signal);
        if signal != "-KILL" {
            let mut child = fetch(&silent.at, &models).spawn().unwrap();
            let before = silent.requests();
            wait_until(&mut child, || silent.requests() > before);
            let (done, took) = end(child, signal);
            done.fails_with(130);
            assert!(took < SOON && names(&models).is_empty(), "{took:?}");
        }
        let part = models.join("g.onnx.part");
        let mut child = fetch(&server.at, &models).spawn().unwrap();
        wait_until(&mut child, || std::fs::metadata(&part).is_ok_and(|m| m.len() as usize == FIRST));
        let (done, took) = end(child, signal);
        if signal != "-KILL" {
            assert!(done.fails_with(130).stderr.contains("what arrived is kept"));
            assert!(took < SOON, "{took:?}");
        }
        assert_eq!(names(&models), ["g.onnx.part", "g.onnx.part.tag", "sam2.1-tiny.json"]);
        Done::from(fetch(&server.at, &models).output().unwrap()).ok();
        assert!(server.seen.lock().unwrap().last().unwrap().to_lowercase().contains(&format!("bytes={FIRST}-")));
        assert_eq!(names(&models), ["g.onnx", "sam2.1-tiny.json"]);
        assert!(std::fs::read(models.join("g.onnx")).unwrap() == content);
    }
}

/// Lines that a process prints on standard error.
fn lines_of(child: &mut Child) -> Receiver<String> {
    let (told, lines) = sync_channel(10_000);
    let stderr = BufReader::new(child.stderr.take().unwrap());
    let read = move || stderr.lines().map_while(Result::ok).try_for_each(|line| told.send(line));
    std::thread::Builder::new().name("lines".into()).spawn(read).unwrap();
    lines
}

fn wait_for_line(lines: &Receiver<String>, what: &str) -> String {
    let mut told = Vec::new();
    loop {
        match lines.recv_timeout(Duration::from_secs(120)) {
            Ok(line) if line.contains(what) => return line,
            Ok(line) => told.push(line),
            Err(e) => panic!("'{what}' was not told ({e}): {told:?}"),
        }
    }
}

#[test]
fn a_finished_training_is_left_alone_and_objects_survive_one_that_goes_on() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let (photos, out) = (photos.to_str().unwrap(), folder.path().join("scene"));
    let scene = out.to_str().unwrap();
    let train = |steps: &str| fmlgs(&train_arguments(photos, scene, steps));
    let find = || fmlgs(&["preprocess", scene, "--masks", photos, "--encoder", "none", "--max-seeds", "1"]);
    let names = || fmlgs(&["info", scene, "--json"]).ok().json()["identities"].clone();

    // Stopped, labeled, resumed: the objects are carried over, and kept as they were.
    let mut child = start(&train_arguments(photos, scene, "600"));
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 2);
    send(&child, "-INT");
    child.wait().unwrap();
    find().ok();
    let query = |name: &str| fmlgs(&["query", scene, name, "--json"]).ok().json()["pixels"].as_u64().unwrap();
    let (known, before) = (names(), query("box 1"));
    assert!(before > 20, "{before}");
    let gone_on = train("600").ok();
    assert!(gone_on.stderr.contains("transferred") && gone_on.stderr.contains("earlier"), "{}", gone_on.stderr);
    assert_eq!(names(), known);
    let after = query("box 1");
    assert!(after > before / 2 && after < 2 * before, "{before} px, then {after}");
    let kept = out.join("earlier/1");
    assert_eq!(fmlgs(&["info", kept.to_str().unwrap(), "--json"]).ok().json()["identities"], known);

    // Again: nothing to do, nothing touched.
    let files = files_in(&out);
    let again = train("600").ok();
    assert!(again.stderr.contains("nothing has changed"), "{}", again.stderr);
    assert_eq!(again.json()["end"], "finished");
    assert!(files_in(&out) == files, "a training with nothing to do changed files");
    // The same objects found again change nothing either.
    find().ok();
    let files = files_in(&out);
    find().ok();
    assert!(files_in(&out) == files, "finding the same objects changed files");
    // Other settings, or no checkpoint: refused, with the way out.
    assert!(train("700").fails_with(1).stderr.contains("choose another folder"));
    std::fs::remove_file(out.join("checkpoint.bin")).unwrap();
    assert!(train("600").fails_with(1).stderr.contains("no checkpoint to resume from"));
    assert!(fmlgs(&train_arguments(photos, photos, "5")).fails_with(1).stderr.contains("holds the photos"));
}

#[test]
fn no_result_replaces_what_was_read_or_what_somebody_else_made() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let (photos, out) = (photos.to_str().unwrap(), folder.path().join("scene"));
    let scene = out.to_str().unwrap();
    fmlgs(&train_arguments(photos, scene, "20")).ok();
    fmlgs(&["preprocess", scene, "--masks", photos, "--encoder", "none"]).ok();
    let (photo, cloud, info) =
        (format!("{photos}/images/0001.png"), format!("{scene}/point_cloud.ply"), format!("{scene}/scene.json"));
    let before = (files_in(Path::new(photos)), files_in(&out));
    for refused in [
        &["segment", scene, "box 1", "--out", &cloud][..],
        &["export", scene, "--out", &cloud],
        &["query", scene, "box 1", "--mask", &info],
        &["query", scene, "box 1", "--heat", &photo],
        &["agent", scene, "show me box 1", "--view", &photo],
        &["agent", scene, "show me box 1", "--transcript", &info],
        &["path", scene, "--to-photo", "3", "--out", &info],
        &["render", scene, "--camera", "1", "--out", &photo],
        &["eval", scene, "--pictures", &format!("{photos}/images")],
    ] {
        let done = fmlgs(refused);
        let told = done.stderr.contains("choose another name") || done.stderr.contains("must end in");
        assert!(matches!(done.code, Some(1 | 2)) && told, "{refused:?}: {}", done.stderr);
        assert!((files_in(Path::new(photos)), files_in(&out)) == before, "{refused:?} changed files");
    }
    // Beside them is room for results, again and again.
    let path = format!("{scene}/path.json");
    for _ in 0..2 {
        fmlgs(&["path", scene, "--to-photo", "3", "--out", &path]).ok();
    }
    std::fs::remove_file(path).unwrap();

    // A folder that somebody else filled is no place for synthetic photos.
    let mine = folder.path().join("mine");
    std::fs::create_dir(&mine).unwrap();
    std::fs::write(mine.join("transforms.json"), "{}").unwrap();
    let glb = folder.path().join("boxes.glb");
    let synth = ["synth", glb.to_str().unwrap(), "--view-count", "2", "--size", "16x16", "-q", "--out"];
    let done = fmlgs(&[&synth[..], &[mine.to_str().unwrap()]].concat()).fails_with(1);
    assert!(done.stderr.contains("choose another folder"), "{}", done.stderr);
    assert_eq!(std::fs::read_dir(&mine).unwrap().count(), 1);

    // One wrong bit in a checkpoint is seen.
    let checkpoint = out.join("checkpoint.bin");
    let mut bytes = std::fs::read(&checkpoint).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&checkpoint, bytes).unwrap();
    let done = fmlgs(&train_arguments(photos, scene, "20")).fails_with(1);
    assert!(done.stderr.contains("checkpoint.bin") && done.stderr.contains("checksum"), "{}", done.stderr);
}

#[test]
fn a_second_writer_is_refused_by_name() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let (photos, out) = (photos.to_str().unwrap(), folder.path().join("scene"));
    let scene = out.to_str().unwrap();
    let mut child = start(&train_arguments(photos, scene, "1000000"));
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 1);
    let second = fmlgs(&train_arguments(photos, scene, "1000000")).fails_with(1);
    let named = second.stderr.contains(&format!("process {} (training)", child.id()));
    assert!(named && second.stderr.contains("wait until that is done"), "{}", second.stderr);
    send(&child, "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    // While it is held in another way, objects cannot be looked for either.
    let lock = std::fs::File::create(out.join(".fmlgs.lock")).unwrap();
    lock.lock().unwrap();
    let refused = fmlgs(&["preprocess", scene, "--masks", photos]).fails_with(1);
    assert!(refused.stderr.contains("is being written by"), "{}", refused.stderr);
    assert_eq!(fmlgs(&["info", scene, "--json"]).ok().json()["kind"], "trained", "reading is allowed");
    drop(lock);
    fmlgs(&["preprocess", scene, "--masks", photos, "--encoder", "none"]).ok();
}

#[test]
fn a_scene_of_the_first_version_opens_answers_and_goes_on() {
    let folder = folder();
    first_version(folder.path());
    let out = folder.path().join("scene");
    let scene = out.to_str().unwrap();
    let checkpoint = out.join("checkpoint.bin");
    assert!(std::fs::read(&checkpoint).unwrap().starts_with(b"FMLGSCP1"), "no checksum at its end");

    let info = fmlgs(&["info", scene, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["gaussians"], &info["identities"]), (&"trained".into(), &196.into(), &3.into()));
    // What the version that wrote it answered: this name, 253 px.
    let query = |text: &str| fmlgs(&["query", scene, text, "--json"]);
    let found = query("box 1").ok().json();
    assert_eq!((&found["answer"], &found["hits"][0]["name"]), (&"found".into(), &"box 1".into()));
    let pixels = found["pixels"].as_u64().unwrap();
    assert!((240..=266).contains(&pixels), "{pixels}");
    query("giraffe").fails_with(1);

    // It was stopped after 9 of 80 steps.
    let gone_on = fmlgs(&["train", scene, "--json"]).ok();
    let done = gone_on.json();
    assert_eq!((&done["end"], &done["steps"]), (&"finished".into(), &80.into()));
    assert!(gone_on.stderr.contains("transferred"), "{}", gone_on.stderr);
    assert!(!gone_on.stderr.contains("cannot be shown"), "{}", gone_on.stderr);
    assert!(!std::fs::read(&checkpoint).unwrap().starts_with(b"FMLGSCP1"), "it is written as it is now");
    assert_eq!(query("box 1").ok().json()["answer"], "found");
}
