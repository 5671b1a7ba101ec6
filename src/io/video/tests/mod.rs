//! Videos written, then decoded independently of the writer.

mod decode;
mod refusals;

use std::path::Path;

use decode::{Decoded, decode};

use super::*;

/// Sides of the test video; no multiples of 16, so that encoders must crop.
const SIZE: (u32, u32) = (100, 68);
const FRAMES: u64 = 24;
const FPS: f64 = 12.5;

/// Frame `t` of a smooth pattern that moves far from frame to frame.
fn picture(t: u64, (width, height): (u32, u32)) -> Vec<u8> {
    let wave = |phase: f64| (127.5 + 100.0 * phase.sin()).round() as u8;
    let mut rgb = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (x, y, t) = (f64::from(x) * 0.05, f64::from(y) * 0.04, t as f64);
            rgb.extend([wave(x + 0.9 * t), wave(y - 0.7 * t), wave(x - y + 1.1 * t)]);
        }
    }
    rgb
}

/// Writes the test video and returns its summary.
fn film(path: &Path, settings: &VideoSettings) -> VideoSummary {
    let mut writer = VideoWriter::create(path, settings).expect("create");
    for t in 0..FRAMES {
        writer.push(&picture(t, (settings.width_px, settings.height_px))).expect("push");
    }
    assert_eq!(writer.frames, FRAMES);
    writer.finish().expect("finish")
}

fn settings() -> VideoSettings {
    VideoSettings::new(SIZE.0, SIZE.1, FPS)
}

/// Peak signal-to-noise ratio in dB of two pictures.
fn psnr(a: &[u8], b: &[u8]) -> f64 {
    assert_eq!(a.len(), b.len());
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    10.0 * (255.0_f64.powi(2) * a.len() as f64 / squares.max(1e-9)).log10()
}

/// Lowest PSNR of a frame, each compared with the one `shift` further on.
fn worst_psnr(film: &Decoded, shift: u64) -> f64 {
    let frames = film.frames.len() as u64;
    let of = |(t, frame): (usize, &Vec<u8>)| psnr(frame, &picture((t as u64 + shift) % frames, film.size_px));
    film.frames.iter().enumerate().map(of).fold(f64::INFINITY, f64::min)
}

fn entries(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).expect("list").map(|e| e.expect("entry").file_name());
    let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn every_format_decodes_to_what_was_pushed() {
    let folder = tempfile::tempdir().expect("folder");
    for (name, format, least_db) in [
        ("a.mp4", Format::Mp4, 34.0),
        ("a.gif", Format::Gif, 30.0),
        ("a.webp", Format::WebP, 34.0),
        ("frames", Format::Frames, 90.0),
    ] {
        let path = folder.path().join(name);
        let summary = film(&path, &settings());
        assert_eq!((summary.format, summary.frames), (Some(format), FRAMES), "{name}");
        assert_eq!((summary.size_px, summary.secs), (SIZE, FRAMES as f64 / FPS), "{name}");
        let film = decode(&path, format);
        assert_eq!((film.frames.len() as u64, film.size_px, film.bytes), (FRAMES, SIZE, summary.bytes), "{name}");
        if let Some(secs) = film.secs {
            assert!((secs - summary.secs).abs() < 1e-6, "{name}: {secs} s");
        }
        let (same, shuffled) = (worst_psnr(&film, 0), worst_psnr(&film, 1));
        println!("{name}: worst frame {same:.1} dB, next frame's {shuffled:.1} dB, {} bytes", summary.bytes);
        assert!(same >= least_db, "{name}: {same} dB");
        assert!(shuffled < 20.0, "{name}: frames in a wrong order score {shuffled} dB");
    }
    assert_eq!(entries(folder.path()), ["a.gif", "a.mp4", "a.webp", "frames"]);
}

#[test]
fn quality_is_size() {
    let folder = tempfile::tempdir().expect("folder");
    for name in ["a.mp4", "a.webp"] {
        let path = folder.path().join(name);
        let with = |quality| film(&path, &VideoSettings { quality, overwrite: true, ..settings() }).bytes;
        let sizes = [5, 50, 95].map(with);
        assert!(sizes[0] < sizes[1] && sizes[1] < sizes[2], "{name}: {sizes:?}");
    }
}

#[test]
fn webp_of_highest_quality_is_exact() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.webp");
    film(&path, &VideoSettings { quality: 100, ..settings() });
    assert!(worst_psnr(&decode(&path, Format::WebP), 0) > 90.0);
}

#[test]
fn an_odd_last_column_and_row_are_left_out_of_mp4_only() {
    let folder = tempfile::tempdir().expect("folder");
    let odd = VideoSettings::new(51, 35, 30.0);
    for (name, format, size) in [
        ("a.mp4", Format::Mp4, (50, 34)),
        ("a.gif", Format::Gif, (51, 35)),
        ("a.webp", Format::WebP, (51, 35)),
        ("frames", Format::Frames, (51, 35)),
    ] {
        let path = folder.path().join(name);
        let writer = VideoWriter::create(&path, &odd).expect("create");
        assert_eq!(writer.size_px, size, "{name}");
        drop(writer);
        assert_eq!(film(&path, &odd).size_px, size, "{name}");
        let film = decode(&path, format);
        assert_eq!(film.size_px, size, "{name}");
        // The pattern depends on the position only, so the cropped picture equals a smaller one.
        assert!(worst_psnr(&film, 0) > 28.0, "{name}: {}", worst_psnr(&film, 0));
    }
}

#[test]
fn smallest_and_thin_films_are_written() {
    let folder = tempfile::tempdir().expect("folder");
    for (name, format, size) in [
        ("a.mp4", Format::Mp4, (16, 16)),
        ("b.mp4", Format::Mp4, (17, 400)),
        ("a.gif", Format::Gif, (1, 1)),
        ("a.webp", Format::WebP, (1, 1)),
        ("frames", Format::Frames, (1, 7)),
    ] {
        let path = folder.path().join(name);
        let summary = film(&path, &VideoSettings::new(size.0, size.1, 30.0));
        let film = decode(&path, format);
        assert_eq!((film.frames.len() as u64, film.size_px), (FRAMES, summary.size_px), "{name}");
    }
}

#[test]
fn frames_that_repeat_keep_their_time() {
    let folder = tempfile::tempdir().expect("folder");
    let still = |t: u64| picture(if t < 10 { 3 } else { 8 }, SIZE);
    for (name, format) in [("a.mp4", Format::Mp4), ("a.gif", Format::Gif), ("a.webp", Format::WebP)] {
        let path = folder.path().join(name);
        let mut writer = VideoWriter::create(&path, &settings()).expect("create");
        (0..FRAMES).for_each(|t| writer.push(&still(t)).expect("push"));
        let summary = writer.finish().expect("finish");
        let film = decode(&path, format);
        assert!((film.secs.expect("times") - summary.secs).abs() < 1e-6, "{name}");
        if format == Format::WebP {
            assert_eq!(film.frames.len(), 2, "equal frames become one");
            assert!(psnr(&film.frames[0], &still(0)) > 30.0 && psnr(&film.frames[1], &still(10)) > 30.0);
        } else {
            assert_eq!(film.frames.len() as u64, FRAMES, "{name}");
            assert!((0..FRAMES).all(|t| psnr(&film.frames[t as usize], &still(t)) > 30.0), "{name}");
        }
    }
}

#[test]
fn times_of_gif_do_not_drift() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.gif");
    film(&path, &VideoSettings { fps: 30.0, ..settings() });
    let secs = decode(&path, Format::Gif).secs.expect("times");
    assert!((secs - 0.8).abs() < 0.0051, "{secs}");
}

#[test]
fn a_film_that_is_dropped_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    for name in ["a.mp4", "a.gif", "a.webp", "frames"] {
        let path = folder.path().join(name);
        let mut writer = VideoWriter::create(&path, &settings()).expect("create");
        for t in 0..3 {
            writer.push(&picture(t, SIZE)).expect("push");
        }
        drop(writer);
        assert_eq!(entries(folder.path()), [""; 0], "{name}");
        film(&path, &settings());
        let before = decode(&path, Format::of(&path).expect("format")).bytes;
        let mut writer = VideoWriter::create(&path, &VideoSettings { overwrite: true, ..settings() }).expect("create");
        writer.push(&picture(0, SIZE)).expect("push");
        drop(writer);
        assert_eq!(entries(folder.path()), [name], "{name}");
        assert_eq!(decode(&path, Format::of(&path).expect("format")).bytes, before, "{name}");
        if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) }.expect("remove");
    }
}

#[test]
fn a_writer_can_move_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<VideoWriter>();
}
