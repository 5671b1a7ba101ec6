//! COLMAP's reconstructions and their photos, wherever people keep them.

use std::fs;

use super::{Copy, info, photos, refusal, right, warnings, warns};

#[test]
fn the_reconstruction_of_most_photos_is_taken_and_what_is_left_is_counted() {
    let Some(set) = Copy::of("02_two_models") else { return };
    let all = info(set.path());
    assert_eq!(all["photos"], 6);
    warns(&all, &["sparse/1 is taken", "(6)", "sparse/0 (2 photos)"]);
    warns(&all, &["2 of 8 photos have no pose"]);
    // One of them opened by itself, by its folder or a file in it.
    for path in ["sparse/0", "sparse/0/images.txt", "sparse/0/cameras.txt"] {
        let small = info(&set.at(path));
        assert_eq!((&small["photos"], warnings(&small).len()), (&2.into(), 1), "{path}");
        warns(&small, &["6 of 8 photos have no pose"]);
    }
    // The other way round, and as the tenth of many.
    set.rename("sparse/0", "sparse/2");
    set.rename("sparse/1", "sparse/10");
    let all = info(set.path());
    warns(&all, &["sparse/10 is taken", "sparse/2 (2 photos)"]);
    // A broken one is named and does not keep the others from being used.
    fs::write(set.at("sparse/2/images.txt"), "1 2 three").expect("write");
    warns(&info(set.path()), &["sparse/10 is taken", "sparse/2 (cannot be read"]);
    // Where all are broken that is the error.
    fs::write(set.at("sparse/10/images.txt"), "1 2 three").expect("write");
    assert!(refusal(set.path()).contains("images.txt, line 1"));
}

#[test]
fn one_reconstruction_is_found_in_every_usual_place() {
    for place in [
        "colmap/sparse/0",
        "sparse/0",
        "sparse/1",
        "sparse",
        "distorted/sparse/0",
        "colmap/sparse",
        "colmap_text",
        "dense/sparse",
        "Sparse/0",
        "COLMAP/Sparse/0",
        "my model",
    ] {
        let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
        set.rename("colmap/sparse/0", "kept");
        fs::remove_dir_all(set.at("colmap")).expect("remove");
        set.rename("kept", place);
        let found = info(set.path());
        right(&found, 8);
        assert_eq!((&found["points"], warnings(&found).len()), (&400.into(), 0), "{place}: {:?}", warnings(&found));
        // The folder of the reconstruction itself, and the one of the photos.
        right(&info(&set.at(place)), 8);
        let by_photos = info(&set.at("images"));
        right(&by_photos, 8);
        warns(&by_photos, &["the poses of the photos in"]);
    }
}

#[test]
fn photos_are_found_beside_the_reconstruction_in_whatever_folder() {
    for photos in ["images", "Images", "input", "photos", "rgb", "data/frames", "images_2", "colmap/images", "."] {
        let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
        if photos == "." {
            for i in 0..8 {
                set.rename(&format!("images/img_0{i}.png"), &format!("img_0{i}.png"));
            }
            fs::remove_dir(set.at("images")).expect("remove");
        } else if photos != "images" {
            set.rename("images", photos);
        }
        let found = info(set.path());
        right(&found, 8);
        assert!(warnings(&found).is_empty(), "{photos}: {:?}", warnings(&found));
    }
    // Those before they were undistorted belong to what was found before.
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    set.rename("colmap/sparse/0", "distorted/sparse/0");
    set.rename("images", "input");
    fs::create_dir(set.at("images")).expect("create");
    for i in 0..8 {
        image::RgbImage::new(50, 50).save(set.at(&format!("images/img_0{i}.png"))).expect("save");
    }
    right(&info(set.path()), 8);
}

#[test]
fn all_in_one_folder_is_a_data_set_too() {
    let Some(set) = Copy::of("13_realityscan_flat") else { return };
    let found = info(set.path());
    right(&found, 8);
    assert_eq!((&found["points"], warnings(&found)), (&400.into(), vec![]));
    // One photo more than has a pose, and what systems leave.
    fs::copy(set.at("img_00.png"), set.at("img_99.png")).expect("copy");
    fs::write(set.at("._img_00.png"), "x").expect("write");
    warns(&info(set.path()), &["1 of 9 photos have no pose", "img_99.png"]);
}

#[test]
fn data_sets_in_a_folder_are_not_the_folders() {
    let Some(set) = Copy::of("13_realityscan_flat") else { return };
    let names: Vec<_> = fs::read_dir(set.path()).expect("list").flatten().map(|e| e.file_name()).collect();
    for name in names {
        let name = name.to_str().expect("a name").to_owned();
        set.rename(&name, &format!("one/{name}"));
    }
    fs::create_dir(set.at("others")).expect("create");
    for i in 0..2 {
        fs::copy(set.at("one/img_00.png"), set.at(&format!("others/{i}.png"))).expect("copy");
    }
    assert!(refusal(set.path()).contains("Found: one/, others/"));
    assert!(refusal(&set.at("others")).contains("2 photos, no camera poses"));
    right(&info(&set.at("one")), 8);
}

#[test]
fn points_are_read_from_a_ply_beside_the_reconstruction() {
    for (name, points) in [("points3D.ply", 400), ("points3d.ply", 400), ("sparse.ply", 400), ("other.ply", 0)] {
        let Some(set) = Copy::of("11_points3D_ply") else { return };
        if name != "points3D.ply" {
            set.rename("sparse/0/points3D.ply", &format!("sparse/0/{name}"));
        }
        let found = info(set.path());
        right(&found, 8);
        assert_eq!(found["points"], points, "{name}");
        assert_eq!(warnings(&found).is_empty(), points > 0, "{name}");
    }
    // COLMAP's own file comes first; a splat is no sparse points.
    let Some(set) = Copy::of("11_points3D_ply") else { return };
    fs::write(set.at("sparse/0/points3D.txt"), "1 0 0 1 10 20 30 0.5\n").expect("write");
    assert_eq!(info(set.path())["points"], 1);
    fs::remove_file(set.at("sparse/0/points3D.txt")).expect("remove");
    let splat = crate::cli_support::tiny_splat(&set.at("sparse/0/points3D.ply"));
    assert!(splat.is_file());
    assert_eq!(info(set.path())["points"], 0);
}

#[test]
fn lists_of_another_name_and_photos_beside_their_list_are_opened() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    let by_photos = info(&set.at("images"));
    right(&by_photos, 8);
    assert_eq!(photos(&by_photos).1, ["img_05", "img_06", "img_07"]);
    set.rename("transforms.json", "transforms_colmap.json");
    right(&info(set.path()), 8);
    fs::copy(set.at("transforms_colmap.json"), set.at("transforms_other.json")).expect("copy");
    let e = refusal(set.path());
    assert!(e.contains("transforms_colmap.json and transforms_other.json") && e.contains("open the file"), "{e}");
    right(&info(&set.at("transforms_other.json")), 8);
    // Of photos alone what is wrong with the poses beside them is said, and data sets beside them are not theirs.
    fs::write(set.at("transforms.json"), "{").expect("write");
    let e = refusal(&set.at("images"));
    assert!(e.contains("8 photos, no camera poses") && e.contains("holds poses that cannot be read"), "{e}");
    fs::remove_file(set.at("transforms.json")).expect("remove");
    // Poses that nobody here reads are named.
    fs::remove_file(set.at("transforms_colmap.json")).expect("remove");
    fs::remove_file(set.at("transforms_other.json")).expect("remove");
    assert!(refusal(set.path()).contains("8 photos, no camera poses; "), "the control");
    fs::write(set.at("sfm_data.json"), "{}").expect("write");
    let e = refusal(set.path());
    assert!(e.contains("8 photos, no camera poses (sfm_data.json may hold poses"), "{e}");
}
