//! Pixels and points that count in training: transparent pixels, masks, scenes without points, one camera among others.

use std::fs;
use std::path::Path;

use fmlgs::io::{Opened, open};
use glam::DVec3;
use image::{GrayImage, Luma, Rgb, RgbImage};
use serde_json::json;

use crate::cases::object_photos::{BALLS, ObjectPhotos};
use crate::cli_support::{Done, copy, fmlgs, folder};
use crate::common::case;

/// Trains on the CPU, without holding photos out unless `more` says so.
fn train(data: &Path, out: &Path, steps: usize, more: &[&str]) -> Done {
    let steps = steps.to_string();
    let (data, out) = (data.to_str().expect("UTF-8"), out.to_str().expect("UTF-8"));
    let mut all =
        vec!["train", data, "--out", out, "--steps", &steps, "--backend", "cpu", "--sh-degree", "1", "--json"];
    all.extend(["--eval-every", "0"].iter().chain(more));
    fmlgs(&all).ok()
}

fn info(data: &Path) -> serde_json::Value {
    fmlgs(&["info", data.to_str().expect("UTF-8"), "--json"]).ok().json()
}

fn warnings(data: &Path) -> String {
    info(data)["warnings"].to_string()
}

fn held_out_db(done: &Done) -> f64 {
    done.json()["evaluations"][0]["psnr"].as_f64().expect("held out")
}

/// Gaussians of opacity over 0.1 that lie farther from the balls than a tenth of the larger one's radius.
fn outside(scene: &Path, scale: f64) -> usize {
    let Ok(Opened::Trained(scene)) = open(scene) else { panic!("a scene") };
    let cloud = &scene.cloud;
    let far = |i: &usize| {
        let p = cloud.world_position(*i) / scale;
        BALLS.iter().all(|(center, radius)| p.distance(DVec3::from(*center)) > radius + 0.1)
    };
    (0..cloud.len()).filter(far).filter(|i| cloud.opacity_logits[*i] > (0.1_f32 / 0.9).ln()).count()
}

/// Mean drawn alpha where a photo is transparent, and where it is opaque.
fn drawn_alpha(scene: &Path, camera: &str, photo: &image::RgbaImage) -> [f64; 2] {
    let picture = scene.join("alpha.png");
    let (scene, out) = (scene.to_str().expect("UTF-8"), picture.to_str().expect("UTF-8"));
    fmlgs(&["render", scene, "--camera", camera, "--channel", "alpha", "--out", out]).ok();
    let drawn = image::open(&picture).expect("picture").to_luma8();
    assert_eq!(drawn.dimensions(), photo.dimensions());
    [0_u8, 255].map(|value| {
        let of: Vec<f64> = photo
            .enumerate_pixels()
            .filter(|(_, _, p)| p.0[3] == value)
            .map(|(x, y, _)| f64::from(drawn.get_pixel(x, y).0[0]) / 255.0)
            .collect();
        of.iter().sum::<f64>() / of.len() as f64
    })
}

#[test]
fn a_thing_that_was_cut_out_needs_no_points() {
    let folder = folder();
    let (data, out) = (folder.path().join("data"), folder.path().join("scene"));
    ObjectPhotos::default().blender(&data);
    let db = held_out_db(&train(&data, &out, 300, &["--random-points", "3000"]));
    assert!(db > 16.0, "{db}");
    assert_eq!(outside(&out, 1.0), 0);

    // Negative control: points strewn along the rays of photos before white, as training began once.
    let opaque = ObjectPhotos { backdrop: Some([255; 3]), ..ObjectPhotos::default() };
    let (data, out) = (folder.path().join("strewn"), folder.path().join("fog"));
    opaque.nerfstudio(&data, |_, _| {});
    let mut points = String::new();
    for k in 0..3_000_u32 {
        let noise = |n: u32| f64::from((k * 7 + n).wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24);
        let i = k as usize % opaque.views;
        let eye = opaque.eye(i);
        let side = DVec3::new(noise(1) - 0.5, noise(2) - 0.5, noise(3) - 0.5) * 2.0;
        let p = eye + (side - eye) * 4.0_f64.powf(2.0 * noise(4) - 1.0);
        points += &format!("{} {} {} 255 255 255\n", p.x, p.y, p.z);
    }
    let header = "ply\nformat ascii 1.0\nelement vertex 3000\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    fs::write(data.join("points.ply"), format!("{header}{points}")).expect("write");
    let mut about: serde_json::Value =
        serde_json::from_slice(&fs::read(data.join("transforms.json")).expect("read")).expect("JSON");
    (about["ply_file_path"], about["fmlgs"]) = (json!("points.ply"), json!({ "background": [1.0, 1.0, 1.0] }));
    fs::write(data.join("transforms.json"), about.to_string()).expect("write");
    let strewn = held_out_db(&train(&data, &out, 300, &[]));
    assert!(strewn < db - 3.0, "{strewn} {db}");
    assert!(outside(&out, 1.0) > 50);
}

#[test]
fn photos_before_a_backdrop_need_no_points_either() {
    for stated in [true, false] {
        let folder = folder();
        let (data, out) = (folder.path().join("data"), folder.path().join("scene"));
        let photos = ObjectPhotos { backdrop: Some([255; 3]), ..ObjectPhotos::default() };
        match stated {
            true => photos.blender(&data),
            false => photos.nerfstudio(&data, |_, _| {}),
        }
        let db = held_out_db(&train(&data, &out, 300, &["--random-points", "3000"]));
        assert!(db > 16.0, "{stated}: {db}");
        assert_eq!(outside(&out, 1.0), 0);
    }
}

#[test]
fn the_cut_out_thing_of_a_report_stands_alone() {
    let Some(data) = case("21_rgba_cutout") else { return };
    assert_eq!(info(&data)["alpha"], "empty");
    let folder = folder();
    let out = folder.path().join("scene");
    let done = train(&data, &out, 1000, &["--held-out-every", "0"]);
    assert!(done.stderr.contains("Transparent pixels are kept empty"), "{}", done.stderr);
    let photo = image::open(data.join("images/img_05.png")).expect("photo").to_rgba8();
    let [outside, inside] = drawn_alpha(&out, "5", &photo);
    assert!(outside < 0.05 && inside > 0.9, "{outside} {inside}");
    // Negative control, and the option: what is passed over is filled with anything.
    let out = folder.path().join("ignored");
    train(&data, &out, 400, &["--held-out-every", "0", "--alpha", "ignore"]);
    let [outside, _] = drawn_alpha(&out, "5", &photo);
    assert!(outside > 0.3, "{outside}");
}

#[test]
fn cut_out_photos_of_every_layout_are_scored_before_what_they_were_trained_before() {
    let folder = folder();
    let (data, out) = (folder.path().join("data"), folder.path().join("scene"));
    ObjectPhotos::default().nerfstudio(&data, |_, _| {});
    assert_eq!(info(&data)["alpha"], "empty");
    let done = train(&data, &out, 200, &["--alpha", "background", "--random-points", "2000"]);
    let trained = held_out_db(&done);
    let scene = out.to_str().expect("UTF-8");
    let scored = fmlgs(&["eval", scene, "--json"]).ok().json();
    let scored = scored["psnr"].as_f64().expect("a number");
    assert!((trained - scored).abs() < 0.01, "{trained} {scored}");
    // The same again goes on where it stopped; with another meaning of alpha it is another run.
    train(&data, &out, 200, &["--alpha", "background", "--random-points", "2000"]);
    let data = data.to_str().expect("UTF-8");
    let other = [
        &["train", data, "--out", scene, "--steps", "200", "--backend", "cpu", "--sh-degree", "1", "--eval-every", "0"]
            [..],
        &["--random-points", "2000", "--alpha", "ignore"],
    ]
    .concat();
    assert_ne!(fmlgs(&other).code, Some(0));
}

#[test]
fn transparent_holes_and_corners_are_passed_over() {
    // Somebody was taken out of the photos.
    let folder = folder();
    let photos = ObjectPhotos { backdrop: Some([120, 140, 90]), views: 12, ..ObjectPhotos::default() };
    photos.nerfstudio(folder.path(), |_, _| {});
    for i in 0..12_u32 {
        let path = folder.path().join(format!("images/{i:02}.png"));
        let mut picture = image::open(&path).expect("photo").to_rgba8();
        (0..100).for_each(|k| picture.get_pixel_mut(10 + i + k % 10, 12 + k / 10).0[3] = 0);
        picture.save(&path).expect("save");
    }
    assert_eq!(info(folder.path())["alpha"], "ignore");
    // Opaque photos say nothing.
    photos.nerfstudio(folder.path(), |_, _| {});
    assert!(info(folder.path())["alpha"].is_null());
}

/// Pixels under the black of the masks change nothing.
fn masked_pixels_do_not_count(data: &Path, masked: impl Fn(u32, u32) -> bool, photos: &Path) {
    let folder = folder();
    let clouds = [false, true].map(|change| {
        if change {
            for entry in fs::read_dir(photos).expect("photos") {
                let path = entry.expect("entry").path();
                let mut picture = image::open(&path).expect("photo").to_rgb8();
                for (x, y, p) in picture.enumerate_pixels_mut().filter(|(x, y, _)| masked(*x, *y)) {
                    *p = Rgb([(x * 37 % 256) as u8, (y * 91 % 256) as u8, 255]);
                }
                picture.save(&path).expect("save");
            }
        }
        let out = folder.path().join(format!("scene-{change}"));
        train(data, &out, 60, &["--max-side", "84"]);
        let scene = out.to_str().expect("UTF-8");
        let scored = fmlgs(&["eval", scene, "--json"]).ok().json()["psnr"].as_f64().expect("a number");
        let Ok(Opened::Trained(scene)) = open(&out) else { panic!("a scene") };
        (scene.cloud, scored)
    });
    assert!(clouds[0].0 == clouds[1].0, "other Gaussians");
    assert_eq!(clouds[0].1, clouds[1].1, "another score");
}

#[test]
fn masks_of_a_report_say_which_pixels_count() {
    let Some(case) = case("01_masks_folder") else { return };
    let folder = folder();
    let data = folder.path().join("data");
    copy(&case, &data);
    assert_eq!(info(&data)["masks"], 8);
    masked_pixels_do_not_count(&data, |x, _| x < 42, &data.join("images"));
}

#[test]
fn masks_that_frames_name_and_masks_of_the_photos_stems_count() {
    let photos = ObjectPhotos { backdrop: Some([90, 120, 60]), views: 10, ..ObjectPhotos::default() };
    let mask = |side: u32| GrayImage::from_fn(side, side, |x, _| Luma([if x < side / 2 { 0 } else { 255 }]));
    let named = folder();
    photos.nerfstudio(named.path(), |i, frame| frame["mask_path"] = json!(format!("counts/m{i}.png")));
    fs::create_dir(named.path().join("counts")).expect("folder");
    (0..10).for_each(|i| mask(24).save(named.path().join(format!("counts/m{i}.png"))).expect("save"));
    assert_eq!(info(named.path())["masks"], 10);
    masked_pixels_do_not_count(named.path(), |x, _| x < 24, &named.path().join("images"));

    let beside = folder();
    photos.nerfstudio(beside.path(), |_, _| {});
    fs::create_dir(beside.path().join("masks")).expect("folder");
    (0..9).for_each(|i| mask(48).save(beside.path().join(format!("masks/{i:02}.png"))).expect("save"));
    assert_eq!(info(beside.path())["masks"], 9);
    // One of another shape is named, and the others are used.
    mask(30).save(beside.path().join("masks/03.png")).expect("save");
    GrayImage::new(48, 20).save(beside.path().join("masks/03.png")).expect("save");
    assert_eq!(info(beside.path())["masks"], 8);
    assert!(
        warnings(beside.path()).contains("1 of 9 masks cannot be used") && warnings(beside.path()).contains("03.png")
    );

    // Masks that frames name must be there, and fit.
    fs::remove_file(named.path().join("counts/m4.png")).expect("removed");
    assert!(warnings(named.path()).contains("1 listed masks are missing"), "{}", warnings(named.path()));
    GrayImage::new(48, 20).save(named.path().join("counts/m4.png")).expect("save");
    let said = fmlgs(&["info", named.path().to_str().expect("UTF-8")]).fails_with(1).stderr;
    assert!(said.contains("m4.png"), "{said}");
}

#[test]
fn photos_whose_masks_are_all_black_are_left_out_and_named() {
    let folder = folder();
    let data = folder.path().join("data");
    let photos = ObjectPhotos { backdrop: Some([90, 120, 60]), views: 10, ..ObjectPhotos::default() };
    photos.nerfstudio(&data, |i, frame| frame["mask_path"] = json!(format!("counts/{i:02}.png")));
    fs::create_dir(data.join("counts")).expect("folder");
    let mask = |i: usize, value: u8| {
        let path = data.join(format!("counts/{i:02}.png"));
        GrayImage::from_pixel(24, 24, Luma([value])).save(path).expect("save");
    };
    let out = |name: &str| folder.path().join(name);
    let said = |name: &str, every: &str| train(&data, &out(name), 20, &["--held-out-every", every]).stderr;
    (0..10).for_each(|i| mask(i, 255));
    assert!(!said("all", "0").contains("show nothing"), "the control");
    mask(3, 0);
    let one = said("one", "0");
    assert!(one.contains("1 of 10 photos show nothing and are left out") && one.contains("03.png"), "{one}");
    assert_eq!(one.matches("show nothing").count(), 1, "{one}");
    // The same run goes on: it is the same photo that is left out.
    train(&data, &out("one"), 40, &["--held-out-every", "0", "--go-on"]);
    // One that is held out is no reason to stop either.
    (0..10).for_each(|i| mask(i, 255));
    mask(0, 0);
    let held = said("held", "5");
    assert!(held.contains("1 of 2 photos show nothing") && held.contains("00.png"), "{held}");
    let scene = out("held");
    let judged = fmlgs(&["eval", scene.to_str().expect("UTF-8"), "--json"]).ok();
    assert!(judged.stderr.contains("1 photo left out") && judged.stderr.contains("00.png"), "{}", judged.stderr);
    assert_eq!(judged.json()["views"].as_array().map(Vec::len), Some(1));
    // Without any that shows something, there is nothing to train on.
    (0..10).for_each(|i| mask(i, 0));
    let (data, out) = (data.to_str().expect("UTF-8"), out("none"));
    let none = fmlgs(&["train", data, "--out", out.to_str().expect("UTF-8"), "--steps", "20", "--backend", "cpu"]);
    assert!(none.fails_with(1).stderr.contains("shows nothing"));
}

#[test]
fn labels_beside_the_photos_are_no_masks() {
    let photos = ObjectPhotos { backdrop: Some([90, 120, 60]), views: 6, ..ObjectPhotos::default() };
    let several = |x: u32| Rgb([(x / 12 * 60) as u8; 3]);
    let colors = |x: u32| if x < 20 { Rgb([0; 3]) } else { Rgb([200, 30, 30]) };
    for label in [&several as &dyn Fn(u32) -> Rgb<u8>, &colors] {
        let folder = folder();
        photos.nerfstudio(folder.path(), |_, _| {});
        fs::create_dir(folder.path().join("masks")).expect("folder");
        for i in 0..6 {
            let picture = RgbImage::from_fn(48, 48, |x, _| label(x));
            picture.save(folder.path().join(format!("masks/{i:02}.png"))).expect("save");
        }
        assert_eq!(info(folder.path())["masks"], 0);
        assert!(warnings(folder.path()).contains("6 pictures beside the photos are passed over"));
    }
}

#[test]
fn one_wild_camera_is_named_and_costs_little() {
    let folder = folder();
    let (data, out) = (folder.path().join("data"), folder.path().join("scene"));
    let photos = ObjectPhotos { views: 24, ..ObjectPhotos::default() };
    photos.nerfstudio(&data, |_, _| {});
    assert!(!warnings(&data).contains("far from all others"));
    let good = held_out_db(&train(&data, &out, 200, &["--random-points", "2000"]));
    photos.nerfstudio(&data, |i, frame| {
        if i == 5 {
            frame["transform_matrix"][0][3] = json!(900.0);
        }
    });
    let said = warnings(&data);
    assert!(said.contains("far from all others") && said.contains("images/05.png"), "{said}");
    let out = folder.path().join("wild");
    let wild = held_out_db(&train(&data, &out, 200, &["--random-points", "2000"]));
    assert!(wild > good - 1.0, "{wild} {good}");
}

#[test]
fn scenes_of_any_scale_train_alike() {
    let folder = folder();
    let [small, usual, large] = [0.001, 1.0, 1000.0].map(|scale| {
        let (data, out) = (folder.path().join(format!("data-{scale}")), folder.path().join(format!("scene-{scale}")));
        ObjectPhotos { scale, views: 24, ..ObjectPhotos::default() }.nerfstudio(&data, |_, _| {});
        let done = train(&data, &out, 200, &["--random-points", "2000"]);
        let shot =
            fmlgs(&["eval", out.to_str().expect("UTF-8"), "--json"]).ok().json()["psnr"].as_f64().expect("a number");
        assert!((shot - held_out_db(&done)).abs() < 0.05, "{scale}: {shot}");
        held_out_db(&done)
    });
    assert!((small - usual).abs() < 0.5 && (large - usual).abs() < 0.5, "{small} {usual} {large}");
}
