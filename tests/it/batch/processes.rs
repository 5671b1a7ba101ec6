//! One process at a time works on a unit; signals stop it; the script of an array.

use super::*;

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
    let checkpoint = || std::fs::read(unit.join("scene-2/checkpoint.bin")).unwrap();
    let before = checkpoint();
    wait_for("the heir goes on", || checkpoint() != before);
    kill(&heir, "TERM");
    Done::from(heir.wait_with_output().unwrap()).fails_with(STOPPED);
    assert!(unit.join("scene-2/scene.json").exists());
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
        // Asked for the number of the array, it lists all of its tasks.
        ("squeue", "[ \"$3\" = 77_1 ] || echo PENDING; echo \"$STATE\""),
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
