//! Tests of SPZ.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::*;
use crate::io::{IoError, test_clouds};
use crate::scene::{Axes, GaussianCloud, SplatRenderMode};

const P: &str = "a.spz";

fn header(version: u32, count: u32, [degree, fraction, flags, streams]: [u8; 4]) -> Vec<u8> {
    let [version, count] = [version, count].map(u32::to_le_bytes);
    [MAGIC, &version[..], &count, &[degree, fraction, flags, streams]].concat()
}

fn gzip(parts: &[&[u8]]) -> Vec<u8> {
    let mut out = GzEncoder::new(Vec::new(), Compression::fast());
    parts.iter().for_each(|part| out.write_all(part).expect("pack"));
    out.finish().expect("packed")
}

/// A Zstandard stream of uncompressed `bytes`.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    let size = (bytes.len() as u32).to_le_bytes();
    // One segment with its size in four bytes, and one raw block, the last.
    let block = ((bytes.len() as u32) << 3 | 1).to_le_bytes();
    [&[0x28, 0xb5, 0x2f, 0xfd, 0xa0][..], &size, &block[..3], bytes].concat()
}

/// A file of version 4 with these columns.
fn version_4(head: &[u8], columns: &[&[u8]]) -> Vec<u8> {
    let streams: Vec<Vec<u8>> = columns.iter().map(|c| zstd(c)).collect();
    let mut out = [head, &32_u32.to_le_bytes(), &[0; 12]].concat();
    for (packed, column) in streams.iter().zip(columns) {
        out.extend((packed.len() as u64).to_le_bytes());
        out.extend((column.len() as u64).to_le_bytes());
    }
    [out, streams.concat()].concat()
}

fn parsed(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
    parse(bytes, Path::new(P))
}

/// Parses the numbers without a change of axes.
fn raw(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
    parse_in(bytes, Path::new(P), SpzAxes::Given(Axes::PLY))
}

fn bytes(cloud: &GaussianCloud) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out, cloud, &mut |_| Ok(())).expect("encode");
    out
}

/// x = 1, y = -1/256, z = -32768 with 8 fractional bits.
const POSITION: [u8; 9] = [0, 1, 0, 255, 255, 255, 0, 0, 128];
/// Opacity 51/255, color, scales.
const BYTES: [u8; 7] = [51, 255, 0, 128, 0, 160, 255];
/// The largest is z; x is +1/2 of its maximum, y as much below zero, w 0.
const ROTATION: u32 = 2 << 30 | 256 << 20 | (512 | 256) << 10;
/// One band: -1, 0, 127/128.
const HARMONICS: [u8; 9] = [0, 128, 255, 0, 128, 255, 0, 128, 255];

#[test]
fn fields_are_where_each_version_puts_them() {
    let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a} {b}");
    let (first, rest) = ([191, 64, 128], HARMONICS);
    let old = gzip(&[&header(2, 1, [1, 8, 1, 0]), &POSITION, &BYTES, &first, &rest]);
    let three = gzip(&[&header(3, 1, [1, 8, 0, 0]), &POSITION, &BYTES, &ROTATION.to_le_bytes(), &rest]);
    let columns: [&[u8]; 6] = [&POSITION, &BYTES[..1], &BYTES[1..4], &BYTES[4..], &ROTATION.to_le_bytes(), &rest];
    let four = version_4(&header(4, 1, [1, 8, 1, 6]), &columns);
    let half = [1.0_f32, -2.0, 0.5].map(|v| half::f16::from_f32(v).to_le_bytes()).concat();
    let one = gzip(&[&header(1, 1, [0, 0, 0, 0]), &half, &BYTES, &first]);
    for (file, position, mode, degree, smallest) in [
        (&old, [1.0, -1.0 / 256.0, -32_768.0], SplatRenderMode::Mip, 1, false),
        (&three, [1.0, -1.0 / 256.0, -32_768.0], SplatRenderMode::Plain, 1, true),
        (&four, [1.0, -1.0 / 256.0, -32_768.0], SplatRenderMode::Mip, 1, true),
        (&one, [1.0, -2.0, 0.5], SplatRenderMode::Plain, 0, false),
    ] {
        let c = raw(file).expect("valid");
        assert_eq!((c.len(), c.sh_degree, c.positions[0], c.render_mode), (1, degree, position, mode));
        assert_eq!(c.log_scales[0], [-10.0, 0.0, 5.9375]);
        near(c.opacity_logits[0], (0.2_f32 / 0.8).ln());
        near(c.sh[0][0], 0.5 / 0.15);
        near(c.sh[0][1], -0.5 / 0.15);
        if degree == 1 {
            assert_eq!(c.sh[1..], [[-1.0, 0.0, 127.0 / 128.0]; 3]);
        }
        let [w, x, y, z] = c.quaternions[0];
        match smallest {
            true => {
                let part = 256.0 / 511.0 / 2.0_f32.sqrt();
                near(x, part);
                near(y, -part);
                near(z, (1.0 - 2.0 * part * part).sqrt());
                assert_eq!(w, 0.0);
            }
            false => {
                near(x, 191.0 / 127.5 - 1.0);
                near(y, 64.0 / 127.5 - 1.0);
                near(w, (1.0 - x * x - y * y - z * z).sqrt());
            }
        }
    }
}

#[test]
fn what_is_written_comes_back_as_near_as_its_bytes_are() {
    for degree in 0..=3 {
        let cloud = GaussianCloud { render_mode: SplatRenderMode::Mip, ..test_clouds::random(5_000, degree) };
        let back = parsed(&bytes(&cloud)).expect("valid");
        // Sixteen steps of 1/128 in the upper bands.
        test_clouds::assert_near(&back, &cloud, [1e-6, 0.032, 3e-6, 0.0021, 0.07]);
        // A second pass of packing loses nothing more.
        test_clouds::assert_near(&parsed(&bytes(&back)).expect("again"), &back, [1e-6; 5]);
    }
}

#[test]
fn coordinates_get_all_the_bits_that_fit() {
    let at = |x: f64| GaussianCloud {
        origin: glam::DVec3::new(x, 0.0, 0.0),
        ..GaussianCloud::isotropic(vec![[0.25, 0.0, 0.0]], -3.0, 0.0)
    };
    for (x, most) in [(0.0, 1e-7), (1e6, 1e-6), (-8e6, 1e-6)] {
        let error = parsed(&bytes(&at(x))).expect("valid").world_position(0).x - (x + 0.25);
        assert!(error.abs() <= most, "{x}: {error}");
    }
    let wide = GaussianCloud::isotropic(vec![[1e7, 0.0, 0.0], [0.0; 3]], -3.0, 0.0);
    let e = encode(&mut Vec::new(), &wide, &mut |_| Ok(())).expect_err("too far");
    assert!(e.to_string().contains("10000000"), "{e}");
}

#[test]
fn hostile_files_are_named() {
    let good = bytes(&test_clouds::random(50, 1));
    let columns: [&[u8]; 5] = [&POSITION, &BYTES[..1], &BYTES[1..4], &BYTES[4..], &ROTATION.to_le_bytes()];
    let four = version_4(&header(4, 1, [0, 8, 0, 5]), &columns);
    assert_eq!(parsed(&four).expect("valid").len(), 1);
    for n in [0, 1, 2, 10, 19, good.len() / 2, good.len() - 12] {
        parsed(&good[..n]).expect_err("cut off");
    }
    for n in 0..four.len() {
        parsed(&four[..n]).expect_err("cut off");
    }
    let refused = |head: Vec<u8>| parsed(&gzip(&[&head, &[0; 20]])).expect_err("refused");
    assert!(matches!(refused(header(5, 1, [0; 4])), IoError::Version { found: 5, supported: 4, .. }));
    assert!(matches!(refused(header(3, 1, [5, 0, 0, 0])), IoError::Unsupported { .. }));
    assert!(matches!(refused(header(3, 1, [0, 25, 0, 0])), IoError::Syntax { .. }));
    assert!(matches!(refused(header(3, 2, [0; 4])), IoError::Truncated { .. }));
    assert!(matches!(refused(header(3, u32::MAX, [0; 4])), IoError::Count { .. }));
    assert!(matches!(refused(b"NGSQ000000000000".to_vec()), IoError::Syntax { .. }));
    // Counts and sizes that contradict one another.
    for (place, value) in [(8, 2_u8), (15, 6), (16, 255), (32, 255), (40, 10), (47, 255)] {
        let mut bad = four.clone();
        bad[place] = value;
        parsed(&bad).expect_err("changed");
    }
    // A window of gigabytes in the head of a frame.
    let mut frame = four.clone();
    let start = 32 + 5 * 16;
    frame[start + 4..start + 6].copy_from_slice(&[0x00, 0xff]);
    parsed(&frame).expect_err("too large a window");
    // A half float that is infinite.
    let infinite = gzip(&[&header(1, 1, [0; 4]), &[0, 0x7c, 0, 0, 0, 0], &BYTES, &[0; 3]]);
    assert!(matches!(parsed(&infinite), Err(IoError::Cloud { .. })));
}

#[test]
fn records_of_version_4_say_the_axes_and_broken_ones_end_them() {
    let columns: [&[u8]; 5] = [&POSITION, &BYTES[..1], &BYTES[1..4], &BYTES[4..], &ROTATION.to_le_bytes()];
    let plain = version_4(&header(4, 1, [0, 8, 2, 5]), &columns);
    let with = |record: &[u8]| {
        let mut file = plain.clone();
        file[16..20].copy_from_slice(&(32 + record.len() as u32).to_le_bytes());
        file.splice(32..32, record.iter().copied());
        parsed(&file).expect("valid")
    };
    let record = |kind: u32, length: u32, value: u32| [kind, length, value].map(u32::to_le_bytes).concat();
    for (number, place) in [(6, [1.0, -1.0, -1.0]), (4, [1.0, 1.0, 1.0]), (2, [1.0, -1.0, 1.0])] {
        let c = with(&record(0xADBE_0003, 4, number));
        let numbers = [1.0, 1.0 / 256.0, 32_768.0];
        assert_eq!(c.positions[0], [0, 1, 2].map(|k| numbers[k] * place[k]), "{number}");
        assert!(c.warnings.is_empty());
    }
    for (broken, told) in [
        (record(0xADBE_0003, 400, 6), 1),
        (record(0xADBE_0003, 4, 99), 1),
        (record(7, u32::MAX, 6), 1),
        (record(7, 4, 6), 2),
        (vec![1, 2, 3], 1),
    ] {
        let c = with(&broken);
        assert_eq!((c.positions[0], c.warnings.len()), ([1.0, 1.0 / 256.0, 32_768.0], told), "{:?}", c.warnings);
    }
}
