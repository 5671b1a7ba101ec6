//! Photos from videos, and makers in Python that are faked.

use super::*;
use crate::io::video::{VideoSettings, VideoWriter};
use crate::jobs::poses::makers::installed;
use crate::jobs::poses::source::{folder_of, photos_of};

/// A video of stripes that move by a pixel each frame; every third frame is plain in its lower half, so less sharp.
fn video(path: &Path, frames: usize) {
    let (w, h) = (64, 48);
    let settings = VideoSettings::new(w, h, 30.0);
    let mut writer = VideoWriter::create(path, &settings).expect("created");
    for i in 0..frames {
        let value = |x: u32, y: u32| match (i % 3, y < h / 2) {
            (1, false) => 120,
            _ => 40 + 150 * u8::from((x + i as u32) / 5 % 2 == 0),
        };
        let rgb: Vec<u8> = (0..h).flat_map(|y| (0..w).flat_map(move |x| [value(x, y); 3])).collect();
        writer.push(&rgb).expect("pushed");
    }
    writer.finish().expect("finished");
}

fn listed(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).expect("read").map(|e| e.expect("entry").file_name().to_string_lossy().into()).collect();
    names.sort();
    names
}

/// Cancels after some reports of a stage.
struct CancelIn(&'static str, usize);

impl Observer for CancelIn {
    fn progress(&mut self, progress: Progress) {
        self.1 = self.1.saturating_sub(usize::from(progress.stage == self.0));
    }
    fn signal(&self) -> Signal {
        if self.1 == 0 { Signal::Cancel } else { Signal::Continue }
    }
}

#[test]
fn a_video_becomes_photos_once_and_never_among_other_files() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("walk.mp4");
    video(&path, 12);
    let photos = photos_of(&path, None, &mut Silent).expect("taken");
    assert_eq!((photos.images.as_path(), photos.video.as_deref()), (folder_of(&path).as_path(), Some(&*path)));
    assert_eq!(photos.photos.len(), 12, "a short video gives all that differ");
    let before = listed(&photos.images);
    let stamp = |name: &str| fs::metadata(photos.images.join(name)).and_then(|m| m.modified()).expect("a time");
    let at = stamp(&photos.photos[0]);
    assert_eq!(photos_of(&path, None, &mut Silent).expect("again"), photos);
    assert_eq!((listed(&photos.images), stamp(&photos.photos[0])), (before, at), "nothing was written again");
    let few = photos_of(&path, Some(4), &mut Silent).expect("fewer");
    assert_eq!(few.photos.len(), 4);
    assert!(few.photos.iter().all(|name| !["000001", "000004", "000007"].iter().any(|n| name.contains(n))), "{few:?}");
    assert_eq!(listed(folder.path()), ["walk-photos", "walk.mp4"], "nothing is left beside");
    // Something of somebody's own beside the photos stays: other photos would take its place.
    let mask = few.images.join("mask.png");
    fs::write(&mask, "mine").expect("written");
    let text = photos_of(&path, None, &mut Silent).expect_err("taken").to_string();
    assert!(text.contains("holds something else") && mask.is_file(), "{text}");
    fs::remove_file(mask).expect("removed");
    // Somebody's own folder of that name.
    fs::remove_file(few.images.join("video.json")).expect("removed");
    let text = photos_of(&path, Some(4), &mut Silent).expect_err("taken").to_string();
    assert!(text.contains("walk-photos") && text.contains("holds something else"), "{text}");
    assert_eq!(listed(&few.images).len(), 4);
}

#[test]
fn a_canceled_or_still_video_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("walk.mp4");
    video(&path, 12);
    for stage in ["Looking at the video", "Taking photos from the video"] {
        let error = photos_of(&path, None, &mut CancelIn(stage, 5)).expect_err("canceled");
        assert!(error.is_cancelled(), "{error}");
        assert_eq!(listed(folder.path()), ["walk.mp4"], "{stage}");
    }
    fs::write(&path, fs::read(&path).expect("read")).expect("written");
    let still = folder.path().join("still.mp4");
    let settings = VideoSettings::new(64, 48, 30.0);
    let mut writer = VideoWriter::create(&still, &settings).expect("created");
    (0..20).for_each(|_| writer.push(&[90; 64 * 48 * 3]).expect("pushed"));
    writer.finish().expect("finished");
    let text = photos_of(&still, None, &mut Silent).expect_err("still").to_string();
    assert!(text.contains("still.mp4") && text.contains("hardly moves"), "{text}");
    assert_eq!(listed(folder.path()), ["still.mp4", "walk.mp4"]);
}

#[test]
fn a_video_opens_as_photos_without_poses() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("walk.mp4");
    video(&path, 5);
    let Err(crate::io::OpenError::NoPoses(photos)) = io::open(&path) else { panic!("it has no poses") };
    assert_eq!((photos.video.as_deref(), photos.photos.len()), (Some(&*path), 0));
    assert!(photos.found().contains("walk.mp4: a video, no camera poses"));
    fs::write(&path, "no video").expect("written");
    let text = io::open(&path).expect_err("refused").to_string();
    assert!(text.contains("walk.mp4 is no video"), "{text}");
}

#[test]
fn pycolmap_is_found_in_the_active_python_first() {
    let folder = tempfile::tempdir().expect("folder");
    let python = |at: &str, version: &str| {
        let path = folder.path().join(at);
        fs::create_dir_all(path.parent().expect("a folder")).expect("created");
        fs::write(&path, format!("#!/bin/sh\necho '{version}'\n")).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("executable");
    };
    python("path/python3", "");
    let active = Some(folder.path().join("active"));
    let places =
        |python| MakerPlaces { path: folder.path().join("path").into(), python, own_python: folder.path().join("own") };
    let names = |places: &MakerPlaces| {
        let all = installed(places);
        let of_python = all.iter().filter(|maker| maker.kind() == MakerKind::Pycolmap);
        of_python.map(|maker| maker.name()).collect::<Vec<_>>()
    };
    assert!(names(&places(None)).is_empty(), "a Python without the package");
    python("own/bin/python3", "pycolmap 4.0.0");
    assert!(names(&places(None)).is_empty(), "an environment that is not complete");
    fs::write(folder.path().join("own/ready"), "").expect("written");
    assert_eq!(names(&places(None)), ["pycolmap 4.0.0"]);
    python("active/bin/python3", "pycolmap 4.2.1");
    assert_eq!(names(&places(active)), ["pycolmap 4.2.1"]);
    let text = choose(Some(MakerKind::Colmap), &places(None)).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(text.contains("colmap.github.io"), "{text}");
}

#[test]
fn an_environment_is_made_by_pip_and_made_anew_if_that_failed() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("path");
    fs::create_dir(&path).expect("created");
    let places = MakerPlaces { path: path.clone().into(), python: None, own_python: folder.path().join("cache/own") };
    assert!(matches!(environment::install(&places, &mut Silent), Err(JobError::NoPython)));
    // Makes an environment whose Python notes what it is asked, and fails while a file says so.
    let here = folder.path().display();
    let inner = format!(
        "#!/bin/sh\necho \"$@\" >> '{here}/asked'\ntest ! -e '{here}/offline' || {{ echo 'no network' >&2; exit 1; }}\n"
    );
    let script = format!(
        "#!/bin/sh\nmkdir -p \"$3/bin\"\ncat > \"$3/bin/python3\" <<'E'\n{inner}E\nchmod +x \"$3/bin/python3\"\n"
    );
    fs::write(path.join("python3"), script).expect("written");
    fs::set_permissions(path.join("python3"), fs::Permissions::from_mode(0o755)).expect("executable");
    fs::write(folder.path().join("offline"), "").expect("written");
    let text = environment::install(&places, &mut Silent).expect_err("offline").to_string();
    assert!(text.contains("no network"), "{text}");
    assert!(!places.own_python.join("ready").exists());
    fs::remove_file(folder.path().join("offline")).expect("removed");
    environment::install(&places, &mut Silent).expect("installed");
    environment::install(&places, &mut Silent).expect("nothing to do");
    let asked = fs::read_to_string(folder.path().join("asked")).expect("asked");
    assert_eq!(asked.matches("-m pip install").count(), 2, "{asked}");
}
