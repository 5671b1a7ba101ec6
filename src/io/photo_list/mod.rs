//! Turns the photos listed in a dataset's files into [`Photo`]s that exist. Paths stay inside the folder, sizes are
//! compared with the files' own, and warnings count photos that are missing, renamed or without a usable pose.

mod find;
mod pose;
mod tally;
mod unlisted;

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::resample::covers;
use super::{IoError, files, lenses, photo};
use crate::scene::{Camera, CameraError, Distortion, Photo};

pub(super) use find::{FoundFile, Lookup, PhotoFinder, fold, reduction};
pub(super) use pose::straightened;
use tally::ListTally;
pub(super) use tally::some_of;
pub(super) use unlisted::{is_helper, unlisted};

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
    /// Path of its file exactly as listed.
    pub(crate) entry: String,
    /// Folder that the entry is relative to, itself relative to the dataset's folder; empty for the dataset's folder.
    pub(crate) folder: String,
    pub(crate) lens: Lens,
    /// Axes of the camera (x right, y down, z forward) in the world, as columns.
    pub(crate) world_from_camera: DMat3,
    /// Camera center in the world.
    pub(crate) center: DVec3,
    /// True if the pose was already normalized.
    pub(crate) normalized: bool,
    /// Reason why there is no usable pose, if so.
    pub(crate) broken: Option<String>,
    pub(crate) test_split: bool,
    /// Color behind transparent pixels.
    pub(crate) background: Option<[f32; 3]>,
    /// Path of its mask file as listed, relative to the dataset's folder.
    pub(crate) mask: Option<String>,
}

impl ListedPhoto {
    /// The file with its folder, for display.
    fn listed_as(&self) -> String {
        let entry = self.entry.trim_start_matches("./");
        if self.folder.is_empty() { entry.into() } else { format!("{}/{entry}", self.folder) }
    }
}

/// Outcome for a listed photo.
enum Fate {
    Photo {
        photo: Box<Photo>,
        file: FoundFile,
        normalized: bool,
    },
    /// Its pose cannot be used.
    Broken(String, Option<CameraError>),
    Unfound(Lookup),
}

/// Returns the listed photos that exist and have a pose, sorted by name, with warnings that count the others.
///
/// `root` is the dataset's folder, `source` the file that lists them.
pub(super) fn photos(
    listed: Vec<ListedPhoto>,
    root: &Path,
    source: &Path,
    warnings: &mut Vec<String>,
) -> Result<Vec<Photo>, IoError> {
    listed.iter().try_for_each(|l| files::photo_name(&l.entry, source))?;
    let finder = PhotoFinder::new(root)?;
    let fates: Vec<Result<Fate, IoError>> = listed.par_iter().map(|l| fate(l, &finder, source)).collect();
    let mut tally = ListTally { listed: listed.len(), ..ListTally::default() };
    let mut found = Vec::new();
    let mut first_cause = None;
    for (l, fate) in listed.iter().zip(fates) {
        match fate? {
            Fate::Photo { photo, file, normalized } => found.push((l, photo, file, normalized)),
            Fate::Broken(why, cause) => {
                first_cause = first_cause.or(cause.map(|cause| (l.entry.clone(), cause)));
                tally.broken.push((l.listed_as(), why));
            }
            Fate::Unfound(Lookup::Outside) => tally.outside.push(l.entry.clone()),
            Fate::Unfound(Lookup::Several(two)) => tally.several.push((l.listed_as(), two)),
            Fate::Unfound(_) => tally.missing.push(l.listed_as()),
        }
    }
    // Two photos listed under different names cannot both be one file: one name only resembles that of the file.
    let mut users: HashMap<PathBuf, Vec<String>> = HashMap::new();
    for (l, _, file, _) in &found {
        users.entry(files::real(&file.path)).or_default().push(l.listed_as());
    }
    let mut photos: Vec<Photo> = Vec::new();
    for (l, photo, file, normalized) in found {
        let of_file = users.get(&files::real(&file.path)).map_or(&[][..], Vec::as_slice);
        let other = of_file.iter().find(|name| **name != l.listed_as());
        if let (Some(called), Some(other)) = (&file.called, other) {
            tally.shared.push([l.listed_as(), other.clone(), called.clone()]);
            continue;
        }
        if let Some(called) = file.called {
            tally.renamed.push((l.listed_as(), called));
        }
        if normalized {
            tally.normalized.push(photo.name.clone());
        }
        if l.mask.is_some() && photo.mask.is_none() {
            tally.unmasked.push(photo.name.clone());
        }
        if file.linked {
            tally.linked.push(photo.name.clone());
        }
        photos.push(*photo);
    }
    if photos.is_empty() {
        return Err(match first_cause.filter(|_| tally.broken.len() == listed.len()) {
            Some((photo, cause)) => IoError::Camera { path: source.into(), photo, cause },
            None => tally.error(source, root),
        });
    }
    photos.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = photos.windows(2).find(|w| w[0].name == w[1].name) {
        return Err(IoError::Duplicate { path: source.into(), photo: pair[0].name.clone() });
    }
    warnings.extend(tally.warnings(source));
    warnings.extend(lenses::warnings(&photos));
    Ok(photos)
}

fn fate(l: &ListedPhoto, finder: &PhotoFinder<'_>, source: &Path) -> Result<Fate, IoError> {
    let bad = |cause| IoError::Camera { path: source.into(), photo: l.entry.clone(), cause };
    let unusable = |cause: CameraError| Ok(Fate::Broken(cause.to_string(), Some(cause)));
    let d = l.lens.distortion;
    for (property, value) in d.coefficients() {
        if !value.is_finite() {
            let property = format!("distortion {property}");
            return Err(IoError::syntax(
                source,
                format!("photo '{}'", l.entry),
                format!("{property} = {value} is not finite"),
            ));
        }
    }
    if let Some(why) = &l.broken {
        return Ok(Fate::Broken(why.clone(), None));
    }
    let (rotation, scaled) = match straightened(l.world_from_camera) {
        Ok(straight) => straight,
        Err(cause) => return unusable(cause),
    };
    let file = match finder.find(&l.folder, &l.entry) {
        Lookup::Found(file) => file,
        other => return Ok(Fate::Unfound(other)),
    };
    let found = photo::size(&file.path)?;
    let declared = l.lens.camera(found, rotation, l.center);
    match declared.believe() {
        Err(cause @ (CameraError::Center(..) | CameraError::Far(..))) => return unusable(cause),
        other => other.map_err(bad)?,
    }
    if d != Distortion::default() && !covers(&declared, &d) {
        return Err(IoError::syntax(
            source,
            format!("photo '{}'", l.entry),
            format!(
                "its lens distortion ({}) leaves nothing of the picture; calibrate the camera anew or undistort the photo",
                d.coefficients().iter().map(|(name, value)| format!("{name} {value:e}")).collect::<Vec<_>>().join(", ")
            ),
        ));
    }
    let expected = (declared.width_px, declared.height_px);
    if !is_scaled(expected, found) {
        return Err(IoError::PhotoSize { path: file.path, found, expected });
    }
    let camera = if found == expected { declared } else { declared.resized(found.0, found.1) };
    camera.validate().map_err(bad)?;
    let mask = match l.mask.as_deref() {
        Some(entry) => listed_mask(finder, entry, source, found)?,
        None => None,
    };
    let photo = Photo {
        name: file.name.clone(),
        path: file.path.clone(),
        camera,
        distortion: (d != Distortion::default()).then_some(d),
        test_split: l.test_split,
        background: l.background,
        cut_out: false,
        mask,
    };
    Ok(Fate::Photo { photo: Box::new(photo), file, normalized: l.normalized || scaled })
}

/// Finds the mask listed for a photo; `None` if it does not exist.
///
/// # Errors
/// If it lies outside of the folder, cannot be read or has another shape than the photo.
fn listed_mask(
    finder: &PhotoFinder<'_>,
    entry: &str,
    source: &Path,
    size_px: (u32, u32),
) -> Result<Option<PathBuf>, IoError> {
    let path = match finder.find("", entry) {
        Lookup::Found(found) => found.path,
        Lookup::Missing | Lookup::Several(_) => return Ok(None),
        Lookup::Outside => {
            let folder = files::folder_of(source).into();
            return Err(IoError::Outside { path: source.into(), entry: entry.into(), folder });
        }
    };
    let found = photo::size(&path)?;
    if !is_scaled(size_px, found) {
        return Err(IoError::PhotoSize { path, found, expected: size_px });
    }
    Ok(Some(path))
}

/// Returns a point that is finite and within [`Camera::FARTHEST`]; the error names the file, the kind of thing, its
/// index and the axis.
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

/// Finds the photos' folder of a dataset that lists names only: `images`, or else the least reduced `images_<factor>`,
/// or else the dataset's own (empty). `source` is the file with the list.
pub(super) fn photo_folder(root: &Path, source: &Path) -> Result<String, IoError> {
    let mut best: Option<(u32, String)> = None;
    let failed = |cause| IoError::Read { path: root.into(), cause };
    for entry in fs::read_dir(root).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let Some(name) = entry.file_name().to_str().map(str::to_owned) else { continue };
        let factor = match name.to_lowercase().strip_prefix("images") {
            Some("") => Some(1),
            Some(rest) => rest.strip_prefix('_').and_then(|f| f.parse().ok()).filter(|f| *f > 1),
            None => None,
        };
        if let Some(factor) = factor.filter(|f| entry.path().is_dir() && best.as_ref().is_none_or(|b| *f < b.0)) {
            best = Some((factor, name));
        }
    }
    let of_root = || files::names_in(root).is_ok_and(|names| names.iter().any(|name| photo::is_photo(name)));
    match best {
        Some((_, name)) => Ok(name),
        None if of_root() => Ok(String::new()),
        None => Err(IoError::syntax(
            source,
            "photos",
            format!("there is neither a folder 'images' nor 'images_<factor>' in {}", root.display()),
        )),
    }
}

impl Lens {
    /// Makes the pinhole camera of the lens, for a file of `found` px if it declares no size.
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

/// Returns whether a picture of `found` px has the shape of one of `expected` px: one factor for both sides, up to
/// rounding of the smaller picture's sides.
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
}
