//! Label files as they are, and broken.

use std::fs;

use glam::DVec3;

use super::*;
use crate::scene::Camera;

fn photo(name: &str, w: u32, h: u32) -> Photo {
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 0.0), DVec3::ZERO, DVec3::Z, 0.8, w, h).expect("valid");
    Photo { name: name.into(), path: name.into(), camera, distortion: None, test_split: false, background: None }
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
    // A photo of another size is not this label's.
    assert!(matches!(labels.of(&photo("a", 21, 10), 4096), Err(IoError::PhotoSize { .. })));
}

#[test]
fn broken_labels_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    assert!(matches!(Labels::open(folder.path()), Err(IoError::NoLabels { .. })));
    let at = folder.path().join("label.json");
    let read = |text: String| {
        fs::write(&at, text).expect("write");
        isat::read(&at)
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
