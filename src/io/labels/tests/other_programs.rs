//! Labels of LabelMe, COCO and YOLO, recognized by their content.

use serde_json::{Value, json};

use super::*;

struct Set(tempfile::TempDir);

impl Set {
    fn new(files: &[(&str, String)]) -> Self {
        let folder = tempfile::tempdir().expect("folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("parent")).expect("folder");
            fs::write(path, text).expect("write");
        }
        Self(folder)
    }

    fn labels(&self) -> Labels {
        Labels::of_photos(self.0.path(), &[photo("a.png", 20, 10), photo("b.png", 20, 10)]).expect("labels")
    }

    fn regions(&self, name: &str) -> Vec<(String, usize)> {
        let found = self.labels().of(&photo(name, 20, 10), 4096).expect("regions");
        found.into_iter().map(|r| (r.name, r.mask.area())).collect()
    }

    fn fails(&self) -> String {
        let labels = Labels::of_photos(self.0.path(), &[photo("a.png", 20, 10)]);
        labels.and_then(|labels| labels.of(&photo("a.png", 20, 10), 4096)).expect_err("refused").to_string()
    }
}

fn named(list: &[(&str, usize)]) -> Vec<(String, usize)> {
    list.iter().map(|(name, area)| ((*name).to_owned(), *area)).collect()
}

fn labelme(shapes: &[Value]) -> String {
    json!({ "version": "5.4.1", "flags": {}, "shapes": shapes, "imagePath": "..\\images\\a.png", "imageData": null,
        "imageWidth": 20, "imageHeight": 10 })
    .to_string()
}

fn shape(label: &str, kind: &str, points: &Value, group: &Value) -> Value {
    json!({ "label": label, "shape_type": kind, "points": points, "group_id": group, "flags": {} })
}

#[test]
fn labelme_shapes_of_one_group_are_one_thing() {
    let square = |x: f64| json!([[x, 1.0], [x + 4.0, 1.0], [x + 4.0, 5.0], [x, 5.0]]);
    let set = Set::new(&[(
        "x/second.json",
        labelme(&[
            shape("cup", "polygon", &square(0.0), &json!(7)),
            shape("cup", "polygon", &square(5.0), &json!(7)),
            shape("cup", "polygon", &square(10.0), &Value::Null),
            shape("box", "rectangle", &json!([[19.0, 9.0], [15.0, 7.0]]), &Value::Null),
            shape("disk", "circle", &json!([[4.5, 5.5], [4.5, 8.5]]), &Value::Null),
            shape("wire", "linestrip", &json!([[0, 0], [5, 5]]), &Value::Null),
            shape("ring", "linestrip", &json!([[0, 0], [4, 0], [4, 4], [0, 4], [0, 0.5]]), &Value::Null),
            shape("dot", "point", &json!([[1, 1]]), &Value::Null),
            shape("__ignore__", "polygon", &square(0.0), &Value::Null),
        ]),
    )]);
    let found = set.regions("a.png");
    assert_eq!(found[..3], named(&[("cup", 32), ("cup", 16), ("box", 8)]));
    // A circle of radius 3 has 28.3 px.
    assert!(found[3].0 == "disk" && found[3].1.abs_diff(28) <= 1, "{found:?}");
    assert_eq!(found[4..], named(&[("ring", 16)]));
    let notes = set.labels().notes().join("; ");
    assert!(notes.contains("2 shapes without an area") && notes.contains("1 shapes that are to be ignored"), "{notes}");
    // Background cuts what was drawn before it.
    let cut = [
        shape("cup", "polygon", &square(0.0), &Value::Null),
        shape("_background_", "rectangle", &json!([[1, 2], [3, 4]]), &Value::Null),
    ];
    assert_eq!(Set::new(&[("a.json", labelme(&cut))]).regions("a.png"), named(&[("cup", 12)]));
}

#[test]
fn labelme_masks_are_pictures_in_their_place() {
    let picture = image::GrayImage::from_fn(3, 2, |x, _| image::Luma([if x == 0 { 0 } else { 255 }]));
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).expect("encode");
    let mut mask = shape("leaf", "mask", &json!([[17.0, 8.0], [19.0, 9.0]]), &Value::Null);
    mask["mask"] = json!(base64::encode(png.get_ref()));
    let set = Set::new(&[("a.json", labelme(&[mask.clone()]))]);
    let found = set.labels().of(&photo("a.png", 20, 10), 4096).expect("regions");
    assert_eq!(found[0].mask.pixels().collect::<Vec<_>>(), [8 * 20 + 18, 8 * 20 + 19, 9 * 20 + 18, 9 * 20 + 19]);
    mask["mask"] = json!("!");
    assert!(Set::new(&[("a.json", labelme(&[mask.clone()]))]).fails().contains("shapes[0]: its mask is no base64"));
    mask["mask"] = json!("AAAA");
    assert!(Set::new(&[("a.json", labelme(&[mask]))]).fails().contains("its mask is no picture"));
}

fn coco(annotations: &Value, categories: &Value) -> String {
    json!({ "info": {}, "images": [
        { "id": 3, "file_name": "images/a.png", "width": 20, "height": 10 },
        { "id": 5, "file_name": "gone.png", "width": 20, "height": 10 },
        { "id": 6, "file_name": "b.png", "width": 20, "height": 10 },
    ], "annotations": annotations, "categories": categories })
    .to_string()
}

#[test]
fn coco_annotations_are_things_of_their_own() {
    let categories = json!([{ "id": 1, "name": "cup", "supercategory": "object" }, { "id": 2, "name": "plate" }]);
    let square = |x: i32| json!([x, 1, x + 4, 1, x + 4, 5, x, 5]);
    let annotations = json!([
        { "id": 1, "image_id": 3, "category_id": 1, "segmentation": [square(0), square(6)], "iscrowd": 0 },
        { "id": 2, "image_id": 3, "category_id": 1, "segmentation": [square(12)] },
        { "id": 3, "image_id": 3, "category_id": 2, "segmentation": { "size": [10, 20], "counts": [160, 40] }, "iscrowd": 1 },
        // The same columns, packed: 160 is 0x20 + 0 with more, then 5; 40 is 8 with more, then 1.
        { "id": 4, "image_id": 3, "category_id": 2, "segmentation": { "size": [10, 20], "counts": "P5X1" } },
        { "id": 5, "image_id": 3, "category_id": 1, "bbox": [0, 0, 5, 5], "segmentation": [] },
        { "id": 6, "image_id": 5, "category_id": 1, "segmentation": [square(0)] },
        { "id": 7, "image_id": 9, "category_id": 1, "segmentation": [square(0)] },
    ]);
    let set = Set::new(&[("instances.json", coco(&annotations, &categories))]);
    assert_eq!(set.regions("a.png"), named(&[("cup", 32), ("cup", 16), ("plate", 40), ("plate", 40)]));
    let labels = set.labels();
    assert!(!labels.has(&photo("b.png", 20, 10)), "nothing is said about it");
    // "object" without 'parent' is another program's term.
    assert!(labels.of(&photo("a.png", 20, 10), 4096).expect("regions").iter().all(|r| r.level.is_none()));
    let notes = labels.notes().join("; ");
    for words in [
        "1 annotations without a mask",
        "1 annotations are marked as crowds",
        "1 annotations of pictures that are not in the list",
        "1 of 2 labeled pictures are none of the photos, and are not used (first: instances.json, of 'gone.png')",
    ] {
        assert!(notes.contains(words), "{words}: {notes}");
    }
}

#[test]
fn coco_with_wholes_is_our_own() {
    let categories = json!([
        { "id": 1, "name": "cup", "supercategory": "object", "parent": null },
        { "id": 2, "name": "rim \u{b7} cup", "supercategory": "part", "parent": 1 },
        { "id": 3, "name": "lid", "supercategory": "object", "parent": null },
    ]);
    let runs = |from: u32, n: u32| json!({ "size": [10, 20], "counts": [from, n, 200 - from - n] });
    let annotation = |category: u32, from: u32, n: u32| json!({ "id": 1, "image_id": 3, "category_id": category, "segmentation": runs(from, n) });
    let set = Set::new(&[(
        "a.json",
        coco(&json!([annotation(2, 0, 10), annotation(1, 0, 50), annotation(3, 100, 10)]), &categories),
    )]);
    let found = set.labels().of(&photo("a.png", 20, 10), 4096).expect("regions");
    let list: Vec<_> = found.iter().map(|r| (r.name.as_str(), r.level, r.parent, r.mask.area())).collect();
    let [object, part] = [Some(Level::Object), Some(Level::Part)];
    assert_eq!(list, [("cup", object, None, 50), ("lid", object, None, 10), ("rim", part, Some(0), 10)]);
}

#[test]
fn yolo_polygons_are_shares_of_the_photo() {
    let files = [
        (
            "labels/train/a.txt",
            "1 0.1 0.1 0.3 0.1 0.3 0.5 0.1 0.5\n\n0 0.5 0.1 0.75 0.1 0.75 0.5 0.5 0.5 0.87\n1 0.5 0.5 0.2 0.2\n"
                .to_owned(),
        ),
        ("labels/train/c.txt", "0 0.1 0.1 0.3 0.1 0.3 0.5\n".to_owned()),
        ("data.yaml", "train: images\nnames:\n  0: cup\n  1: 'red plate'\n".to_owned()),
        ("cameras.txt", "# cameras\n1 PINHOLE 84 63 68.2 68.2 42 31\n".to_owned()),
        ("points3D.txt", "1 0.5 0.5 0.1 10 20 30 0.5 1 2\n".to_owned()),
    ];
    let set = Set::new(&files);
    assert_eq!(set.regions("a.png"), named(&[("red plate", 16), ("cup", 20)]));
    let notes = set.labels().notes().join("; ");
    assert!(
        notes.contains("1 boxes") && notes.contains("1 of 2 labeled pictures") && notes.contains("c.txt"),
        "{notes}"
    );
    // Without names they are unnamed, and a note says so.
    let bare = Set::new(&files[..1]);
    assert_eq!(bare.regions("a.png"), named(&[("", 16), ("", 20)]));
    assert!(bare.labels().notes().iter().any(|note| note.contains("no names of classes")));
    let classes = Set::new(&[("a.txt", files[0].1.clone()), ("classes.txt", "cup\nred plate\n".into())]);
    assert_eq!(classes.regions("a.png"), named(&[("red plate", 16), ("cup", 20)]));
    let broken = Set::new(&[("a.txt", "0 0.1 0.1 0.3 0.1 0.3 0.5\n0 0.1 x\n".into())]);
    assert!(broken.fails().contains("line 2: expected the number of a class"), "{}", broken.fails());
}

#[test]
fn kinds_are_told_by_what_they_hold_and_may_lie_together() {
    let square = json!([[0.0, 1.0], [4.0, 1.0], [4.0, 5.0], [0.0, 5.0]]);
    let set = Set::new(&[
        ("isat_of_b.json", labelme(&[shape("cup", "polygon", &square, &Value::Null)])),
        ("b.json", LABEL.replace("a.jpg", "b.jpg")),
        ("transforms.json", json!({ "frames": [] }).to_string()),
    ]);
    assert_eq!(set.regions("a.png"), named(&[("cup", 16)]));
    assert_eq!(set.regions("b.png").len(), 3);
    // Boxes alone are no labels, and the error says so.
    let boxes = Set::new(&[("a.txt", "0 0.5 0.5 0.2 0.2\n".into())]).fails();
    assert!(boxes.contains("holds no labels (1 boxes"), "{boxes}");
    let hostile = coco(&json!([{ "image_id": 3, "segmentation": [[0, 0, 1e300, 5, 3, "x"]] }]), &json!([]));
    assert!(Set::new(&[("a.json", hostile)]).fails().contains("holds no labels"));
    let odd = coco(&json!([{ "image_id": 3, "segmentation": [[0, 0, 9, 5, 3, 4, 5]] }]), &json!([]));
    assert!(Set::new(&[("a.json", odd)]).fails().contains("annotations[0]: a polygon that is not x and y"));
    let long = coco(&json!([{ "image_id": 3, "segmentation": { "size": [10, 20], "counts": [0, 999] } }]), &json!([]));
    assert!(Set::new(&[("a.json", long)]).fails().contains("longer than 20 x 10"));
}
