//! Sentences on the command line change a scene as those in the window do: names are stored in it.

use std::path::Path;

use fmlgs::io::{SceneFolder, semantic_map, trained};
use fmlgs::scene::Identities;

use crate::cli_support::{Done, first_version, fmlgs, folder};

/// Objects and parts by the scene's folder.
pub fn stored(scene: &Path) -> Identities {
    let loaded = trained::load(scene).expect("a scene");
    let map = semantic_map::load(scene, loaded.state.as_deref(), &loaded.cloud).expect("readable");
    map.expect("objects").identities
}

fn say(scene: &Path, sentences: &[&str]) -> Done {
    fmlgs(&[&["agent", scene.to_str().expect("UTF-8")][..], sentences].concat())
}

#[test]
fn a_name_is_stored_after_a_yes_and_taken_back_by_undo() {
    let folder = folder();
    first_version(folder.path());
    let scene = folder.path().join("scene");
    let before = stored(&scene);
    assert_eq!(before.name(2), "box 1");
    say(&scene, &["rename box 1 to crate"]).fails_with(1);
    say(&scene, &["rename box 1 to crate", "no"]).ok();
    assert_eq!(stored(&scene), before, "nobody said yes");

    let said = say(&scene, &["rename box 1 to crate", "yes", "undo"]).ok().stdout;
    assert!(said.contains("calls #2 crate, stored") && said.contains("calls #2 box 1 again, stored"), "{said}");
    assert_eq!(stored(&scene), before);

    let said = say(&scene, &["rename box 1 to crate", "yes", "rename box 2 to chest", "yes"]).ok().stdout;
    assert!(said.contains("calls #3 chest, stored"), "{said}");
    let now = stored(&scene);
    assert_eq!([1, 2, 3].map(|id| now.name(id)), ["box 0", "crate", "chest"]);
    say(&scene, &["where is the crate?"]).ok();
    // Only what was done in the same conversation is taken back.
    say(&scene, &["undo"]).fails_with(1);
    assert_eq!(stored(&scene), now);
}

#[test]
fn a_name_that_cannot_be_stored_is_no_success() {
    let folder = folder();
    first_version(folder.path());
    let scene = folder.path().join("scene");
    let before = stored(&scene);
    let held = SceneFolder::hold(&scene, "a test").expect("ours");
    let failed = say(&scene, &["rename box 1 to crate", "yes"]).fails_with(1);
    assert!(failed.stderr.contains("a test") && failed.stdout.contains("failed: "), "{}", failed.stderr);
    drop(held);
    assert_eq!(stored(&scene), before);
}
