//! Changes under a training: its photos and poses while it rests, its folder while it runs.

use super::*;

/// Trains until it has saved twice, and stops it there.
fn stopped(arguments: &[&str], out: &Path) {
    let mut child = start(arguments);
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 2);
    send(&child, "-INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

/// Moves every camera of `photos` by 0.2 units.
fn move_cameras(photos: &Path) {
    let list = photos.join("transforms.json");
    let mut all: serde_json::Value = serde_json::from_slice(&std::fs::read(&list).unwrap()).unwrap();
    for frame in all["frames"].as_array_mut().unwrap() {
        let x = frame["transform_matrix"][0][3].as_f64().unwrap();
        frame["transform_matrix"][0][3] = (x + 0.2).into();
    }
    std::fs::write(&list, all.to_string()).unwrap();
}

#[test]
fn a_stopped_training_goes_on_with_what_it_began_with() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let [out, other] = ["scene", "other"].map(|name| folder.path().join(name));
    let (to_out, to_other) = (out.to_str().unwrap(), other.to_str().unwrap());
    let arguments = train_arguments(photos.to_str().unwrap(), to_out, "1500");
    stopped(&arguments, &out);
    crate::cli_support::copy(&out, &other);

    let refused = |what: &[&str]| {
        let before = files_in(&out);
        let done = fmlgs(&arguments).fails_with(2);
        for word in [what, &["began with other photos or poses", "--anyway", "--out"]].concat() {
            assert!(done.stderr.contains(word), "'{word}' is not said: {}", done.stderr);
        }
        assert!(files_in(&out) == before, "a refused training changed files");
    };
    let (list, first) = (photos.join("transforms.json"), photos.join("images/0001.png"));
    let [list_before, first_before] = [&list, &first].map(|path| std::fs::read(path).unwrap());
    move_cameras(&photos);
    refused(&["16 photos moved by up to 0.2 units"]);

    // Who wants that goes on, and is told what has changed.
    let elsewhere = train_arguments(photos.to_str().unwrap(), to_other, "1500");
    let done = fmlgs(&[&elsewhere[..], &["--anyway"]].concat()).ok();
    assert!(done.stderr.contains("Continuing at step"), "{}", done.stderr);
    assert!(done.stderr.contains("not with what it began with: 16 photos moved"), "{}", done.stderr);

    std::fs::write(&list, &list_before).unwrap();
    std::fs::copy(photos.join("images/0003.png"), &first).unwrap();
    refused(&["1 photo has other pixels", "0001.png"]);

    // The control: with all as it was it goes on without a word.
    std::fs::write(&first, &first_before).unwrap();
    let done = fmlgs(&arguments).ok();
    assert!(done.stderr.contains("Continuing at step"), "{}", done.stderr);
    assert!(!done.stderr.contains("began with"), "{}", done.stderr);
    assert_eq!(done.json()["steps"], 1500);
}

#[test]
fn a_training_outlives_its_folder() {
    let folder = folder();
    let photos = tiny_dataset(folder.path());
    let (out, away) = (folder.path().join("scene"), folder.path().join("away"));
    let scene = out.to_str().unwrap();
    let mut child = start(&train_arguments(photos.to_str().unwrap(), scene, "1500"));
    wait_for_checkpoints(&mut child, &out.join("checkpoint.bin"), 1);
    std::fs::rename(&out, &away).unwrap();
    let done = Done::from(child.wait_with_output().unwrap()).ok();
    assert!(done.stderr.contains("went away during the training and is made again"), "{}", done.stderr);
    assert_eq!((&done.json()["end"], &done.json()["steps"]), (&"finished".into(), &1500.into()));
    let info = fmlgs(&["info", scene, "--json"]).ok().json();
    assert_eq!((&info["kind"], &info["gaussians"]), (&"trained".into(), &done.json()["gaussians"]));
    // The control: what was moved away holds no result.
    assert!(away.join("checkpoint.bin").exists() && !away.join("point_cloud.ply").exists());
}
