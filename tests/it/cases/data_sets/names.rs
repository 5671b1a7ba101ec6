//! Names and paths as other systems and programs write them, and byte order marks.

use std::fs;

use serde_json::json;

use super::{Copy, info, photos, refusal, right, warnings, warns};
use crate::common::case;

#[test]
fn letter_case_and_endings_do_not_matter_but_are_told() {
    let Some(set) = Copy::of("14_letter_case") else { return };
    let found = info(set.path());
    right(&found, 8);
    warns(&found, &["4 of 8 listed photos were found under other names", "img_01.JPG is images/img_01.jpg"]);
    assert_eq!(warnings(&found).len(), 1);
    // All of them, in a folder of another case; then pictures of another format than listed.
    set.rename("images", "Images");
    set.edit("sparse/0/images.txt", |text| text.replace(".jpg", ".JPG"));
    warns(&info(set.path()), &["8 of 8 listed photos were found under other names"]);
    set.edit("sparse/0/images.txt", |text| text.replace(".JPG", ".png"));
    let found = info(set.path());
    right(&found, 8);
    warns(&found, &["8 of 8", "img_00.png is Images/img_00.jpg"]);
    // Two that fit alike: neither is taken.
    fs::copy(set.at("Images/img_00.jpg"), set.at("Images/img_00.webp")).expect("copy");
    let found = info(set.path());
    right(&found, 7);
    warns(&found, &["1 of 8", "could each be one of several files", "img_00.jpg or img_00.webp"]);
    // Two listed photos and one file.
    fs::remove_file(set.at("Images/img_00.webp")).expect("remove");
    set.edit("sparse/0/images.txt", |text| text.replace("img_01.png", "img_00.JPG"));
    let found = info(set.path());
    assert_eq!(found["photos"], 6);
    warns(&found, &["2 of 8", "would both be Images/img_00.jpg"]);
}

#[test]
fn paths_of_other_systems_and_computers_lead_to_the_photos_in_the_folder() {
    let Some(set) = Copy::of("15_backslashes") else { return };
    let found = info(set.path());
    right(&found, 8);
    warns(&found, &["8 of 8", "images\\img_00.png is images/img_00.png"]);
    let name_all = |front: &str, end: &str| {
        set.edit_json("transforms.json", |json| {
            for (i, frame) in json["frames"].as_array_mut().expect("frames").iter_mut().enumerate() {
                frame["file_path"] = json!(format!("{front}img_0{i}{end}"));
            }
        });
    };
    let inside = format!("{}/images/", set.path().display());
    for (front, end, told) in [
        (&*inside, ".png", false),
        ("./images/", "", false),
        ("images/../images/", ".png", false),
        ("/home/somebody/fox/images/", ".png", true),
        ("C:\\Users\\somebody\\fox\\images\\", ".png", true),
        ("../data/fox/images/", ".png", true),
        ("data/fox/images/", ".png", true),
        (".\\Images\\", ".PNG", true),
    ] {
        name_all(front, end);
        let found = info(set.path());
        right(&found, 8);
        assert_eq!(warnings(&found).len(), usize::from(told), "{front}: {:?}", warnings(&found));
    }
}

#[test]
fn nothing_outside_of_the_folder_is_read_whatever_a_list_says() {
    let Some(set) = Copy::of("15_backslashes") else { return };
    let outer = Copy::of("15_backslashes").expect("there");
    let secret = outer.at("secret.png");
    fs::copy(outer.at("images/img_00.png"), &secret).expect("copy");
    let up = format!("../{}/secret.png", outer.path().file_name().expect("name").to_string_lossy());
    for entry in [secret.to_string_lossy().into_owned(), up, "..\\..\\secret.png".into()] {
        set.edit_json("transforms.json", |json| json["frames"][0]["file_path"] = json!(entry));
        let found = info(set.path());
        right(&found, 7);
        warns(&found, &["1 of 8 listed photos lie outside of the folder", &entry]);
    }
    set.edit_json("transforms.json", |json| {
        let frames = json["frames"].as_array_mut().expect("frames");
        frames.truncate(1);
    });
    let e = refusal(set.path());
    assert!(e.contains("lies outside the folder"), "{e}");
}

#[cfg(unix)]
#[test]
fn links_to_photos_elsewhere_are_followed_and_told() {
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    let store = Copy::of("12_colmap_elsewhere").expect("there");
    fs::remove_dir_all(set.at("images")).expect("remove");
    std::os::unix::fs::symlink(store.at("images"), set.at("images")).expect("link");
    let found = info(set.path());
    right(&found, 8);
    warns(&found, &["8 of 8 photos are links to files outside of the folder"]);
    // One by one, to files without an ending, as caches of downloads keep them; and the reconstruction too.
    fs::remove_file(set.at("images")).expect("remove");
    fs::create_dir(set.at("images")).expect("create");
    for i in 0..8 {
        store.rename(&format!("images/img_0{i}.png"), &format!("blobs/{i:040}"));
        let link = set.at(&format!("images/img_0{i}.png"));
        std::os::unix::fs::symlink(store.at(&format!("blobs/{i:040}")), link).expect("link");
    }
    fs::remove_dir_all(set.at("colmap")).expect("remove");
    std::os::unix::fs::symlink(store.at("colmap"), set.at("colmap")).expect("link");
    right(&info(set.path()), 8);
    // The folder itself by another name.
    let alias = store.at("alias");
    std::os::unix::fs::symlink(set.path(), &alias).expect("link");
    right(&info(&alias), 8);
}

#[test]
fn byte_order_marks_are_skipped_in_every_list() {
    let Some(dir) = case("19_byte_order_mark") else { return };
    for set in ["tf", "colmap"] {
        let found = info(&dir.join(set));
        right(&found, 8);
        assert!(warnings(&found).is_empty(), "{set}: {:?}", warnings(&found));
    }
    let set = Copy::of("19_byte_order_mark").expect("there");
    // A list of photos to hold out, marked too.
    fs::write(set.at("colmap/sparse/0/test.txt"), "\u{feff}img_03.png\r\n").expect("write");
    assert_eq!(photos(&info(&set.at("colmap"))).1, ["img_03"]);
    // UTF-16 is named, for text and JSON.
    for name in ["tf/transforms.json", "colmap/sparse/0/images.txt"] {
        let text = fs::read_to_string(set.at(name)).expect("read");
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        fs::write(set.at(name), wide).expect("write");
        let e = refusal(&set.at(name.split('/').next().expect("a folder")));
        assert!(e.contains("UTF-16") && e.contains("save the file as UTF-8"), "{e}");
    }
}

#[test]
fn points_and_cameras_may_begin_with_a_mark_and_be_named_by_a_path_of_elsewhere() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    let ply = "\u{feff}ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
               end_header\n1 2 3\n";
    fs::write(set.at("Sparse_PC.ply"), ply).expect("write");
    set.edit_json("transforms.json", |json| json["ply_file_path"] = json!("/home/u/fox\\sparse_pc.ply"));
    let found = info(set.path());
    assert_eq!(found["points"], 1);
    warns(&found, &["sparse points", "were found as Sparse_PC.ply"]);
    // Without being named it is found by its usual name.
    set.edit_json("transforms.json", |json| json["ply_file_path"] = json!(null));
    assert_eq!(info(set.path())["points"], 1);
    // A camera file, as `fmlgs info --json` gives it, saved by an editor that marks it.
    let camera = set.at("camera.json");
    let first = format!("\u{feff}{}", found["cameras"][0]);
    fs::write(&camera, first).expect("write");
    let splat = crate::cli_support::tiny_splat(&set.at("a.ply"));
    let pictures = crate::cli_support::folder();
    let out = pictures.path().join("a.png");
    let words = [&splat, &camera, &out].map(|p| p.to_str().expect("a name").to_owned());
    crate::cli_support::fmlgs(&["render", &words[0], "--camera", &words[1], "--out", &words[2]]).ok();
}

#[test]
fn reduced_photos_stand_for_those_that_are_listed_and_gone() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    fs::create_dir(set.at("images_2")).expect("create");
    set.rename("images", "images_4");
    for i in 0..8 {
        let small = image::open(set.at(&format!("images_4/img_0{i}.png"))).expect("a picture").thumbnail_exact(42, 32);
        small.save(set.at(&format!("images_4/img_0{i}.png"))).expect("saved");
    }
    fs::remove_dir(set.at("images_2")).expect("remove");
    let found = info(set.path());
    warns(&found, &["8 of 8 listed photos were found under other names", "is images_4/img_00.png"]);
    assert_eq!(found["cameras"][0]["camera"]["width_px"], 42);
}

#[test]
fn what_systems_leave_is_passed_over() {
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    for (name, text) in [
        ("images/._img_00.png", "x"),
        ("images/.DS_Store", "x"),
        ("images/Thumbs.db", "x"),
        ("__MACOSX/images/._img_00.png", "x"),
        ("sparse/.DS_Store", "x"),
        ("._sparse", "x"),
    ] {
        fs::create_dir_all(set.at(name).parent().expect("parent")).expect("create");
        fs::write(set.at(name), text).expect("write");
    }
    let found = info(set.path());
    right(&found, 8);
    assert!(warnings(&found).is_empty(), "{:?}", warnings(&found));
    fs::remove_dir_all(set.at("colmap")).expect("remove");
    assert!(refusal(set.path()).contains("8 photos, no camera poses"));
}
