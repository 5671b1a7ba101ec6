//! A disk that is full, a folder that cannot be written to, and standard error without a reader.

use super::*;

#[test]
fn a_read_only_folder_is_named_and_left_alone() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let out = folder.path().join("scene");
    fmlgs(&train_arguments(photos.to_str().unwrap(), out.to_str().unwrap(), "20")).ok();
    let before = files_in(&out);
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
    assert!(files_in(&out) == before, "a failed save changed files");
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
fn a_full_disk_is_named_and_ends_nothing() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let small = folder.path().join("small");
    std::fs::create_dir(&small).unwrap();
    let Some(_mount) = Mount::new(&small, &["-t", "tmpfs", "-o", "size=8m", "tmpfs"], &[]) else { return };
    let out = small.join("scene");
    let checkpoint = out.join("checkpoint.bin");
    let arguments = train_arguments(photos.to_str().unwrap(), out.to_str().unwrap(), "1000000");
    let mut child = start(&arguments);
    let told = lines_of(&mut child);
    wait_for_checkpoints(&mut child, &checkpoint, 2);
    let filler = small.join("filler");
    fill(&filler);
    let line = wait_for_line(&told, "Checkpoint not saved, training continues");
    assert!(line.contains("checkpoint.bin") && line.contains("the disk is full"), "{line}");
    // The checkpoint before is whole, and with space again there are new ones.
    let before = std::fs::read(&checkpoint).unwrap();
    assert!(child.try_wait().unwrap().is_none(), "the training ended");
    std::fs::remove_file(&filler).unwrap();
    wait_for_line(&told, "Checkpoints are saved again");
    assert!(std::fs::read(&checkpoint).unwrap() != before, "no new checkpoint");
    send(&child, "-KILL");
    child.wait().unwrap();

    // A run that ends on a full disk says so; the one after it goes on.
    let mut child = start(&arguments);
    let told = lines_of(&mut child);
    wait_for_line(&told, "Continuing at step");
    wait_for_checkpoints(&mut child, &checkpoint, 2);
    fill(&filler);
    wait_for_line(&told, "Checkpoint not saved");
    send(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(1));
    let error = wait_for_line(&told, "error: ");
    assert!(error.contains("the disk is full"), "{error}");
    let names: Vec<String> = files_in(&out).into_keys().map(|name| name.display().to_string()).collect();
    assert!(names.iter().all(|n| !n.starts_with('.')), "left behind: {names:?}");
    std::fs::remove_file(&filler).unwrap();
    let mut child = start(&arguments);
    wait_for_line(&lines_of(&mut child), "Continuing at step");
    send(&child, "-KILL");
    child.wait().unwrap();
}

/// A closed pipe, a full disk behind standard error, a lost terminal: the training ends well.
#[test]
fn what_cannot_be_told_ends_nothing() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let photos = photos.to_str().unwrap();
    for (name, told) in [("full", "2>/dev/full"), ("closed", "2>&1 >/dev/null | head -n 1"), ("none", "2>&-")] {
        let out = folder.path().join(name);
        let arguments = train_arguments(photos, out.to_str().unwrap(), "60").join(" ");
        let line = format!("{} {arguments} {told}", env!("CARGO_BIN_EXE_fmlgs"));
        // Standard output as JSON goes where it can be read only without the pipe.
        Command::new("sh").args(["-c", &line]).stdin(Stdio::null()).stdout(Stdio::null()).status().unwrap();
        assert_eq!(fmlgs(&["info", out.to_str().unwrap(), "--json"]).ok().json()["kind"], "trained", "{told}");
    }
    // A lost terminal saves as SIGTERM does; a program that was told to outlive it does.
    let out = folder.path().join("hung up");
    let arguments = train_arguments(photos, out.to_str().unwrap(), "1000000");
    // Whoever runs the tests may have been told to outlive its terminal; this child has not.
    let mut hears = Command::new("env");
    hears.arg("--default-signal=HUP").arg(env!("CARGO_BIN_EXE_fmlgs")).args(&arguments).env_remove("DISPLAY");
    let mut child = hears.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 2);
    send(&child, "-HUP");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(fmlgs(&["info", out.to_str().unwrap(), "--json"]).ok().json()["kind"], "trained");
    let mut nohup = Command::new("nohup");
    let mut child = nohup.arg(env!("CARGO_BIN_EXE_fmlgs")).args(&arguments).env_remove("DISPLAY");
    child = child.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = child.spawn().unwrap();
    wait_for_line(&lines_of(&mut child), "Continuing at step");
    send(&child, "-HUP");
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 3);
    send(&child, "-KILL");
    child.wait().unwrap();
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
