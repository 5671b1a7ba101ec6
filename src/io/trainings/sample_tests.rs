//! Samples in each program's exact format (`tools/results/write_samples.py`) against the arrays they were written from.

use std::path::PathBuf;

use super::*;
use crate::io::{self, Opened, npy};
use crate::math::rotation::{matrix_from_quaternion, unit_quaternion};
use crate::scene::SplatRenderMode;

fn samples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results")
}

fn array(name: &str) -> Vec<f64> {
    let path = samples().join(name);
    let bytes = std::fs::read(&path).expect(name);
    npy::open(&bytes, &path).expect(name).values().expect(name)
}

/// Single-precision array of the scene that all samples show.
fn scene(name: &str) -> Vec<f32> {
    array(&format!("scene/{name}.npy")).into_iter().map(|v| v as f32).collect()
}

fn cloud(path: &str) -> GaussianCloud {
    match io::open(&samples().join(path)) {
        Ok(Opened::Cloud(cloud)) => cloud,
        other => panic!("{path}: {other:?}"),
    }
}

/// Checks that a cloud is the scene, bit for bit.
fn is_the_scene(cloud: &GaussianCloud, path: &str) {
    assert_eq!(cloud.positions.as_flattened(), scene("xyz"), "{path}");
    assert_eq!(cloud.log_scales.as_flattened(), scene("log_scale"), "{path}");
    assert_eq!(cloud.quaternions.as_flattened(), scene("rotation"), "{path}");
    assert_eq!(cloud.opacity_logits, scene("opacity"), "{path}");
    assert_eq!(cloud.sh.as_flattened(), scene("sh"), "{path}");
}

#[test]
fn plain_trainings_have_the_values_that_were_written() {
    for path in [
        "3dgs",
        "3dgs/chkpnt30000.pth",
        "3dgs/cameras.json",
        "gsplat",
        "gsplat/cfg.yml",
        "gsplat/ckpts/ckpt_29999_rank1.pt",
        // Results with language: their Gaussians are those of the training.
        "langsplat/output/made_up_1/chkpnt30000.pth",
        "langsplat_v2/output/made_up_0_3/chkpnt10000.pth",
    ] {
        is_the_scene(&cloud(path), path);
    }
    assert_eq!(cloud("3dgs/point_cloud/iteration_7000").len(), 12, "an earlier iteration");
    assert_eq!(cloud("gsplat/ckpts/ckpt_6999_rank0.pt").len(), 8, "an earlier step");
    let mut other = cloud("3dgs");
    other.sh.swap(1, 2);
    assert_ne!(other.sh.as_flattened(), scene("sh"), "the control");
}

#[test]
fn disks_have_two_scales_and_filters_are_in_the_gaussians() {
    let disks = cloud("2dgs");
    assert_eq!(disks.render_mode, SplatRenderMode::Surfels);
    for (own, expected) in disks.log_scales.iter().zip(scene("log_scale").as_chunks::<3>().0) {
        assert_eq!(own[..2], expected[..2]);
    }
    let mip = cloud("mip_splatting");
    assert_eq!((mip.render_mode, mip.extras.len()), (SplatRenderMode::Mip, 0));
    let scales = array("mip_splatting/expected/scales_with_filter.npy");
    let opacities = array("mip_splatting/expected/opacity_with_filter.npy");
    for (own, expected) in mip.log_scales.as_flattened().iter().zip(&scales) {
        assert!((f64::from(*own).exp() / expected - 1.0).abs() < 1e-6);
    }
    for (own, expected) in mip.opacity_logits.iter().zip(&opacities) {
        assert!((1.0 / (1.0 + (-f64::from(*own)).exp()) / expected - 1.0).abs() < 1e-6);
    }
    assert_ne!(mip.log_scales, cloud("3dgs").log_scales, "the control");
}

#[test]
fn splatfacto_is_in_the_world_again() {
    for path in ["splatfacto", "splatfacto/made_up/splatfacto/2026-01-02_030405"] {
        let c = cloud(path);
        let (centers, scales) =
            (array("splatfacto/expected/world_xyz.npy"), array("splatfacto/expected/world_scales.npy"));
        let rotations = array("splatfacto/expected/world_rotations.npy");
        assert_eq!(c.len(), 32);
        for i in 0..c.len() {
            let center = glam::DVec3::from_slice(&centers[3 * i..]);
            assert!((c.world_position(i) - center).length() < 1e-5, "{i}");
            for (own, expected) in c.log_scales[i].iter().zip(&scales[3 * i..]) {
                assert!((f64::from(*own).exp() / expected - 1.0).abs() < 1e-5, "{i}");
            }
            let unit = unit_quaternion(c.quaternions[i].map(f64::from)).expect("a rotation");
            let rows = matrix_from_quaternion(unit).expect("a rotation");
            for (own, expected) in rows.as_flattened().iter().zip(&rotations[9 * i..]) {
                assert!((own - expected).abs() < 1e-5, "{i}");
            }
        }
    }
    let trained = array("splatfacto/expected/means.npy");
    let first = cloud("splatfacto").world_position(0);
    assert!((first - glam::DVec3::from_slice(&trained)).length() > 0.1, "the control");
}

#[test]
fn hostile_checkpoints_are_named_and_not_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/torch");
    let open = |name: &str| io::open(&folder.join(name));
    let mut refused = 0;
    for entry in std::fs::read_dir(&folder).expect("the corpus") {
        let name = entry.expect("an entry").file_name().into_string().expect("a name");
        match open(&name) {
            Ok(Opened::Cloud(c)) => {
                assert!(["two.pth", "not_a_number.pth"].contains(&&*name) && c.len() <= 2, "{name}")
            }
            Ok(other) => panic!("{name}: {other:?}"),
            Err(e) => {
                assert!(e.to_string().contains(&name), "{e}");
                refused += 1;
            }
        }
    }
    assert!(refused > 15, "{refused}");
    for (name, says) in [
        ("system.pth", "posix.system"),
        ("eval_in_dictionary.pth", "eval"),
        ("codec.pth", "Latin-1"),
        ("scalar_of_objects.pth", "NumPy"),
        ("huge_storage.pth", "has 64 bytes"),
        ("huge_shape.pth", "reaches beyond"),
        ("other_count.pth", "0.6"),
        ("wrong_shape.pth", "0.1"),
        ("bomb.pth", "compressed"),
    ] {
        let error = open(name).expect_err(name).to_string();
        assert!(error.contains(says), "{says}: {error}");
    }
    let Ok(Opened::Cloud(left)) = open("not_a_number.pth") else { panic!("one is left") };
    assert!(left.len() == 1 && left.warnings.concat().contains("1 of 2 Gaussians"));
}
