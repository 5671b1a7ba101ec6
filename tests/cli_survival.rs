//! What survives: a kill, Ctrl-C, a full disk, a folder that cannot be written to.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cli_support;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use cli_support::{Done, command, fmlgs, folder, tiny_dataset};

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

/// Every file in `folder` with its contents.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entry = |e: std::io::Result<std::fs::DirEntry>| {
        let e = e.unwrap();
        (e.file_name().to_string_lossy().into_owned(), std::fs::read(e.path()).unwrap())
    };
    let mut all: Vec<_> = std::fs::read_dir(folder).unwrap().map(entry).collect();
    all.sort();
    all
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
    let cloud = |scene: &str| std::fs::read(Path::new(scene).join("point_cloud.ply")).unwrap();
    assert!(cloud(&out) == cloud(&straight), "the resumed run ended elsewhere than the straight one");
    // Negative control: another seed must end elsewhere.
    let other = at("other");
    fmlgs(&[&train_arguments(photos, &other, steps)[..], &["--seed", "1"]].concat()).ok();
    assert!(cloud(&other) != cloud(&straight), "the comparison cannot tell runs apart");
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
        assert!(done.stderr.contains("cancelled:") && done.stderr.contains("goes on"), "{}", done.stderr);
        assert_eq!(done.json()["end"], "cancelled");
        assert!(done.json()["steps"].as_u64().unwrap() > 0);
        // What was trained so far can be looked at.
        assert_eq!(fmlgs(&["info", out.to_str().unwrap(), "--json"]).ok().json()["kind"], "trained");
    }
}

#[test]
fn a_read_only_folder_is_named_and_left_alone() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    fmlgs(&train_arguments(photos.to_str().unwrap(), out.to_str().unwrap(), "20")).ok();
    let before = contents(&out);
    std::fs::set_permissions(&out, std::fs::Permissions::from_mode(0o555)).unwrap();
    // The superuser may write anywhere, so the check needs another way to be locked out.
    if std::fs::write(out.join("probe"), "x").is_ok() {
        std::fs::remove_file(out.join("probe")).unwrap();
        let Some(mount) = Mount::new(&out, &["--bind"], &["-o", "remount,bind,ro"]) else { return };
        refused(&photos, &out, "Read-only file system");
        drop(mount);
    } else {
        refused(&photos, &out, "ermission");
    }
    std::fs::set_permissions(&out, std::fs::Permissions::from_mode(0o755)).unwrap();
    assert!(contents(&out) == before, "a failed save changed files");
}

/// Exports into `out` and goes on training there; both must fail and name the reason.
fn refused(photos: &Path, out: &Path, reason: &str) {
    let scene = out.to_str().unwrap();
    let target = out.join("new.ply");
    let done = fmlgs(&["export", scene, "--out", target.to_str().unwrap()]).fails_with(1);
    assert!(done.stderr.contains("new.ply") && done.stderr.contains(reason), "{}", done.stderr);
    assert!(!target.exists());
    let done = fmlgs(&[&["train", photos.to_str().unwrap(), "--out", scene][..], &["--steps", "21"]].concat());
    assert_eq!(done.code, Some(1), "{}", done.stderr);
}

#[test]
fn a_full_disk_is_named_and_the_checkpoint_survives() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let small = folder.path().join("small");
    std::fs::create_dir(&small).unwrap();
    let Some(_mount) = Mount::new(&small, &["-t", "tmpfs", "-o", "size=8m", "tmpfs"], &[]) else { return };
    let out = small.join("scene");
    let checkpoint = out.join("checkpoint.bin");
    let arguments = train_arguments(photos.to_str().unwrap(), out.to_str().unwrap(), "1000000");

    let mut child = start(&arguments);
    wait_for_checkpoints(&mut child, &checkpoint, 2);
    let filler = small.join("filler");
    fill(&filler);
    let done: Done = child.wait_with_output().unwrap().into();
    let done = done.fails_with(1);
    let named = done.stderr.contains("checkpoint.bin") && done.stderr.contains("the disk is full");
    assert!(named && !done.stderr.contains("panicked"), "{}", done.stderr);
    let names: Vec<String> = contents(&out).into_iter().map(|(name, _)| name).collect();
    assert!(names.iter().all(|n| !n.ends_with(".tmp")), "left behind: {names:?}");

    // With space again the run goes on from the checkpoint that was there before.
    std::fs::remove_file(&filler).unwrap();
    let mut child = start(&arguments);
    wait_for_checkpoints(&mut child, &checkpoint, 2);
    send(&child, "-KILL");
    let done: Done = child.wait_with_output().unwrap().into();
    assert!(done.stderr.contains("Continuing at step"), "{}", done.stderr);
}

/// Writes to `path` until not one byte more fits.
fn fill(path: &Path) {
    let mut file = std::fs::File::create(path).unwrap();
    let mut block = 1 << 20;
    while block > 0 {
        if std::io::Write::write_all(&mut file, &vec![1; block]).is_err() {
            block /= 2;
        }
    }
}

/// A mount that is taken away at the end; only the superuser may make one.
struct Mount<'a>(&'a Path);

impl<'a> Mount<'a> {
    /// Mounts on `target`, then changes the mount as `then` says; `None`, and a line that says so, where
    /// that is not allowed.
    fn new(target: &'a Path, arguments: &[&str], then: &[&str]) -> Option<Self> {
        let mount = |arguments: &[&str], source: Option<&Path>| {
            let mut command = Command::new("mount");
            command.args(arguments).args(source).arg(target).stderr(Stdio::null());
            command.status().is_ok_and(|s| s.success())
        };
        let source = arguments.contains(&"--bind").then_some(target);
        if !mount(arguments, source) {
            println!("skipped: mounting is not allowed here");
            return None;
        }
        let mounted = Self(target);
        if !then.is_empty() && !mount(then, None) {
            println!("skipped: remounting is not allowed here");
            return None;
        }
        Some(mounted)
    }
}

impl Drop for Mount<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0).status();
    }
}
