//! The real binary on results of other methods: they are described, asked, imported, and edited from then on.

use std::path::{Path, PathBuf};

use crate::agent_commands::stored::stored;
use crate::cli_support::{Done, command, copy, fmlgs, folder};

/// A small result in the exact format of its method.
fn sample(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results").join(name);
    path.to_str().expect("UTF-8").to_owned()
}

/// All files of a folder with their contents.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => all.extend(files(&path)),
            false => all.push((path.clone(), std::fs::read(&path).expect("readable"))),
        }
    }
    all.sort();
    all
}

#[test]
fn a_result_of_gaussian_grouping_becomes_a_scene_that_is_asked_and_edited() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (run, scene) = (folder.path().join("run"), at("scene"));
    copy(Path::new(&sample("gaussian_grouping")), &run);
    let before = files(&run);
    let run_text = run.to_str().expect("UTF-8");

    let info = fmlgs(&["info", run_text, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["result"]["method"]), (&"result".into(), &"Gaussian Grouping".into()));
    assert_eq!((&info["gaussians"], info["cameras"].as_array().expect("cameras").len()), (&32.into(), 2));
    let told = fmlgs(&["info", run_text]).ok().stdout;
    assert!(told.contains("256 classes") && told.contains("does not answer  phrases"), "{told}");

    let done = fmlgs(&["import", run_text, "--out", &scene, "--json"]).ok().json();
    let counts = ["gaussians", "objects", "parts", "cameras"].map(|key| done[key].as_u64().expect("a number"));
    assert_eq!((counts, &done["method"]), ([32, 3, 0, 2], &"Gaussian Grouping".into()));
    let info = fmlgs(&["info", &scene, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["identities"]), (&"trained".into(), &3.into()));
    let names = || {
        let all = stored(Path::new(&scene));
        (1..4).map(|id| all.name(id)).collect::<Vec<_>>()
    };
    assert_eq!(names(), ["class 3", "class 7", "class 200"]);

    // Asked by name, renamed, asked again.
    let pixels =
        |text: &str| fmlgs(&["query", &scene, text, "--json"]).ok().json()["pixels"].as_u64().expect("a number");
    assert!(pixels("class 7") > 0);
    fmlgs(&["query", &scene, "giraffe"]).fails_with(1);
    fmlgs(&["agent", &scene, "rename class 7 to kettle", "yes"]).ok();
    assert_eq!(names(), ["class 3", "kettle", "class 200"]);
    assert!(pixels("kettle") > 0);

    // Removed and exported, each into its own place.
    let left = fmlgs(&["remove", &scene, "kettle", "--fill", "none", "--out", &at("without"), "--json"]).ok().json();
    assert!(left["gaussians"].as_u64().is_some_and(|n| (1..=24).contains(&n)), "{left}");
    fmlgs(&["segment", &scene, "kettle", "--out", &at("kettle.ply")]).ok();
    let kettle = fmlgs(&["info", &at("kettle.ply"), "--json"]).ok().json();
    assert_eq!((&kettle["kind"], &kettle["gaussians"]), (&"splat".into(), &8.into()));
    fmlgs(&["export", &scene, "--out", &at("all.ply"), "--no-measure"]).ok();
    assert_eq!(fmlgs(&["info", &at("all.ply"), "--json"]).ok().json()["gaussians"], 32);
    assert!(files(&run) == before, "the result stays as it is");

    // Once more, onto the scene: refused, and nothing changes.
    let kept = files(Path::new(&scene));
    let refused = fmlgs(&["import", run_text, "--out", &scene]).fails_with(1).stderr;
    assert!(refused.contains("holds something already"), "{refused}");
    let refused = fmlgs(&["import", run_text, "--out", run_text]).fails_with(1).stderr;
    assert!(refused.contains("holds something already"), "{refused}");
    assert!(files(Path::new(&scene)) == kept && files(&run) == before);
}

#[test]
fn classes_are_objects_without_an_import() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let run = sample("gaussian_grouping");
    let answer = fmlgs(&["query", &run, "class 3", "--mask", &at("mask.png"), "--json"]).ok().json();
    assert!(answer["pixels"].as_u64().is_some_and(|n| n > 0) && Path::new(&at("mask.png")).exists(), "{answer}");
    fmlgs(&["query", &run, "giraffe"]).fails_with(1);
    fmlgs(&["remove", &run, "class 3", "--fill", "none", "--out", &at("without")]).ok();
    let without = fmlgs(&["info", &at("without"), "--json"]).ok().json();
    assert!(without["kind"] == "trained" && without["gaussians"].as_u64().is_some_and(|n| n < 32), "{without}");
    fmlgs(&["render", &run, "--camera", "1", "--out", &at("view.png")]).ok();
}

#[test]
fn what_a_result_cannot_do_is_said_with_what_can() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let run = |arguments: &[&str]| -> Done {
        let mut command = command(arguments);
        command.env("FMLGS_MODELS", folder.path().join("no-models")).output().expect("runs").into()
    };
    let (language, saga) = (sample("langsplat/output"), sample("saga"));
    // The encoder is not here.
    let refused = run(&["query", &language, "kettle", "--out", &at("answer")]).fails_with(1).stderr;
    assert!(refused.contains("clip-vit-b16") && refused.contains("fmlgs models"), "{refused}");
    assert!(!folder.path().join("answer").exists(), "nothing was written");
    let refused = run(&["query", &language, "kettle", "--kind", "part"]).fails_with(2).stderr;
    assert!(refused.contains("--kind has no effect on a result of LangSplat"), "{refused}");
    let info = run(&["info", &language]).ok().stdout;
    assert!(info.contains("result of LangSplat") && info.contains("small: codes of 3 numbers"), "{info}");
    assert!(info.contains("clip-vit-b16"), "{info}");

    for (name, method, says) in [
        ("gags", "GAGS", "codes of 16 numbers"),
        ("laga", "LaGa", "2 embeddings each"),
        ("semantic_gaussians", "Semantic Gaussians", "clip-vit-b32"),
        ("splat_distiller", "splat-distiller", "embeddings of 512 numbers"),
    ] {
        let info = run(&["info", &sample(name)]).ok().stdout;
        assert!(info.contains(&format!("result of {method}")) && info.contains(says), "{info}");
    }

    let refused = run(&["query", &saga, "kettle"]).fails_with(1).stderr;
    assert!(refused.contains("SAGA") && refused.contains("fmlgs import"), "{refused}");
    let refused = run(&["query", &sample("gaussian_grouping"), "class 3", "--level", "1"]).fails_with(2).stderr;
    assert!(refused.contains("--level"), "{refused}");
    let refused = run(&["preprocess", &saga]).fails_with(1).stderr;
    assert!(refused.contains("fmlgs import"), "{refused}");

    let refused = run(&["import", &language, "--out", &at("scene"), "--scale", "0.5"]).fails_with(2).stderr;
    assert!(refused.contains("--scale has no effect"), "{refused}");
    assert!(!folder.path().join("scene").exists());
    let done = run(&["import", &language, "--out", &at("scene")]).ok().stdout;
    assert!(done.contains("32 Gaussians of LangSplat") && done.contains("fmlgs query"), "{done}");
    let refused = run(&["import", &at("scene"), "--out", &at("again")]).fails_with(2).stderr;
    assert!(refused.contains("already") && !folder.path().join("again").exists(), "{refused}");
}

/// Numbers of a NumPy file of 32-bit floating point, and their shape.
fn array(path: &str) -> (Vec<u64>, Vec<f32>) {
    let bytes = std::fs::read(path).expect(path);
    let file = npyz::NpyFile::new(&bytes[..]).expect("an array");
    (file.shape().to_vec(), file.into_vec().expect("numbers"))
}

/// Largest difference of numbers.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn phrases_are_answered_by_vectors_of_a_file_without_an_encoder() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (language, texts) = (sample("langsplat/output"), sample("scene/texts.npy"));
    let run = |more: &[&str]| -> Done {
        let mut command = command(&[&["query", &*language, "kettle", "--vectors", &*texts][..], more].concat());
        command.env("FMLGS_MODELS", folder.path().join("no-models")).output().expect("runs").into()
    };
    let answer = run(&["--level", "2", "--out", &at("answer"), "--arrays", "--json"]).ok().json();
    assert_eq!((&answer["level"], &answer["method"]), (&"medium".into(), &"LangSplat".into()));
    let (shape, relevancy) = array(&at("answer/relevancy.npy"));
    assert_eq!(shape, [18, 24]);
    let wanted = |level: u32| array(&sample(&format!("langsplat/expected/relevancy_pixels_{level}.npy"))).1;
    assert!(apart(&relevancy, &wanted(2)) < 1e-4 && apart(&relevancy, &wanted(1)) > 1e-3, "and another level");
    let names = |folder: &str| {
        let files = files(Path::new(&at(folder))).into_iter();
        files.map(|(path, _)| path.file_name().expect("a name").to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    assert_eq!(names("answer"), ["mask-common-rule.npy", "mask-own-rule.npy", "relevancy.npy"]);
    run(&["--out", &at("pictures")]).ok();
    assert_eq!(names("pictures"), ["mask-common-rule.png", "mask-own-rule.png", "relevancy.png"]);
    run(&["--arrays"]).fails_with(2);
    // Other vectors, and a scene that compares none.
    std::fs::write(at("none.npy"), "no array").expect("written");
    let none = at("none.npy");
    let refused = fmlgs(&["query", &language, "kettle", "--vectors", &none]).fails_with(1).stderr;
    assert!(refused.contains("none.npy"), "{refused}");
    let refused = fmlgs(&["query", &sample("gaussian_grouping"), "class 3", "--vectors", &texts]).fails_with(2).stderr;
    assert!(refused.contains("--vectors"), "{refused}");
}

#[test]
fn objects_have_relevancy_and_both_masks_as_files() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let ask = |text: &str, out: &str| {
        let run = sample("gaussian_grouping");
        fmlgs(&["query", &run, text, "--out", &at(out), "--arrays", "--json"]).ok().json()
    };
    let (seven, three) = (ask("class 7", "seven"), ask("class 3", "three"));
    assert_eq!(seven["own_rule"]["pixels"], seven["pixels"]);
    assert!(seven["common_rule"]["rule"].as_str().is_some_and(|rule| rule.contains("20 %")), "{seven}");
    let read = |out: &str| array(&at(&format!("{out}/relevancy.npy"))).1;
    assert!(apart(&read("seven"), &read("three")) > 0.1, "another object, {three}");
    let plain = fmlgs(&["query", &sample("gaussian_grouping"), "class 7", "--json"]).ok().json();
    assert!(plain["common_rule"].is_null() && plain["pixels"] == seven["pixels"], "the control");
}

#[test]
fn features_of_gaussians_are_written_as_arrays() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (language, codes) = (sample("langsplat/output"), at("codes.npy"));
    let facts = fmlgs(&["features", &language, "--level", "large", "--codes", &codes, "--json"]).ok().json();
    assert_eq!(
        (&facts["level"], &facts["gaussians"], &facts["code_numbers"]),
        (&"large".into(), &32.into(), &3.into())
    );
    let wanted = |level: u32| array(&sample(&format!("langsplat/expected/codes_{level}.npy")));
    assert_eq!(array(&codes), wanted(3));
    assert_ne!(array(&codes), wanted(1), "the control");
    let told = fmlgs(&["features", &sample("occams_lgs"), "--level", "2"]).ok().stdout;
    assert!(told.contains("Gaussians of its own") && told.contains("clip-vit-b16"), "{told}");
    let refused = fmlgs(&["features", &language, "--codes", &at("a.npy"), "--embeddings", &at("a.npy")]).fails_with(2);
    assert!(refused.stderr.contains("--embeddings"), "{}", refused.stderr);
    let refused = fmlgs(&["features", &sample("3dgs"), "--codes", &at("a.npy")]).fails_with(2).stderr;
    assert!(refused.contains("no result of another method") && !Path::new(&at("a.npy")).exists(), "{refused}");
    let refused = fmlgs(&["features", &sample("saga"), "--embeddings", &at("a.npy")]).fails_with(2).stderr;
    assert!(refused.contains("SAGA knows no language"), "{refused}");
}
