//! From what a dataset's files say about its photos to [`Photo`]s that exist: paths stay inside
//! the folder, missing files are counted, sizes are compared with the files' own, poses against
//! what a pose must be.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::resample::covers;
use super::{IoError, files, photo};
use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::scene::{Camera, CameraError, Distortion, Photo};

/// Endings tried where a file lists a photo without one (Blender's convention).
const ENDINGS: [&str; 8] = ["png", "jpg", "jpeg", "webp", "PNG", "JPG", "JPEG", "WEBP"];

/// Largest deviation from a rotation that is taken for rounding and corrected.
const ROUNDING: f64 = 1e-3;

/// Focal lengths as files give them.
#[derive(Clone, Copy, Debug)]
pub(super) enum Focal {
    /// In px of the declared size.
    Px(DVec2),
    /// Full horizontal angle of view and, where given, the vertical one, in rad.
    Angle(f64, Option<f64>),
}

#[derive(Clone, Debug)]
pub(super) struct Lens {
    /// The picture size that the other values refer to; `None` = the file's own.
    pub(crate) size_px: Option<(u32, u32)>,
    pub(crate) focal: Focal,
    /// Principal point in px; `None` = the middle.
    pub(crate) principal_px: Option<DVec2>,
    pub(crate) distortion: Distortion,
}

#[derive(Clone, Debug)]
pub(super) struct ListedPhoto {
    pub(crate) name: String,
    /// Its file, relative to the dataset's folder, from [`files::relative`].
    pub(crate) entry: String,
    pub(crate) lens: Lens,
    /// Axes of the camera (x right, y down, z forward) in the world, as columns.
    pub(crate) world_from_camera: DMat3,
    /// Camera center in the world.
    pub(crate) center: DVec3,
    pub(crate) test_split: bool,
    /// What transparent pixels are composited over.
    pub(crate) background: Option<[f32; 3]>,
    /// The file with its mask, relative to the dataset's folder, as it is written.
    pub(crate) mask: Option<String>,
}

/// The listed photos that exist, sorted by name, with a warning that counts the others.
///
/// `root` is the dataset's folder, `source` the file that lists them.
pub(super) fn photos(
    listed: Vec<ListedPhoto>,
    root: &Path,
    source: &Path,
    warnings: &mut Vec<String>,
) -> Result<Vec<Photo>, IoError> {
    listed.iter().try_for_each(|l| files::photo_name(&l.name, source))?;
    let mut names = HashSet::new();
    if let Some(twice) = listed.iter().find(|l| !names.insert(l.name.as_str())) {
        return Err(IoError::Duplicate { path: source.into(), photo: twice.name.clone() });
    }
    let resolved: Vec<Result<Option<Photo>, IoError>> = listed.par_iter().map(|l| resolve(l, root, source)).collect();
    let mut photos = Vec::new();
    let mut missing = Vec::new();
    for (l, photo) in listed.iter().zip(resolved) {
        match photo? {
            Some(p) => photos.push(p),
            None => missing.push(l.entry.as_str()),
        }
    }
    if photos.is_empty() {
        let first = missing.first().map_or_else(String::new, |m| (*m).into());
        return Err(IoError::NoPhotos { path: source.into(), listed: listed.len(), first });
    }
    if let Some(first) = missing.first() {
        warnings.push(format!(
            "{} of {} listed photos are missing and were skipped (first: {first})",
            missing.len(),
            listed.len()
        ));
    }
    let has_mask: HashSet<&str> = listed.iter().filter(|l| l.mask.is_some()).map(|l| l.name.as_str()).collect();
    let unmasked = photos.iter().filter(|p: &&Photo| p.mask.is_none() && has_mask.contains(p.name.as_str()));
    if let Some((first, count)) = unmasked.clone().next().map(|p| (p.name.clone(), unmasked.count())) {
        warnings.push(format!(
            "{count} listed masks are missing, so all pixels of those photos count (first: that of {first})"
        ));
    }
    photos.sort_by(|a: &Photo, b| a.name.cmp(&b.name));
    Ok(photos)
}

fn resolve(l: &ListedPhoto, root: &Path, source: &Path) -> Result<Option<Photo>, IoError> {
    let bad = |cause| IoError::Camera { path: source.into(), photo: l.name.clone(), cause };
    let rotation = rotation(l.world_from_camera).map_err(bad)?;
    let d = l.lens.distortion;
    for (property, value) in [("k1", d.k1), ("k2", d.k2), ("p1", d.p1), ("p2", d.p2)] {
        if !value.is_finite() {
            let property = format!("distortion {property}");
            return Err(IoError::syntax(
                source,
                format!("photo '{}'", l.name),
                format!("{property} = {value} is not finite"),
            ));
        }
    }
    let Some(path) = find(root, &l.entry, source)? else { return Ok(None) };
    let found = photo::size(&path)?;
    let declared = l.lens.camera(found, rotation, l.center);
    declared.believe().map_err(bad)?;
    if d != Distortion::default() && !covers(&declared, &d) {
        return Err(IoError::syntax(
            source,
            format!("photo '{}'", l.name),
            format!(
                "its lens distortion (k1 {:e}, k2 {:e}, p1 {:e}, p2 {:e}) leaves nothing of the picture; calibrate the camera \
                 anew or undistort the photo",
                d.k1, d.k2, d.p1, d.p2
            ),
        ));
    }
    let expected = (declared.width_px, declared.height_px);
    if !is_scaled(expected, found) {
        return Err(IoError::PhotoSize { path, found, expected });
    }
    let camera = if found == expected { declared } else { declared.resized(found.0, found.1) };
    camera.validate().map_err(bad)?;
    let mask = l.mask.as_deref().map(|entry| listed_mask(root, entry, source, found)).transpose()?.flatten();
    Ok(Some(Photo {
        name: l.name.clone(),
        path,
        camera,
        distortion: (d != Distortion::default()).then_some(d),
        test_split: l.test_split,
        background: l.background,
        cut_out: false,
        mask,
    }))
}

/// The mask that a file names for a photo; `None` if it does not exist.
///
/// # Errors
/// If it cannot be read or has another shape than the photo.
fn listed_mask(root: &Path, entry: &str, source: &Path, size_px: (u32, u32)) -> Result<Option<PathBuf>, IoError> {
    let Some(path) = files::inside(root, &files::relative(root, entry, source)?, source)?.filter(|p| p.is_file())
    else {
        return Ok(None);
    };
    let found = photo::size(&path)?;
    if !is_scaled(size_px, found) {
        return Err(IoError::PhotoSize { path, found, expected: size_px });
    }
    Ok(Some(path))
}

/// The place of a point, if it is one: the error names the file, the kind of thing, its index and the axis.
pub(super) fn place(p: DVec3, element: &'static str, index: usize, path: &Path) -> Result<DVec3, IoError> {
    let Some(axis) = p.to_array().iter().position(|v| !(v.abs() <= Camera::FARTHEST)) else { return Ok(p) };
    let (property, value) = (["x", "y", "z"][axis], p[axis]);
    if !value.is_finite() {
        return Err(IoError::NotFinite { path: path.into(), element, index, property: property.into() });
    }
    Err(IoError::syntax(
        path,
        format!("{element} {index}"),
        format!("{property} = {value:e} is farther than {:e} units from the origin", Camera::FARTHEST),
    ))
}

/// The listed file, with one of the usual endings if it has none.
fn find(root: &Path, entry: &str, source: &Path) -> Result<Option<PathBuf>, IoError> {
    let is_file = |p: Option<PathBuf>| p.filter(|p| p.is_file());
    if let Some(path) = is_file(files::inside(root, entry, source)?) {
        return Ok(Some(path));
    }
    for ending in ENDINGS {
        if let Some(path) = is_file(files::inside(root, &format!("{entry}.{ending}"), source)?) {
            return Ok(Some(path));
        }
    }
    Ok(None)
}

/// The folder with the photos of a dataset that lists names only: `images`, or else the least
/// reduced `images_<factor>`. `source` is the file that lists them.
pub(super) fn photo_folder(root: &Path, source: &Path) -> Result<String, IoError> {
    let mut best: Option<(u32, String)> = None;
    let failed = |cause| IoError::Read { path: root.into(), cause };
    for entry in fs::read_dir(root).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let Some(name) = entry.file_name().to_str().map(str::to_owned) else { continue };
        let factor = match name.strip_prefix("images") {
            Some("") => Some(1),
            Some(rest) => rest.strip_prefix('_').and_then(|f| f.parse().ok()).filter(|f| *f > 1),
            None => None,
        };
        if let Some(factor) = factor.filter(|f| entry.path().is_dir() && best.as_ref().is_none_or(|b| *f < b.0)) {
            best = Some((factor, name));
        }
    }
    match best {
        Some((_, name)) => Ok(name),
        None => Err(IoError::syntax(
            source,
            "photos",
            format!("there is neither a folder 'images' nor 'images_<factor>' in {}", root.display()),
        )),
    }
}

impl Lens {
    /// The pinhole camera that the lens describes, for a file of `found` px if it declares no size.
    fn camera(&self, found: (u32, u32), world_from_camera: DMat3, center: DVec3) -> Camera {
        let (width_px, height_px) = self.size_px.unwrap_or(found);
        let size = DVec2::new(f64::from(width_px), f64::from(height_px));
        let focal_px = match self.focal {
            Focal::Px(f) => f,
            Focal::Angle(x, y) => {
                let along = |size: f64, angle: f64| 0.5 * size / (0.5 * angle).tan();
                let fx = along(size.x, x);
                DVec2::new(fx, y.map_or(fx, |y| along(size.y, y)))
            }
        };
        let principal_px = self.principal_px.unwrap_or(size * 0.5);
        Camera { width_px, height_px, focal_px, principal_px, world_from_camera, center }
    }
}

/// `m` with rounding errors removed; an error if it is no rotation.
fn rotation(m: DMat3) -> Result<DMat3, CameraError> {
    let error = rotation_error(&m);
    if error > ROUNDING || error.is_nan() {
        return Err(CameraError::Rotation(error));
    }
    Ok(nearest_rotation(&m))
}

/// Whether a picture of `found` px shows the same as one of `expected` px, larger or smaller: one
/// factor for both sides, up to rounding of the smaller picture's sides.
pub(super) fn is_scaled(expected: (u32, u32), found: (u32, u32)) -> bool {
    let scaled = |side: u32, by: (u32, u32)| f64::from(side) * f64::from(by.0) / f64::from(by.1);
    let across = scaled(expected.1, (found.0, expected.0)) - f64::from(found.1);
    let down = scaled(expected.0, (found.1, expected.1)) - f64::from(found.0);
    // One px of the smaller picture is `larger / smaller` px of the larger one.
    let unit = (f64::from(found.0) / f64::from(expected.0)).max(1.0);
    across.abs().min(down.abs()) <= unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaled_sizes_are_told_from_other_sizes() {
        for found in [(1008, 756), (504, 378), (252, 189), (2016, 1512), (126, 95), (126, 94)] {
            assert!(is_scaled((1008, 756), found), "{found:?}");
        }
        for found in [(756, 1008), (504, 370), (1008, 750), (1000, 756)] {
            assert!(!is_scaled((1008, 756), found), "{found:?}");
        }
        // Mip-NeRF 360's reduced folders round each side on its own.
        assert!(is_scaled((5187, 3361), (648, 420)));
    }

    #[test]
    fn rounding_is_removed_and_scale_refused() {
        let exact = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(1.1);
        let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * 1e4).round() / 1e4));
        assert!(rotation_error(&rounded) > 1e-6);
        let fixed = rotation(rounded).expect("close");
        assert!(rotation_error(&fixed) < 1e-14);
        assert!((fixed - exact).to_cols_array().iter().all(|v| v.abs() < 1e-4));
        assert!(matches!(rotation(exact * 1.01), Err(CameraError::Rotation(_))));
        assert!(matches!(rotation(-exact), Err(CameraError::Rotation(_))));
        assert!(matches!(rotation(DMat3::ZERO), Err(CameraError::Rotation(_))));
        assert!(matches!(rotation(DMat3::NAN), Err(CameraError::Rotation(_))));
    }
}
