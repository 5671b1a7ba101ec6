//! Photos that were posed together with some of the scene's own, brought into the scene's frame by those in common.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat3, DVec3};

use crate::io::files;
use crate::jobs::JobError;
use crate::math::format::things;
use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::navigate::pose;
use crate::scene::{Camera, Dataset, Photo};

/// Fewest photos in common that give a frame.
const FEWEST: usize = 2;
/// Largest distance of a photo in common from its place, relative to the spread of all, and largest angle, degrees.
const OFF: f64 = 0.05;
const TURNED_DEG: f64 = 3.0;
/// The same under which both frames are one.
const SAME: f64 = 1e-6;

/// Similarity from the frame of added photos to that of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameChange {
    scale: f64,
    rotation: DMat3,
    shift: DVec3,
}

impl FrameChange {
    /// Returns the camera in the frame of the scene.
    pub(super) fn applied(&self, camera: &Camera) -> Camera {
        Camera {
            world_from_camera: self.rotation * camera.world_from_camera,
            center: self.rotation * camera.center * self.scale + self.shift,
            ..camera.clone()
        }
    }

    /// Finds the change from pairs of cameras of one photo: in the frame of the scene, and in the other.
    ///
    /// # Errors
    /// The reason, in words.
    fn of(pairs: &[[&Camera; 2]]) -> Result<Option<Self>, String> {
        if pairs.len() < FEWEST {
            return Ok(None);
        }
        let n = pairs.len() as f64;
        let mean = |k: usize| pairs.iter().map(|p| p[k].center).sum::<DVec3>() / n;
        let (here, there) = (mean(0), mean(1));
        let spread =
            |k: usize, mean: DVec3| pairs.iter().map(|p| p[k].center.distance_squared(mean)).sum::<f64>().sqrt();
        let (own, other) = (spread(0, here), spread(1, there));
        let size = here.length().max(1.0);
        if !(other > 0.0 && own > SAME * size) {
            return Err("the photos in common were all taken from one place".into());
        }
        let turns = pairs.iter().map(|[a, b]| a.world_from_camera * b.world_from_camera.transpose());
        let rotation = nearest_rotation(&(turns.fold(DMat3::ZERO, |sum, turn| sum + turn) * n.recip()));
        let scale = own / other;
        let change = Self { scale, rotation, shift: here - rotation * there * scale };
        let worst = |off: &dyn Fn(&Camera, &Camera) -> f64| {
            pairs.iter().map(|[a, b]| off(a, &change.applied(b))).fold(0.0, f64::max)
        };
        let off = worst(&|a, b| a.center.distance(b.center) / own);
        let turned = worst(&|a, b| pose::angle(&a.world_from_camera, &b.world_from_camera).to_degrees());
        if off > OFF || turned > TURNED_DEG || rotation_error(&rotation) > SAME {
            return Err(format!(
                "the poses of the {} in common disagree, by {:.0} % of their spread and {turned:.1} degrees",
                things(pairs.len(), "photo"),
                100.0 * off
            ));
        }
        let is_same = pairs.iter().all(|[a, b]| a.center.distance(b.center) <= SAME * size);
        Ok(if is_same { None } else { Some(change) })
    }
}

/// Returns the photos of `added` that are none of the scene's own, and the change into the scene's frame if theirs is
/// another. Without photos in common, the frame is the scene's.
///
/// # Errors
/// If photos are in common and their poses disagree.
pub(super) fn aligned(scene: &Dataset, added: &Dataset) -> Result<(Vec<Photo>, Option<FrameChange>), JobError> {
    let mut own: BTreeMap<String, Vec<&Photo>> = BTreeMap::new();
    scene.photos.iter().for_each(|p| own.entry(file_name(&p.path)).or_default().push(p));
    let mut pairs: Vec<[&Camera; 2]> = Vec::new();
    let mut others = Vec::new();
    for photo in &added.photos {
        let alike = own.get(&file_name(&photo.path)).map_or(&[][..], Vec::as_slice);
        match alike.iter().find(|p| is_same_file(&p.path, &photo.path)) {
            Some(known) => pairs.push([&known.camera, &photo.camera]),
            None => others.push(photo.clone()),
        }
    }
    let change = FrameChange::of(&pairs).map_err(|why| {
        let text = format!(
            "{}: {why}; pose the photos again, or add them one by one without poses, so that they are located",
            added.root.display()
        );
        JobError::AddPhotos(text)
    })?;
    Ok((others, change))
}

/// Returns whether a picture is one of the scene's own photos.
pub(super) fn is_own(scene: &Dataset, picture: &Path) -> bool {
    scene.photos.iter().any(|p| file_name(&p.path) == file_name(picture) && is_same_file(&p.path, picture))
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Returns whether two paths hold the same bytes.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let size = |path: &Path| path.metadata().ok().map(|m| m.len());
    files::real(a) == files::real(b)
        || size(a).is_some()
            && size(a) == size(b)
            && matches!((files::sha256(a), files::sha256(b)), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(angle: f64) -> Camera {
        let eye = DVec3::new(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
        Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 16, 12).expect("valid")
    }

    #[test]
    fn photos_in_common_give_the_frame_of_all() {
        let folder = tempfile::tempdir().expect("a folder");
        let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.3);
        let back = FrameChange { scale: 0.4, rotation: turn, shift: DVec3::new(5.0, -2.0, 1.0) };
        let photo = |set: &str, name: &str, value: u8, camera: Camera| {
            let path = folder.path().join(set).join(name);
            std::fs::create_dir_all(folder.path().join(set)).expect("made");
            image::RgbImage::from_pixel(16, 12, image::Rgb([value; 3])).save(&path).expect("written");
            Photo::new(name, path, camera)
        };
        let own = |i: u8| photo("own", &format!("{i}.png"), i, camera(f64::from(i)));
        let scene = Dataset { photos: (0..4).map(own).collect(), ..Dataset::default() };
        let set = |moved: f64| {
            let other = |i: u8| {
                // Another picture of the same name is another photo.
                let value = if i == 1 { 77 } else { i };
                let mut camera = back.applied(&camera(f64::from(i) + 0.1 * f64::from(u8::from(i == 1))));
                camera.center.x += if i == 2 { moved } else { 0.0 };
                photo("new", &format!("{i}.png"), value, camera)
            };
            Dataset { photos: (0..6).map(other).collect(), ..Dataset::default() }
        };
        let (new, change) = aligned(&scene, &set(0.0)).expect("aligned");
        let names: Vec<&str> = new.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["1.png", "4.png", "5.png"]);
        let change = change.expect("another frame");
        let place = change.applied(&new[1].camera);
        assert!(place.center.distance(camera(4.0).center) < 1e-9, "{}", place.center);
        assert!((place.world_from_camera.z_axis - camera(4.0).world_from_camera.z_axis).length() < 1e-9);
        let error = aligned(&scene, &set(1.5)).expect_err("one of them is elsewhere").to_string();
        assert!(error.contains("in common disagree"), "{error}");
        let (new, change) = aligned(&scene, &scene).expect("the same");
        assert!(new.is_empty() && change.is_none());
    }
}
