//! Tests of reading and writing splats.

use std::path::Path;

use glam::DVec3;
use rand::{RngExt, SeedableRng};

use super::*;
use crate::io::IoError;
use crate::math::sh::coefficients;
use crate::scene::{CloudError, ExtraProperty, GaussianCloud, SplatRenderMode};

fn random_cloud(n: usize, sh_degree: u8, origin: DVec3) -> GaussianCloud {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    let mut v = || rng.random_range(-3.0_f32..3.0);
    GaussianCloud {
        origin,
        positions: (0..n).map(|_| [v(), v(), v()]).collect(),
        log_scales: (0..n).map(|_| [v(), v(), v()]).collect(),
        quaternions: (0..n).map(|_| [v(), v(), v(), v()]).collect(),
        opacity_logits: (0..n).map(|_| v()).collect(),
        sh_degree,
        sh: (0..n * coefficients(sh_degree)).map(|_| [v(), v(), v()]).collect(),
        render_mode: SplatRenderMode::Mip,
        up: None,
        warnings: Vec::new(),
        extras: vec![ExtraProperty { name: "confidence".into(), values: (0..n).map(|_| v()).collect() }],
    }
}

fn bytes(cloud: &GaussianCloud) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out, cloud, None).expect("encode");
    out
}

fn parsed(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
    parse(bytes, Path::new("cloud.ply"))
}

#[test]
fn every_degree_survives_a_round_trip() {
    for degree in 0..=3 {
        let cloud = random_cloud(5000, degree, DVec3::ZERO);
        assert!(parsed(&bytes(&cloud)).expect("parse") == cloud, "degree {degree}");
    }
}

#[test]
fn a_far_origin_survives_a_round_trip_and_others_read_world_positions() {
    let cloud = random_cloud(1000, 1, DVec3::new(1e6, -2e6 + 0.125, 3.7));
    let bytes = bytes(&cloud);
    assert!(parsed(&bytes).expect("parse") == cloud);
    // A reader without support for the origin sees the world in single precision.
    let points = crate::io::points_ply::parse(&bytes, Path::new("cloud.ply")).expect("points");
    assert!((points[3].position - cloud.world_position(3)).abs().max_element() < 0.1);
}

#[test]
fn coefficients_are_stored_channel_by_channel() {
    let mut cloud = random_cloud(1, 1, DVec3::ZERO);
    cloud.sh = vec![[0.5, 0.6, 0.7], [1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.0]];
    let bytes = bytes(&cloud);
    let body = &bytes[bytes.len() - 4 * (9 + 9 + 8 + 1)..];
    let float = |k: usize| f32::from_le_bytes([body[4 * k], body[4 * k + 1], body[4 * k + 2], body[4 * k + 3]]);
    let rest: Vec<f32> = (9..18).map(float).collect();
    assert_eq!(rest, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    assert_eq!([float(3), float(4), float(5)], [0.0; 3], "normals");
}

#[test]
fn properties_may_come_in_any_order_and_as_text() {
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float rot_3\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float opacity\nproperty float scale_2\nproperty float scale_1\nproperty float scale_0\nproperty float f_dc_2\nproperty float f_dc_1\nproperty float f_dc_0\nproperty float z\nproperty float y\nproperty float x\nproperty uchar label\nend_header\n0.4 0.1 0.2 0.3 -1 3 2 1 33 22 11 9 8 7 200\n";
    let c = parsed(text.as_bytes()).expect("parse");
    assert_eq!(c.quaternions, [[0.1, 0.2, 0.3, 0.4]]);
    assert_eq!(c.log_scales, [[1.0, 2.0, 3.0]]);
    assert_eq!(c.sh, [[11.0, 22.0, 33.0]]);
    assert_eq!(c.positions, [[7.0, 8.0, 9.0]]);
    assert_eq!(c.extras, [ExtraProperty { name: "label".into(), values: vec![200.0] }]);
}

#[test]
fn doubles_get_an_origin_that_keeps_their_precision() {
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n1000000.001 0 0 0 0 0 0 0 0 0 1 0 0 0\n1000002 0 0 0 0 0 0 0 0 0 1 0 0 0\n";
    let c = parsed(text.as_bytes()).expect("parse");
    assert!((c.world_position(0).x - 1_000_000.001).abs() < 1e-6);
}

#[test]
fn gaussians_that_are_not_finite_are_left_out_and_named() {
    let good = random_cloud(3000, 2, DVec3::ZERO);
    let mut c = good.clone();
    c.sh[2100 * 9 + 4][1] = f32::NAN;
    c.log_scales[7][2] = f32::INFINITY;
    let left = parsed(&bytes(&c)).expect("others are finite");
    let told = left.warnings.concat();
    assert!(told.contains("2 of 3,000 Gaussians") && told.contains("first: Gaussian 7, scale"), "{told}");
    let kept: Vec<usize> = (0..3000).filter(|i| ![7, 2100].contains(i)).collect();
    assert!(GaussianCloud { warnings: Vec::new(), ..left } == good.select(&kept));
    let folder = tempfile::tempdir().expect("folder");
    let e = write(&folder.path().join("a.ply"), &c).expect_err("infinite");
    assert!(matches!(e, IoError::Cloud { cause: CloudError::NotFinite { index: 7, .. }, .. }));
    assert!(write(&folder.path().join("a.ply"), &good).is_ok());
}

#[test]
fn infinite_opacities_become_large_ones() {
    let mut c = random_cloud(3, 0, DVec3::ZERO);
    [c.opacity_logits[0], c.opacity_logits[1]] = [f32::INFINITY, f32::NEG_INFINITY];
    let read = parsed(&bytes(&c)).expect("read").opacity_logits;
    assert!(
        read[0] > 13.0
            && read[0].is_finite()
            && read[1] < -13.0
            && read[1].is_finite()
            && read[2] == c.opacity_logits[2],
        "{read:?}"
    );
    c.opacity_logits[0] = f32::NAN;
    assert!(parsed(&bytes(&c)).expect("two are left").warnings.concat().contains("Gaussian 0, opacity"));
    c.opacity_logits = vec![f32::NAN; 3];
    assert!(matches!(parsed(&bytes(&c)), Err(IoError::Cloud { cause: CloudError::NoneFinite { count: 3, .. }, .. })));
}

#[test]
fn wrong_numbers_of_coefficients_are_refused() {
    let good = String::from_utf8_lossy(&bytes(&random_cloud(0, 1, DVec3::ZERO))).into_owned();
    assert_eq!(parsed(good.as_bytes()).expect("empty").len(), 0);
    for (from, to) in [("property float f_rest_8\n", ""), ("f_rest_8", "f_rest_9"), ("f_rest_0", "f_rest_77")] {
        let e = parsed(good.replace(from, to).as_bytes()).expect_err(from);
        assert!(matches!(&e, IoError::Syntax { reason, .. } if reason.contains("f_rest")), "{e}");
    }
}

#[test]
fn points_and_truncated_files_are_refused() {
    let points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    assert!(matches!(parsed(points.as_bytes()), Err(IoError::Unsupported { .. })));
    let full = bytes(&random_cloud(20, 0, DVec3::ZERO));
    let e = parsed(&full[..full.len() - 1]).expect_err("truncated");
    assert!(matches!(e, IoError::Count { claimed: 20, possible: 19, .. }), "{e}");
}

#[test]
fn extra_names_that_would_break_the_file_are_refused() {
    let folder = tempfile::tempdir().expect("folder");
    for name in ["x", "f_rest_3", "two words", "line\nbreak", ""] {
        let mut cloud = random_cloud(1, 0, DVec3::ZERO);
        cloud.extras[0].name = name.into();
        assert!(matches!(write(&folder.path().join("a.ply"), &cloud), Err(IoError::Syntax { .. })), "{name:?}");
    }
}

#[test]
fn a_file_read_in_blocks_is_the_file_read_as_a_whole() {
    let mut cloud = random_cloud(5_000, 3, DVec3::new(1e6, 0.0, 0.0));
    let values = (0..5_000).map(|i| i as f32).collect();
    cloud.extras = vec![ExtraProperty { name: "kept".into(), values }];
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("splat.ply");
    write(&path, &cloud).expect("written");
    let mut bytes = std::fs::read(&path).expect("bytes");
    assert!(bytes.len() > 2 * (512 << 10), "several blocks");
    let whole = parse(&bytes, &path).expect("parsed");
    assert_eq!(stream::read(&path).expect("read"), Some(whole.clone()));
    assert_eq!((whole.len(), whole.origin), (cloud.len(), cloud.origin));
    // An error far behind is reported with the Gaussian's own number.
    let last = bytes.len() - bytes.len() / cloud.len() * 2;
    bytes[last..last + 8].copy_from_slice(&[0xff; 8]);
    std::fs::write(&path, &bytes).expect("written");
    let parts = [stream::read(&path).expect("read").expect("plain"), parse(&bytes, &path).expect("parsed")];
    assert!(parts[0] == parts[1] && parts[0].len() == 4_999, "{:?}", parts[0].warnings);
    assert!(parts[0].warnings.concat().contains("Gaussian 4998"), "{:?}", parts[0].warnings);
    // A file that is too short is left to the reader of whole files.
    std::fs::write(&path, &bytes[..bytes.len() - 1]).expect("written");
    assert_eq!(stream::read(&path).expect("not told here"), None);
}
