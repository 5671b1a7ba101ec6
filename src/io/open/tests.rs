//! Tests of sniffing.

use std::path::PathBuf;

use super::*;

fn folder() -> (tempfile::TempDir, PathBuf) {
    let guard = tempfile::tempdir().expect("folder");
    let path = guard.path().to_path_buf();
    (guard, path)
}

#[test]
fn what_is_not_recognized_says_what_was_looked_for_and_found() {
    let (_guard, path) = folder();
    let e = open(&path).expect_err("empty");
    assert!(matches!(&e, OpenError::Unrecognized { found, .. } if found == "an empty folder"), "{e}");
    for i in 0..10 {
        fs::write(path.join(format!("note{i}.txt")), "hello").expect("write");
    }
    fs::create_dir(path.join("a_folder")).expect("create");
    let text = open(&path).expect_err("notes").to_string();
    for part in ["transforms.json", "scene.json", "a_folder/", "note0.txt", "and 3 more"] {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
    let text = open(&path.join("note0.txt")).expect_err("a note").to_string();
    for part in [".ply", "note0.txt", "a text file of another kind"] {
        assert!(text.contains(part), "'{part}' is missing in: {text}");
    }
    for (name, bytes, found) in [
        ("a.ply", "element", "without PLY header"),
        ("a.sog", "none", "no zip archive"),
        ("a.spz", "none", "neither packed"),
        ("a.splat", "", "an empty file"),
        ("a.ply", "", "an empty file"),
        ("a.bin", "\u{1}\u{2}", "a file of another kind"),
    ] {
        fs::write(path.join(name), bytes).expect("write");
        let text = open(&path.join(name)).expect_err(name).to_string();
        assert!(text.contains(found), "'{found}' is missing in: {text}");
    }
    assert!(matches!(open(&path.join("nothing")), Err(OpenError::NotFound { .. })));
}

#[test]
fn photos_without_poses_are_counted_and_one_picture_is_none() {
    let (_guard, path) = folder();
    fs::create_dir(path.join("images")).expect("create");
    fs::write(path.join("images/b.JPG"), "b").expect("write");
    assert!(matches!(open(&path), Err(OpenError::Unrecognized { .. })), "a picture is no scene");
    for name in ["a.png", ".hidden.jpg", "notes.txt"] {
        fs::write(path.join("images").join(name), "x").expect("write");
    }
    let e = open(&path).expect_err("no poses");
    assert!(e.to_string().contains("2 photos, no camera poses"), "{e}");
    let OpenError::NoPoses(found) = e else { panic!("{e}") };
    assert_eq!((found.images, found.photos), (path.join("images"), vec!["a.png".to_owned(), "b.JPG".to_owned()]));
}

#[test]
fn splats_and_scenes_are_told_apart() {
    let (_guard, path) = folder();
    let cloud = GaussianCloud::isotropic(vec![[1.0; 3]], 0.0, 0.0);
    splat_ply::write(&path.join("any.name"), &cloud).expect("write");
    assert!(matches!(open(&path.join("any.name")), Ok(Opened::Cloud(c)) if c == cloud));
    let scene = path.join("scene");
    trained::save(&scene, &trained::SceneInfo::default(), &cloud, None).expect("save");
    assert!(matches!(open(&scene), Ok(Opened::Trained(t)) if t.cloud == cloud));
    assert!(matches!(open(&scene.join("scene.json")), Ok(Opened::Trained(_))));
}

#[cfg(unix)]
#[test]
fn devices_are_refused() {
    assert!(matches!(open(Path::new("/dev/zero")), Err(OpenError::Io(IoError::NotAFile { .. }))));
}
