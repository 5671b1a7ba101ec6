//! The real binary with networks: masks of everything in the photos by SAM 2, followed from photo to
//! photo, looked at by CLIP, asked for. With the reduced networks of the fixtures, whose answers mean
//! nothing: what is tested is that every network is run, and that a run that was stopped goes on.

use std::path::PathBuf;

use crate::cli_support::{Done, command, folder, tiny_dataset};

#[test]
fn networks_find_follow_and_look() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let network = |name: &str| {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name);
        path.to_str().unwrap().to_owned()
    };
    let run = |arguments: &[&str]| -> Done {
        command(arguments).env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_MODELS", at("models")).output().unwrap().into()
    };
    let scene = at("scene");
    let train = ["train", photos.to_str().unwrap(), "--out", &scene, "--steps", "60", "--backend", "cpu"];
    run(&[&train[..], &["--eval-every", "0", "--max-side", "64", "-q"]].concat()).ok();

    // Masks that come with the photos, followed by SAM 2 and looked at by CLIP.
    let (sam2, clip) = (network("sam2.json"), network("clip.json"));
    let masks = photos.to_str().unwrap();
    let by = |tracker: &str| {
        let network: &[&str] = if tracker == "geometry" { &[] } else { &["--tracker-model", &sam2] };
        let tracking = ["--tracker", tracker, "--encoder", &clip, "--max-seeds", "1", "--json", "-q"];
        run(&[&["preprocess", &scene, "--masks", masks], network, &tracking[..]].concat()).ok().json()
    };
    let (geometry, both) = (by("geometry"), by("both"));
    let is_frame = |file: &PathBuf| file.extension().is_some_and(|e| e == "frame");
    let all = || std::fs::read_dir(folder.path().join("scene/cache")).unwrap().map(|e| e.unwrap().path());
    let files = || all().filter(is_frame);
    let looked = files().count();
    assert!((2..14).contains(&looked), "of 14 photos, those that the seed does not explain are looked at: {looked}");
    assert_eq!(geometry["identities"].as_array().unwrap().len(), both["identities"].as_array().unwrap().len());
    assert!(geometry["disagreements"].as_array().unwrap().is_empty());
    assert!(geometry["unknown"].as_f64().is_some_and(|share| (0.0..1.0).contains(&share)), "{}", geometry["unknown"]);
    let identity = &geometry["identities"][0];
    assert!(
        identity["photos"].as_u64().is_some_and(|n| n > 0) && identity["confidence"].as_f64().is_some(),
        "{identity}"
    );
    // Random weights follow nothing: the Gaussians do not let themselves be led astray.
    let drifts = both["disagreements"].as_array().unwrap().iter().filter(|d| d["what"].get("drift").is_some()).count();
    println!("{drifts} drifts were left out");
    let seen = |found: &serde_json::Value| {
        let views = found["views"].as_array().unwrap();
        views.iter().map(|v| v["seen"].as_array().unwrap().len()).sum::<usize>()
    };
    assert!(seen(&both) > 0 && seen(&geometry) > 0);
    // What is on disk is not looked at again.
    let stamp = |name: &std::path::Path| std::fs::metadata(name).unwrap().modified().unwrap();
    let before: Vec<_> = files().map(|f| (stamp(&f), f)).collect();
    let sam2_alone = by("sam2");
    let gaussians = |found: &serde_json::Value| -> Vec<i64> {
        found["identities"].as_array().unwrap().iter().map(|i| i["gaussians"].as_i64().unwrap()).collect()
    };
    let off = |found: &serde_json::Value| -> i64 {
        gaussians(found).iter().zip(gaussians(&geometry)).map(|(a, b)| (a - b).abs()).sum()
    };
    println!(
        "Gaussians {:?}, {:?} with both, {:?} with SAM 2 alone",
        gaussians(&geometry),
        gaussians(&both),
        gaussians(&sam2_alone)
    );
    assert!(drifts > 0 && off(&both) < off(&sam2_alone), "{} {}", off(&both), off(&sam2_alone));
    assert!(before.iter().all(|(time, file)| stamp(file) == *time));

    // What is told is kept with the scene, and told again: here where SAM 2 alone leads astray.
    let told = run(&["info", &scene, "--json"]).ok().json();
    assert_eq!((&told["objects"], &told["unknown"]), (&sam2_alone["identities"], &sam2_alone["unknown"]));

    // Every photo's features are CLIP's; a phrase is beyond the reduced network's vocabulary, which is
    // told, and does not end the program.
    let error = run(&["query", &scene, "something shiny"]).fails_with(1).stderr;
    assert!(error.contains("clip.json knows 1024 tokens"), "{error}");

    // Everything in the photos, by SAM 2 alone.
    let found =
        run(&["preprocess", &scene, "--segmenter", &sam2, "--encoder", "none", "--max-seeds", "1", "--json", "-q"])
            .ok()
            .json();
    assert!(!found["identities"].as_array().unwrap().is_empty());
    assert!(found["identities"][0]["names"].as_array().unwrap().is_empty());

    // What is not here, or is something else, is told.
    let error = run(&["preprocess", &scene, "--segmenter", "sam2.1-tiny"]).fails_with(1).stderr;
    assert!(error.contains("not on this machine") && error.contains("fmlgs models"), "{error}");
    let error = run(&["preprocess", &scene, "--segmenter", &clip]).fails_with(1).stderr;
    assert!(error.contains("finds no masks"), "{error}");
    let error = run(&["preprocess", &scene, "--masks", masks, "--encoder", &sam2]).fails_with(1).stderr;
    assert!(error.contains("'clip' is wanted"), "{error}");
    let error = run(&["preprocess", &scene, "--masks", masks, "--encoder", "no-such"]).fails_with(1).stderr;
    assert!(error.contains("no-such") && error.contains("fmlgs models"), "{error}");
}
