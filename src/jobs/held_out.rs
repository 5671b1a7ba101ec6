//! Held-out photos of a scene.

use std::path::Path;

use super::JobError;
use crate::io::gs_output::is_of;
use crate::io::trained::SceneCamera;
use crate::scene::Dataset;

/// Returns the indices of the photos of `dataset` that a scene with these `cameras` was not trained on, or every
/// `every`-th if given. If the scene records them, by name, since the dataset may have gained or lost photos and
/// settings may have changed; else by `default_every`.
pub(crate) fn held_out(
    dataset: &Dataset,
    cameras: &[SceneCamera],
    every: Option<usize>,
    default_every: usize,
) -> Vec<usize> {
    if every.is_some() || cameras.is_empty() {
        return dataset.split(every.unwrap_or(default_every)).1;
    }
    let is_of = naming(dataset, cameras);
    let held = |name: &str| cameras.iter().any(|c| c.held_out && is_of(&c.name, name));
    (0..dataset.photos.len()).filter(|&i| held(&dataset.photos[i].name)).collect()
}

/// Returns the rule by which a camera's name is a photo's: the strictest that matches any of these. Names are equal, or
/// follow 3D Gaussian Splatting, or the photos were stored in another format since.
pub(crate) fn naming(dataset: &Dataset, cameras: &[SceneCamera]) -> fn(&str, &str) -> bool {
    let rules: [fn(&str, &str) -> bool; 3] = [|camera, photo| camera == photo, is_of, is_but_for_ending];
    let holds =
        |is_of: &fn(&str, &str) -> bool| cameras.iter().any(|c| dataset.photos.iter().any(|p| is_of(&c.name, &p.name)));
    rules.into_iter().find(holds).unwrap_or(is_but_for_ending)
}

/// Returns whether two names with folders differ in nothing but the file extension.
fn is_but_for_ending(one: &str, other: &str) -> bool {
    Path::new(one).with_extension("") == Path::new(other).with_extension("")
}

/// Refuses to hold out every n-th photo if the data set itself marks photos as test.
///
/// # Errors
/// [`JobError::TestPhotos`] if it does.
pub(crate) fn refuse_holdout(dataset: &Dataset) -> Result<(), JobError> {
    match dataset.test_photos() {
        0 => Ok(()),
        marked => Err(JobError::TestPhotos { data: dataset.root.clone(), marked, all: dataset.photos.len() }),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, Photo};

    #[test]
    fn a_scene_says_by_name_which_photos_it_has_not_seen() {
        let photo = |name: &str| {
            Photo::new(
                name,
                PathBuf::new(),
                Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid"),
            )
        };
        let trained_on = Dataset { photos: ["a", "b", "c", "d"].map(photo).to_vec(), ..Dataset::default() };
        let held = [0, 2];
        let seen = |(i, p): (usize, &Photo)| SceneCamera {
            name: p.name.clone(),
            camera: p.camera.clone(),
            held_out: held.contains(&i),
        };
        let cameras: Vec<SceneCamera> = trained_on.photos.iter().enumerate().map(seen).collect();
        let now = Dataset { photos: ["b", "c", "d", "e"].map(photo).to_vec(), ..Dataset::default() };
        assert_eq!(held_out(&now, &cameras, None, 2), [1], "a is gone, b and d were trained on, e is new");
        assert_eq!(held_out(&now, &cameras, Some(2), 9), [0, 2], "somebody wants otherwise");
        assert_eq!(held_out(&now, &[], None, 2), [0, 2], "a splat says nothing");
    }

    #[test]
    fn photos_are_known_under_other_endings_where_none_has_its_own() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let set = |names: &[&str]| {
            let photo = |name: &&str| Photo::new(*name, PathBuf::new(), camera.clone());
            Dataset { photos: names.iter().map(photo).collect(), ..Dataset::default() }
        };
        let cameras = ["a/1.png", "a/2.png", "b/1.png"].map(|name| SceneCamera {
            name: name.into(),
            camera: camera.clone(),
            held_out: name == "a/1.png",
        });
        let held = |names: &[&str]| held_out(&set(names), &cameras, None, 2);
        assert_eq!(held(&["a/1.jpg", "a/2.jpg", "b/1.jpg"]), [0], "packed anew; b/1 is another photo");
        assert_eq!(held(&["a/1.jpg", "a/2.png"]), [0_usize; 0], "names are kept, so a/1.jpg is a new photo");
        assert_eq!(held(&["c/7.jpg"]), [0_usize; 0], "of no camera");
    }
}
