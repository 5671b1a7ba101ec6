//! Work of the user is kept on the command line, too: objects found anew, trainings resumed, things removed.

use std::path::{Path, PathBuf};

use fmlgs::io::{SceneFolder, semantic_map, trained};
use fmlgs::scene::SemanticMap;

use crate::cli_support::{Done, first_version, fmlgs, folder};

/// Three boxes and their photos, trained for a moment.
fn boxes(to: &Path) -> (PathBuf, PathBuf) {
    let photos = first_version(to);
    (to.join("scene"), photos)
}

fn run(arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> Done {
    let arguments: Vec<String> = arguments.iter().map(|a| a.as_ref().to_string_lossy().into_owned()).collect();
    fmlgs(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

fn map(scene: &Path) -> SemanticMap {
    let loaded = trained::load(scene).expect("a scene");
    semantic_map::load(scene, loaded.state.as_deref(), &loaded.cloud).expect("readable").expect("objects")
}

/// Gaussians of the first identity with this name; none if there is none.
fn own(map: &SemanticMap, name: &str) -> Vec<usize> {
    let id = map.identities.iter().find(|(_, i)| i.names.first().is_some_and(|n| n == name)).map(|(id, _)| id);
    id.map_or_else(Vec::new, |id| (0..map.identity_of.len()).filter(|i| map.identity_of[*i] == id).collect())
}

fn preprocess(scene: &Path, photos: &Path, more: &[&str]) -> Done {
    let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"preprocess", &scene, &"--masks", &photos, &"--max-seeds", &"1", &"--encoder", &"none", &"--json"];
    arguments.extend(more.iter().map(|a| a as &dyn AsRef<std::ffi::OsStr>));
    run(&arguments)
}

#[test]
fn finding_objects_anew_keeps_what_was_named_and_says_so() {
    let folder = folder();
    let (scene, photos) = boxes(folder.path());
    let found = preprocess(&scene, &photos, &[]).ok().json();
    assert_eq!(found["kept"], serde_json::json!([]), "nothing was made by hand");
    run(&[&"segment", &scene, &"--click", &"48,36", &"--view", &"0", &"--keep", &"crate"]).ok();
    let before = map(&scene);
    assert!(!own(&before, "crate").is_empty());
    let done = preprocess(&scene, &photos, &[]).ok();
    assert_eq!(done.json()["kept"], serde_json::json!(["crate"]));
    assert!(done.stderr.contains("Kept as it was"), "{}", done.stderr);
    let now = map(&scene);
    assert_eq!(own(&now, "crate"), own(&before, "crate"));
    assert!(now.identities.len() > 1, "the rest was found beside it");
    let done = preprocess(&scene, &photos, &["--replace-all"]).ok();
    assert_eq!(done.json()["kept"], serde_json::json!([]));
    assert!(own(&map(&scene), "crate").is_empty() && !own(&map(&scene), "box 0").is_empty());
    // What was replaced is still there, a scene of its own.
    assert!((1..9).any(|n| scene.join(format!("earlier/{n}")).is_dir()));
}

#[test]
fn a_click_corrects_what_has_a_name_and_tells_what_others_lose() {
    let folder = folder();
    let (scene, photos) = boxes(folder.path());
    preprocess(&scene, &photos, &[]).ok();
    let click = |name: &str| {
        run(&[&"segment", &scene, &"--click", &"48,36", &"--width", &"4", &"--view", &"0", &"--correct", &name])
    };
    let before = map(&scene);
    click("nothing of that name").fails_with(1);
    assert_eq!(map(&scene).identity_of, before.identity_of, "the control");
    let done = click("box 1").ok();
    assert!(done.stdout.contains("corrected 'box 1'"), "{}", done.stdout);
    let now = map(&scene);
    assert_eq!(now.identities.len(), before.identities.len());
    for name in ["box 0", "box 2"] {
        let (had, has) = (own(&before, name).len(), own(&now, name).len());
        assert!(has <= had && (has == had || done.stderr.contains(&format!("from '{name}'"))), "{}", done.stderr);
    }
}

#[test]
fn what_was_removed_is_not_found_again() {
    let folder = folder();
    let (scene, photos) = boxes(folder.path());
    preprocess(&scene, &photos, &[]).ok();
    assert!(!own(&map(&scene), "box 1").is_empty(), "the control");
    let without = folder.path().join("without");
    run(&[&"remove", &scene, &"box 1", &"--out", &without]).ok();
    let gone = |scene: &Path| {
        let map = map(scene);
        assert!(map.identities.iter().all(|(_, i)| !i.names.contains(&"box 1".to_owned())), "{:?}", map.identities);
        assert!(!own(&map, "box 0").is_empty() && !own(&map, "box 2").is_empty());
        map
    };
    for _ in 0..2 {
        let done = preprocess(&without, &photos, &[]).ok();
        assert!(done.stderr.contains("What was removed (box 1) is not looked for"), "{}", done.stderr);
        gone(&without);
    }
    run(&[&"query", &without, &"box 1"]).fails_with(1);
    // As a version left it that kept nothing but the name.
    let loaded = trained::load(&without).expect("a scene");
    let stripped = SemanticMap { removed: None, ..map(&without) };
    let place = SceneFolder::hold(&without, "a test").expect("ours");
    place.save(&loaded.info, &loaded.cloud, Some(&stripped)).expect("saved");
    drop(place);
    let done = preprocess(&without, &photos, &[]).ok();
    assert!(done.stderr.contains("masks of that name are left out"), "{}", done.stderr);
    assert!(gone(&without).removed.is_none());
}

#[test]
fn what_photos_show_otherwise_than_the_scene_is_said_where_they_are_compared() {
    let folder = folder();
    let (scene, _) = boxes(folder.path());
    let (without, edited) = (folder.path().join("without"), folder.path().join("edited"));
    run(&[&"remove", &scene, &"box 1", &"--out", &without]).ok();
    run(&[&"edit", &scene, &"box 1", &"--move", &"0.5,0,0", &"--out", &edited]).ok();
    let eval = |scene: &Path| {
        let done = run(&[&"eval", &scene, &"--json"]).ok();
        (done.json()["psnr"].as_f64().expect("a number"), done.stderr)
    };
    let (whole, said) = eval(&scene);
    assert!(!said.contains("still show") && !said.contains("edited"), "the control: {said}");
    let (psnr, said) = eval(&without);
    assert!(said.contains("The photos still show what was removed (box 1): their pixels of it are left out"), "{said}");
    assert!(psnr > whole - 3.0, "{psnr} dB where the whole scene has {whole} dB");
    let (_, said) = eval(&edited);
    assert!(said.contains("edited after it was trained"), "{said}");
}

#[test]
fn a_training_goes_on_with_more_steps_where_that_is_asked_for() {
    let folder = folder();
    let (_, photos) = boxes(folder.path());
    let out = folder.path().join("out");
    let train = |steps: &str, more: &[&str]| {
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"train", &photos, &"--out", &out, &"--max-side", &"48", &"--backend", &"cpu", &"--steps", &steps];
        arguments.extend(more.iter().map(|a| a as &dyn AsRef<std::ffi::OsStr>));
        run(&arguments)
    };
    let done = train("20", &["--go-on"]).fails_with(1);
    assert!(done.stderr.contains("no training yet that could go on"), "{}", done.stderr);
    train("20", &[]).ok();
    let done = train("40", &[]).fails_with(1);
    assert!(done.stderr.contains("settings"), "other settings are another training: {}", done.stderr);
    let done = train("40", &["--go-on"]).ok();
    assert!(done.stderr.contains("Continuing at step 20 of 40"), "{}", done.stderr);
    let info = trained::load_info(&out).expect("a scene");
    assert_eq!(info.history.steps.last().map(|s| s.step), Some(40));
    let done = train("30", &["--go-on"]).fails_with(1);
    assert!(done.stderr.contains("settings"), "it is past 30 steps: {}", done.stderr);
}
