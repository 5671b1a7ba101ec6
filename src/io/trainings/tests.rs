//! Tests with folders written as the programs write them.

use std::fs;
use std::path::PathBuf;

use super::*;
use crate::io::torch::written::{Saved, saved};
use crate::io::{self, Opened};
use crate::scene::SplatRenderMode;

/// Distinct numbers of a tensor.
fn numbers(start: u16, count: usize) -> Vec<f32> {
    (0..count).map(|k| f32::from(start) + k as f32 / 64.0).collect()
}

fn tensor(start: u16, shape: &[usize]) -> Saved {
    Saved::Tensor(shape.to_vec(), numbers(start, shape.iter().product()))
}

/// Checkpoint of 3D Gaussian Splatting with `n` Gaussians and `scales` scales each.
fn inria(n: usize, scales: usize, more: usize) -> Saved {
    let none = || Saved::Tensor(vec![n], vec![0.0; n]);
    let mut all = vec![
        Saved::Int(1),
        tensor(1, &[n, 3]),
        tensor(2, &[n, 1, 3]),
        tensor(3, &[n, 3, 3]),
        tensor(4, &[n, scales]),
        tensor(5, &[n, 4]),
        tensor(6, &[n, 1]),
        none(),
        none(),
        none(),
        Saved::dict([("state", Saved::dict([("0", tensor(9, &[n, 3]))]))]),
        Saved::Scalar("numpy.core.multiarray", "f8", 3.5_f64.to_le_bytes().to_vec()),
    ];
    all.extend((0..more).map(|_| none()));
    Saved::Tuple(vec![Saved::Tuple(all), Saved::Int(30_000)])
}

fn gsplat(n: usize, start: u16) -> Saved {
    let splats = Saved::dict([
        ("means", tensor(start, &[n, 3])),
        ("scales", tensor(2, &[n, 3])),
        ("quats", tensor(3, &[n, 4])),
        ("opacities", tensor(4, &[n])),
        ("sh0", tensor(5, &[n, 1, 3])),
        ("shN", tensor(6, &[n, 8, 3])),
    ]);
    Saved::dict([("step", Saved::Int(29_999)), ("splats", splats)])
}

fn splatfacto(n: usize, rest: usize) -> Saved {
    let of = |name: &str, shape: &[usize], start| (format!("_model.gauss_params.{name}"), tensor(start, shape));
    let state = vec![
        of("means", &[n, 3], 1),
        of("scales", &[n, 3], 2),
        of("quats", &[n, 4], 3),
        of("features_dc", &[n, 3], 4),
        of("features_rest", &[n, rest, 3], 5),
        of("opacities", &[n, 1], 6),
    ];
    let rate = Saved::Scalar("numpy._core.multiarray", "f8", 1e-6_f64.to_le_bytes().to_vec());
    Saved::dict([
        ("step", Saved::Int(29_999)),
        ("pipeline", Saved::Dict(state)),
        ("schedulers", Saved::dict([("means", Saved::dict([("_last_lr", Saved::List(vec![rate]))]))])),
    ])
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let guard = tempfile::tempdir().expect("folder");
    let path = guard.path().canonicalize().expect("there");
    (guard, path)
}

fn put(path: &Path, value: &Saved) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    fs::write(path, saved(value)).expect("written");
}

fn cloud(path: &Path) -> GaussianCloud {
    match io::open(path) {
        Ok(Opened::Cloud(cloud)) => cloud,
        other => panic!("{}: {other:?}", path.display()),
    }
}

fn refused(path: &Path) -> String {
    io::open(path).expect_err("refused").to_string()
}

#[test]
fn a_checkpoint_without_ply_has_the_gaussians_of_its_latest_iteration() {
    let (_guard, root) = folder();
    fs::write(root.join("cfg_args"), "Namespace(source_path='/gone/data', white_background=True)").expect("written");
    put(&root.join("chkpnt7000.pth"), &inria(2, 3, 0));
    put(&root.join("chkpnt30000.pth"), &inria(5, 3, 0));
    for path in ["", "cfg_args", "chkpnt30000.pth"] {
        let c = cloud(&root.join(path));
        assert_eq!((c.len(), c.sh_degree, c.render_mode), (5, 1, SplatRenderMode::Plain), "{path}");
        assert_eq!(c.positions.as_flattened(), numbers(1, 15));
        assert_eq!(c.log_scales.as_flattened(), numbers(4, 15));
        assert_eq!(c.quaternions.as_flattened(), numbers(5, 20));
        assert_eq!(c.opacity_logits, numbers(6, 5));
        let (dc, rest) = (numbers(2, 15), numbers(3, 45));
        for i in 0..5 {
            assert_eq!(c.sh[i * 4], [0, 1, 2].map(|k| dc[i * 3 + k]));
            assert_eq!(c.sh[i * 4 + 1..][..3].as_flattened(), &rest[i * 9..][..9], "coefficient by coefficient");
        }
        assert!(c.warnings.is_empty(), "{:?}", c.warnings);
    }
    assert_eq!(cloud(&root.join("chkpnt7000.pth")).len(), 2, "the one that was asked for");
    let beside = open(&root).expect("opens").beside;
    let source = beside.source.expect("stated");
    assert!(beside.white_background && source.found.is_none());
    // Two scales are those of disks, further values are told, Mip-Splatting's filter would be missing.
    put(&root.join("chkpnt40000.pth"), &inria(3, 2, 1));
    let disks = cloud(&root);
    assert_eq!(
        (disks.render_mode, disks.log_scales[1][..2].to_vec()),
        (SplatRenderMode::Surfels, numbers(4, 6)[2..4].to_vec())
    );
    assert!(disks.warnings.concat().contains("more than Gaussians"));
    fs::write(root.join("cfg_args"), "Namespace(kernel_size=0.1, source_path='')").expect("written");
    assert!(refused(&root).contains("point_cloud.ply"), "{}", refused(&root));
}

#[test]
fn gaussians_of_all_ranks_are_one_scene_and_a_missing_rank_is_named() {
    let (_guard, root) = folder();
    fs::write(root.join("cfg.yml"), "antialiased: true\ndata_dir: gone/garden\nnormalize_world_space: true\n")
        .expect("written");
    put(&root.join("ckpts/ckpt_6999_rank0.pt"), &gsplat(2, 1));
    for (rank, n) in [(0, 4), (1, 3), (2, 1)] {
        put(&root.join(format!("ckpts/ckpt_29999_rank{rank}.pt")), &gsplat(n, 10 + rank));
    }
    for path in ["", "ckpts", "cfg.yml", "ckpts/ckpt_29999_rank1.pt"] {
        let c = cloud(&root.join(path));
        assert_eq!((c.len(), c.sh_degree, c.render_mode), (8, 2, SplatRenderMode::Mip), "{path}");
        let starts: Vec<f32> = [0, 4, 7].iter().map(|i| c.positions[*i][0]).collect();
        assert_eq!(starts, [10.0, 11.0, 12.0]);
        assert_eq!(c.sh[9..10], [[0, 1, 2].map(|k| numbers(5, 12)[3 + k])]);
    }
    let warnings = |path: &str| open(&root.join(path)).expect("opens").beside.warnings.concat();
    assert_eq!(warnings(""), "");
    assert!(warnings("ckpts/ckpt_6999_rank0.pt").contains("3 GPUs and this one of 1"), "an earlier step");
    fs::remove_file(root.join("ckpts/ckpt_29999_rank1.pt")).expect("removed");
    let error = refused(&root);
    assert!(error.contains("rank 1 is missing") && error.contains("3 GPUs"), "{error}");
    // The last rank alone: the first is missing.
    fs::remove_file(root.join("ckpts/ckpt_29999_rank0.pt")).expect("removed");
    assert!(refused(&root).contains("rank 0 is missing"));
    // The first versions wrote no ranks; a network that makes colors is refused.
    put(&root.join("ckpts/ckpt_39999.pt"), &gsplat(6, 1));
    assert_eq!(cloud(&root).len(), 6);
    let network = Saved::dict([(
        "splats",
        Saved::dict([("means", tensor(1, &[2, 3])), ("features", tensor(1, &[2, 8])), ("colors", tensor(1, &[2, 3]))]),
    )]);
    put(&root.join("ckpts/ckpt_49999.pt"), &network);
    assert!(refused(&root).contains("app_opt"), "{}", refused(&root));
}

#[test]
fn splatfacto_is_found_from_every_folder_above_and_its_axes_are_undone() {
    let (_guard, root) = folder();
    let run = root.join("outputs/garden/splatfacto/2026-01-02_030405");
    put(
        &root.join("outputs/garden/splatfacto/2025-01-01_000000/nerfstudio_models/step-000000999.ckpt"),
        &splatfacto(1, 15),
    );
    put(&run.join("nerfstudio_models/step-000029999.ckpt"), &splatfacto(4, 3));
    put(&run.join("nerfstudio_models/step-000002000.ckpt"), &splatfacto(2, 3));
    let config = "data: !!python/object/apply:pathlib.PosixPath\n- data\n- garden\nexperiment_name: garden\n\
                  method_name: splatfacto\npipeline:\n  model:\n    background_color: white\n    rasterize_mode: antialiased\n";
    fs::write(run.join("config.yml"), config).expect("written");
    let plain = cloud(&run);
    assert_eq!((plain.len(), plain.render_mode), (4, SplatRenderMode::Mip));
    assert_eq!(plain.positions.as_flattened(), numbers(1, 12));
    assert!(open(&run).expect("opens").beside.warnings.concat().contains("no dataparser_transforms.json"));
    // x to y, y to -x, moved by 1, twice as large.
    let transform = r#"{"transform": [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 0]], "scale": 2}"#;
    fs::write(run.join("dataparser_transforms.json"), transform).expect("written");
    let paths = ["outputs/garden", "outputs/garden/splatfacto", "outputs"].map(|p| root.join(p));
    let inside = ["", "config.yml", "nerfstudio_models", "nerfstudio_models/step-000029999.ckpt"].map(|p| run.join(p));
    for path in paths.iter().chain(&inside) {
        let c = cloud(path);
        assert_eq!(c.len(), 4, "{}", path.display());
        for i in 0..4 {
            let p = plain.world_position(i) / 2.0 - glam::DVec3::X;
            let expected = glam::DVec3::new(p.y, -p.x, p.z);
            assert!((c.world_position(i) - expected).length() < 1e-6, "{}", c.world_position(i));
            assert!((c.log_scales[i][1] - (plain.log_scales[i][1] - 2.0_f32.ln())).abs() < 1e-6);
        }
        assert!(c.up.is_some_and(|up| (up - glam::DVec3::Z).length() < 1e-12));
    }
    let beside = open(&run).expect("opens").beside;
    assert_eq!((beside.name.as_deref(), beside.white_background), (Some("garden"), true));
    assert!(beside.warnings.is_empty(), "{:?}", beside.warnings);
    assert_eq!(cloud(&run.join("nerfstudio_models/step-000002000.ckpt")).len(), 2);
    // Without higher harmonics, its constants are logits of colors.
    put(&run.join("nerfstudio_models/step-000039999.ckpt"), &splatfacto(2, 0));
    let flat = cloud(&run);
    let color = 0.5 + crate::math::sh::SH_C0 as f32 * flat.sh[1][0];
    assert!((color - 1.0 / (1.0 + (-numbers(4, 6)[3]).exp())).abs() < 1e-6, "{color}");
}

#[test]
fn networks_and_radiance_fields_are_refused_by_name() {
    let (_guard, root) = folder();
    let of = |names: &[&str]| {
        let state = names.iter().map(|name| (format!("_model.{name}"), tensor(1, &[2]))).collect();
        Saved::dict([("pipeline", Saved::Dict(state))])
    };
    let file = root.join("step-000029999.ckpt");
    for (value, says) in [
        (of(&["field.mlp_base.params", "proposal_networks.0.params"]), "NeRF"),
        (of(&["field.mlp_base.params", "lerf_field.clip_net.params"]), "LERF"),
        (of(&["weights"]), "pipeline._model.weights"),
        (Saved::dict([("decoder.0.weight", tensor(1, &[2]))]), "decoder.0.weight"),
        (Saved::Tuple(vec![Saved::Int(1)]), "without Gaussians"),
    ] {
        put(&file, &value);
        let error = refused(&file);
        assert!(error.contains(says) && error.contains("step-000029999.ckpt"), "{says}: {error}");
    }
    let run = root.join("run");
    put(&run.join("nerfstudio_models/step-000029999.ckpt"), &of(&["field.mlp_base.params"]));
    fs::write(run.join("config.yml"), "method_name: nerfacto\n").expect("written");
    assert!(refused(&run).contains("nerfacto"), "{}", refused(&run));
    fs::remove_file(run.join("nerfstudio_models/step-000029999.ckpt")).expect("removed");
    assert!(refused(&run).contains("step-<n>.ckpt"), "{}", refused(&run));
}

#[test]
fn tensors_that_do_not_fit_each_other_are_named() {
    let (_guard, root) = folder();
    let file = root.join("chkpnt30000.pth");
    let with = |index: usize, value: Saved| {
        let Saved::Tuple(mut outer) = inria(3, 3, 0) else { panic!("a tuple") };
        if let Saved::Tuple(inner) = &mut outer[0] {
            inner[index] = value;
        }
        put(&file, &Saved::Tuple(outer));
        refused(&file)
    };
    for (index, value, says) in [
        (1, tensor(1, &[3, 4]), "0.1"),
        (2, tensor(1, &[2, 1, 3]), "0.2"),
        (3, tensor(1, &[3, 24, 3]), "degree 0 to 3"),
        (3, tensor(1, &[3, 3, 2]), "0.3"),
        (4, tensor(1, &[3, 1]), "0.4"),
        (5, tensor(1, &[4, 3]), "0.5"),
        (6, Saved::Whole(vec![3, 1], vec![1, 2, 3]), "whole numbers"),
        (6, Saved::Nothing, "is not there"),
        (6, Saved::Missing, "not in the archive"),
        (10, Saved::Raw(b"cposix\nsystem\nX\x02\0\0\0id\x85R".to_vec()), "posix.system"),
    ] {
        let error = with(index, value);
        assert!(error.contains(says) && error.contains("chkpnt30000.pth"), "{says}: {error}");
    }
    // Numbers that are none: those Gaussians are left out, as of a .ply.
    let Saved::Tuple(mut outer) = inria(3, 3, 0) else { panic!("a tuple") };
    if let Saved::Tuple(inner) = &mut outer[0] {
        inner[6] = Saved::Tensor(vec![3, 1], vec![1.0, f32::NAN, f32::INFINITY]);
    }
    put(&file, &Saved::Tuple(outer));
    let c = cloud(&file);
    assert_eq!((c.len(), c.opacity_logits[1].is_finite()), (2, true));
    assert!(c.warnings.concat().contains("1 of 3 Gaussians are left out"));
}

#[test]
fn no_cut_and_no_changed_byte_makes_it_fail_otherwise_than_by_an_error() {
    let (_guard, root) = folder();
    let file = root.join("chkpnt30000.pth");
    let whole = saved(&inria(3, 3, 0));
    let mut refused = 0;
    for at in (0..whole.len()).step_by(7) {
        fs::write(&file, &whole[..at]).expect("written");
        assert!(io::open(&file).is_err(), "cut at {at}");
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&file, &bytes).expect("written");
        refused += usize::from(io::open(&file).is_err());
    }
    assert!(refused > whole.len() / 7 / 5, "{refused}");
    fs::write(&file, &whole).expect("written");
    assert_eq!(cloud(&file).len(), 3, "the control");
    fs::write(&file, b"\x80\x02cposix\nsystem\n").expect("written");
    assert!(io::open(&file).expect_err("old").to_string().contains("older PyTorch"));
}

#[test]
fn photos_fit_the_gaussians_of_splatfacto_and_are_found_from_its_settings() {
    let (_guard, root) = folder();
    let (run, data) = (root.join("outputs/garden/splatfacto/2026-01-02_030405"), root.join("data/garden"));
    fs::create_dir_all(data.join("images")).expect("made");
    let frame = |(i, center): (usize, [f64; 3])| {
        image::RgbImage::new(64, 48).save(data.join(format!("images/{i}.png"))).expect("saved");
        let [x, y, z] = center;
        let pose = [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z], [0.0, 0.0, 0.0, 1.0]];
        serde_json::json!({ "file_path": format!("images/{i}.png"), "transform_matrix": pose })
    };
    let centers = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]];
    let frames: Vec<_> = centers.into_iter().enumerate().map(frame).collect();
    let list = serde_json::json!({ "fl_x": 50.0, "w": 64, "h": 48, "frames": frames });
    fs::write(data.join("transforms.json"), list.to_string()).expect("written");
    put(&run.join("nerfstudio_models/step-000029999.ckpt"), &splatfacto(4, 3));
    let config = "data: !!python/object/apply:pathlib.PosixPath\n- data\n- garden\nmethod_name: splatfacto\n";
    fs::write(run.join("config.yml"), config).expect("written");
    let transform = r#"{"transform": [[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 5]], "scale": 2}"#;
    fs::write(run.join("dataparser_transforms.json"), transform).expect("written");
    let scene = crate::jobs::open::scene(&run).expect("opens");
    assert_eq!((scene.dataset_path.as_ref(), &*scene.name), (Some(&data), "garden"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let held_out: Vec<bool> = scene.cameras.iter().map(|c| c.held_out).collect();
    assert_eq!(held_out, [false; 3], "ceil(0.9 * 3) are trained on");
    // The first Gaussian at half its stored place, moved and turned back; seen from the world's origin along -z.
    let q = glam::DVec3::new(1.0, 1.0 + 1.0 / 64.0, 1.0 + 2.0 / 64.0) / 2.0 - glam::DVec3::new(1.0, 0.0, 5.0);
    let p = glam::DVec3::new(q.y, -q.x, q.z);
    let expected = glam::DVec2::new(32.0 + 50.0 * p.x / -p.z, 24.0 - 50.0 * p.y / -p.z);
    let seen = |scene: &crate::jobs::Scene| {
        let first = &scene.cameras[0];
        assert_eq!(first.name, "images/0.png");
        first.camera.project(scene.cloud.world_position(0))
    };
    assert!((seen(&scene).expect("in front") - expected).length() < 1e-4);
    // Without the file, nothing fits, and that is told.
    fs::remove_file(run.join("dataparser_transforms.json")).expect("removed");
    let other = crate::jobs::open::scene(&run).expect("opens");
    assert!(seen(&other).is_none_or(|seen| (seen - expected).length() > 1.0), "the control");
    assert!(other.warnings.concat().contains("may not fit"), "{:?}", other.warnings);
    // Photos that were moved are found beside the training by their name, and missing ones are told.
    fs::rename(&data, root.join("outputs/garden/garden")).expect("moved");
    let moved = crate::jobs::open::scene(&run).expect("opens");
    assert_eq!(moved.dataset_path, Some(root.join("outputs/garden/garden")));
    fs::remove_dir_all(root.join("outputs/garden/garden")).expect("removed");
    let gone = crate::jobs::open::scene(&run).expect("opens");
    assert!(gone.cameras.is_empty() && gone.dataset_path.is_none());
    assert!(gone.warnings.concat().contains("data/garden, which is not here"), "{:?}", gone.warnings);
}
