//! Label files: what belongs to which photo, groups, holes, other formats.

use std::fs;
use std::path::{Path, PathBuf};

use fmlgs::io::labels::Labels;
use fmlgs::io::{self, Opened};
use fmlgs::scene::Dataset;
use serde_json::{Value, json};

use crate::cli_support::{copy, fmlgs, folder};
use crate::common::case;

fn dataset(photos: &Path) -> Dataset {
    match io::open(photos).expect("photos") {
        Opened::Dataset(dataset) => dataset,
        _ => panic!("{} is no data set", photos.display()),
    }
}

/// Trains a little on `photos`, finds objects from `labels`, and returns the scene and what `preprocess --json` says.
fn found(out: &Path, photos: &Path, labels: &Path) -> (PathBuf, Value) {
    let scene = out.join("scene");
    let [p, s, l] = [photos, &scene, labels].map(|path| path.to_str().unwrap());
    fmlgs(&[
        "train",
        p,
        "--out",
        s,
        "--steps",
        "60",
        "--backend",
        "cpu",
        "--held-out-every",
        "0",
        "--max-side",
        "84",
        "-q",
    ])
    .ok();
    let done = fmlgs(&["preprocess", s, "--masks", l, "--encoder", "none", "--json", "-q"]).ok();
    (scene, done.json())
}

fn objects(found: &Value) -> Vec<String> {
    let of = |i: &Value| i["names"][0].as_str().unwrap_or_default().to_owned();
    let all = found["identities"].as_array().expect("identities");
    let mut names: Vec<String> = all.iter().filter(|i| i["level"] == "object").map(of).collect();
    names.sort();
    names
}

#[test]
fn two_groups_of_a_category_are_two_objects() {
    let Some(case) = case("03_isat_groups") else { return };
    let out = folder();
    let (_, found) = found(out.path(), &case.join("photos"), &case.join("labels"));
    assert_eq!(objects(&found), ["cup", "cup"], "{found}");
}

#[test]
fn background_cuts_a_hole_and_is_no_name() {
    let Some(case) = case("04_isat_hole") else { return };
    let out = folder();
    let (scene, found) = found(out.path(), &case.join("photos"), &case.join("labels"));
    assert_eq!(objects(&found), ["ring"]);
    assert!(!found.to_string().contains("__background__"), "{found}");
    let mask = out.path().join("mask.png");
    let [s, m] = [&scene, &mask].map(|path| path.to_str().unwrap());
    fmlgs(&["query", s, "ring", "--camera", "0", "--mask", m, "-q"]).ok();
    // The label itself, pixel by pixel.
    let photos = dataset(&case.join("photos"));
    let labels = Labels::of_photos(&case.join("labels"), &photos.photos).expect("labels");
    let region = labels.of(&photos.photos[0], 84).expect("regions").remove(0);
    // 60 x 48 pixels without 26 x 24, and the rims of both.
    assert!(region.mask.area().abs_diff(60 * 48 - 26 * 24) < 30, "{}", region.mask.area());
    let drawn = image::open(&mask).expect("a mask").into_luma8();
    let (w, h) = drawn.dimensions();
    let at = |x: u32, y: u32| drawn.get_pixel(x * w / 84, y * h / 63).0[0] > 127;
    assert!(at(14, 32) && !at(41, 32));
}

#[test]
fn labels_of_a_rig_are_of_one_photo() {
    let Some(case) = case("05_rig_labels") else { return };
    let (photos, at) = (dataset(&case.join("photos")).photos, folder());
    let has = |labels: &Labels| photos.iter().filter(|p| labels.has(p)).map(|p| p.name.clone()).collect::<Vec<_>>();
    let labels = Labels::of_photos(&case.join("labels"), &photos).expect("labels");
    assert_eq!(has(&labels), ["cam0/frame00.png"]);
    // The folder that the label file lies in, or none that helps.
    let text = fs::read_to_string(case.join("labels/frame00.json")).expect("read");
    let text = text.replace("D:/set/images/cam0", "");
    fs::create_dir_all(at.path().join("cam1")).expect("folder");
    fs::write(at.path().join("cam1/frame00.json"), &text).expect("write");
    assert_eq!(has(&Labels::of_photos(at.path(), &photos).expect("labels")), ["cam1/frame00.png"]);
    fs::rename(at.path().join("cam1/frame00.json"), at.path().join("frame00.json")).expect("move");
    let e = Labels::of_photos(at.path(), &photos).err().expect("two photos").to_string();
    assert!(e.contains("'cam0/frame00.png'") && e.contains("'cam1/frame00.png'"), "{e}");
}

#[test]
fn renamed_and_second_label_files_count_and_others_are_named() {
    let Some(case) = case("22_labels_renamed") else { return };
    let at = folder();
    copy(&case.join("labels"), at.path());
    let text = fs::read_to_string(at.path().join("img_03.json")).expect("read");
    fs::write(at.path().join("gone.json"), text).expect("write");
    let photos = dataset(&case.join("photos")).photos;
    let labels = Labels::of_photos(at.path(), &photos).expect("labels");
    let names = |photo: usize| labels.of(&photos[photo], 84).expect("regions").len();
    assert_eq!((names(0), names(3), names(1)), (2, 1, 0));
    let notes = labels.notes().join("\n");
    assert!(notes.contains("1 of 4") && notes.contains("gone.json"), "{notes}");
    assert!(notes.contains("img_00.json") && notes.contains("second.json") && notes.contains("joined"), "{notes}");
}

#[test]
fn all_that_people_labeled_is_found_in_the_scene() {
    let Some(case) = case("22_labels_renamed") else { return };
    let out = folder();
    let (_, found) = found(out.path(), &case.join("photos"), &case.join("labels"));
    assert_eq!(objects(&found), ["bowl", "cup", "plate"], "{found}");
    assert_eq!(found["seeds"], json!(["images/img_00.png", "images/img_03.png"]), "{}", found["seeds"]);
    assert!(found["warnings"].to_string().contains("joined"), "{}", found["warnings"]);
}

/// The same two rectangles in the forms of four programs give the same pixels.
#[test]
fn the_same_labels_of_four_programs_are_the_same() {
    let Some(case) = case("03_isat_groups") else { return };
    let photos = dataset(&case.join("photos")).photos;
    let (w, h) = (84.0, 63.0);
    let boxes = [[8.0, 10.0, 26.0, 40.0], [55.0, 10.0, 75.0, 40.0]];
    let corners = |[l, t, r, b]: [f64; 4]| [[l, t], [r, t], [r, b], [l, b]];
    let shape =
        |b: [f64; 4]| json!({ "label": "cup", "points": corners(b), "group_id": null, "shape_type": "polygon" });
    let labelme = json!({ "version": "5.4.1", "shapes": boxes.map(shape), "imagePath": "img_00.png", "imageHeight": 63, "imageWidth": 84 });
    let annotation = |b: [f64; 4]| json!({ "id": b[0], "image_id": 9, "category_id": 4, "iscrowd": 0, "segmentation": [corners(b).concat()] });
    let coco = json!({ "images": [{ "id": 9, "file_name": "img_00.png", "width": 84, "height": 63 }],
        "categories": [{ "id": 4, "name": "cup" }], "annotations": boxes.map(annotation) });
    let line = |b: [f64; 4]| format!("0 {}\n", corners(b).map(|[x, y]| format!("{} {}", x / w, y / h)).join(" "));
    let files = [
        ("labelme", "anything.json", labelme.to_string()),
        ("coco", "instances.json", coco.to_string()),
        ("yolo", "labels/img_00.txt", boxes.map(line).concat()),
        ("yolo", "data.yaml", "names:\n  0: cup\n".to_owned()),
    ];
    let at = folder();
    for (kind, name, text) in &files {
        let path = at.path().join(kind).join(name);
        fs::create_dir_all(path.parent().expect("parent")).expect("folder");
        fs::write(path, text).expect("write");
    }
    for kind in ["labelme", "coco", "yolo"] {
        let labels = Labels::of_photos(&at.path().join(kind), &photos).expect(kind);
        assert!(labels.notes().is_empty(), "{kind}: {:?}", labels.notes());
        let regions = labels.of(&photos[0], 84).expect(kind);
        assert_eq!(regions.iter().map(|r| r.mask.area()).collect::<Vec<_>>(), [540, 600], "{kind}");
        assert!((1..8).all(|i| !labels.has(&photos[i])), "{kind}");
    }
}
