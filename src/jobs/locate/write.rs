//! Located photos as a `transforms.json`, which this program and others open.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{LocatedPhoto, PhotoPlace};
use crate::io::transforms::opengl_pose;
use crate::io::{atomic, files};
use crate::jobs::{JobError, export};

/// Refuses a list that cannot name the photos, before any work is done: they lie in its folder or below.
pub(crate) fn check(out: &Path, photos: &[PathBuf], reads: &[&Path]) -> Result<(), JobError> {
    export::check(out, &[".json"], reads)?;
    photos.iter().try_for_each(|photo| beside(out, photo).map(drop))
}

/// A photo's path from the list's folder.
fn beside(out: &Path, photo: &Path) -> Result<String, JobError> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.into());
    let folder = real(files::folder_of(out));
    match real(photo).strip_prefix(&folder) {
        Ok(inside) => Ok(inside.to_string_lossy().replace('\\', "/")),
        Err(_) => Err(JobError::Output(format!(
            "'{}' does not lie in the folder of '{}' or below, so the list cannot name it; write the list beside the photos",
            photo.display(),
            out.display()
        ))),
    }
}

/// Writes the photos that were located.
pub(crate) fn transforms(out: &Path, photos: &[LocatedPhoto]) -> Result<(), JobError> {
    let mut frames = Vec::new();
    for photo in photos.iter().filter(|p| p.located) {
        let Some(place) = &photo.place else { continue };
        frames.push(frame(place, &beside(out, &photo.photo)?));
    }
    let document = json!({ "camera_model": "OPENCV", "frames": frames });
    atomic::write(out, |w| serde_json::to_writer_pretty(w, &document).map_err(Into::into))?;
    Ok(())
}

fn frame(PhotoPlace { camera, distortion, .. }: &PhotoPlace, file: &str) -> serde_json::Value {
    let lens = distortion.unwrap_or_default();
    json!({
        "file_path": file, "w": camera.width_px, "h": camera.height_px, "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
        "cx": camera.principal_px.x, "cy": camera.principal_px.y, "k1": lens.k1, "k2": lens.k2, "p1": lens.p1,
        "p2": lens.p2, "transform_matrix": opengl_pose(camera),
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Camera, Distortion};

    #[test]
    fn what_is_written_is_read_with_the_same_cameras() {
        let folder = tempfile::tempdir().expect("a folder");
        let photo = folder.path().join("a.png");
        image::RgbImage::new(64, 48).save(&photo).expect("written");
        let eye = DVec3::new(1.0, -3.0, 0.4);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let place = PhotoPlace {
            camera: camera.clone(),
            distortion: Some(Distortion { k1: 0.02, ..Distortion::default() }),
            explained: 0.9,
            correlation: 0.9,
            agreeing: 40,
            gain: [1.0; 3],
            bias: [0.0; 3],
            center_deviation: None,
            rotation_deviation_deg: None,
            covariance: None,
        };
        let found = LocatedPhoto {
            photo: photo.clone(),
            located: true,
            place: Some(place),
            problem: None,
            notes: vec![],
            secs: 1.0,
        };
        let refused = LocatedPhoto { located: false, ..found.clone() };
        let out = folder.path().join("transforms.json");
        check(&out, std::slice::from_ref(&photo), &[]).expect("beside it");
        transforms(&out, &[found, refused]).expect("written");
        let read = crate::io::transforms::read(&out).expect("read");
        assert_eq!(read.photos.len(), 1);
        assert!(read.photos[0].camera.center.distance(eye) < 1e-9);
        assert!((read.photos[0].camera.focal_px - camera.focal_px).length() < 1e-9);
        assert_eq!(read.photos[0].distortion.map(|d| d.k1), Some(0.02));
        let elsewhere = tempfile::tempdir().expect("a folder");
        let error = check(&elsewhere.path().join("t.json"), &[photo], &[]).expect_err("elsewhere").to_string();
        assert!(error.contains("beside the photos"), "{error}");
    }
}
