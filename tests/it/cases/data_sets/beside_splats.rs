//! Files that 3D Gaussian Splatting leaves beside its splats: cameras, and the path of the photos.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::{Copy, info, right, warnings, warns};
use crate::cli_support::{fmlgs, tiny_splat};

/// The cameras of a data set as 3D Gaussian Splatting writes them.
fn cameras(of: &Value) -> Value {
    let entry = |c: &Value| {
        let camera = &c["camera"];
        let axes: Vec<f64> = camera["world_from_camera"]
            .as_array()
            .expect("axes")
            .iter()
            .map(|v| v.as_f64().expect("a number"))
            .collect();
        let rows: Vec<Vec<f64>> = (0..3).map(|row| (0..3).map(|column| axes[3 * column + row]).collect()).collect();
        let name = c["name"].as_str().expect("a name").rsplit('/').next().expect("a file").trim_end_matches(".png");
        json!({"id": 0, "img_name": name, "width": 84, "height": 63, "position": camera["center"], "rotation": rows,
            "fx": camera["focal_px"][0], "fy": camera["focal_px"][1]})
    };
    json!(of["cameras"].as_array().expect("cameras").iter().map(entry).collect::<Vec<_>>())
}

fn output(folder: &Path, set: &Copy) {
    for iteration in [7_000, 30_000] {
        let at = folder.join(format!("point_cloud/iteration_{iteration}"));
        fs::create_dir_all(&at).expect("create");
        tiny_splat(&at.join("point_cloud.ply"));
    }
    fs::write(folder.join("cameras.json"), cameras(&info(set.path())).to_string()).expect("write");
    let source = set.path().display();
    let settings =
        format!("Namespace(eval=False, images='images', sh_degree=3, source_path='{source}', white_background=True)");
    fs::write(folder.join("cfg_args"), settings).expect("write");
}

#[test]
fn cameras_and_photos_beside_a_splat_are_found() {
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    let out = tempfile::tempdir().expect("folder");
    output(out.path(), &set);
    let splat = out.path().join("point_cloud/iteration_7000/point_cloud.ply");
    for path in [out.path(), &splat, &out.path().join("point_cloud/iteration_30000")] {
        let found = info(path);
        assert_eq!((&found["kind"], &found["gaussians"]), (&json!("splat"), &json!(3)));
        right(&found, 8);
        assert_eq!(found["dataset"], json!(set.path()), "{:?}", warnings(&found));
        assert!(warnings(&found).is_empty());
    }
    // A photo's view is drawn by its name, over the background of the training.
    let picture = out.path().join("a.png");
    let words = [&splat, &picture].map(|p| p.to_str().expect("a name").to_owned());
    fmlgs(&["render", &words[0], "--camera", "img_03", "--out", &words[1]]).ok();
    let drawn = image::open(&picture).expect("a picture").to_rgb8();
    assert_eq!((drawn.width(), drawn.height()), (84, 63));
    assert!(drawn.pixels().any(|p| p.0 == [255; 3]), "white behind everything");
    // The splat alone, elsewhere: nothing beside it, and no cameras.
    let alone = tempfile::tempdir().expect("folder");
    let alone = tiny_splat(&alone.path().join("point_cloud.ply"));
    assert!(info(&alone)["cameras"].as_array().is_some_and(Vec::is_empty));
}

#[test]
fn photos_that_are_gone_and_files_of_others_are_told() {
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    let out = tempfile::tempdir().expect("folder");
    output(out.path(), &set);
    fs::write(out.path().join("cfg_args"), "Namespace(source_path='/no/such/place', eval=True)").expect("write");
    let found = info(out.path());
    right(&found, 8);
    warns(&found, &["its photos were in /no/such/place, which is not here"]);
    // With a split: the photos that were held out come first.
    let mut all = cameras(&info(set.path()));
    let list = all.as_array_mut().expect("a list");
    let held_out = list.remove(4);
    list.insert(0, held_out);
    fs::write(out.path().join("cameras.json"), all.to_string()).expect("write");
    assert_eq!(super::photos(&info(out.path())).1, ["img_04"]);
    // A file of that name of another program.
    fs::write(out.path().join("cameras.json"), "{\"frames\": []}").expect("write");
    let found = info(out.path());
    assert_eq!(found["gaussians"], 3);
    warns(&found, &["the cameras beside the splat were passed over"]);
}
