//! Tests of compressed `.ply` files.

use std::path::Path;

use super::*;
use crate::io::{IoError, test_clouds};
use crate::math::sh::SH_C0;
use crate::scene::{GaussianCloud, SplatRenderMode};

/// One chunk of `n` Gaussians, all with the same packed values.
fn file(n: usize, packed: [u32; 4]) -> Vec<u8> {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
    let mut bounds = Vec::new();
    for (group, lo, hi) in [("", -1.0_f32, 3.0_f32), ("scale_", -8.0, 0.0)] {
        for (end, value) in [("min", lo), ("max", hi)] {
            for axis in ["x", "y", "z"] {
                text += &format!("property float {end}_{group}{axis}\n");
                bounds.extend(value.to_le_bytes());
            }
        }
    }
    text += &format!("element vertex {n}\n");
    for name in ["position", "rotation", "scale", "color"] {
        text += &format!("property uint packed_{name}\n");
    }
    let mut out = (text + "end_header\n").into_bytes();
    out.extend(bounds);
    (0..n).for_each(|_| packed.iter().for_each(|v| out.extend(v.to_le_bytes())));
    out
}

fn parse(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
    crate::io::splat_ply::parse(bytes, Path::new("a.compressed.ply"))
}

#[test]
fn fields_are_where_the_format_puts_them() {
    // Position: x at its top, y at 0, z at its top. Scale the other way round.
    let position = (2047 << 21) | 2047;
    let scale = 1023 << 11;
    // Largest component y (2), the others 0 (511.5 is the middle; 512 is just above).
    let rotation = (2 << 30) | (512 << 20) | (512 << 10) | 512;
    let color = (255 << 24) | (128 << 8) | 51;
    let c = parse(&file(2, [position, rotation, scale, color])).expect("valid");
    assert_eq!(c.len(), 2);
    assert_eq!(c.positions[1], [3.0, -1.0, 3.0]);
    assert_eq!(c.log_scales[1], [-8.0, 0.0, -8.0]);
    let [w, x, y, z] = c.quaternions[0];
    assert!(y > 0.9999 && w.abs() < 1e-3 && x.abs() < 1e-3 && z.abs() < 1e-3);
    let rgb = c.sh[0].map(|v| v * SH_C0 as f32 + 0.5);
    assert!((rgb[0] - 1.0).abs() < 1e-6 && rgb[1].abs() < 1e-6 && (rgb[2] - 128.0 / 255.0).abs() < 1e-6);
    assert!((c.opacity_logits[0] - (0.2_f32 / 0.8).ln()).abs() < 1e-6);
    c.validate().expect("finite");
}

#[test]
fn more_vertices_than_chunks_hold_are_refused() {
    let e = parse(&file(257, [0; 4])).expect_err("too many");
    assert!(matches!(e, IoError::Count { claimed: 257, possible: 256, .. }), "{e}");
    assert!(parse(&file(256, [0; 4])).is_ok());
}

#[test]
fn bounds_that_are_not_finite_are_named() {
    let mut bytes = file(1, [0; 4]);
    let body = bytes.len() - 16 - 48;
    bytes[body + 16..body + 20].copy_from_slice(&f32::NAN.to_le_bytes());
    let e = parse(&bytes).expect_err("NaN");
    assert!(matches!(&e, IoError::NotFinite { element: "chunk", property, .. } if property == "max_y"), "{e}");
}

fn bytes(cloud: &GaussianCloud) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out, cloud, &mut |_| Ok(())).expect("encode");
    out
}

#[test]
fn what_is_written_comes_back_as_near_as_its_chunks_allow() {
    for degree in 0..=3 {
        let mode = SplatRenderMode::Mip;
        let cloud = GaussianCloud { render_mode: mode, ..test_clouds::random(1000, degree) };
        let back = parse(&bytes(&cloud)).expect("valid");
        // Bounds of 6 units in 11 bits, of 4 log-scales, and harmonics in steps of 1/32.
        let cloud = test_clouds::in_order(&cloud);
        test_clouds::assert_near(&back, &cloud, [0.003, 0.003, 1e-5, 0.002, 0.016]);
    }
}

#[test]
fn one_gaussian_and_a_chunk_more_are_written_too() {
    for n in [1, 256, 257] {
        let cloud = GaussianCloud::isotropic(vec![[1e6, 0.0, -1e6]; n], -20.0, 100.0);
        let back = parse(&bytes(&cloud)).expect("valid");
        assert_eq!((back.len(), back.positions[n - 1], back.log_scales[0]), (n, [1e6, 0.0, -1e6], [-20.0; 3]));
    }
}
