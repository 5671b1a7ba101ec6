//! The lens of a photo that nobody calibrated: as given, as that of the scene's photos of its size, as EXIF says, or
//! unknown.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

use crate::io::exif::{self, ExifFocal};
use crate::io::photo;
use crate::jobs::JobError;
use crate::pipeline::locate::FocalKnowledge;
use crate::scene::{Camera, Dataset, Photo};

/// EXIF and a camera of the scene that differ by less, as a ratio, are of one lens: EXIF is rounded to mm.
const SAME_LENS: f64 = 1.2;

/// A photo with its lens and no pose.
pub(super) struct PhotoLens {
    pub(super) photo: Photo,
    pub(super) focal: FocalKnowledge,
}

/// A photo of this size without a pose; `focal_sides` are longer sides.
fn pinhole(path: &Path, (width_px, height_px): (u32, u32), focal_sides: f64) -> Photo {
    let size = DVec2::new(f64::from(width_px), f64::from(height_px));
    let camera = Camera {
        width_px,
        height_px,
        focal_px: DVec2::splat(focal_sides * size.max_element()),
        principal_px: size * 0.5,
        world_from_camera: DMat3::IDENTITY,
        center: DVec3::ZERO,
    };
    Photo::new(path.to_string_lossy(), path, camera)
}

/// The photo with the usual focal length, in longer sides, instead of that of `camera`.
pub(super) fn unknown(path: &Path, camera: &Camera, usual: f64) -> Photo {
    pinhole(path, (camera.width_px, camera.height_px), usual)
}

/// The lens of the photo at `path`, with remarks. `usual` is the usual focal length of the scene, in longer sides.
pub(super) fn of(
    path: &Path,
    focal_px: Option<f64>,
    (cameras, dataset): (&[Camera], Option<&Dataset>),
    usual: f64,
    notes: &mut Vec<String>,
) -> Result<PhotoLens, JobError> {
    let size = photo::size(path)?;
    let longer = f64::from(size.0.max(size.1));
    if let Some(focal_px) = focal_px {
        return Ok(PhotoLens { photo: pinhole(path, size, focal_px / longer), focal: FocalKnowledge::Known });
    }
    let said = match exif::focal(path, size)? {
        ExifFocal::Unsaid => None,
        ExifFocal::Sides(sides) => Some(sides),
        ExifFocal::Absurd(sides) => {
            notes.push(format!("EXIF says a focal length of {sides:.3} image sides, which no lens has; it is ignored"));
            None
        }
    };
    let is_same = |c: &Camera| {
        let ratio = said.map_or(1.0, |said| said * longer / c.focal_px.x);
        (c.width_px, c.height_px) == size && (1.0 / SAME_LENS..=SAME_LENS).contains(&ratio)
    };
    // Photos of one size are mostly of one camera.
    let known = dataset.into_iter().flat_map(|d| &d.photos);
    let same = known.into_iter().find(|p| is_same(&p.camera) && p.distortion.is_none_or(|d| d.is_plain()));
    let template =
        same.map(|p| (&p.camera, p.distortion)).or_else(|| Some((cameras.iter().find(|c| is_same(c))?, None)));
    Ok(match (template, said) {
        (Some((camera, distortion)), _) => {
            let blank = pinhole(path, size, usual);
            let (focal_px, principal_px) = (camera.focal_px, camera.principal_px);
            let camera = Camera { focal_px, principal_px, ..blank.camera.clone() };
            PhotoLens { photo: Photo { camera, distortion, ..blank }, focal: FocalKnowledge::Near }
        }
        (None, Some(sides)) => PhotoLens { photo: pinhole(path, size, sides), focal: FocalKnowledge::Near },
        (None, None) => PhotoLens { photo: pinhole(path, size, usual), focal: FocalKnowledge::Unknown },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_given_focal_length_wins_and_a_camera_of_the_size_is_next() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        image::RgbImage::new(80, 60).save(&path).expect("written");
        let mut notes = Vec::new();
        let camera = pinhole(&path, (80, 60), 1.5).camera;
        let camera = Camera { principal_px: DVec2::new(39.0, 31.0), center: DVec3::ONE, ..camera };
        let mut of = |focal, cameras: &[Camera]| of(&path, focal, (cameras, None), 0.9, &mut notes).expect("a picture");
        let given = of(Some(100.0), std::slice::from_ref(&camera));
        assert_eq!((given.focal, given.photo.camera.focal_px.x), (FocalKnowledge::Known, 100.0));
        let same = of(None, std::slice::from_ref(&camera));
        assert_eq!(same.focal, FocalKnowledge::Near);
        assert_eq!((same.photo.camera.focal_px.x, same.photo.camera.principal_px.x), (120.0, 39.0));
        assert_eq!(same.photo.camera.center, DVec3::ZERO, "its pose is nobody's");
        let other = of(None, &[camera.resized(81, 60)]);
        assert_eq!((other.focal, other.photo.camera.focal_px.x), (FocalKnowledge::Unknown, 72.0));
        assert!(notes.is_empty());
    }
}
