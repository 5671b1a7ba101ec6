//! COLMAP's binary files.

use std::path::Path;

use glam::DVec3;

use super::{Cameras, Image, distinct, lens, point};
use crate::io::IoError;
use crate::io::reader::Reader;
use crate::scene::SparsePoint;

/// Least bytes of a camera: id, model, size, two parameters.
const CAMERA_BYTES: usize = 4 + 4 + 16 + 16;
/// Least bytes of an image: id, pose, camera, empty name, number of 2-D points.
const IMAGE_BYTES: usize = 4 + 56 + 4 + 1 + 8;
const OBSERVATION_BYTES: usize = 24;
/// Least bytes of a point: id, position, color, error, length of its track.
pub(super) const POINT_BYTES: usize = 8 + 24 + 3 + 8 + 8;
pub(super) const TRACK_BYTES: usize = 8;

/// `cameras.bin`.
pub(super) fn cameras(bytes: &[u8], path: &Path) -> Result<Cameras, IoError> {
    let mut r = Reader::new(bytes, path);
    let n = r.count("cameras", CAMERA_BYTES)?;
    let mut cameras = Cameras::new();
    let mut ids = Vec::new();
    for i in 0..n {
        let place = format!("camera {i}");
        let id = r.u32(&place)?;
        ids.push(u64::from(id));
        let number = r.u32(&place)?;
        let size = (r.u64(&place)?, r.u64(&place)?);
        let model = lens::by_number(number, &place, path)?;
        let params = (0..model.params).map(|_| r.f64(&place)).collect::<Result<Vec<_>, _>>()?;
        cameras.insert(id, lens::lens(model, size, &params, id, path)?);
    }
    distinct(ids, "camera", path)?;
    Ok(cameras)
}

/// `images.bin`.
pub(super) fn images(bytes: &[u8], path: &Path) -> Result<Vec<Image>, IoError> {
    let mut r = Reader::new(bytes, path);
    let n = r.count("images", IMAGE_BYTES)?;
    let mut images = Vec::new();
    let mut ids = Vec::new();
    for i in 0..n {
        let place = format!("image {i}");
        let number = r.u32(&place)?;
        ids.push(u64::from(number));
        let mut q = [0.0; 4];
        for v in &mut q {
            *v = r.f64(&place)?;
        }
        let translation = DVec3::new(r.f64(&place)?, r.f64(&place)?, r.f64(&place)?);
        let camera = r.u32(&place)?;
        let name = std::str::from_utf8(r.c_string(&place)?)
            .map_err(|_| IoError::syntax(path, place.clone(), "its name is not UTF-8 text"))?;
        let observations = r.count(&format!("2-D points of {place}"), OBSERVATION_BYTES)?;
        r.take(observations * OBSERVATION_BYTES, &place)?;
        images.push(Image { number, name: name.into(), camera, quaternion: q, translation });
    }
    distinct(ids, "image", path)?;
    Ok(images)
}

/// `points3D.bin`.
pub(super) fn points(bytes: &[u8], path: &Path) -> Result<Vec<SparsePoint>, IoError> {
    let mut r = Reader::new(bytes, path);
    let n = r.count("points", POINT_BYTES)?;
    let mut points = Vec::with_capacity(n);
    let mut ids = Vec::with_capacity(n);
    for i in 0..n {
        ids.push(r.u64("a point")?);
        let position = DVec3::new(r.f64("a point")?, r.f64("a point")?, r.f64("a point")?);
        let rgb = r.array("a point")?;
        r.f64("a point")?;
        let track = r.count("track entries of a point", TRACK_BYTES)?;
        r.take(track * TRACK_BYTES, "a point's track")?;
        points.push(point(position, rgb, i, path)?);
    }
    distinct(ids, "point", path)?;
    Ok(points)
}

/// Number of cameras in the bytes of a `cameras.bin`.
pub fn check_cameras(bytes: &[u8], path: &Path) -> Result<usize, IoError> {
    cameras(bytes, path).map(|c| c.len())
}

/// Number of photos in the bytes of an `images.bin`.
pub fn check_images(bytes: &[u8], path: &Path) -> Result<usize, IoError> {
    images(bytes, path).map(|i| i.len())
}

/// Number of points in the bytes of a `points3D.bin`.
pub fn check_points(bytes: &[u8], path: &Path) -> Result<usize, IoError> {
    points(bytes, path).map(|p| p.len())
}
