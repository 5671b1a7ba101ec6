//! A reconstruction of OpenMVG as COLMAP's binary files.

use std::collections::HashMap;
use std::io::{self, Write};
use std::path::Path;

use glam::{DMat3, DQuat};
use openmvg::sfm::model::LandmarkStatus;
use openmvg::sfm::{Camera, Reconstruction};

use super::failed;
use crate::io::{atomic, photo};
use crate::jobs::{JobError, export};

/// COLMAP's number of the model OPENCV.
const OPENCV: u32 = 4;

/// Pixel of a photo that sees a point.
struct Seen {
    pixel: [f64; 2],
    point: u64,
}

/// Writes `cameras.bin`, `images.bin` and `points3D.bin` into `folder`; colors are those of the photos in `images`.
pub(super) fn write(found: &Reconstruction, images: &Path, folder: &Path) -> Result<(), JobError> {
    export::make_folder(folder)?;
    // By photo, and for each point by photo and place in its list.
    let mut seen: Vec<Vec<Seen>> = found.views().iter().map(|_| Vec::new()).collect();
    let mut tracks: HashMap<usize, Vec<[u32; 2]>> = HashMap::new();
    for observation in found.observations() {
        let (view, point) = (observation.view.index(), observation.landmark.index());
        let list = &mut seen[view];
        tracks.entry(point).or_default().push([view as u32 + 1, list.len() as u32]);
        list.push(Seen { pixel: [observation.pixel.x, observation.pixel.y], point: point as u64 + 1 });
    }
    let colors = colors(found, &seen, images)?;
    atomic::write(&folder.join("cameras.bin"), |w| cameras(found, w))?;
    atomic::write(&folder.join("images.bin"), |w| photos(found, &seen, w))?;
    let points: Vec<_> =
        found.landmarks().as_slice().iter().filter(|point| point.status == LandmarkStatus::Active).collect();
    atomic::write(&folder.join("points3D.bin"), |w| {
        w.write_all(&(points.len() as u64).to_le_bytes())?;
        for point in &points {
            w.write_all(&(point.id.index() as u64 + 1).to_le_bytes())?;
            numbers(w, &[point.point.x, point.point.y, point.point.z])?;
            w.write_all(&colors.get(&(point.id.index() as u64 + 1)).copied().unwrap_or([128; 3]))?;
            numbers(w, &[point.reprojection_error.value()])?;
            let track = tracks.get(&point.id.index()).map_or(&[][..], Vec::as_slice);
            w.write_all(&(track.len() as u64).to_le_bytes())?;
            for entry in track.as_flattened() {
                w.write_all(&entry.to_le_bytes())?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

fn numbers(w: &mut dyn Write, values: &[f64]) -> io::Result<()> {
    values.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))
}

fn cameras(found: &Reconstruction, w: &mut dyn Write) -> io::Result<()> {
    let sizes: HashMap<usize, (u32, u32)> =
        found.views().iter().map(|v| (v.intrinsic_id.index(), (v.meta.width, v.meta.height))).collect();
    w.write_all(&(found.camera_models().len() as u64).to_le_bytes())?;
    for (i, camera) in found.camera_models().iter().enumerate() {
        let (width, height) = sizes.get(&i).copied().unwrap_or_default();
        let Camera::BrownConrady(lens) = camera else {
            return Err(io::Error::other("a lens of another model than was asked for"));
        };
        let (k, p) = (lens.radial_distortion(), lens.tangential_distortion());
        w.write_all(&(i as u32 + 1).to_le_bytes())?;
        w.write_all(&OPENCV.to_le_bytes())?;
        w.write_all(&u64::from(width).to_le_bytes())?;
        w.write_all(&u64::from(height).to_le_bytes())?;
        let [cx, cy] = [lens.principal_x(), lens.principal_y()];
        numbers(w, &[lens.focal_x(), lens.focal_y(), cx, cy, k.k1(), k.k2(), p.p1(), p.p2()])?;
    }
    Ok(())
}

fn photos(found: &Reconstruction, seen: &[Vec<Seen>], w: &mut dyn Write) -> io::Result<()> {
    w.write_all(&(found.registered_view_count() as u64).to_le_bytes())?;
    for (view, pose) in found.registered_views() {
        let (record, pose) = (&found.views()[view.index()], &pose.pose);
        let rotation = DQuat::from_mat3(&DMat3::from_cols_slice(pose.rotation_matrix().as_slice()));
        let shift = pose.translation();
        w.write_all(&(view.index() as u32 + 1).to_le_bytes())?;
        numbers(w, &[rotation.w, rotation.x, rotation.y, rotation.z, shift.x, shift.y, shift.z])?;
        w.write_all(&(record.intrinsic_id.index() as u32 + 1).to_le_bytes())?;
        w.write_all(record.meta.name.as_bytes())?;
        w.write_all(&[0])?;
        w.write_all(&(seen[view.index()].len() as u64).to_le_bytes())?;
        for Seen { pixel, point } in &seen[view.index()] {
            numbers(w, pixel)?;
            w.write_all(&point.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Colors of the points, by number, each from the first photo that sees it.
fn colors(found: &Reconstruction, seen: &[Vec<Seen>], images: &Path) -> Result<HashMap<u64, [u8; 3]>, JobError> {
    let mut colors = HashMap::new();
    for (view, list) in found.views().iter().zip(seen) {
        if list.iter().all(|s| colors.contains_key(&s.point)) {
            continue;
        }
        let picture = photo::open(&images.join(&view.meta.name)).map_err(|e| failed(&e))?;
        let (width, height) = (picture.width_px as usize, picture.height_px as usize);
        for s in list {
            let at = |v: f64, most: usize| (v.max(0.0) as usize).min(most - 1);
            let color = picture.rgb.get(at(s.pixel[1], height) * width + at(s.pixel[0], width));
            colors.entry(s.point).or_insert(color.copied().unwrap_or([128; 3]));
        }
    }
    Ok(colors)
}
