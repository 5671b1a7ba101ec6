//! Tests of trained scenes.

use glam::{DMat3, DVec2, DVec3};

use std::fs;

use super::*;
use crate::scene::{
    Camera, Dataset, Evaluation, ExtraProperty, Photo, PhotoExposure, PhotoFit, StepMetrics, ViewScore,
};

fn camera() -> Camera {
    Camera {
        width_px: 640,
        height_px: 480,
        focal_px: DVec2::new(500.1, 501.0 / 3.0),
        principal_px: DVec2::new(320.5, 239.5),
        world_from_camera: DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(1.0 / 3.0),
        center: DVec3::new(0.1, 0.2, 0.3),
    }
}

fn cloud(n: usize) -> GaussianCloud {
    GaussianCloud {
        sh: vec![[0.1, 0.2, 0.3]; n],
        extras: vec![ExtraProperty { name: "label".into(), values: vec![2.0; n] }],
        ..GaussianCloud::isotropic((0..n).map(|i| [i as f32, 0.5, -1.0]).collect(), -1.0, 0.25)
    }
}

fn info() -> SceneInfo {
    let exposure = Some(PhotoExposure { gain: [1.1, 0.9, 1.0 / 3.0], bias: [0.01, 0.0, -0.1] });
    let fit = PhotoFit { name: "b.jpg".into(), moved: Some([0.1 + 0.2, 0.05]), exposure };
    SceneInfo {
        meters_per_unit: Some(0.5),
        state: None,
        version: VERSION,
        name: "plush".into(),
        dataset: Some(DatasetReference { path: "../plush".into(), format: "transforms.json".into() }),
        cameras: vec![SceneCamera { name: "a.jpg".into(), camera: camera(), held_out: true }],
        background: Some([1.0, 0.5, 0.25]),
        edited: true,
        config: serde_json::json!({ "steps": 7000 }),
        history: History {
            steps: vec![StepMetrics { step: 10, secs: 0.1, loss: 0.3, train_psnr: 12.0, gaussians: 5 }],
            evaluations: vec![Evaluation {
                step: 10,
                secs: 0.1,
                psnr: f64::INFINITY,
                ssim: 1.0,
                gaussians: 5,
                views: vec![ViewScore { name: "a.jpg".into(), psnr: f64::INFINITY, ssim: 1.0 }],
                fitted: None,
            }],
        },
        photo_fits: vec![fit],
    }
}

#[test]
fn a_scene_survives_a_round_trip_and_a_second_save() {
    let folder = tempfile::tempdir().expect("folder");
    let folder = folder.path().join("new/scene");
    save(&folder, &info(), &cloud(5), None).expect("save");
    assert!(is_scene(&folder));
    let back = load(&folder).expect("load");
    let state = back.state.clone();
    assert!(state.is_some());
    let info_there = SceneInfo { state: state.clone(), ..info() };
    assert_eq!(back, TrainedScene { folder: folder.clone(), info: info_there, cloud: cloud(5), state });
    save(&folder, &info(), &cloud(9), None).expect("save again");
    assert_eq!(load(&folder).expect("load").cloud.len(), 9);
    assert_eq!(fs::read_dir(&folder).expect("list").count(), 2, "temporary files are left");
}

#[test]
fn a_failed_save_keeps_the_scene_that_was_there() {
    let folder = tempfile::tempdir().expect("folder");
    save(folder.path(), &info(), &cloud(5), None).expect("save");
    let mut broken = cloud(6);
    broken.positions[3][1] = f32::NAN;
    assert!(matches!(save(folder.path(), &info(), &broken, None), Err(IoError::Cloud { .. })));
    assert_eq!(load(folder.path()).expect("load").cloud.len(), 5);
}

#[test]
fn datasets_are_referred_to_relatively() {
    let folder = tempfile::tempdir().expect("folder");
    let root = folder.path().join("data/plush");
    fs::create_dir_all(&root).expect("create");
    let photo = |name: &str| Photo::new(name, root.join(name), camera());
    let dataset = Dataset { root: root.clone(), photos: vec![photo("a"), photo("b")], ..Dataset::default() };
    let scene = folder.path().join("out/scene");
    fs::create_dir_all(&scene).expect("create");
    let info = SceneInfo::of(&dataset, &[1], &scene);
    assert_eq!(info.dataset.as_ref().expect("known").path, Path::new("../../data/plush"));
    assert_eq!(info.cameras.iter().map(|c| c.held_out).collect::<Vec<_>>(), [false, true]);
    let trained = TrainedScene { folder: scene, info, cloud: cloud(1), state: None };
    let found = trained.dataset_path().expect("exists");
    assert_eq!(found, fs::canonicalize(&root).expect("real"), "not by way of the scene");
    fs::remove_dir(&root).expect("remove");
    assert_eq!(trained.dataset_path(), None);
}

#[test]
fn other_versions_and_broken_files_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    save(folder.path(), &info(), &cloud(1), None).expect("save");
    let path = folder.path().join(SCENE_FILE);
    let text = fs::read_to_string(&path).expect("read");
    let load_with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replacen(from, to, 1)).expect("write");
        load(folder.path())
    };
    assert!(matches!(load_with("\"version\": 1", "\"version\": 2"), Err(IoError::Version { found: 2, .. })));
    assert!(matches!(load_with("\"version\": 1", "\"version\": -1"), Err(IoError::Syntax { .. })));
    assert!(matches!(load_with("\"width_px\": 640", "\"width_px\": 0"), Err(IoError::Camera { .. })));
    assert!(matches!(load_with("{", "["), Err(IoError::Syntax { .. })));
    fs::write(&path, &text).expect("write");
    fs::remove_file(folder.path().join(CLOUD_FILE)).expect("remove");
    assert!(matches!(load(folder.path()), Err(IoError::Read { .. })));
}
