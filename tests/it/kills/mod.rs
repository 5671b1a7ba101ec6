//! Processes killed at random moments: what is there afterwards is the old or the new, whole, and the
//! next start goes on and clears up.
//!
//! `FMLGS_KILLS=50 cargo test --test it kills -- --nocapture` kills each command 50 times.
#![cfg(unix)]

mod written;

use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cli_support::{Done, Server, command, first_version, fmlgs, folder, tiny_dataset};
use fmlgs::io::{SceneFolder, semantic_map, trained};
use fmlgs::jobs::Folders;
use fmlgs::jobs::edit::EditRequest;
use fmlgs::jobs::workspace::{OpenedPath, Workspace};
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::train::checkpoint;
use fmlgs::scene::SemanticMap;
use rand::{RngExt, SeedableRng};

/// Kills of each command.
fn kills() -> u64 {
    std::env::var("FMLGS_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(3)
}

/// Starts `start` again and again, kills it at a random moment of the first `longest`, and calls `check` after each.
fn kill_often(what: &str, longest: Duration, start: &mut dyn FnMut(u64) -> Command, check: &mut dyn FnMut()) {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(what.bytes().map(u64::from).sum());
    let (mut killed, mut ended) = (0, 0);
    for round in 0..kills() {
        let mut child: Child = start(round).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(longest.mul_f64(random.random_range(0.0..1.0)));
        match child.try_wait().unwrap() {
            None => killed += 1,
            Some(_) => ended += 1,
        }
        // A process that has ended already cannot be killed.
        let _ = child.kill();
        child.wait().unwrap();
        check();
    }
    println!("{what}: {killed} killed, {ended} had ended before");
    assert!(killed > 0, "{what}: nothing was killed");
}

/// Run time of a command from start to end.
fn time(command: &mut Command) -> Duration {
    let start = Instant::now();
    Done::from(command.output().unwrap()).ok();
    start.elapsed()
}

fn train<'a>(photos: &'a str, out: &'a str, steps: &'a str) -> Vec<&'a str> {
    let mut arguments = vec!["train", photos, "--out", out, "--steps", steps, "--backend", "cpu", "--max-side", "64"];
    arguments.extend(["--eval-every", "0", "--checkpoint-secs", "0.02", "--no-densify", "-q"]);
    arguments
}

/// Names below `folder` that only a process at work may have.
fn leftovers(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.file_name().unwrap().to_string_lossy().starts_with('.') {
            found.push(path);
        } else if path.is_dir() {
            found.extend(leftovers(&path));
        }
    }
    found
}

fn assert_tidy(folder: &Path) {
    assert_eq!(leftovers(folder), Vec::<PathBuf>::new());
}

fn map_of(scene: &Path) -> SemanticMap {
    let loaded = trained::load(scene).unwrap();
    semantic_map::load(scene, loaded.state.as_deref(), &loaded.cloud).unwrap().expect("objects")
}

#[test]
fn trainings() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    let (photos, scene) = (photos.to_str().unwrap(), out.to_str().unwrap());
    let longest = time(&mut command(&train(photos, scene, "40"))) + Duration::from_millis(300);
    std::fs::remove_dir_all(&out).unwrap();
    let mut steps = 0;
    kill_often("train", longest, &mut |_| command(&train(photos, scene, "1000000")), &mut || {
        let path = out.join(checkpoint::FILE);
        let saved = checkpoint::load(&path).unwrap().map_or(0, |c| c.header.step);
        assert!(saved >= steps, "a checkpoint of step {saved} after one of {steps}");
        steps = saved;
        assert!(!trained::is_scene(&out) || trained::load(&out).is_ok());
    });
    drop(SceneFolder::hold(&out, "test").unwrap());
    assert_tidy(folder.path());
    // A run that ends by itself, killed around its end as well.
    let out = folder.path().join("short");
    let scene = out.to_str().unwrap();
    kill_often("train to its end", longest, &mut |_| command(&train(photos, scene, "40")), &mut || {
        let finished = trained::is_scene(&out).then(|| trained::load(&out).unwrap());
        if finished.is_some_and(|s| s.info.history.steps.last().is_some_and(|s| s.step == 40)) {
            std::fs::remove_dir_all(&out).unwrap();
        }
    });
    fmlgs(&train(photos, scene, "40")).ok();
    assert_eq!(trained::load(&out).unwrap().info.history.steps.last().unwrap().step, 40);
    assert_tidy(folder.path());
}

#[test]
fn objects_being_found() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    let (photos, scene) = (photos.to_str().unwrap(), out.to_str().unwrap());
    fmlgs(&train(photos, scene, "40")).ok();
    // The same photos with other names: identities of one beside names of the other would be wrong.
    let others = folder.path().join("others");
    assert!(Command::new("cp").arg("-r").args([photos, others.to_str().unwrap()]).status().unwrap().success());
    let labels = std::fs::read_to_string(others.join("identities.json")).unwrap();
    std::fs::write(others.join("identities.json"), labels.replace("box", "crate")).unwrap();
    // And other seeds, so that other Gaussians belong to them.
    let others = others.to_str().unwrap();
    let find = |round: u64| {
        let of = if round.is_multiple_of(2) { [others, "0003"] } else { [photos, "0001"] };
        command(&["preprocess", scene, "--masks", of[0], "--seed", of[1], "--max-seeds", "1", "--encoder", "none"])
    };
    let mut known = Vec::new();
    let mut longest = Duration::ZERO;
    for round in [1, 0] {
        longest = longest.max(time(&mut find(round)));
        known.push(map_of(&out));
    }
    assert!(
        known[0].identity_of != known[1].identity_of && known[0].identities != known[1].identities,
        "the same either way"
    );
    kill_often("preprocess", longest, &mut |round| find(round), &mut || {
        let map = map_of(&out);
        assert!(known.contains(&map), "a mixture of two saves");
    });
    Done::from(find(0).output().unwrap()).ok();
    assert_tidy(folder.path());
}

#[test]
fn a_scene_trained_anew_without_a_thing() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (photos, scene) = (photos.to_str().unwrap(), at("scene"));
    fmlgs(&train(photos, &scene, "40")).ok();
    fmlgs(&["preprocess", &scene, "--masks", photos, "--encoder", "none", "-q"]).ok();
    let remove = |out: &str, seed: u64| {
        command(&["remove", &scene, "box 1", "--fill", "photos", "--out", out, "--seed", &seed.to_string(), "-q"])
    };
    let state = |out: &str| {
        let loaded = trained::load(Path::new(out)).unwrap();
        (loaded.cloud, map_of(Path::new(out)).identity_of)
    };
    let (whole, killed) = (at("whole"), at("killed"));
    let longest = time(&mut remove(&whole, 0));
    let done = state(&whole);
    fmlgs(&["query", &whole, "box 1"]).fails_with(1);
    fmlgs(&["query", &whole, "box 2"]).ok();
    // It trained on photos of its own, in which other things are as they were and the box is not.
    let eval = |scene: &str, photos: &str| {
        let all = ["eval", scene, "--photos", photos, "--held-out-every", "0", "--json"];
        fmlgs(&all).ok().json()["psnr"].as_f64().unwrap()
    };
    let own = at("whole/photos");
    let scores = [[&whole, &scene].map(|s| eval(s, &own)), [&whole, &scene].map(|s| eval(s, photos))];
    assert!(scores[0][0] > scores[0][1] + 1.0, "{scores:?}");
    // Photos that still show the box are compared without its pixels.
    assert!(scores[1][0] > scores[0][0] - 2.0, "{scores:?}");

    // Again nothing changes; another wish is refused, and so is the scene itself.
    Done::from(remove(&whole, 0).output().unwrap()).ok();
    assert_eq!(state(&whole), done);
    Done::from(remove(&whole, 1).output().unwrap()).fails_with(1);
    Done::from(remove(&scene, 0).output().unwrap()).fails_with(1);
    assert_eq!(state(&whole), done);

    kill_often("remove --fill photos", longest.mul_f64(0.5), &mut |_| remove(&killed, 0), &mut || {
        let out = Path::new(&killed);
        assert!(!trained::is_scene(out) || trained::load(out).is_ok());
    });
    Done::from(remove(&killed, 0).output().unwrap()).ok();
    assert!(state(&killed) == done, "what was killed became another scene");
    assert_tidy(folder.path());
}

/// Names the scene that [`edits`], in a process of its own, is to edit until it is killed.
const EDITED: &str = "FMLGS_EDITED_SCENE";

/// Changes the objects of a scene to and fro.
fn edit_for_ever(scene: PathBuf) {
    let workspace = Workspace::new(Folders { data: scene.join("data") });
    let opened = workspace.open(&scene, &mut Silent).expect("a scene");
    let OpenedPath::Scene(opened) = opened else { panic!("not opened") };
    let (cloud, map) = (opened.cloud.clone(), opened.semantics.clone().unwrap());
    let mut other = (*map).clone();
    other.identity_of.reverse();
    // What a kill left may be the one or the other.
    let seeds = if map.seeds == ["reversed"] { "straight" } else { "reversed" };
    other = SemanticMap::from_identities(other.identities, other.identity_of, other.margin, vec![seeds.into()]);
    let other = Arc::new(other);
    for round in 0.. {
        let to = if round % 2 == 0 { &other } else { &map };
        let request = EditRequest::Restore(Arc::clone(to));
        workspace.edit_objects(&cloud, &map, &request, &scene).expect("edited");
    }
}

#[test]
fn edits() {
    if let Some(scene) = std::env::var_os(EDITED) {
        return edit_for_ever(scene.into());
    }
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    let (photos, scene) = (photos.to_str().unwrap(), out.to_str().unwrap());
    fmlgs(&train(photos, scene, "40")).ok();
    fmlgs(&["preprocess", scene, "--masks", photos, "--encoder", "none"]).ok();
    let before = map_of(&out);
    let mut reversed = before.identity_of.clone();
    reversed.reverse();
    assert!(reversed != before.identity_of);
    let mut changed = 0;
    let mut edit = |_| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "kills::edits"]).env(EDITED, &out);
        command
    };
    kill_often("edits", Duration::from_millis(1500), &mut edit, &mut || {
        let map = map_of(&out);
        let is_reversed = map.seeds == ["reversed"];
        changed += u32::from(is_reversed);
        assert!(
            map.identity_of == if is_reversed { reversed.clone() } else { before.identity_of.clone() },
            "a mixture of two saves"
        );
    });
    println!("edits: {changed} times the changed state was found");
    drop(SceneFolder::hold(&out, "test").unwrap());
    assert_tidy(&out);
}

#[test]
fn exports() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    // Large enough to be met in the middle.
    let splats = ["one.ply", "two.ply"].map(|name| {
        let small = crate::cli_support::tiny_splat(&folder.path().join(name));
        let mut cloud = fmlgs::io::splat_ply::read(&small).unwrap();
        let shift = if name == "one.ply" { 0.0 } else { 1.0 };
        let n = 100_000;
        cloud.positions = (0..n).map(|i| [i as f32 + shift, 0.0, 0.0]).collect();
        for i in 3..n {
            cloud.log_scales.push(cloud.log_scales[i % 3]);
            cloud.quaternions.push(cloud.quaternions[i % 3]);
            cloud.opacity_logits.push(cloud.opacity_logits[i % 3]);
            cloud.sh.push(cloud.sh[i % 3]);
        }
        fmlgs::io::splat_ply::write(&small, &cloud).unwrap();
        small.to_str().unwrap().to_owned()
    });
    let whole = splats.clone().map(|s| std::fs::read(s).unwrap());
    let out = at("out/exported.ply");
    let export = |round: u64| command(&["export", &splats[(round % 2) as usize], "--out", &out]);
    let longest = time(&mut export(1));
    kill_often("export", longest, &mut |round| export(round), &mut || {
        assert!(whole.contains(&std::fs::read(&out).unwrap()), "neither the one nor the other");
    });
    Done::from(export(0).output().unwrap()).ok();
    assert_tidy(folder.path());
}

#[test]
fn photos_being_made() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let glb = folder.path().join("boxes.glb");
    let (glb, out) = (glb.to_str().unwrap(), photos.to_str().unwrap());
    let arguments = |views: &str| {
        let all = ["synth", glb, "--out", out, "--view-count", views, "--size", "64x48", "--samples", "2", "-q"];
        command(&all)
    };
    let longest = time(&mut arguments("24"));
    let views = |round: u64| if round.is_multiple_of(2) { "16" } else { "24" };
    let mut refused = 0;
    kill_often("synth", longest, &mut |round| arguments(views(round)), &mut || {
        let info = fmlgs(&["info", out, "--json"]);
        match info.code {
            // Whole, with the ids and depths of all of its photos.
            Some(0) => {
                let n = info.json()["photos"].as_u64().unwrap();
                assert!(n == 16 || n == 24, "{n} photos");
                let there = |folder: &str| std::fs::read_dir(photos.join(folder)).unwrap().count() as u64;
                assert!(["images", "object_ids", "part_ids", "depth"].iter().all(|f| there(f) >= n));
            }
            code => {
                refused += 1;
                // Nothing yet, or photos whose poses were not written yet.
                let refusals = ["that FMLGS can open", "no camera poses"];
                assert!(code == Some(1) && refusals.iter().any(|r| info.stderr.contains(r)), "{}", info.stderr);
            }
        }
    });
    println!("synth: {refused} times the folder was refused as incomplete");
    Done::from(arguments("16").output().unwrap()).ok();
    assert_eq!(fmlgs(&["info", out, "--json"]).ok().json()["photos"], 16);
    assert_tidy(folder.path());
}

#[test]
fn downloads() {
    let folder = folder();
    let content: Vec<u8> = (0..2_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 16) as u8).collect();
    let whole = folder.path().join("whole");
    std::fs::write(&whole, &content).unwrap();
    let graph = serde_json::json!({ "file": "g.onnx", "bytes": content.len(),
        "sha256": fmlgs::models::fetch::sha256(&whole).unwrap() });
    let description = serde_json::json!({ "version": 1, "kind": "sam2", "graphs": { "a": graph } }).to_string();
    let served = content.clone();
    let server = Server::new(move |stream, head| {
        let range: Option<usize> =
            head.lines().find_map(|l| l.to_lowercase().strip_prefix("range: bytes=")?.strip_suffix('-')?.parse().ok());
        let (line, body): (String, &[u8]) = match range {
            _ if head.contains(".json") => ("200 OK".into(), description.as_bytes()),
            Some(start) => (
                format!("206 Rest\r\nContent-Range: bytes {start}-{}/{}", served.len() - 1, served.len()),
                &served[start..],
            ),
            None => ("200 OK".into(), &served),
        };
        let head =
            format!("HTTP/1.1 {line}\r\nETag: \"1\"\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
        // Whoever asked may have gone. Slowly, so that kills meet it in the middle.
        let _ = stream.write_all(head.as_bytes());
        for piece in body.chunks(20_000) {
            if stream.write_all(piece).is_err() {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    });
    let models = folder.path().join("models");
    let fetch = || {
        let mut fetch = command(&["models", "fetch", "sam2.1-tiny", "--from", &format!("http://{}", server.at)]);
        fetch.env("FMLGS_MODELS", &models);
        fetch
    };
    let names = || {
        let entry = |e: std::io::Result<std::fs::DirEntry>| e.unwrap().file_name().to_string_lossy().into_owned();
        let mut names: Vec<String> = std::fs::read_dir(&models).into_iter().flatten().map(entry).collect();
        names.sort();
        names
    };
    let done = ["g.onnx", "sam2.1-tiny.json"];
    let longest = time(&mut fetch());
    std::fs::remove_dir_all(&models).unwrap();
    kill_often("fetch", longest, &mut |_| fetch(), &mut || {
        if names().contains(&"g.onnx".to_owned()) {
            assert!(std::fs::read(models.join("g.onnx")).unwrap() == content);
            std::fs::remove_dir_all(&models).unwrap();
        }
    });
    Done::from(fetch().output().unwrap()).ok();
    assert_eq!(names(), done);
    assert!(std::fs::read(models.join("g.onnx")).unwrap() == content);
}
