//! Batches: shards that are killed at random and started again bring what an uninterrupted run brings, bit for bit;
//! two processes never work on one unit; what is wrong is told before anything runs.
//!
//! `FMLGS_KILLS=50 cargo test --test it batch -- --nocapture` kills shards 50 times.
#![cfg(unix)]

mod processes;
mod refusals;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::cli_support::{Done, command, fmlgs, folder, tiny_dataset};
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
    crate::cli_support::copy(&photos, &folder.join("others"));
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
        crate::cli_support::copy(&killed.join(name), &if k % 2 == 0 { &here } else { &there }.join(name));
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
