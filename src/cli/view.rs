//! Choice of the camera to draw from: a photo's, one from a file, or one that shows the whole splat.

use std::path::Path;

use super::CliError;
use crate::io::trained::SceneCamera;
use crate::jobs::{Scene, render};
use crate::scene::Camera;

/// The camera that `wanted` names: an index from 0, a photo's name (its end is enough where that
/// is unambiguous), or a JSON file. Without it, the scene's first view.
pub(crate) fn choose(wanted: Option<&str>, scene: &Scene) -> Result<Camera, CliError> {
    let Some(wanted) = wanted else {
        if scene.cameras.is_empty() && scene.cloud.is_empty() {
            return Err(CliError::failed("the splat holds no Gaussians, so there is nothing to look at"));
        }
        return Ok(scene.home().camera([640, 480]));
    };
    if let Some(camera) = of_photo(wanted, &scene.cameras).map_err(CliError::failed)? {
        return Ok(camera);
    }
    let path = Path::new(wanted);
    if path.is_file() {
        return Ok(render::camera(path)?);
    }
    let known = match scene.cameras.as_slice() {
        [] => "The scene has no photos: give a JSON camera file, or --photos with their dataset".to_owned(),
        [one] => format!("The only photo is '{}'", one.name),
        [first, .., last] => {
            let count = scene.cameras.len();
            format!("Photos are 0 to {} or '{}' to '{}'", count - 1, first.name, last.name)
        }
    };
    Err(CliError::failed(format!("no photo and no file is called '{wanted}'. {known}")))
}

/// The camera of the photo `wanted`, by its index, its name or the end of that; an error if several end so.
pub(super) fn of_photo(wanted: &str, cameras: &[SceneCamera]) -> Result<Option<Camera>, String> {
    if let Some(exact) = cameras.iter().find(|c| c.name == wanted) {
        return Ok(Some(exact.camera.clone()));
    }
    if let Some(at) = wanted.parse::<usize>().ok().and_then(|i| cameras.get(i)) {
        return Ok(Some(at.camera.clone()));
    }
    let ends: Vec<&SceneCamera> = cameras.iter().filter(|c| ends_with_path(&c.name, wanted)).collect();
    match ends.as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(one.camera.clone())),
        [a, b, ..] => Err(format!("'{wanted}' may be '{}' or '{}': give more of it", a.name, b.name)),
    }
}

/// Returns whether `wanted` is the last part of the path `name`, with or without its extension.
fn ends_with_path(name: &str, wanted: &str) -> bool {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    [name, stem].iter().any(|n| *n == wanted || n.strip_suffix(wanted).is_some_and(|front| front.ends_with('/')))
}

/// Parses `640x480`.
pub(crate) fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let side = |s: &str| s.trim().parse::<u32>().ok().filter(|v| (1..=Camera::MAX_SIDE_PX).contains(v));
    let both = text.split_once(['x', 'X']).and_then(|(w, h)| Some([side(w)?, side(h)?]));
    both.ok_or_else(|| format!("WIDTHxHEIGHT is needed, for example 640x480, each 1 to {}", Camera::MAX_SIDE_PX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn scene(names: &[&str]) -> Scene {
        let camera = |i: usize| {
            let eye = DVec3::new(1.0 + i as f64, -3.0, 1.0);
            Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid")
        };
        let named =
            |(i, name): (usize, &&str)| SceneCamera { name: (*name).to_owned(), camera: camera(i), held_out: false };
        Scene { cameras: names.iter().enumerate().map(named).collect(), ..Scene::default() }
    }

    #[test]
    fn photos_are_found_by_index_name_and_end_of_name() {
        let s = scene(&["images/a.jpg", "images/b.jpg", "more/b.jpg", "images/7.png"]);
        let index = |wanted: &str| {
            let camera = choose(Some(wanted), &s).ok()?;
            s.cameras.iter().position(|c| c.camera == camera)
        };
        assert_eq!(index("1"), Some(1));
        assert_eq!(index("more/b.jpg"), Some(2));
        assert_eq!(index("a.jpg"), Some(0));
        assert_eq!(index("a"), Some(0));
        assert_eq!(index("7"), Some(3), "a name wins where the index is out of range");
        assert_eq!(index("b.jpg"), None, "two photos end like that");
        assert_eq!(index("c.jpg"), None);
        assert_eq!(index("99"), None);
        assert_eq!(choose(None, &s).expect("first"), s.cameras[0].camera);
        assert!(choose(None, &scene(&[])).is_err(), "nothing to see");
    }

    #[test]
    fn a_camera_file_is_read_in_both_forms_and_checked() {
        let folder = tempfile::tempdir().expect("folder");
        let camera = scene(&["a"]).cameras[0].camera.clone();
        let path = folder.path().join("camera.json");
        std::fs::write(&path, serde_json::to_string(&camera).expect("json")).expect("write");
        assert_eq!(render::camera(&path).expect("alone"), camera);
        let entry = serde_json::json!({ "name": "a", "camera": camera, "held_out": false });
        std::fs::write(&path, entry.to_string()).expect("write");
        assert_eq!(render::camera(&path).expect("entry"), camera);
        let bad = Camera { width_px: 0, ..camera };
        std::fs::write(&path, serde_json::to_string(&bad).expect("json")).expect("write");
        assert!(render::camera(&path).is_err());
        std::fs::write(&path, "[]").expect("write");
        assert!(render::camera(&path).is_err());
    }

    #[test]
    fn sizes_are_two_numbers() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        for bad in ["640", "0x4", "4x", "x", "99999x4", "-1x4"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
