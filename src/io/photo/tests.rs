//! Tests of photo loading.

use std::fs;
use std::path::PathBuf;

use glam::{DMat3, DVec2, DVec3};
use image::codecs::jpeg::JpegEncoder;
use image::{ImageEncoder, ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

use super::*;

fn photo(path: PathBuf, width_px: u32, height_px: u32) -> Photo {
    Photo::new(
        "a",
        path,
        Camera {
            width_px,
            height_px,
            focal_px: DVec2::splat(f64::from(width_px)),
            principal_px: DVec2::new(f64::from(width_px), f64::from(height_px)) * 0.5,
            world_from_camera: DMat3::IDENTITY,
            center: DVec3::ZERO,
        },
    )
}

fn gradient(w: u32, h: u32) -> RgbImage {
    RgbImage::from_fn(w, h, |x, y| Rgb([(x * 3) as u8, (y * 3) as u8, 90]))
}

#[test]
fn lossless_formats_arrive_unchanged() {
    let folder = tempfile::tempdir().expect("folder");
    for (name, format) in [("a.png", ImageFormat::Png), ("a.webp", ImageFormat::WebP)] {
        let path = folder.path().join(name);
        gradient(64, 48).save_with_format(&path, format).expect("save");
        let out = load(&photo(path, 64, 48), 1000).expect("load");
        assert_eq!(out.rgb.as_flattened(), gradient(64, 48).as_raw().as_slice());
        assert_eq!(out.coverage, None);
    }
}

#[test]
fn size_follows_the_limited_camera() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.jpg");
    gradient(80, 61).save(&path).expect("save");
    assert_eq!(size(&path).expect("size"), (80, 61));
    let p = photo(path, 80, 61);
    for side in [1, 7, 40, 80, 4000] {
        let out = load(&p, side).expect("load");
        let c = p.camera.limited_to(side);
        assert_eq!(
            (out.width_px, out.height_px, out.len()),
            (c.width_px, c.height_px, (c.width_px * c.height_px) as usize)
        );
    }
}

#[test]
fn transparency_is_coverage_or_background() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.png");
    RgbaImage::from_fn(2, 1, |x, _| Rgba([100, 0, 0, if x == 0 { 255 } else { 51 }])).save(&path).expect("save");
    let mut p = photo(path, 2, 1);
    let out = load(&p, 100).expect("load");
    assert_eq!((out.rgb[1], out.coverage), ([100, 0, 0], Some(vec![255, 51])));
    p.background = Some([1.0; 3]);
    let out = load(&p, 100).expect("load");
    // 0.2 * 100 + 0.8 * 255 and 0.8 * 255.
    assert_eq!((out.rgb.clone(), out.coverage), (vec![[100, 0, 0], [224, 204, 204]], None));
}

#[test]
fn the_orientation_tag_is_left_alone() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.jpg");
    gradient(16, 8).save(&path).expect("save");
    let plain = fs::read(&path).expect("read");
    // Exif with orientation 6 (rotate by 90 degrees), inserted after the start marker.
    let tiff = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    let mut tagged = vec![0xFF, 0xD8, 0xFF, 0xE1];
    tagged.extend(((2 + 6 + tiff.len()) as u16).to_be_bytes());
    tagged.extend(b"Exif\0\0");
    tagged.extend(tiff);
    tagged.extend(&plain[2..]);
    let other = folder.path().join("b.jpg");
    fs::write(&other, tagged).expect("write");
    let a = load(&photo(path, 16, 8), 100).expect("plain");
    let b = load(&photo(other, 16, 8), 100).expect("tagged");
    assert_eq!(a, b);
}

#[test]
fn hostile_pictures_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a");
    let check = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("write");
        (size(&path), load(&photo(path.clone(), 64, 48), 100))
    };
    let (s, l) = check(b"");
    assert!(matches!(s, Err(IoError::Picture { .. })) && matches!(l, Err(IoError::Picture { .. })));
    let (s, l) = check(b"GIF89a, or so it says");
    assert!(matches!(s, Err(IoError::Picture { .. })) && matches!(l, Err(IoError::Picture { .. })));
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP] {
        let mut full = Cursor::new(Vec::new());
        gradient(64, 48).write_to(&mut full, format).expect("encode");
        let full = full.into_inner();
        for n in [full.len() / 3, full.len() / 2, full.len() - 8] {
            let (_, l) = check(&full[..n]);
            assert!(matches!(l, Err(IoError::Picture { .. })), "{format:?} cut to {n} of {} bytes: {l:?}", full.len());
        }
        let (_, l) = check(&full);
        assert!(l.is_ok(), "{format:?} {l:?}");
    }
}

#[test]
fn absurd_sizes_are_refused_before_decoding() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.png");
    gradient(64, 48).save(&path).expect("save");
    let good = fs::read(&path).expect("read");
    for (w, h) in [(0_u32, 48_u32), (64, 0), (0, 0), (u32::MAX / 2, 48), (20_000, 20_000)] {
        let mut bytes = good.clone();
        bytes[16..20].copy_from_slice(&w.to_be_bytes());
        bytes[20..24].copy_from_slice(&h.to_be_bytes());
        let checksum = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        fs::write(&path, &bytes).expect("write");
        let e = size(&path).expect_err("absurd");
        assert!(matches!(e, IoError::Picture { .. } | IoError::EmptyPicture { .. }), "{w} x {h}: {e}");
    }
    fs::write(&path, &good).expect("write");
    let e = load(&photo(path, 64, 47), 100).expect_err("another size");
    assert!(matches!(e, IoError::PhotoSize { found: (64, 48), expected: (64, 47), .. }));
}

#[test]
fn pictures_without_alpha_are_told_by_their_headers() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a");
    let encoded = |picture: &DynamicImage| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).expect("encode");
        bytes.into_inner()
    };
    let alpha_of = |bytes: &[u8]| {
        fs::write(&path, bytes).expect("write");
        alpha(&path)
    };
    // Their pixels are cut off, so decoding them fails.
    let opaque = encoded(&gradient(64, 48).into());
    assert!(matches!(alpha_of(&opaque[..opaque.len() / 2]), Ok(None)));
    let clear = encoded(&RgbaImage::from_pixel(64, 48, Rgba([9, 9, 9, 0])).into());
    assert!(alpha_of(&clear[..clear.len() / 2]).is_err(), "the control");
    assert!(matches!(alpha_of(&clear), Ok(Some((64, 48, alpha))) if alpha.iter().all(|a| *a == 0)));
    // A profile that is longer than the part that is read first.
    let mut jpeg = Vec::new();
    let mut encoder = JpegEncoder::new(&mut jpeg);
    encoder.set_icc_profile(vec![7; 2 * HEADER_BYTES as usize]).expect("a profile");
    encoder.encode_image(&gradient(64, 48)).expect("encode");
    assert!(matches!(alpha_of(&jpeg[..jpeg.len() - 2]), Ok(None)));
    // One color is transparent: that of the first pixel.
    let mut chunk = b"tRNS\0\0\0\0\0\x5a".to_vec();
    chunk.extend(crc32(&chunk).to_be_bytes());
    let keyed = [&opaque[..33], &6_u32.to_be_bytes(), &chunk[..], &opaque[33..]].concat();
    let (.., alpha) = alpha_of(&keyed).expect("read").expect("transparent somewhere");
    assert_eq!((alpha[0], alpha[1]), (0, 255));
}

/// The checksum of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |c: u32, b: &u8| {
        (0..8).fold(c ^ u32::from(*b), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
    };
    !bytes.iter().fold(u32::MAX, step)
}
