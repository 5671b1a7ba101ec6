//! Photos that a scene is compared with: with their own background, seen in training or not.

use std::path::{Path, PathBuf};

use image::RgbImage;
use serde_json::{Value, json};

use crate::cases::object_photos::ObjectPhotos;
use crate::cli_support::{copy, fmlgs, folder, tiny_dataset};

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// Trains for a moment.
fn train(photos: &Path, out: &Path, steps: &str, more: &[&str]) {
    let all = ["train", text(photos), "--out", text(out), "--steps", steps, "--backend", "cpu", "--max-side", "64"];
    fmlgs(&[&all[..], &["--eval-every", "0", "-q"], more].concat()).ok();
}

/// Measurements of `fmlgs eval`.
fn eval(scene: &Path, more: &[&str]) -> Value {
    fmlgs(&[&["eval", text(scene), "--json"], more].concat()).ok().json()
}

fn psnr(measured: &Value) -> f64 {
    measured["psnr"].as_f64().expect("a number")
}

/// Changes the list of a data set.
fn edit(photos: &Path, change: impl Fn(&mut Value)) {
    let list = photos.join("transforms.json");
    let mut all: Value = serde_json::from_slice(&std::fs::read(&list).expect("read")).expect("JSON");
    change(&mut all);
    std::fs::write(&list, all.to_string()).expect("written");
}

/// Mean difference of two pictures, in steps of 8 bits.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: f64 = a.iter().zip(b.iter()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / a.len() as f64
}

#[test]
fn a_splat_file_is_drawn_before_the_background_of_the_photos() {
    let folder = folder();
    let at = |name: &str| -> PathBuf { folder.path().join(name) };
    let photos = tiny_dataset(folder.path());
    let (scene, splat, black) = (at("scene"), at("splat.ply"), at("black"));
    train(&photos, &scene, "100", &[]);
    fmlgs(&["export", text(&scene), "--out", text(&splat)]).ok();
    // The control: the same photos, said to be before black.
    copy(&photos, &black);
    edit(&black, |all| all["fmlgs"]["background"] = json!([0.0, 0.0, 0.0]));

    let whole = psnr(&eval(&scene, &[]));
    let [file, before_black] = [&photos, &black].map(|photos| psnr(&eval(&splat, &["--photos", text(photos)])));
    assert!((file - whole).abs() < 0.1, "{file} dB of the file, {whole} dB of the scene");
    assert!(before_black < whole - 3.0, "{before_black} dB before black, {whole} dB before what is stated");

    let picture = |of: &Path, more: &[&str]| {
        let out = at("drawn.png");
        fmlgs(&[&["render", text(of), "--camera", "3", "--out", text(&out)], more].concat()).ok();
        image::open(&out).expect("a picture").to_rgb8()
    };
    let whole = picture(&scene, &[]);
    let [file, before_black] = [&photos, &black].map(|photos| picture(&splat, &["--photos", text(photos)]));
    assert!(difference(&file, &whole) < 1.0, "{}", difference(&file, &whole));
    assert!(difference(&before_black, &whole) > 10.0, "{}", difference(&before_black, &whole));
}

#[test]
fn photos_that_training_saw_are_marked() {
    let folder = folder();
    let (photos, scene) = (folder.path().join("photos"), folder.path().join("scene"));
    ObjectPhotos { backdrop: Some([90, 120, 60]), views: 12, ..ObjectPhotos::default() }.nerfstudio(&photos, |_, _| {});
    train(&photos, &scene, "20", &["--held-out-every", "4", "--random-points", "500"]);
    let rows = |more: &[&str]| fmlgs(&[&["eval", text(&scene)], more].concat()).ok().stdout;

    let own = rows(&[]);
    assert!(own.contains("mean of 3") && !own.contains("trained on"), "{own}");
    // Photo 0 was held out then, too; photo 6 was not.
    let others = rows(&["--held-out-every", "6"]);
    assert!(others.contains("06.png (trained on)") && !others.contains("00.png (trained on)"), "{others}");
    assert!(others.contains("mean of 1 held out") && others.contains("mean of 1 trained on"), "{others}");

    let measured = eval(&scene, &["--held-out-every", "6"]);
    let (held_out, trained_on) = (&measured["held_out"], &measured["trained_on"]);
    assert_eq!((&held_out["views"], &trained_on["views"]), (&json!(1), &json!(1)));
    assert_eq!(held_out["psnr"], measured["views"][0]["psnr"]);
    assert_eq!(trained_on["psnr"], measured["views"][1]["psnr"]);
    assert_eq!([0_usize, 1].map(|i| &measured["views"][i]["trained_on"]), [&json!(false), &json!(true)]);
    let all = eval(&scene, &["--held-out-every", "0"]);
    assert_eq!((&all["held_out"]["views"], &all["trained_on"]["views"]), (&json!(3), &json!(9)));
    let own = eval(&scene, &[]);
    assert_eq!((&own["held_out"]["views"], &own["trained_on"]), (&json!(3), &Value::Null));
}

#[test]
fn a_set_that_marks_its_test_photos_is_split_in_no_other_way() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let (out, scene) = (folder.path().join("out"), folder.path().join("scene"));
    let why = ["--held-out-every has no effect here", "marks 2 of its 16 photos as test", "Leave the option out"];
    let refused = |arguments: &[&str]| {
        let said = fmlgs(arguments).fails_with(2).stderr;
        why.iter().for_each(|words| assert!(said.contains(words), "{arguments:?}: {said}"));
    };
    for every in ["0", "2"] {
        refused(&["train", text(&photos), "--out", text(&out), "--steps", "5", "--held-out-every", every]);
        assert!(!out.exists());
    }
    train(&photos, &scene, "5", &[]);
    refused(&["eval", text(&scene), "--held-out-every", "2"]);
    // All photos, however they are marked.
    let all = eval(&scene, &["--held-out-every", "0"]);
    assert_eq!((&all["held_out"]["views"], &all["trained_on"]["views"]), (&json!(2), &json!(14)));

    // The control: without marks it is every second one.
    edit(&photos, |all| {
        for name in ["train_filenames", "val_filenames", "test_filenames"] {
            all.as_object_mut().expect("an object").remove(name);
        }
    });
    train(&photos, &out, "5", &["--held-out-every", "2"]);
    assert_eq!(eval(&out, &[])["held_out"]["views"], 8);
}
