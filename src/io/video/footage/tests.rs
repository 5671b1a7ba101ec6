//! Videos of the program's own encoder read back, and files that are none.

use std::ffi::OsString;
use std::fs;

use super::*;
use crate::io::video::{VideoSettings, VideoWriter};

const SIZE: (u32, u32) = (64, 48);

/// A video of this many frames; each is one color with a brighter top left quarter.
fn video(path: &Path, frames: u8) {
    let settings = VideoSettings::new(SIZE.0, SIZE.1, 30.0);
    let mut writer = VideoWriter::create(path, &settings).expect("created");
    for i in 0..frames {
        let pixel = |x: u32, y: u32| if x < SIZE.0 / 2 && y < SIZE.1 / 2 { [220; 3] } else { [40 + 8 * i; 3] };
        let rgb: Vec<u8> = (0..SIZE.1).flat_map(|y| (0..SIZE.0).flat_map(move |x| pixel(x, y))).collect();
        writer.push(&rgb).expect("pushed");
    }
    writer.finish().expect("finished");
}

fn pictures(path: &Path) -> Result<Vec<RgbImage>, FootageError> {
    let footage = Footage::open(path, &OsString::new())?;
    let mut all = Vec::new();
    footage.visit(&mut |i, frame: &VideoFrame<'_>| -> Result<(), FootageError> {
        assert_eq!(i, all.len());
        all.push(frame.picture().expect("a picture"));
        Ok(())
    })?;
    Ok(all)
}

/// Replaces the last occurrence of some bytes.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).rposition(|w| w == from).expect("it is there");
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

#[test]
fn frames_come_back_in_order_and_in_their_colors() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.mp4");
    video(&path, 9);
    let all = pictures(&path).expect("read");
    assert_eq!(all.len(), 9);
    for (i, picture) in all.iter().enumerate() {
        let (bright, dark) = (picture.get_pixel(8, 8).0[1], picture.get_pixel(56, 40).0[1]);
        assert!(bright.abs_diff(220) < 8 && dark.abs_diff(40 + 8 * i as u8) < 8, "{i}: {bright} {dark}");
    }
    assert_eq!(Footage::open(&path, &OsString::new()).map(|f| f.frames()).ok(), Some(Some(9)));
}

#[test]
fn the_picture_is_turned_as_the_file_says() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.mp4");
    video(&path, 2);
    let bytes = fs::read(&path).expect("read");
    let matrix = |m: [i32; 9]| m.iter().flat_map(|v| v.to_be_bytes()).collect::<Vec<u8>>();
    const ONE: i32 = 1 << 16;
    let plain = matrix([ONE, 0, 0, 0, ONE, 0, 0, 0, 1 << 30]);
    // The track's matrix is the second one, after that of the whole file.
    let at = bytes.windows(plain.len()).rposition(|w| w == plain).expect("a matrix");
    for (turn, corner) in [
        ([0, ONE, 0, -ONE, 0, 0, 0, 0, 1 << 30], (1, 0)),
        ([-ONE, 0, 0, 0, -ONE, 0, 0, 0, 1 << 30], (1, 1)),
        ([0, -ONE, 0, ONE, 0, 0, 0, 0, 1 << 30], (0, 1)),
        ([ONE, 0, 0, 0, ONE, 0, 0, 0, 1 << 30], (0, 0)),
    ] {
        let turned = [&bytes[..at], &matrix(turn), &bytes[at + plain.len()..]].concat();
        let path = folder.path().join("turned.mp4");
        fs::write(&path, turned).expect("written");
        let picture = pictures(&path).expect("read").remove(0);
        let (w, h) = picture.dimensions();
        assert_eq!((w > h), turn[0] != 0, "{turn:?}");
        let bright = picture.get_pixel(8 + corner.0 * (w - 16), 8 + corner.1 * (h - 16)).0[1];
        assert!(bright > 180, "{turn:?}: {bright}");
    }
}

#[test]
fn what_is_no_video_is_told_with_the_reason() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.mp4");
    video(&path, 5);
    let whole = fs::read(&path).expect("read");
    let told = |bytes: &[u8], name: &str| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        pictures(&path).err().map(|e| e.to_string()).unwrap_or_default()
    };
    for (bytes, part) in [
        (&b""[..], "it is empty"),
        (&b"not a video at all, but some text"[..], "does not begin like an MP4"),
        (&whole[..whole.len() / 2], "cut off"),
        (&replaced(&whole, b"vide", b"soun")[..], "no picture, only sound"),
        (&replaced(&whole, b"moov", b"free")[..], "no index"),
    ] {
        let text = told(bytes, "b.mp4");
        assert!(text.contains(part) && text.contains("b.mp4"), "'{part}' is missing in {text}");
    }
    let hevc = told(&replaced(&whole, b"avc1", b"hvc9"), "phone.mov");
    assert!(hevc.contains("no 'ffmpeg' on the PATH") && hevc.contains("ffmpeg -i '"), "{hevc}");
    assert!(told(&whole, "c.mkv").contains(".mkv"), "other endings need the program");
    assert_eq!(told(&whole, "whole.mp4"), "", "the control");
    // The index is at one end of the file, the frames at the other; no length of the file crashes.
    for cut in (0..whole.len()).step_by(7) {
        assert_ne!(told(&whole[..cut], "cut.mp4"), "", "{cut} of {} bytes", whole.len());
    }
}

#[test]
fn tiny_frames_are_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.mp4");
    let settings = VideoSettings::new(16, 16, 30.0);
    let mut writer = VideoWriter::create(&path, &settings).expect("created");
    writer.push(&[9; 16 * 16 * 3]).expect("pushed");
    writer.finish().expect("finished");
    let text = pictures(&path).expect_err("too small").to_string();
    assert!(text.contains("16 x 16 px, too small"), "{text}");
}

#[cfg(unix)]
#[test]
fn other_videos_go_through_ffmpeg() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("folder");
    let program = folder.path().join("ffmpeg");
    let path = folder.path().join("a.mkv");
    fs::write(&path, "stands for a video").expect("written");
    let behaves = |script: &str| {
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("written");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("executable");
        let mut all = Vec::new();
        let footage = Footage::open(&path, folder.path().as_os_str()).expect("the program is there");
        let read = footage.visit(&mut |_, frame: &VideoFrame<'_>| -> Result<(), FootageError> {
            all.push((frame.picture().expect("a picture").dimensions(), frame.luma().0[0]));
            Ok(())
        });
        read.map(|()| all).map_err(|e| e.to_string())
    };
    let frame = "printf 'P6\\n40 32\\n255\\n'; head -c 3840 /dev/zero | tr '\\0' 'd'";
    assert_eq!(behaves(&format!("{frame}\n{frame}")), Ok(vec![((40, 32), 100.0); 2]));
    let told = behaves("echo 'moov atom not found' >&2; exit 1").expect_err("it fails");
    assert!(told.contains("moov atom not found") && told.contains("exit status: 1"), "{told}");
    assert!(behaves("exit 0").expect_err("nothing").contains("has no frames"));
    assert!(behaves("printf 'P6\\n999999999 2\\n255\\n'").expect_err("absurd").contains("has no frames"));
}
