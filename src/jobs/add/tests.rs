//! Photos added to a made-up scene.

use std::collections::BTreeMap;

use glam::DVec3;

use super::*;
use crate::io::transforms::opengl_pose;
use crate::pipeline::observer::Silent;
use crate::pipeline::observer::testing::StopsAfter;
use crate::pipeline::train::TrainConfig;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Colored balls in a row; the small ones at the end show only in close-ups.
fn thing() -> GaussianCloud {
    let mut xs: Vec<[f32; 3]> = (0..12).map(|i| [0.25 * (i as f32 - 6.0), 0.1 * (i % 3) as f32, 0.0]).collect();
    xs.extend((0..12).map(|i| [0.04 * (i % 4) as f32, 0.04 * (i / 4) as f32, -0.25]));
    let mut cloud = GaussianCloud::isotropic(xs, -1.9, 3.0);
    cloud.log_scales[12..].fill([-4.0; 3]);
    cloud.sh = (0..cloud.len()).map(|i| std::array::from_fn(|c| ((i * 7 + c * 5) % 11) as f32 / 4.0 - 1.2)).collect();
    cloud
}

fn camera(angle: f64, distance: f64) -> Camera {
    let eye = DVec3::new(distance * angle.sin(), 0.3 * distance, -distance * angle.cos());
    Camera::look_at(eye, DVec3::new(0.05, 0.05, -0.2), DVec3::Y, 0.7, 48, 36).expect("valid")
}

/// Writes photos of the thing, those of the names in `test` held out.
fn photos(folder: &Path, cameras: &[Camera], test: &[usize]) {
    std::fs::create_dir_all(folder).expect("made");
    let (cloud, mut renderer) = (thing(), Renderer::new());
    let name = |i: usize| format!("{i:02}.png");
    for (i, camera) in cameras.iter().enumerate() {
        let frame = renderer.render(&cloud, Features::NONE, camera, &RenderSettings::default()).expect("drawn");
        let value = |k: usize, c: usize| (frame.color[c][k].clamp(0.0, 1.0) * 255.0) as u8;
        let rgb: Vec<u8> = (0..48 * 36).flat_map(|k| (0..3).map(move |c| (k, c))).map(|(k, c)| value(k, c)).collect();
        image::RgbImage::from_raw(48, 36, rgb).expect("of its size").save(folder.join(name(i))).expect("written");
    }
    let frame = |(i, c): (usize, &Camera)| json!({ "file_path": name(i), "transform_matrix": opengl_pose(c) });
    let held = |wanted: bool| (0..cameras.len()).filter(|i| test.contains(i) == wanted).map(name).collect::<Vec<_>>();
    let list = json!({
        "w": 48, "h": 36, "fl_x": cameras[0].focal_px.x, "frames": cameras.iter().enumerate().map(frame).collect::<Vec<_>>(),
        "train_filenames": held(false), "test_filenames": held(true), "fmlgs": { "background": [0.0, 0.0, 0.0] },
    });
    std::fs::write(folder.join("transforms.json"), list.to_string()).expect("written");
}

fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = std::fs::read_dir(folder).expect("a folder").flatten().map(|e| e.path()).filter(|p| p.is_file());
    files.map(|p| (p.clone(), std::fs::read(p).expect("read"))).collect()
}

/// A scene trained from afar, and close-ups of it.
fn far_and_near() -> (tempfile::TempDir, Scene) {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    photos(&at("far"), &(0..9).map(|i| camera(f64::from(i) * 0.3 - 1.2, 5.0)).collect::<Vec<_>>(), &[4]);
    photos(&at("near"), &(0..4).map(|i| camera(f64::from(i) * 0.2 - 0.3, 1.6)).collect::<Vec<_>>(), &[1]);
    let config = TrainConfig {
        steps: 150,
        sh_degree: 0,
        max_gaussians: Some(400),
        random_points: 150,
        eval_every: 0,
        backend: BackendChoice::Cpu,
        ..TrainConfig::default()
    };
    let dataset = open::dataset(&at("far")).expect("photos");
    let done = train::run(&dataset, &config, [at("scene")], &IfChanged::Ask.into(), &mut Silent).expect("trained");
    assert!(done.is_finished());
    let scene = open::scene(&at("scene")).expect("a scene");
    (folder, scene)
}

#[test]
fn close_ups_refine_what_they_show_and_the_scene_stays() {
    let (folder, scene) = far_and_near();
    let at = |name: &str| folder.path().join(name);
    let before = bytes(&at("scene"));
    let options = AddOptions { steps: Some(60), ..AddOptions::default() };
    let add = |out: &str, observer: &mut dyn Observer| run(&scene, &[at("near")], &options, &at(out), observer);
    let done = add("whole", &mut Silent).expect("added");
    assert!(done.finished && done.unchanged, "{done:?}");
    assert_eq!((done.trained, done.held_out, done.located), (3, 1, 0));
    assert!(done.refined.frozen > 0 && done.refined.frozen < done.refined.gaussians, "{done:?}");
    assert_eq!(done.held_out_scores.map(|s| s.photos), Some(1));
    assert_eq!(bytes(&at("scene")), before, "the scene is only read");
    let new = open::scene(&at("whole")).expect("a scene");
    assert_eq!((new.cameras.len(), new.cameras.iter().filter(|c| c.held_out).count()), (13, 2));
    assert!(new.dataset_path.is_some_and(|p| open::dataset(&p).is_ok_and(|d| d.photos.len() == 13)));
    // Killed before the list was written: nothing is in the way.
    std::fs::create_dir_all(at("stopped0/photos")).expect("made");
    std::fs::write(at("stopped0/photos/.joined.json.fmlgs-a1.tmp"), "{").expect("written");
    assert!(is_bare(&at("stopped0")) && !is_bare(&at("whole")) && !is_bare(&at("gone")), "where the window goes on");
    // Stopped at several places, and resumed: the same Gaussians.
    for (i, stop) in [3, 20, 60].into_iter().enumerate() {
        let out = format!("stopped{i}");
        let stopped = add(&out, &mut StopsAfter::new(stop));
        assert!(stopped.map_or_else(|e| e.is_cancelled(), |done| !done.finished), "at {stop}");
        assert!(add(&out, &mut Silent).expect("resumed").finished);
        let cloud = |name: &str| trained::load(&at(name)).expect("a scene").cloud;
        assert_eq!(cloud(&out).positions, cloud("whole").positions, "stopped at {stop}");
    }
    assert!(add("whole", &mut Silent).expect("done before").finished);
    let other = AddOptions { steps: Some(61), ..options.clone() };
    let error = run(&scene, &[at("near")], &other, &at("whole"), &mut Silent).expect_err("another request");
    assert!(error.to_string().contains("holds something"), "{error}");
    std::fs::create_dir_all(at("own/photos")).expect("made");
    std::fs::write(at("own/photos/mine.jpg"), "mine").expect("written");
    let error = run(&scene, &[at("near")], &options, &at("own"), &mut Silent).expect_err("the control").to_string();
    assert!(error.contains("holds something"), "{error}");
    let error = run(&scene, &[at("near")], &options, &at("scene"), &mut Silent).expect_err("itself").to_string();
    assert!(error.contains("the scene itself"), "{error}");
    // Once more, to what was made: all photos are there, and those that are known are no news.
    let whole = open::scene(&at("whole")).expect("a scene");
    let known = run(&whole, &[at("near")], &options, &at("known"), &mut Silent).expect_err("known").to_string();
    assert!(known.contains("no photo is left to add"), "{known}");
    photos(&at("nearer"), &[camera(0.1, 1.0), camera(-0.2, 1.0)], &[]);
    let again = run(&whole, &[at("nearer")], &options, &at("again"), &mut Silent).expect("added again");
    assert_eq!((again.trained, again.unchanged, again.held_out_scores.map(|s| s.photos)), (2, true, Some(2)));
    let list = joined::list(&at("again").join(PHOTOS)).expect("a list");
    assert_eq!(list.added.len(), 6);
}

#[test]
fn bad_photos_leave_nothing_behind() {
    let (folder, scene) = far_and_near();
    let at = |name: &str| folder.path().join(name);
    let before = bytes(&at("scene"));
    std::fs::write(at("text.jpg"), b"no picture").expect("written");
    image::RgbImage::new(1, 1).save(at("one.png")).expect("written");
    image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([(x * y % 251) as u8; 3]))
        .save(at("noise.png"))
        .expect("written");
    for name in ["text.jpg", "one.png", "noise.png"] {
        let options = AddOptions::default();
        let error = run(&scene, &[at(name)], &options, &at("out"), &mut Silent).expect_err(name).to_string();
        assert!(error.contains("no photo is left to add") && error.contains(name), "{error}");
        assert!(!at("out").exists(), "{name}");
    }
    let focal = AddOptions { focal_px: Some(50.0), ..AddOptions::default() };
    let error = run(&scene, &[at("near")], &focal, &at("out"), &mut Silent).expect_err("posed").to_string();
    assert!(error.contains("have poses"), "{error}");
    let masks = AddOptions { segmenter: Some("regions".into()), ..AddOptions::default() };
    let error = run(&scene, &[at("near")], &masks, &at("out"), &mut Silent).expect_err("no objects").to_string();
    assert!(error.contains("no objects") && !at("out").exists(), "{error}");
    // Posed in another frame: looks like nothing there.
    photos(&at("elsewhere"), &[camera(0.0, 1.6), camera(0.2, 1.6)], &[]);
    let text = std::fs::read_to_string(at("elsewhere/transforms.json")).expect("read");
    let mut list: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for frame in list["frames"].as_array_mut().expect("frames") {
        frame["transform_matrix"] = json!(opengl_pose(&Camera { center: DVec3::splat(40.0), ..camera(2.0, 5.0) }));
    }
    std::fs::write(at("elsewhere/transforms.json"), list.to_string()).expect("written");
    let elsewhere = run(&scene, &[at("elsewhere")], &AddOptions::default(), &at("other"), &mut Silent);
    let error = elsewhere.expect_err("posed elsewhere").to_string();
    assert!(error.contains("in another frame"), "{error}");
    assert!(!files::holds_something(&at("other")), "the folder can be used for another try");
    assert_eq!(bytes(&at("scene")), before);
}
