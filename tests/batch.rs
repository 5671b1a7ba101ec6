//! Batches: shards that are killed at random and started again bring what an uninterrupted run brings, bit for bit;
//! two processes never work on one unit; what is wrong is told before anything runs.
//!
//! `FMLGS_KILLS=50 cargo test --test batch -- --nocapture` kills shards 50 times.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cli_support;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cli_support::{Done, command, fmlgs, folder, tiny_dataset};
use rand::{RngExt, SeedableRng};
use serde_json::Value;

/// Exit code of a shard that was stopped.
const STOPPED: i32 = 99;

/// Two scenes, one with objects, two settings and two seeds: eight units.
const JOBS: &str = r#"
seeds = [0, 1]

[[scene]]
path = "photos"
name = "boxes"
masks = "photos"

[[scene]]
path = "others"

[[setting]]
name = "plain"
steps = 24
max-side = 64
no-densify = true
eval-every = 0
checkpoint-secs = 0.02
backend = "cpu"

[[setting]]
name = "dense"
steps = 30
max-side = 48
max-gaussians = 900
sh-degree = 1
checkpoint-secs = 0.02
backend = "cpu"

[objects]
max-seeds = 1
encoder = "none"
"#;

/// Photos, the same under another name, and the batch of both. Labels come with each, but are used of the first.
fn prepare(folder: &Path) -> PathBuf {
    let photos = tiny_dataset(folder);
    cli_support::copy(&photos, &folder.join("others"));
    let jobs = folder.join("jobs.toml");
    let labeled = JOBS.replace("path = \"others\"", "path = \"others\"\nmasks = \"others\"");
    std::fs::write(&jobs, labeled).unwrap();
    jobs
}

fn batch(jobs: &Path, out: &Path, more: &[&str]) -> Command {
    let mut arguments = vec!["batch", jobs.to_str().unwrap(), "--out", out.to_str().unwrap(), "-q"];
    arguments.extend(more);
    let mut command = command(&arguments);
    for name in ["ID", "COUNT", "MIN", "STEP"] {
        command.env_remove(format!("SLURM_ARRAY_TASK_{name}"));
    }
    command
}

fn done(mut command: Command) -> Done {
    command.output().expect("the binary starts").into()
}

/// Everything of a unit's result that does not say when and where it was made: its Gaussians as they are stored, and
/// its document without times.
fn outcome(unit: &Path) -> (Vec<u8>, Value) {
    let splat = std::fs::read(unit.join("scene/point_cloud.ply")).unwrap();
    // Every save has an id of its own, in a comment of the header.
    let end = splat.windows(10).position(|w| w == b"end_header").expect("a header");
    let header = String::from_utf8(splat[..end].to_vec()).unwrap();
    let lines: Vec<&str> = header.lines().filter(|l| !l.starts_with("comment fmlgs state ")).collect();
    assert_eq!(lines.len() + 1, header.lines().count(), "{header}");
    let bytes = [lines.join("\n").as_bytes(), &splat[end..]].concat();
    let mut document: Value = serde_json::from_slice(&std::fs::read(unit.join("result.json")).unwrap()).unwrap();
    let all = document.as_object_mut().unwrap();
    for of_the_run in ["secs", "host", "computer"] {
        assert!(all.remove(of_the_run).is_some(), "{of_the_run}");
    }
    (bytes, document)
}

/// The outcomes of all units below `out`, by name.
fn outcomes(out: &Path) -> BTreeMap<String, (Vec<u8>, Value)> {
    let listed = |folder: &Path| std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect::<Vec<_>>();
    let units = listed(out).into_iter().flat_map(|scene| listed(&scene)).flat_map(|setting| listed(&setting));
    units.map(|u| (u.strip_prefix(out).unwrap().to_str().unwrap().to_owned(), outcome(&u))).collect()
}

fn kill(child: &Child, signal: &str) {
    let _ = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).stderr(Stdio::null()).status();
}

#[test]
fn shards_that_are_killed_bring_what_an_uninterrupted_run_brings() {
    let folder = folder();
    let jobs = prepare(folder.path());
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    let start = Instant::now();
    let all = done(batch(&jobs, &whole, &["--json"])).ok().json();
    let longest = start.elapsed();
    assert_eq!((&all["units"], &all["done"]), (&8.into(), &8.into()), "{all}");
    println!("uninterrupted: {:.1} s", longest.as_secs_f64());

    let kills: u32 = std::env::var("FMLGS_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(21);
    let spawn = |shard: usize| {
        let mut command = batch(&jobs, &killed, &["--shard", &format!("{shard}/4")]);
        (shard, command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
    };
    let mut running: Vec<(usize, Child)> = (1..=4).map(spawn).collect();
    let (mut ended_by, mut starts) = (BTreeMap::<String, u32>::new(), 4);
    for round in 0..kills {
        std::thread::sleep(longest.mul_f64(random.random_range(0.0..1.0 / f64::from(kills))));
        let working: Vec<usize> = (0..4).filter(|&k| running[k].1.try_wait().unwrap().is_none()).collect();
        if working.is_empty() {
            break;
        }
        let victim = working[random.random_range(0..working.len())];
        let signal = ["KILL", "TERM", "KILL", "USR1", "INT"][round as usize % 5];
        kill(&running[victim].1, signal);
        // At once, and not only once the one before has ended: two of one shard may meet.
        let next = spawn(running[victim].0);
        starts += 1;
        let (_, mut child) = std::mem::replace(&mut running[victim], next);
        let how = match child.wait().unwrap().code() {
            None => "killed".to_owned(),
            Some(code) => {
                assert!(code == 0 || code == STOPPED, "{signal}: exit code {code}");
                format!("exit code {code}")
            }
        };
        *ended_by.entry(how).or_default() += 1;
    }
    for (_, mut child) in running {
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
    // What one of two that met left to the other is done by now, or is done by whoever comes last.
    for shard in 1..=4 {
        done(batch(&jobs, &killed, &["--shard", &format!("{shard}/4")])).ok();
    }
    println!("{starts} starts, ended by {ended_by:?}");
    assert!(ended_by.contains_key("killed") && ended_by.contains_key("exit code 99"), "{ended_by:?}");

    let (of_whole, of_killed) = (outcomes(&whole), outcomes(&killed));
    assert_eq!(of_whole.keys().collect::<Vec<_>>(), of_killed.keys().collect::<Vec<_>>());
    for (name, (bytes, document)) in &of_whole {
        let (other_bytes, other_document) = &of_killed[name];
        assert!(bytes == other_bytes, "{name}: other Gaussians");
        assert_eq!(document, other_document, "{name}");
    }
    // Another seed is told from it by the same comparison, and so is a unit of the other setting.
    let [a, b, c] = ["boxes/plain/seed-0", "boxes/plain/seed-1", "boxes/dense/seed-0"].map(|name| &of_whole[name]);
    assert!(a.0 != b.0 && a.0 != c.0 && a.1["sha256"] != b.1["sha256"]);
    assert!(a.1["evaluation"]["psnr"] != b.1["evaluation"]["psnr"] && a.1["masks"]["miou"].as_f64().unwrap() > 0.3);
    // One scene, and nothing of those who were killed.
    for name in of_whole.keys() {
        let entries = std::fs::read_dir(killed.join(name)).unwrap().map(|e| e.unwrap().file_name());
        let mut names: Vec<String> = entries.map(|n| n.to_string_lossy().into_owned()).collect();
        names.sort();
        assert_eq!(names, ["claims", "result.json", "scene", "unit.json"], "{name}");
    }
    merged(&whole, &killed, &of_whole);
}

/// The page of all results, from one folder or from several with parts of them.
fn merged(whole: &Path, killed: &Path, units: &BTreeMap<String, (Vec<u8>, Value)>) {
    let folder = folder();
    let merge = |from: &[&Path], out: &Path| {
        let mut arguments = vec!["report", "merge"];
        arguments.extend(from.iter().map(|p| p.to_str().unwrap()));
        arguments.extend(["--out", out.to_str().unwrap(), "--json"]);
        fmlgs(&arguments)
    };
    let out = folder.path().join("one");
    let one = merge(&[whole], &out).ok().json();
    let names = |of: &Value| -> Vec<String> {
        let asked = of["units"].as_array().unwrap().iter().map(|u| u["asked"].clone());
        let name = |a: Value| format!("{}/{}/seed-{}", text(&a["scene"]), text(&a["setting"]), a["seed"]);
        asked.map(name).collect()
    };
    let text_of = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    assert_eq!(names(&one), units.keys().cloned().collect::<Vec<_>>());
    assert_eq!(text_of("merged.csv").lines().count(), 1 + units.len());
    let page = text_of("merged.html");
    assert!(units.values().all(|(_, u)| page.contains(&format!("{:.4}", u["evaluation"]["ssim"].as_f64().unwrap()))));
    let row =
        one["rows"].as_array().unwrap().iter().find(|r| r["scene"] == "boxes" && r["setting"] == "plain").unwrap();
    let psnr = [0, 1].map(|seed| units[&format!("boxes/plain/seed-{seed}")].1["evaluation"]["psnr"].as_f64().unwrap());
    let mean = 0.5 * (psnr[0] + psnr[1]);
    assert!((row["psnr"]["mean"].as_f64().unwrap() - mean).abs() < 1e-9 && row["units"] == 2, "{row}");

    // Half of the units here, half there.
    let (here, there) = (folder.path().join("here"), folder.path().join("there"));
    for (k, name) in units.keys().enumerate() {
        cli_support::copy(&killed.join(name), &if k % 2 == 0 { &here } else { &there }.join(name));
    }
    let two = merge(&[&here, &there], &folder.path().join("two")).ok().json();
    let without_times = |mut of: Value| {
        for unit in of["units"].as_array_mut().unwrap() {
            unit.as_object_mut().unwrap().remove("secs");
        }
        of["units"].clone()
    };
    assert_eq!(without_times(two), without_times(one));

    // Settings of one name that are not the same.
    let result = there.join("others/plain/seed-1/result.json");
    let told = std::fs::read_to_string(&result).unwrap();
    std::fs::write(&result, told.replace("\"steps\": 24,", "\"steps\": 25,")).unwrap();
    let refused = merge(&[&here, &there], &folder.path().join("three")).fails_with(1).stderr;
    assert!(refused.contains("'plain'") && refused.contains("steps: ") && refused.contains("here"), "{refused}");
    std::fs::remove_file(&result).unwrap();
    let part = merge(&[&here, &there], &folder.path().join("four")).ok().json();
    assert_eq!(part["unfinished"], serde_json::json!(["others/plain/seed-1"]));
    assert!(merge(&[folder.path().join("jobs").as_path()], &out).fails_with(1).stderr.contains("jobs"));
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap()
}

/// A long batch of one unit.
fn long_batch(folder: &Path) -> PathBuf {
    tiny_dataset(folder);
    let jobs = folder.join("jobs.toml");
    let settings = "steps = 100000000\nmax-side = 64\nno-densify = true\ncheckpoint-secs = 0.05\nbackend = \"cpu\"";
    std::fs::write(&jobs, format!("[[scene]]\npath = \"photos\"\n[[setting]]\nname = \"long\"\n{settings}\n")).unwrap();
    jobs
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let end = Instant::now() + Duration::from_secs(300);
    while !there() {
        assert!(Instant::now() < end, "{what}: in vain");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn start(jobs: &Path, out: &Path, more: &[&str]) -> Child {
    batch(jobs, out, more).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn state(jobs: &Path, out: &Path) -> String {
    let listed = done(batch(jobs, out, &["--dry-run", "--json"])).ok().json();
    text(&listed["units"][0]["state"]).to_owned()
}

#[test]
fn signals_save_a_checkpoint_and_end_with_the_code_that_queues_again() {
    let folder = folder();
    let (jobs, out) = (long_batch(folder.path()), folder.path().join("runs"));
    let unit = out.join("photos/long/seed-0");
    assert_eq!(state(&jobs, &out), "waiting");
    assert!(!out.exists(), "a dry run writes nothing");
    for (n, signal) in ["TERM", "USR1", "INT"].into_iter().enumerate() {
        let child = start(&jobs, &out, &[]);
        let own = unit.join(format!("scene-{}", n + 1));
        wait_for(signal, || own.join("checkpoint.bin").exists());
        assert_eq!(state(&jobs, &out), "held");
        kill(&child, signal);
        // Schedulers do not wait for the first to be answered.
        if signal == "USR1" {
            kill(&child, "TERM");
        }
        let ended = Done::from(child.wait_with_output().unwrap()).fails_with(STOPPED);
        assert!(ended.stderr.contains("the same command"), "{}", ended.stderr);
        assert!(own.join("scene.json").exists() && !unit.join("result.json").exists());
        assert_eq!(state(&jobs, &out), "begun");
    }
    // Stopped before anything was done, it goes on all the same.
    let mut child = start(&jobs, &out, &[]);
    kill(&child, "KILL");
    child.wait().unwrap();
    assert_eq!(state(&jobs, &out), "begun");
}

#[test]
fn of_two_processes_one_works_on_a_unit() {
    let folder = folder();
    let (jobs, out) = (long_batch(folder.path()), folder.path().join("runs"));
    // A heartbeat a second.
    let quick = ["--takeover-secs", "12"];
    let mut both: Vec<Child> = (0..2).map(|_| start(&jobs, &out, &quick)).collect();
    let mut left = None;
    wait_for("one of two leaves it to the other", || {
        left = both.iter_mut().position(|child| child.try_wait().unwrap().is_some());
        left.is_some()
    });
    let left = both.remove(left.unwrap());
    let told = Done::from(left.wait_with_output().unwrap()).ok().stderr;
    let mut owner = both.remove(0);
    assert!(told.contains(&format!("left to process {}", owner.id())), "{told}");
    assert!(owner.try_wait().unwrap().is_none(), "the owner works on");
    assert_eq!(std::fs::read_dir(out.join("photos/long/seed-0/claims")).unwrap().count(), 1);

    // One that stands still is taken for dead, although it is not.
    let unit = out.join("photos/long/seed-0");
    wait_for("a checkpoint", || unit.join("scene-1/checkpoint.bin").exists());
    kill(&owner, "STOP");
    let heir = start(&jobs, &out, &quick);
    wait_for("the unit is taken over", || unit.join("scene-2/checkpoint.bin").exists());
    assert!(!unit.join("scene-1").exists());
    // When it wakes, it leaves the unit, and spoils nothing of it.
    kill(&owner, "CONT");
    let told = Done::from(owner.wait_with_output().unwrap()).ok().stderr;
    assert!(told.contains("took over"), "{told}");
    assert!(!unit.join("failed.json").exists() && !unit.join("result.json").exists());
    kill(&heir, "TERM");
    Done::from(heir.wait_with_output().unwrap()).fails_with(STOPPED);
    assert!(unit.join("scene-2/scene.json").exists());
}

#[test]
fn what_is_wrong_is_told_before_anything_runs() {
    let folder = folder();
    tiny_dataset(folder.path());
    let (jobs, out) = (folder.path().join("jobs.toml"), folder.path().join("runs"));
    let scene = "[[scene]]\npath = \"photos\"\n";
    let setting = |line: &str| format!("{scene}[[setting]]\nname = \"fast\"\n{line}\n");
    let twice = format!("{scene}[[scene]]\npath = \"../{}/photos\"\n", folder.path().file_name().unwrap().display());
    let cases: Vec<(String, Vec<&str>)> = vec![
        ("[[scene]\n".into(), vec!["line 1"]),
        (format!("{scene}\n[eval\n"), vec!["line 4"]),
        (format!("{scene}pathe = \"x\"\n"), vec!["line 3", "pathe", "masks"]),
        (format!("sceen = 1\n{scene}"), vec!["line 1", "sceen"]),
        ("seeds = [1]\n".into(), vec!["[[scene]]", "none"]),
        (format!("seeds = []\n{scene}"), vec!["'seeds'"]),
        (format!("seeds = [3, 4, 3]\n{scene}"), vec!["seeds '3'", "twice"]),
        (format!("seeds = [-1]\n{scene}"), vec!["line 1"]),
        (setting("stepz = 5"), vec!["'fast'", "'stepz'", "steps, max-side"]),
        (setting("steps = \"many\""), vec!["'fast'", "--steps", "from 1 to"]),
        (setting("steps = 0"), vec!["--steps", "from 1 to"]),
        (setting("antialias = 1"), vec!["'antialias'", "true or false"]),
        (setting("seed = 1"), vec!["'seed'", "seeds = "]),
        (setting("steps = [1, 2]"), vec!["'steps'", "one value"]),
        (setting("distortion-weight = 0.5"), vec!["--surfels"]),
        (setting("plan = [\"photos=huge\"]"), vec!["photos"]),
        (setting("preset = \"none.toml\""), vec!["none.toml"]),
        (format!("{scene}[[setting]]\nsteps = 5\n"), vec!["[[setting]] number 1", "name"]),
        (setting("") + "[[setting]]\nname = \"Fast\"\n", vec!["[[setting]] 'Fast'", "twice"]),
        (format!("{scene}[[setting]]\nname = \"a/b\"\n"), vec!["'a/b'", "/"]),
        (format!("{scene}[[setting]]\nname = \"..\"\n"), vec!["'..'", "dot"]),
        (twice, vec!["[[scene]] 'photos'", "twice", "'name'"]),
        ("[[scene]]\npath = \"gone\"\n".into(), vec!["gone", "does not exist"]),
        ("[[scene]]\npath = \"jobs.toml\"\n".into(), vec!["jobs.toml"]),
        (format!("{scene}masks = \"photos\"\n"), vec!["'photos'", "[objects]"]),
        (format!("{scene}[objects]\nencodr = \"none\"\n"), vec!["[objects]", "'encodr'"]),
        (format!("{scene}[objects]\nencoder = \"no-such\"\n"), vec!["[objects]", "'encoder'", "no-such"]),
        (format!("{scene}[objects]\nsegmenter = \"no-such\"\n"), vec!["'segmenter'", "no-such"]),
        (format!("{scene}[eval]\nprotocol = \"guess\"\n"), vec!["[eval]", "guess"]),
        (format!("out = \"photos/runs\"\n{scene}"), vec!["photos", "among what is read", "--out"]),
        (
            "out = \"x\"\n[[scene]]\npath = \"x/a/default/seed-0/in\"\nname = \"a\"\n".into(),
            vec!["folder of its results"],
        ),
    ];
    cli_support::copy(&folder.path().join("photos"), &folder.path().join("x/a/default/seed-0/in"));
    for (file, named) in cases {
        std::fs::write(&jobs, &file).unwrap();
        let mut arguments = vec!["batch", jobs.to_str().unwrap()];
        if !file.contains("out = ") {
            arguments.extend(["--out", out.to_str().unwrap()]);
        }
        let told = fmlgs(&arguments).fails_with(1).stderr;
        assert!(told.contains("jobs.toml"), "{file}\n{told}");
        named.iter().for_each(|word| assert!(told.contains(word), "{word} is not said of\n{file}\n{told}"));
        assert!(!out.exists() && !folder.path().join("photos/runs").exists());
    }
    std::fs::write(&jobs, scene).unwrap();
    for (arguments, code) in [(&["--shard", "0/4"][..], 2), (&["--shard", "5/4"], 2), (&["--takeover-secs", "0"], 2)] {
        done(batch(&jobs, &out, arguments)).fails_with(code);
    }
    // Arrays whose tasks are no range.
    let mut uneven = batch(&jobs, &out, &[]);
    uneven.env("SLURM_ARRAY_TASK_ID", "7").env("SLURM_ARRAY_TASK_COUNT", "2").env("SLURM_ARRAY_TASK_MIN", "3");
    assert!(done(uneven).fails_with(2).stderr.contains("--shard I/N"));
    let mut array = batch(&jobs, &out, &["--dry-run", "--json"]);
    array.env("SLURM_ARRAY_TASK_ID", "14").env("SLURM_ARRAY_TASK_COUNT", "3");
    array.env("SLURM_ARRAY_TASK_MIN", "10").env("SLURM_ARRAY_TASK_STEP", "2");
    assert_eq!(done(array).ok().json()["shard"], "3/3");
}

/// Three units, of which the second cannot be trained.
#[test]
fn a_unit_that_fails_is_recorded_and_stops_no_other() {
    let folder = folder();
    tiny_dataset(folder.path());
    let (jobs, out) = (folder.path().join("jobs.toml"), folder.path().join("runs"));
    let quick = "steps = 3\nmax-side = 16\nno-densify = true\nbackend = \"cpu\"\n";
    let setting = |name: &str, more: &str| format!("[[setting]]\nname = \"{name}\"\n{quick}{more}");
    let file = |more: &str| {
        let settings = [setting("a", ""), setting("b", more), setting("c", "")].concat();
        std::fs::write(&jobs, format!("[[scene]]\npath = \"photos\"\n{settings}")).unwrap();
    };
    // Surfels are not for the GPU.
    file("surfels = true\n");
    let broken =
        std::fs::read_to_string(&jobs).unwrap().replacen("backend = \"cpu\"\nsurfels", "backend = \"gpu\"\nsurfels", 1);
    std::fs::write(&jobs, broken).unwrap();
    let told = done(batch(&jobs, &out, &["--json"])).fails_with(1);
    assert_eq!((&told.json()["done"], &told.json()["failed"][0]["unit"]), (&2.into(), &"photos/b/seed-0".into()));
    assert!(told.stderr.contains("--retry-failed"), "{}", told.stderr);
    let unit = out.join("photos/b/seed-0");
    let failed: Value = serde_json::from_slice(&std::fs::read(unit.join("failed.json")).unwrap()).unwrap();
    assert!(text(&failed["error"]).contains("--backend cpu"), "{failed}");
    // Not tried again until that is asked for, whatever the settings are now.
    file("");
    let before = std::fs::read(out.join("photos/a/seed-0/result.json")).unwrap();
    assert_eq!(done(batch(&jobs, &out, &["--json"])).fails_with(1).json()["failed"].as_array().unwrap().len(), 1);
    assert_eq!(done(batch(&jobs, &out, &["--retry-failed", "--json"])).ok().json()["done"], 3);
    assert!(!unit.join("failed.json").exists() && unit.join("result.json").exists());
    assert_eq!(std::fs::read(out.join("photos/a/seed-0/result.json")).unwrap(), before, "what is done stays");

    // Other settings under the same name: nothing runs, and nothing is lost.
    file("sh-degree = 0\n");
    let refused = done(batch(&jobs, &out, &[])).fails_with(1).stderr;
    assert!(refused.contains("sh_degree: 3 there, 0 now") && refused.contains("photos/b/seed-0"), "{refused}");
    let listed = done(batch(&jobs, &out, &["--dry-run", "--json"])).ok().json();
    let states: Vec<&str> = listed["units"].as_array().unwrap().iter().map(|u| text(&u["state"])).collect();
    assert_eq!(states, ["done", "changed", "done"]);
    // How often a training looks and saves changes nothing, and neither does a comment.
    file("eval-every = 1\ncheckpoint-secs = 5\n# ...\n");
    assert_eq!(done(batch(&jobs, &out, &["--json"])).ok().json()["done"], 3);
    // Other photos under the same name do.
    std::fs::write(
        folder.path().join("photos/images/0003.png"),
        std::fs::read(folder.path().join("photos/images/0001.png")).unwrap(),
    )
    .unwrap();
    assert!(done(batch(&jobs, &out, &[])).fails_with(1).stderr.contains("photos: "));
}

/// The script is run with commands that stand for those of Slurm.
#[test]
fn the_array_script_runs_a_shard_and_queues_it_again() {
    let folder = folder();
    let (jobs, out) = (long_batch(folder.path()), folder.path().join("it's $HOME"));
    let at = |name: &str| folder.path().join(name);
    let more = |jobs: &Path, more: &[&str]| done(batch(jobs, &out, more));
    let script = more(&jobs, &["--print-sbatch=3"]).ok().stdout;
    for line in ["#!/bin/bash", "#SBATCH --array=1-3", "#SBATCH --requeue", "#SBATCH --signal=USR1@180"] {
        assert!(script.lines().any(|l| l == line), "{line}:\n{script}");
    }
    assert!(more(&jobs, &["--print-sbatch"]).ok().stdout.contains("--array=1-1\n"), "a task for each unit");
    more(&jobs, &["--print-sbatch=0"]).fails_with(2);
    std::fs::write(at("batch.sh"), &script).unwrap();
    let checked = Command::new("bash").args(["-n", at("batch.sh").to_str().unwrap()]).output().unwrap();
    assert!(checked.status.success() && checked.stderr.is_empty(), "{}", String::from_utf8_lossy(&checked.stderr));

    let bin = at("bin");
    std::fs::create_dir(&bin).unwrap();
    for (name, text) in [
        ("srun", "echo $$ > \"$LOG.pid\"; exec \"$@\""),
        ("squeue", "echo \"$STATE\""),
        ("scontrol", "echo \"$@\" >> \"$LOG\""),
    ] {
        std::fs::write(bin.join(name), format!("#!/bin/sh\n{text}\n")).unwrap();
        assert!(Command::new("chmod").arg("+x").arg(bin.join(name)).status().unwrap().success());
    }
    for (state, code, queued) in [("RUNNING", 0, "requeue 77_1\n"), ("COMPLETING", STOPPED, "")] {
        let log = at(&format!("log-{state}"));
        let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
        let mut bash = Command::new("bash");
        bash.arg(at("batch.sh")).env("PATH", path).env("LOG", &log).env("STATE", state).current_dir(folder.path());
        bash.env("SLURM_JOB_ID", "80").env("SLURM_ARRAY_JOB_ID", "77").env("SLURM_ARRAY_TASK_ID", "1");
        bash.env("SLURM_ARRAY_TASK_COUNT", "3").env("SLURM_ARRAY_TASK_MIN", "1").env("SLURM_ARRAY_TASK_STEP", "1");
        let running = bash.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        let unit = out.join("photos/long/seed-0");
        let claims = || std::fs::read_dir(unit.join("claims")).into_iter().flatten().count();
        let before = claims();
        wait_for("the unit is begun", || claims() > before && state_is_trained(&unit, claims()));
        let pid = std::fs::read_to_string(at(&format!("log-{state}.pid"))).unwrap();
        assert!(Command::new("kill").args(["-USR1", pid.trim()]).status().unwrap().success());
        assert_eq!(running.wait_with_output().unwrap().status.code(), Some(code));
        assert_eq!(std::fs::read_to_string(&log).unwrap_or_default(), queued);
    }
}

fn state_is_trained(unit: &Path, claim: usize) -> bool {
    unit.join(format!("scene-{claim}/checkpoint.bin")).exists()
}
