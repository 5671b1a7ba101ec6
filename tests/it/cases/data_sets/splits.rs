//! Held-out photos, and poses that are not quite ones.

use std::fs;

use serde_json::{Value, json};

use super::{Copy, info, photos, refusal, right, warnings, warns};

fn numbered(list: &[usize]) -> Vec<String> {
    list.iter().map(|i| format!("img_0{i}")).collect()
}

#[test]
fn lists_of_photos_to_train_on_and_to_hold_out_are_obeyed() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    let found = info(set.path());
    right(&found, 8);
    assert_eq!(photos(&found), (numbered(&[0, 1, 2, 3, 4]), numbered(&[5, 6, 7])));
    assert!(warnings(&found).is_empty());
    let names = |list: &[usize]| json!(list.iter().map(|i| format!("images/img_0{i}.png")).collect::<Vec<_>>());
    // Train, validation and test: photos in none of the lists are left out; other spellings are understood.
    set.edit_json("transforms.json", |json| {
        json["train_filenames"] = names(&[0, 1, 2]);
        json["val_filenames"] = json!(["./images/img_03.png", "images\\img_04.png"]);
        json["test_filenames"] = json!(["img_05.png", "gone.png"]);
    });
    let found = info(set.path());
    assert_eq!(photos(&found), (numbered(&[0, 1, 2]), numbered(&[3, 4, 5])));
    warns(&found, &["2 of 8 photos are in none of the lists", "img_06.png", "img_07.png"]);
    warns(&found, &["1 of 2 names in test_filenames are of no photo", "gone.png"]);
    // In both lists: trained on, and not scored as if it were not.
    set.edit_json("transforms.json", |json| json["val_filenames"] = names(&[0, 3]));
    let found = info(set.path());
    assert_eq!(photos(&found).1, numbered(&[3, 5]));
    warns(&found, &["1 photos are listed to be trained on and to be held out", "img_00.png"]);
    // Only what is held out is listed, as before: the others are trained on.
    set.edit_json("transforms.json", |json| {
        json["train_filenames"] = json!([]);
        json["val_filenames"] = json!([]);
        json["test_filenames"] = names(&[7]);
    });
    assert_eq!(photos(&info(set.path())), (numbered(&[0, 1, 2, 3, 4, 5, 6]), numbered(&[7])));
}

#[test]
fn photos_beside_a_list_that_has_no_pose_for_them_are_counted_and_what_belongs_to_a_photo_is_not() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    set.edit_json("transforms.json", |json| {
        let frames = json["frames"].as_array_mut().expect("frames");
        frames.truncate(5);
        json["train_filenames"] = json!([]);
        json["val_filenames"] = json!([]);
    });
    for companion in ["img_00_depth.png", "img_00.png.png", "img_01.mask.png"] {
        fs::copy(set.at("images/img_00.png"), set.at(&format!("images/{companion}"))).expect("copy");
    }
    let found = info(set.path());
    right(&found, 5);
    assert_eq!(warnings(&found).len(), 1);
    warns(&found, &["3 of 8 photos have no pose and were left out", "img_05.png", "img_07.png"]);
}

#[test]
fn lists_beside_a_reconstruction_are_obeyed() {
    for (place, both) in [("colmap/sparse/0/test.txt", false), ("test_list.txt", true), ("train_test_lists.json", true)]
    {
        let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
        let held_out = "img_02.png\nimg_05.png\n";
        match place.ends_with(".json") {
            true => {
                let lists = json!({"train": ["img_00.png", "img_01.png"], "test": ["img_02.png", "img_05.png"]});
                fs::write(set.at(place), lists.to_string()).expect("write");
            }
            false => fs::write(set.at(place), held_out).expect("write"),
        }
        if place == "test_list.txt" {
            fs::write(set.at("train_list.txt"), "img_00.png\nimg_01.png\n").expect("write");
        }
        let found = info(set.path());
        let (train, held) = photos(&found);
        assert_eq!(held, numbered(&[2, 5]), "{place}");
        assert_eq!(train.len(), if both { 2 } else { 6 }, "{place}");
        assert_eq!(warnings(&found).len(), usize::from(both), "{place}: {:?}", warnings(&found));
    }
    // A file of that name about something else is said to be of no photo.
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    fs::write(set.at("train.txt"), "notes\n").expect("write");
    let found = info(set.path());
    right(&found, 8);
    warns(&found, &["1 of 1 names in train.txt are of no photo", "notes"]);
}

#[test]
fn missing_photos_of_a_held_out_list_are_a_warning() {
    let Some(set) = Copy::of("18_blender_without_test_photos") else { return };
    let found = info(set.path());
    right(&found, 6);
    assert_eq!(warnings(&found).len(), 1);
    warns(&found, &["transforms_test.json lists 2 photos and none of them exists"]);
    // One of the two is there: it is held out, and the other counted.
    fs::create_dir(set.at("test")).expect("create");
    fs::copy(set.at("train/img_00.png"), set.at("test/img_06.png")).expect("copy");
    let found = info(set.path());
    assert_eq!(photos(&found).1, numbered(&[6]));
    warns(&found, &["transforms_test.json: 1 of 2 listed photos are missing"]);
    // The validation list where the test list has no photos; left out with a word where it has.
    fs::copy(set.at("transforms_test.json"), set.at("transforms_val.json")).expect("copy");
    set.edit("transforms_val.json", |text| text.replace("./test/", "./val/"));
    warns(&info(set.path()), &["2 photos of transforms_val.json are left out"]);
    set.rename("test", "val");
    let found = info(set.path());
    assert_eq!(photos(&found).1, numbered(&[6]));
    warns(&found, &["transforms_test.json lists 2 photos and none of them exists"]);
    warns(&found, &["transforms_val.json: 1 of 2 listed photos are missing"]);
    // Sparse points as 3D Gaussian Splatting leaves them.
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    fs::write(set.at("points3d.ply"), ply).expect("write");
    assert_eq!(info(set.path())["points"], 1);
    // Without photos to train on there is nothing.
    set.rename("train", "gone");
    let e = refusal(set.path());
    assert!(e.contains("transforms_train.json lists 6 photos and none of them exists"), "{e}");
}

#[test]
fn scaled_rotations_and_rounded_last_rows_are_normalized_with_one_warning() {
    let Some(set) = Copy::of("20_scaled_pose") else { return };
    let found = info(set.path());
    right(&found, 8);
    assert_eq!(warnings(&found).len(), 1);
    warns(&found, &["8 of 8 poses in transforms.json", "normalized"]);
    let found = info(&set.at("transforms_lastrow.json"));
    right(&found, 8);
    assert_eq!(warnings(&found).len(), 1);
    warns(&found, &["of 8 poses in transforms_lastrow.json", "normalized"]);
}

#[test]
fn a_broken_pose_leaves_out_its_photo_by_name() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    set.edit_json("transforms.json", |json| {
        let keep = |json: &mut Value, key: &str| drop(json.as_object_mut().expect("object").remove(key));
        keep(json, "train_filenames");
        keep(json, "val_filenames");
        let frames = json["frames"].as_array_mut().expect("frames");
        // Mirrored, flat, without numbers, another last row, too few rows.
        for row in 0..3 {
            let x = frames[1]["transform_matrix"][row][0].as_f64().expect("a number");
            frames[1]["transform_matrix"][row][0] = json!(-x);
            frames[2]["transform_matrix"][row][2] = json!(0.0);
        }
        frames[3]["transform_matrix"][0][3] = json!("@");
        frames[4]["transform_matrix"][3] = json!([0, 0, 0, 2]);
        frames[5]["transform_matrix"] = json!([[1, 0, 0, 0]]);
    });
    set.edit("transforms.json", |text| text.replace("\"@\"", "NaN"));
    let found = info(set.path());
    right(&found, 3);
    let all = warnings(&found);
    warns(&found, &["5 of 8 listed photos have no usable pose"]);
    for i in 1..6 {
        assert!(all.iter().any(|w| w.contains(&format!("img_0{i}.png: "))), "{i}: {all:?}");
    }
    // The same of a reconstruction.
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    set.edit("colmap/sparse/0/images.txt", |text| {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let first = lines.iter().position(|l| l.ends_with("img_00.png")).expect("listed");
        let words: Vec<&str> = lines[first].split(' ').collect();
        lines[first] = format!("{} nan 0 0 0 {}", words[0], words[5..].join(" "));
        lines.join("\n") + "\n"
    });
    let found = info(set.path());
    right(&found, 7);
    warns(&found, &["1 of 8 listed photos have no usable pose", "img_00.png"]);
    assert_eq!(warnings(&found).len(), 1, "it is told once");
    // All broken: an error.
    set.edit("colmap/sparse/0/images.txt", |text| {
        let broken = |l: &str| {
            let words: Vec<&str> = l.split(' ').collect();
            if words.len() == 10 { format!("{} 0 0 0 0 {}", words[0], words[5..].join(" ")) } else { l.into() }
        };
        text.lines().map(broken).collect::<Vec<_>>().join("\n") + "\n"
    });
    assert!(refusal(set.path()).contains("is not a rotation"));
}
