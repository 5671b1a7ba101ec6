//! Refused videos: errors name the reason, and nothing is left behind.

use std::fs;
use std::path::Path;

use super::{FRAMES, SIZE, decode, entries, film, picture, settings};
use crate::io::IoError;
use crate::io::video::{Format, VideoEncoder, VideoFileError, VideoSettings, VideoWriter};

fn refused(path: &Path, settings: &VideoSettings) -> String {
    VideoWriter::create(path, settings).err().expect("refused").to_string()
}

#[test]
fn formats_are_chosen_by_ending() {
    for (path, format) in [
        ("a.mp4", Format::Mp4),
        ("A.MP4", Format::Mp4),
        ("x/y.z.gif", Format::Gif),
        ("a.WebP", Format::WebP),
        ("frames", Format::Frames),
        ("x.y/frames.v2/", Format::Frames),
    ] {
        assert_eq!(Format::of(path.as_ref()).expect(path), format, "{path}");
    }
    for path in ["a.avi", "a.png", "a.", "", "..", "/"] {
        let text = Format::of(path.as_ref()).expect_err(path).to_string();
        for known in [".mp4", ".gif", ".webp", "folder", "ffmpeg"] {
            assert!(text.contains(known), "{path}: {text}");
        }
    }
}

#[test]
fn settings_that_a_format_cannot_hold_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let cases = [
        ("a.mp4", VideoSettings::new(0, 10, 30.0), "0 x 10 px"),
        ("a.mp4", VideoSettings::new(20_000, 10, 30.0), "20000 x 10 px"),
        ("a.mp4", VideoSettings::new(64, 15, 30.0), "64 x 15 px"),
        ("a.mp4", VideoSettings::new(4000, 2000, 30.0), "3840 x 2160 px"),
        ("a.mp4", VideoSettings::new(3000, 3000, 30.0), "3840 x 2160 px"),
        ("a.webp", VideoSettings::new(16_384, 10, 30.0), "16383 px"),
        ("a.gif", VideoSettings::new(64, 64, 60.0), "60 frames per second"),
        ("a.mp4", VideoSettings::new(64, 64, f64::NAN), "NaN frames per second"),
        ("a.mp4", VideoSettings::new(64, 64, -1.0), "-1 frames per second"),
        ("a.mp4", VideoSettings::new(64, 64, 1e9), "1000000000 frames per second"),
        ("a.mp4", VideoSettings { quality: 101, ..settings() }, "quality 101"),
        ("a.avi", settings(), "a.avi"),
        ("no/a.mp4", settings(), "does not exist"),
        ("no/a.gif", settings(), "does not exist"),
        ("no/a.webp", settings(), "does not exist"),
        ("no/frames", settings(), "does not exist"),
    ];
    for (name, settings, named) in cases {
        let text = refused(&folder.path().join(name), &settings);
        assert!(text.contains(named) && text.contains(name), "{name}, {named}: {text}");
    }
    assert_eq!(entries(folder.path()), [""; 0]);
}

#[test]
fn what_exists_is_not_overwritten_unasked() {
    let folder = tempfile::tempdir().expect("folder");
    for name in ["a.mp4", "a.gif", "a.webp"] {
        let path = folder.path().join(name);
        fs::write(&path, "mine").expect("write");
        let text = refused(&path, &settings());
        assert!(text.contains(name) && text.contains("exists"), "{text}");
        assert_eq!(fs::read(&path).expect("read"), b"mine");
        film(&path, &VideoSettings { overwrite: true, ..settings() });
        assert!(fs::metadata(&path).expect("film").len() > 100);
    }
    fs::create_dir(folder.path().join("b.mp4")).expect("create");
    let text = refused(&folder.path().join("b.mp4/"), &VideoSettings { width_px: 0, ..settings() });
    assert!(text.contains("0 x 68"), "{text}");
}

#[test]
fn a_folder_of_frames_keeps_other_files() {
    let folder = tempfile::tempdir().expect("folder");
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).expect("create");
    fs::write(frames.join("notes.txt"), "mine").expect("write");
    fs::write(frames.join("frame_1.png"), "not numbered like ours").expect("write");
    film(&frames, &settings());
    assert_eq!(entries(&frames).len() as u64, FRAMES + 2);
    let text = refused(&frames, &settings());
    assert!(text.contains("frame_00000.png") && text.contains("exists"), "{text}");

    // A shorter video replaces a longer one entirely.
    let mut writer = VideoWriter::create(&frames, &VideoSettings { overwrite: true, ..settings() }).expect("create");
    writer.push(&picture(3, SIZE)).expect("push");
    writer.push(&picture(4, SIZE)).expect("push");
    let summary = writer.finish().expect("finish");
    assert_eq!((summary.frames, summary.size_px), (2, SIZE));
    assert_eq!(entries(&frames), ["frame_00000.png", "frame_00001.png", "frame_1.png", "notes.txt"]);
    let first = image::open(frames.join("frame_00000.png")).expect("open").into_rgb8();
    assert_eq!(first.into_raw(), picture(3, SIZE));

    // Frames that another program writes meanwhile are not lost.
    let other = folder.path().join("other");
    fs::create_dir(&other).expect("create");
    let mut writer = VideoWriter::create(&other, &settings()).expect("create");
    writer.push(&picture(0, SIZE)).expect("push");
    fs::write(other.join("frame_00000.png"), "mine").expect("write");
    assert!(matches!(writer.finish(), Err(VideoFileError::Exists { .. })));
    assert_eq!(entries(&other), ["frame_00000.png"]);
}

#[test]
fn wrong_frames_and_no_frames_are_refused() {
    let folder = tempfile::tempdir().expect("folder");
    for name in ["a.mp4", "a.gif", "a.webp", "frames"] {
        let path = folder.path().join(name);
        let mut writer = VideoWriter::create(&path, &settings()).expect("create");
        let short = writer.push(&[0; 7]).expect_err("short").to_string();
        assert!(short.contains("frame 0 has 7 bytes instead of 20400"), "{short}");
        let e = writer.finish().expect_err("no frames");
        assert!(matches!(e, VideoFileError::NoFrames { .. }) && e.to_string().contains(name), "{e}");
    }
    assert_eq!(entries(folder.path()), [""; 0]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named() {
    use std::io::Write;

    use crate::io::error::write_error;
    let mut full = fs::OpenOptions::new().write(true).open("/dev/full").expect("open");
    let cause = full.write_all(b"x").expect_err("full");
    let e = VideoFileError::from(write_error("a.mp4".as_ref(), cause)).to_string();
    assert!(e.contains("a.mp4") && e.contains("free some space"), "{e}");
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_to_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("folder");
    fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o555)).expect("permissions");
    for name in ["a.mp4", "a.gif", "a.webp", "frames"] {
        match VideoWriter::create(&folder.path().join(name), &settings()) {
            Err(VideoFileError::Io(e @ IoError::Write { .. })) => {
                let text = e.to_string();
                assert!(text.contains(name) && text.contains("choose another folder"), "{text}");
            }
            Err(e) => panic!("{e}"),
            // The superuser may write anywhere.
            Ok(_) => {}
        }
    }
    fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).expect("permissions");
    assert_eq!(entries(folder.path()), [""; 0]);
}

fn with_program(program: &Path, args: &[&str]) -> VideoSettings {
    let args = args.iter().map(|a| (*a).to_owned()).collect();
    VideoSettings { encoder: VideoEncoder::Ffmpeg { program: program.into(), args }, ..settings() }
}

#[test]
fn a_missing_program_is_named() {
    let folder = tempfile::tempdir().expect("folder");
    let text = refused(&folder.path().join("a.mp4"), &with_program("no-such-ffmpeg".as_ref(), &[]));
    assert!(text.contains("'no-such-ffmpeg'") && text.contains("install ffmpeg"), "{text}");
    assert_eq!(entries(folder.path()), [""; 0]);
}

/// Writes a shell script in ffmpeg's place; its last argument is `file:` and the output.
#[cfg(unix)]
fn script(folder: &Path, body: &str) -> std::path::PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join("program");
    fs::write(&path, format!("#!/bin/sh\nfor out; do :; done\nout=${{out#file:}}\n{body}\n")).expect("write");
    fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).expect("permissions");
    path
}

#[cfg(unix)]
#[test]
fn a_program_gets_every_frame_and_its_words_are_passed_on() {
    let folder = tempfile::tempdir().expect("folder");
    let films = folder.path().join("films");
    fs::create_dir(&films).expect("create");
    let path = films.join("a.raw");

    let copies = script(folder.path(), "echo \"$@\" >\"$0.args\"; cat >\"$out\"");
    let summary = film(&path, &with_program(&copies, &["-qscale", "2"]));
    assert_eq!((summary.format, summary.bytes), (None, FRAMES * 20_400));
    let raw = fs::read(&path).expect("read");
    assert!(raw.chunks(20_400).enumerate().all(|(t, frame)| frame == picture(t as u64, SIZE)));
    let args = fs::read_to_string(folder.path().join("program.args")).expect("arguments");
    let order = ["-f rawvideo", "-pixel_format rgb24", "-video_size 100x68", "-framerate 12.5 -i", "-qscale 2 file:"];
    let places: Vec<_> = order.iter().map(|a| args.find(a).unwrap_or_else(|| panic!("{a} in {args}"))).collect();
    assert!(places.is_sorted(), "{args}");
    assert!(refused(&path, &with_program(&copies, &[])).contains("exists"));

    // The script writes long errors and exits while frames are sent.
    let fails =
        script(folder.path(), "for i in $(seq 50); do echo \"line $i\" >&2; done; head -c 100 >/dev/null; exit 3");
    let failure = |path: &Path, settings: &VideoSettings| {
        let mut writer = VideoWriter::create(path, settings).expect("create");
        for t in 0..FRAMES {
            if let Err(e) = writer.push(&picture(t, SIZE)) {
                assert!(matches!(writer.push(&picture(t, SIZE)), Err(VideoFileError::Broken { .. })));
                assert!(matches!(writer.finish(), Err(VideoFileError::Broken { .. })));
                return e.to_string();
            }
        }
        writer.finish().expect_err("fails").to_string()
    };
    let text = failure(&films.join("b.mp4"), &with_program(&fails, &[]));
    assert!(text.contains("b.mp4") && text.contains("exit status: 3"), "{text}");
    assert!(text.contains("line 50") && text.contains("line 39") && !text.contains("line 38\n"), "{text}");

    // The script takes all input and fails at the end, or succeeds without a video.
    let late = script(folder.path(), "cat >/dev/null; echo 'disk is gone' >&2; exit 1");
    assert!(failure(&films.join("b.mp4"), &with_program(&late, &[])).contains("disk is gone"));
    let idle = script(folder.path(), "cat >/dev/null");
    assert!(failure(&films.join("b.mp4"), &with_program(&idle, &[])).contains("an empty file"));
    assert_eq!(entries(&films), ["a.raw"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_does_not_outlive_a_film_that_is_dropped() {
    let folder = tempfile::tempdir().expect("folder");
    let endless = script(folder.path(), "echo $$ >\"$0.pid\"; exec sleep 1000");
    let path = folder.path().join("a.mp4");
    let writer = VideoWriter::create(&path, &with_program(&endless, &[])).expect("create");
    let pid = folder.path().join("program.pid");
    let started = std::time::Instant::now();
    let id = loop {
        let text = fs::read_to_string(&pid).unwrap_or_default();
        if text.ends_with('\n') {
            break text.trim().to_owned();
        }
        assert!(started.elapsed().as_secs() < 60, "it started");
        std::thread::sleep(std::time::Duration::from_millis(5));
    };
    assert!(Path::new("/proc").join(&id).exists());
    drop(writer);
    // Neither running nor a zombie.
    assert!(!Path::new("/proc").join(&id).exists());
    assert_eq!(entries(folder.path()), ["program", "program.pid"]);
}

/// Writes a video with a real ffmpeg, if there is one.
#[test]
fn a_real_ffmpeg_writes_what_was_pushed() {
    let ffmpeg = Path::new("ffmpeg");
    if std::process::Command::new(ffmpeg).arg("-version").output().is_err() {
        println!("skipped: no ffmpeg on this machine");
        return;
    }
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("frames.gif");
    film(&path, &with_program(ffmpeg, &[]));
    let film = decode(&path, Format::Gif);
    assert_eq!((film.frames.len() as u64, film.size_px), (FRAMES, SIZE));
    assert_eq!(entries(folder.path()), ["frames.gif"]);
}
