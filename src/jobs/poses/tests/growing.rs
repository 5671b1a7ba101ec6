//! Snapshots of poses while they are sought.

use std::time::Duration;

use super::*;
use crate::jobs::poses::snapshots::Snapshots;
use crate::pipeline::observer::FoundSoFar;

/// Help text of a mapper that writes snapshots.
const HELP: &str = "  --Mapper.snapshot_path arg  --Mapper.snapshot_frames_freq arg (=0)";
/// Shell code that copies a snapshot into the folder SNAPSHOT, all of it but its last file.
const COPY: &str = "mkdir -p SNAPSHOT; cp HERE/of/program/cameras.bin HERE/of/program/images.bin SNAPSHOT\n";
/// Shell code that completes it and waits until somebody has seen it.
const COMPLETE: &str = "cp HERE/points.bin SNAPSHOT/points3D.bin\n\
                        for i in $(seq 200); do test -e HERE/seen && break; sleep 0.1; done\n";
/// Shell code that leaves it half written for a while.
const HALF: &str = "head -c 60 HERE/points.bin > SNAPSHOT/points3D.bin; sleep 1.6\n";

/// Keeps what was found, and notes in a file that it has seen something.
struct Watcher {
    found: Vec<FoundSoFar>,
    seen: PathBuf,
    cancels: bool,
}

impl Watcher {
    fn of(fake: &Fake) -> Self {
        Self { found: Vec::new(), seen: fake.guard.path().join("seen"), cancels: false }
    }
}

impl Observer for Watcher {
    fn signal(&self) -> Signal {
        if self.cancels && !self.found.is_empty() { Signal::Cancel } else { Signal::Continue }
    }
    fn wants_poses(&self) -> bool {
        true
    }
    fn poses(&mut self, found: FoundSoFar) {
        self.found.push(found);
        fs::write(&self.seen, "").expect("written");
    }
}

/// Two points as COLMAP writes them.
fn points() -> Vec<u8> {
    let mut bytes = 2_u64.to_le_bytes().to_vec();
    for i in 0..2_u8 {
        bytes.extend(u64::from(i).to_le_bytes());
        bytes.extend([f64::from(i), 0.5, 2.0].iter().flat_map(|v: &f64| v.to_le_bytes()));
        bytes.extend([200, 100, i]);
        bytes.extend(0.4_f64.to_le_bytes());
        bytes.extend(0_u64.to_le_bytes());
    }
    bytes
}

/// A COLMAP whose mapper has this help text, and does this first if it is asked for snapshots.
fn colmap(help: &str, first: &str) -> Fake {
    let fake = Fake::new("true");
    let (here, program) = (fake.guard.path(), fake.guard.path().join("colmap"));
    let script = fs::read_to_string(&program).expect("read");
    let first = first.replace("SNAPSHOT", "\"$9\"/0001").replace("HERE", &here.display().to_string());
    let mapper =
        format!("  [ \"$2\" = \"-h\" ] && {{ echo '{help}'; exit 0; }}\n  if [ $# -gt 8 ]; then\n  true\n{first}fi\n");
    let new = script.replace("  [ \"$2\" = \"-h\" ] && exit 0\n", &mapper);
    assert_ne!(new, script);
    fs::write(here.join("points.bin"), points()).and_then(|()| fs::write(&program, new)).expect("written");
    fake
}

#[test]
fn cameras_and_points_are_passed_on_while_colmap_maps() {
    let fake = colmap(HELP, &[COPY, COMPLETE].concat());
    let mut watcher = Watcher::of(&fake);
    let out = fake.find(&mut watcher).expect("found");
    let asked = fake.asked();
    for option in ["--Mapper.snapshot_path", "--Mapper.snapshot_frames_freq 1"] {
        assert!(asked.contains(option), "'{option}' is missing in {asked}");
    }
    let [found] = &watcher.found[..] else { panic!("{} snapshots, not one", watcher.found.len()) };
    assert_eq!((found.cameras.len(), found.photos, found.cloud.as_ref().map(|c| c.len())), (3, 3, Some(2)));
    assert!(!out.join(SNAPSHOTS).exists() && out.join("sparse/0").is_dir());
    // Control: one that is half written is no error, and nobody hears of it.
    let fake = colmap(HELP, &[COPY, HALF].concat());
    let mut watcher = Watcher::of(&fake);
    let out = fake.find(&mut watcher).expect("found");
    assert!(fake.asked().contains("--Mapper.snapshot_path"));
    assert!(watcher.found.is_empty() && !out.join(SNAPSHOTS).exists());
}

#[test]
fn a_colmap_without_snapshots_is_asked_for_none_and_nobody_asks_for_nobody() {
    for help in ["  --Mapper.fix_existing_images arg (=0)", "  --Mapper.snapshot_path arg"] {
        let fake = colmap(help, "");
        fake.find(&mut Watcher::of(&fake)).expect("found");
        assert!(fake.asked().contains("mapper -h") && !fake.asked().contains("snapshot"), "{}", fake.asked());
    }
    let fake = colmap(HELP, "");
    fake.find(&mut Silent).expect("found");
    assert!(!fake.asked().contains("snapshot"), "{}", fake.asked());
}

#[test]
fn snapshots_of_a_canceled_or_killed_search_are_removed() {
    let fake = colmap(HELP, &[COPY, COMPLETE, "exec sleep 600\n"].concat());
    let mut watcher = Watcher { cancels: true, ..Watcher::of(&fake) };
    let error = fake.find(&mut watcher).expect_err("canceled");
    assert!(error.is_cancelled() && watcher.found.len() == 1, "{error}");
    let snapshots = usual_out(&fake.photos, &Folders { data: fake.guard.path().join("data") }).join(SNAPSHOTS);
    assert!(!snapshots.exists());
    // What a killed search left is gone after the next one, even if that writes none.
    fs::create_dir_all(snapshots.join("0001")).expect("created");
    fake.find(&mut Silent).expect("found");
    assert!(!snapshots.exists());
}

#[test]
fn pycolmap_is_told_where_its_snapshots_go() {
    let fake = Fake::new("true");
    let here = fake.guard.path();
    let script = "#!/bin/sh\n[ \"$1\" = -c ] && { echo 'pycolmap 4.2.1'; exit 0; }\n\
                  [ \"$4\" = mapping ] || { echo x > \"$5/database.db\"; exit 0; }\n\
                  echo \"${12} photos apart\" > HERE/asked\n";
    let result = "mkdir -p \"$6/0\"; cp HERE/of/program/* \"$6/0\"\n";
    let snapshot = [COPY, COMPLETE].concat().replace("SNAPSHOT", "\"${11}\"/0001");
    let text = [script, &snapshot, result].concat().replace("HERE", &here.display().to_string());
    let python = here.join("path/python3");
    fs::create_dir(here.join("path")).and_then(|()| fs::write(&python, text)).expect("written");
    fs::set_permissions(&python, fs::Permissions::from_mode(0o755)).expect("executable");
    fs::write(here.join("points.bin"), points()).expect("written");
    let request = PoseRequest { photos: fake.photos.clone(), ..PoseRequest::default() };
    let places = MakerPlaces { path: here.join("path").into(), ..MakerPlaces::default() };
    let mut watcher = Watcher::of(&fake);
    let found = find_in(&request, &places, &Folders { data: here.join("data") }, &mut watcher).expect("found");
    assert!(found.maker.contains("pycolmap") && fake.asked().contains("1 photos apart"), "{}", found.maker);
    assert!(watcher.found.iter().map(|found| found.cameras.len()).eq([3]));
    assert!(!found.out.join(SNAPSHOTS).exists());
}

#[test]
fn the_newest_complete_snapshot_is_read_and_older_ones_are_removed() {
    let fake = Fake::new("true");
    let here = fake.guard.path();
    let (folder, model) = (here.join("out").join(SNAPSHOTS), here.join("of/program"));
    let images = here.join("out/images");
    fs::create_dir_all(&images).expect("created");
    for name in &fake.photos.photos {
        fs::copy(fake.photos.images.join(name), images.join(name)).expect("copied");
    }
    let write = |snapshot: &str, last: &[u8]| {
        let at = folder.join(snapshot);
        fs::create_dir_all(&at).expect("created");
        for name in ["cameras.bin", "images.bin"] {
            fs::copy(model.join(name), at.join(name)).expect("copied");
        }
        fs::write(at.join("points3D.bin"), last).expect("written");
        // Times of files may be coarse.
        std::thread::sleep(Duration::from_millis(50));
    };
    // Names of times that have overflowed are in no order.
    write("0000000900", &points());
    write("-000000300", &points());
    write("0000000500", &points()[..60]);
    let (mut snapshots, mut watcher) = (Snapshots::new(folder.clone(), 5), Watcher::of(&fake));
    snapshots.look(&mut watcher);
    let [found] = &watcher.found[..] else { panic!("{} snapshots, not one", watcher.found.len()) };
    assert_eq!((found.cameras.len(), found.photos), (3, 5));
    let is_there = |snapshot: &str| folder.join(snapshot).is_dir();
    assert_eq!(["0000000900", "-000000300", "0000000500"].map(is_there), [false, true, true]);
    // It looks seldom; once it does, the half-written one has become complete.
    fs::write(folder.join("0000000500/points3D.bin"), points()).expect("written");
    snapshots.look(&mut watcher);
    assert_eq!(watcher.found.len(), 1, "too early");
    let mut look_until = |done: &dyn Fn(usize) -> bool| {
        for _ in 0..200 {
            std::thread::sleep(Duration::from_millis(100));
            snapshots.look(&mut watcher);
            if done(watcher.found.len()) {
                return true;
            }
        }
        false
    };
    assert!(look_until(&|found| found == 2));
    // Two seconds are time enough to look again.
    let start = std::time::Instant::now();
    assert!(look_until(&|_| start.elapsed() > Duration::from_secs(2)));
    assert_eq!(watcher.found.len(), 2, "each is passed on once");
    assert!(!is_there("-000000300"));
}
