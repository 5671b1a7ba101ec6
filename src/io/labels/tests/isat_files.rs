//! ISAT's groups, layers and background, and several files of one photo.

use super::*;

/// A label file of photo `name` with rectangles: category, group, layer, left top right bottom.
fn file(name: &str, objects: &[(&str, serde_json::Value, f64, [i32; 4])]) -> String {
    let object = |(category, group, layer, [l, t, r, b]): &(&str, serde_json::Value, f64, [i32; 4])| serde_json::json!({ "category": category, "group": group, "layer": layer, "segmentation": [[l, t], [r, t], [r, b], [l, b]] });
    let objects: Vec<_> = objects.iter().map(object).collect();
    let info = serde_json::json!({ "description": "ISAT", "folder": "", "name": name, "width": 20, "height": 10 });
    serde_json::json!({ "info": info, "objects": objects }).to_string()
}

fn regions(files: &[(&str, String)], photo_name: &str) -> (Vec<(String, usize)>, Vec<String>) {
    let folder = tempfile::tempdir().expect("folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("parent")).expect("folder");
        fs::write(path, text).expect("write");
    }
    let photos = [photo(photo_name, 20, 10), photo("other.png", 20, 10)];
    let labels = Labels::of_photos(folder.path(), &photos).expect("labels");
    let found = labels.of(&photos[0], 4096).expect("regions");
    (found.into_iter().map(|r| (r.name, r.mask.area())).collect(), labels.notes().to_vec())
}

#[test]
fn a_category_and_a_group_are_one_thing() {
    let (group, text) = (|v: i32| serde_json::json!(v), serde_json::json!("1"));
    let cups = [
        ("cup", group(1), 1.0, [0, 0, 3, 4]),
        ("cup", group(2), 2.0, [6, 0, 9, 4]),
        ("cup", group(1), 3.0, [12, 0, 15, 4]),
    ];
    let (found, notes) = regions(&[("a.json", file("a.png", &cups))], "a.png");
    assert_eq!(found, [("cup".into(), 2 * 4 * 4), ("cup".into(), 4 * 4)]);
    assert!(notes.is_empty(), "{notes:?}");
    // lerf_ovs numbers polygons, and a category is one region.
    let lerf = file("a.png", &cups).replace("\"description\":\"ISAT\",", "").replace("\"folder\":\"\",", "");
    assert_eq!(regions(&[("a.json", lerf)], "a.png").0, [("cup".into(), 3 * 4 * 4)]);
    // Without groups a category is one region; groups may be strings; one group may hold two categories.
    let none = serde_json::Value::Null;
    let (found, _) = regions(
        &[(
            "a.json",
            file(
                "a.png",
                &[
                    ("cup", none.clone(), 1.0, [0, 0, 3, 4]),
                    ("cup", none, 1.0, [6, 0, 9, 4]),
                    ("plate", text.clone(), 1.0, [0, 5, 3, 9]),
                    ("fork", text, 1.0, [6, 5, 9, 9]),
                ],
            ),
        )],
        "a.png",
    );
    assert_eq!(found.iter().map(|f| f.0.as_str()).collect::<Vec<_>>(), ["cup", "plate", "fork"]);
}

#[test]
fn background_cuts_what_is_drawn_below_it() {
    let g = |v: i32| serde_json::json!(v);
    let ring = ("ring", g(1), 1.0, [0, 0, 10, 8]);
    let hole = |layer| ("__background__", g(0), layer, [3, 3, 6, 5]);
    let (whole, cut) = (11 * 8, 11 * 8 - 4 * 2);
    for (objects, expected) in [
        (vec![ring.clone(), hole(2.0)], vec![("ring", cut)]),
        // Layers decide, not the order in the file.
        (vec![hole(2.0), ring.clone()], vec![("ring", cut)]),
        (vec![hole(0.5), ring.clone()], vec![("ring", whole)]),
        // An island in the hole is above it.
        (vec![ring.clone(), hole(2.0), ("ring", g(1), 3.0, [4, 3, 5, 4])], vec![("ring", cut + 2)]),
        (vec![ring.clone(), ("cup", g(2), 1.0, [2, 2, 8, 7]), hole(2.0)], vec![("ring", cut), ("cup", 7 * 5 - 8)]),
        (vec![ring, ("__ignore__", g(3), 2.0, [0, 0, 9, 9])], vec![("ring", whole)]),
        (vec![hole(1.0)], vec![]),
    ] {
        let (found, _) = regions(&[("a.json", file("a.png", &objects))], "a.png");
        let expected: Vec<(String, usize)> = expected.into_iter().map(|(name, area)| (name.into(), area)).collect();
        assert_eq!(found, expected, "{objects:?}");
    }
}

#[test]
fn two_files_of_one_photo_are_joined_and_others_are_named() {
    let g = |v: i32| serde_json::json!(v);
    let cup = ("cup", g(1), 1.0, [0, 0, 3, 4]);
    let files = [
        ("a.json", file("a.png", std::slice::from_ref(&cup))),
        ("second.json", file("a.png", &[("plate", g(1), 1.0, [6, 0, 9, 4]), ("cup", g(1), 1.0, [12, 0, 15, 4])])),
        ("backup/a.json", file("a.png", &[cup])),
        ("gone.json", file("DSC_1.png", &[])),
        ("._a.json", "\u{0}\u{5}".into()),
    ];
    let (found, notes) = regions(&files, "a.png");
    assert_eq!(found, [("cup".into(), 16), ("plate".into(), 16), ("cup".into(), 16)]);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("1 of 4") && notes[0].contains("gone.json, of 'DSC_1.png'"), "{notes:?}");
    assert!(notes[1].contains("a.json and second.json") && notes[1].contains("joined"), "{notes:?}");
}
