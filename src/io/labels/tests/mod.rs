//! Label files, valid and broken.

use std::fs;

use glam::DVec3;

use super::*;
use crate::scene::Camera;

mod isat_files;
mod language_features;
mod other_programs;

fn photo(name: &str, w: u32, h: u32) -> Photo {
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, w, h).expect("valid");
    Photo::new(name, name, camera)
}

const LABEL: &str = r#"{"info": {"name": "a.jpg", "width": 20, "height": 10}, "objects": [
    {"category": "eye", "level": "part", "parent": "face", "segmentation": [[2,2],[4,2],[4,4],[2,4]]},
    {"category": "face", "level": "part", "parent": "doll", "segmentation": [[1,1],[8,1],[8,8],[1,8]]},
    {"category": "eye", "segmentation": [[6,2],[7,2],[7,4],[6,4]]},
    {"category": "doll", "level": "object", "segmentation": [[0,0],[12,0],[12,9],[0,9]]}]}"#;

#[test]
fn polygons_of_a_category_are_one_region_and_wholes_come_first() {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("label.json"), LABEL).expect("write");
    fs::write(folder.path().join("other.json"), "{\"a\": 1}").expect("write");
    let labels = Labels::open(folder.path()).expect("labels");
    assert!(labels.has(&photo("images/a.png", 20, 10)) && !labels.has(&photo("b.png", 20, 10)));
    let regions = labels.of(&photo("images/a.png", 20, 10), 4096).expect("regions");
    let names: Vec<_> = regions.iter().map(|r| (r.name.as_str(), r.parent, r.mask.area())).collect();
    assert_eq!(names, [("doll", None, 13 * 9), ("face", Some(0), 8 * 7), ("eye", Some(1), 3 * 2 + 2 * 2)]);
    let small = labels.of(&photo("a", 20, 10), 10).expect("regions");
    assert_eq!((small[0].mask.width_px(), small[0].mask.height_px()), (10, 5));
    assert!(labels.of(&photo("c", 20, 10), 10).expect("none").is_empty());
    // A photo of another size does not match this label.
    assert!(matches!(labels.of(&photo("a", 25, 10), 4096), Err(IoError::PhotoSize { .. })));
}

#[test]
fn broken_labels_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    assert!(matches!(Labels::open(folder.path()), Err(IoError::NoLabels { .. })));
    let at = folder.path().join("label.json");
    let read = |text: String| {
        fs::write(&at, text).expect("write");
        isat::read(&at, Sheet::new(&photo("a.png", 20, 10)))
    };
    assert!(matches!(read(LABEL.replace("\"doll\", \"level\"", "\"cat\", \"level\"")), Err(IoError::Syntax { .. })));
    assert!(matches!(read(LABEL.replace("\"width\": 20", "\"width\": 0")), Err(IoError::EmptyPicture { .. })));
    assert!(matches!(read(LABEL.replace("\"width\": 20", "\"width\": 4000000000")), Err(IoError::EmptyPicture { .. })));
    assert!(matches!(read(LABEL.replace("[2,2]", "[2]")), Err(IoError::Syntax { .. })));
    assert!(matches!(read("{".into()), Err(IoError::Syntax { .. })));
    assert!(read(LABEL.replace("[2,2]", "[2e30,-1e30]")).is_ok());
}

#[test]
fn id_maps_become_regions() {
    let folder = tempfile::tempdir().expect("folder");
    let list = r#"{"identities": [{"id": 1, "name": "lamp", "level": "object"}, {"id": 2, "name": "cup", "level": "object"},
        {"id": 3, "name": "shade", "level": "part", "parent": 1}]}"#;
    fs::write(folder.path().join("identities.json"), list).expect("write");
    for (name, id) in [("object_ids", 1_u16), ("part_ids", 3)] {
        fs::create_dir(folder.path().join(name)).expect("folder");
        let picture = image::ImageBuffer::from_fn(6, 4, |x, _| image::Luma([if x > u32::from(id) { id } else { 0 }]));
        picture.save(folder.path().join(name).join("0001.png")).expect("save");
    }
    let labels = Labels::open(folder.path()).expect("labels");
    let regions = labels.of(&photo("images/0001.png", 6, 4), 4096).expect("regions");
    // The cup is not in this photo.
    let seen: Vec<_> = regions.iter().map(|r| (r.name.as_str(), r.level, r.parent, r.mask.area())).collect();
    assert_eq!(seen, [("lamp", Some(Level::Object), None, 16), ("shade", Some(Level::Part), Some(0), 8)]);
    assert!(labels.of(&photo("0002", 6, 4), 4096).expect("none").is_empty());
}

/// A picture 8 wide and 6 high with `value` in the columns `x`, 0 elsewhere.
fn picture(path: &Path, x: std::ops::Range<u32>, value: u8) {
    fs::create_dir_all(path.parent().expect("parent")).expect("folder");
    let at = |px: u32, _| image::Luma([if x.contains(&px) { value } else { 0 }]);
    image::GrayImage::from_fn(8, 6, at).save(path).expect("save");
}

fn summary(labels: &Labels, name: &str) -> Vec<(String, Option<Level>, usize)> {
    let regions = labels.of(&photo(name, 8, 6), 4096).expect(name);
    regions.into_iter().map(|r| (r.name, r.level, r.mask.area())).collect()
}

#[test]
fn spin_nerf_masks_are_anything_but_black() {
    let folder = tempfile::tempdir().expect("folder");
    let label = folder.path().join("images_4/label");
    picture(&label.join("a.png"), 2..5, 1);
    picture(&label.join("a_cutout.png"), 0..8, 255);
    picture(&label.join("b_pseudo.png"), 0..8, 255);
    picture(&folder.path().join("images_8/label/c.png"), 0..8, 255);
    for root in [folder.path(), &label] {
        let labels = Labels::open(root).expect("labels");
        assert_eq!(summary(&labels, "images_4/a.jpg"), [(String::new(), Some(Level::Object), 3 * 6)]);
        assert!(!labels.has(&photo("b.jpg", 8, 6)) && !labels.has(&photo("c.jpg", 8, 6)));
        // The same photo at full size, with and without distortion.
        let large = photo("a.jpg", 32, 24);
        assert_eq!(labels.of(&large, 4096).expect("scaled")[0].mask.area(), 12 * 24);
        let bent = Photo { distortion: Some(crate::scene::Distortion::default()), ..large };
        let area = labels.of(&bent, 4096).expect("scaled")[0].mask.area();
        assert!(area.abs_diff(12 * 24) <= 24, "{area}");
        assert!(matches!(labels.of(&photo("a.jpg", 12, 6), 99), Err(IoError::PhotoSize { .. })));
    }
    // A 16-bit picture in color.
    let deep = image::ImageBuffer::from_fn(8, 6, |x, _| image::Rgb([0, 0, u16::from(x == 3)]));
    deep.save(label.join("a.png")).expect("save");
    let labels = Labels::open(folder.path()).expect("labels");
    assert_eq!(summary(&labels, "a")[0].2, 6);
    fs::write(label.join("a.png"), "no picture").expect("write");
    assert!(matches!(labels.of(&photo("a", 8, 6), 99), Err(IoError::Picture { .. })));
}

#[test]
fn three_d_ovs_masks_are_white_and_belong_to_sorted_photos() {
    let folder = tempfile::tempdir().expect("folder");
    let root = folder.path();
    for name in ["c.jpg", "b.JPG", "a.jpg"] {
        picture(&root.join("images").join(name).with_extension("png"), 0..1, 1);
    }
    let masks = root.join("segmentations");
    picture(&masks.join("02/red apple.png"), 2..5, 255);
    picture(&masks.join("02/wall.png"), 5..8, 254);
    picture(&masks.join("02/unlisted.png"), 0..2, 255);
    fs::write(masks.join("classes.txt"), "wall\n red apple \n\n../secret\n").expect("write");
    for path in [root, &masks] {
        let labels = Labels::open(path).expect("labels");
        // The wall is not white anywhere.
        assert_eq!(summary(&labels, "c.jpg"), [("red apple".into(), Some(Level::Object), 3 * 6)]);
        assert!(!labels.has(&photo("a.jpg", 8, 6)));
    }
    picture(&masks.join("03/wall.png"), 5..8, 255);
    let e = Labels::open(root).err().expect("no fourth photo");
    assert!(e.to_string().contains("there are 3 photos"), "{e}");
    fs::remove_dir_all(masks.join("03")).expect("remove");
    fs::write(masks.join("classes.txt"), "dog").expect("write");
    assert!(matches!(Labels::open(root), Err(IoError::Syntax { .. })));
    fs::write(masks.join("classes.txt"), b"\xff").expect("write");
    assert!(matches!(Labels::open(root), Err(IoError::Syntax { .. })));
    fs::write(masks.join("classes.txt"), "wall").expect("write");
    fs::remove_dir_all(root.join("images")).expect("remove");
    assert!(matches!(Labels::open(root), Err(IoError::Syntax { .. })));
}

#[test]
fn lerf_masks_are_brighter_than_half() {
    let folder = tempfile::tempdir().expect("folder");
    let masks = folder.path().join("test_mask");
    picture(&masks.join("0/apple.png"), 2..5, 129);
    picture(&masks.join("0/green toy.png"), 5..8, 128);
    picture(&masks.join("frame_7/apple.png"), 0..1, 255);
    fs::create_dir(masks.join("empty")).expect("folder");
    for path in [folder.path(), &masks] {
        let labels = Labels::open(path).expect("labels");
        for name in ["test_0.jpg", "0.png"] {
            assert_eq!(summary(&labels, name), [("apple".into(), None, 3 * 6)]);
        }
        assert_eq!(summary(&labels, "images/frame_7.jpg")[0].2, 6);
        assert!(!labels.has(&photo("empty.jpg", 8, 6)));
    }
}

#[test]
fn lists_of_ref_lerf_say_what_sentences_refer_to() {
    let folder = tempfile::tempdir().expect("folder");
    let root = folder.path().join("ramen");
    picture(&root.join("mask/frame_00006/egg.png"), 2..5, 1);
    picture(&root.join("mask/frame_00006/other egg.png"), 6..7, 255);
    picture(&root.join("gt_mask/egg_7.png"), 0..1, 255);
    let list = |at: &str, objects: &str| {
        let path = root.join(at);
        fs::create_dir_all(path.parent().expect("parent")).expect("folder");
        fs::write(&path, format!("{{\"object\": [{objects}], \"image\": 3}}")).expect("write");
    };
    let egg = |picture: &str, sentence: &str| {
        format!(r#"{{"category": "egg", "segmentation": "{picture}", "sentence": ["{sentence}"]}}"#)
    };
    let [first, again, other] = [("egg", "an egg"), ("egg", "half an egg"), ("other egg", "the other egg")]
        .map(|(file, sentence)| egg(&format!("frame_00006/{file}.png"), sentence));
    let of_test = [first, again, other].join(", ");
    list("json/test_json/frame_00006.json", &of_test);
    list("json/train_json/frame_00007.json", &[egg("egg_7.png", "x"), egg("gone.png", "y")].join(", "));
    let labels = Labels::open(&root).expect("labels");
    let object = Some(Level::Object);
    assert_eq!(summary(&labels, "frame_00006.jpg"), [("egg".into(), object, 18), ("other egg".into(), object, 6)]);
    assert_eq!(summary(&labels, "frame_00007.jpg"), [("egg".into(), object, 6)]);
    let photos = ref_lerf::photos(&root).expect("lists");
    let told: Vec<_> = photos["frame_00006"].objects.iter().map(|o| o.sentences.join("; ")).collect();
    assert_eq!(told, ["an egg; half an egg", "the other egg"]);
    let tests = |photos: &BTreeMap<String, ref_lerf::ReferredPhoto>| {
        photos.iter().filter(|p| p.1.is_test).map(|p| p.0.clone()).collect::<Vec<_>>()
    };
    assert_eq!(tests(&photos), ["frame_00006"]);

    // Together, the photos tested are ReferSplat's; in other scenes none are known.
    fs::remove_dir_all(root.join("json")).expect("remove");
    list("json/frame_00006.json", &of_test);
    list("json/frame_00007.json", &egg("egg_7.png", "x"));
    assert_eq!(tests(&ref_lerf::photos(&root).expect("lists")), ["frame_00006"]);
    let unknown = folder.path().join("soup");
    fs::rename(&root, &unknown).expect("renamed");
    assert!(tests(&ref_lerf::photos(&unknown).expect("lists")).is_empty());
    fs::rename(&unknown, &root).expect("renamed");

    for (objects, told) in [
        (egg("gone.png", "x"), "object[0].segmentation: there is no 'gone.png' in"),
        (egg("../egg.png", "x"), "outside"),
        (egg("egg_7.png", "x").replace("sentence", "words"), "missing field `sentence`; a list looks like {\"object\""),
    ] {
        list("json/frame_00006.json", &objects);
        let e = ref_lerf::photos(&root).expect_err("broken").to_string();
        assert!(e.contains("json/frame_00006.json") && e.contains(told), "{e}");
    }
    // JSON of another kind in such folders is no list.
    fs::remove_file(root.join("json/frame_00007.json")).expect("remove");
    fs::write(root.join("json/frame_00006.json"), LABEL).expect("write");
    assert!(ref_lerf::find(&root).expect("no list").is_none() && Labels::open(&root).is_ok());
}

#[test]
fn masklets_belong_to_numbered_photos() {
    let folder = tempfile::tempdir().expect("folder");
    let at = folder.path().join("sav.json");
    let rle = |counts: &str| format!(r#"{{"size": [6, 8], "counts": {counts}}}"#);
    let video = |frames: &str| format!(r#"{{"video_frame_count": 7.0, "masklet": [{frames}]}}"#);
    let frames = format!("[{}, {}], [{}, {}]", rle("[6, 6, 36]"), rle("[48]"), rle("[0, 48]"), rle("[12, 6, 30]"));
    fs::write(&at, video(&frames)).expect("write");
    for path in [folder.path(), &at] {
        let labels = Labels::open(path).expect("labels");
        // Seven frames, two labeled: every fourth.
        assert_eq!(summary(&labels, "v/00000.jpg"), [(String::new(), None, 6)]);
        assert_eq!(summary(&labels, "\u{e9}4\u{e9}.jpg"), [(String::new(), None, 48), (String::new(), None, 6)]);
        for other in ["1.jpg", "8.jpg", "none.jpg", "99999999999999999999999.jpg"] {
            assert!(!labels.has(&photo(other, 8, 6)), "{other}");
        }
        assert!(matches!(labels.of(&photo("0.jpg", 8, 12), 99), Err(IoError::PhotoSize { .. })));
    }
    fs::write(folder.path().join("other.json"), video("")).expect("write");
    let e = Labels::open(folder.path()).err().expect("which of the two?");
    assert!(e.to_string().contains("name one"), "{e}");
    for (hostile, place) in [
        (rle("[18446744073709551615]"), "masklet[0][0]"),
        (r#"{"size": [4000000000, 4000000000], "counts": "0"}"#.into(), "4000000000"),
        (r#"{"size": [0, 8], "counts": []}"#.into(), "8 x 0"),
    ] {
        fs::write(&at, video(&format!("[{hostile}]"))).expect("write");
        let e = Labels::open(&at).expect("lazy").of(&photo("0", 8, 6), 99).expect_err("hostile");
        assert!(e.to_string().contains(place), "{e}");
    }
    fs::write(&at, video("[3]")).expect("write");
    assert!(matches!(Labels::open(&at), Err(IoError::Syntax { .. })));
}

#[test]
fn label_files_of_thirty_thousand_polygons_are_bounded() {
    let folder = tempfile::tempdir().expect("folder");
    let with = |names: usize| {
        let square = [[1, 1], [5, 1], [5, 4], [1, 4]];
        let object = |i| serde_json::json!({ "category": format!("c{}", i % names), "segmentation": square });
        let objects: Vec<_> = (0..30_000).map(object).collect();
        let file = serde_json::json!({ "info": { "name": "0.png", "width": 8, "height": 6 }, "objects": objects });
        fs::write(folder.path().join("a.json"), file.to_string()).expect("write");
        Labels::open(folder.path()).expect("labels").of(&photo("0.png", 8, 6), 99).map(|regions| regions.len())
    };
    assert_eq!(with(20).expect("few things, many polygons"), 20);
    let e = with(30_000).expect_err("too many").to_string();
    assert!(e.contains("a.json, masks: 30000 regions"), "{e}");
}
