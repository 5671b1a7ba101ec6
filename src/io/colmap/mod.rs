//! COLMAP reconstructions, binary and text: `cameras`, `images` and `points3D` in `sparse/0` or other usual folders
//! ([`find`]), photos in `images` or elsewhere ([`photo_folder`]).
//!
//! Poses are camera_from_world with the axes that this program uses (x right, y down, z forward).

mod binary;
mod find;
mod lens;
mod photo_folder;
pub(crate) mod support;
mod text;

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat3, DVec3};

use super::photo_list::{ListedPhoto, PhotoFinder, photos, some_of, unlisted};
use super::splits::Splits;
use super::{IoError, files, lenses, photo_list, points_ply};
use crate::math::rotation::matrix_from_quaternion;
use crate::scene::{Dataset, SparsePoint};
use find::{Largest, ModelFolder};

pub use binary::{check_cameras, check_images, check_points};
pub use text::{check_text_cameras, check_text_images, check_text_points};

struct Image {
    number: u32,
    name: String,
    camera: u32,
    /// camera_from_world, w x y z.
    quaternion: [f64; 4],
    /// camera_from_world.
    translation: DVec3,
}

/// Cameras by their number.
type Cameras = HashMap<u32, lens::FoundLens>;

pub(crate) fn is_colmap(root: &Path) -> bool {
    find::any(root)
}

/// Reads the names of the photos in the largest reconstruction of a folder; none if there is none.
pub(crate) fn photo_names(root: &Path) -> Result<Vec<String>, IoError> {
    let largest = find::largest(root)?;
    Ok(largest.into_iter().flat_map(|found| found.images).map(|image| image.name).collect())
}

/// Reads the dataset in `root`, or the dataset of a reconstruction in `root`.
pub fn read(root: &Path) -> Result<Dataset, IoError> {
    let Some(Largest { model, images, others }) = find::largest(root)? else {
        let cause = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(IoError::Read { path: root.join("sparse/0/cameras.bin"), cause });
    };
    let opened = root;
    let images_file = model.file("images");
    let place = photo_folder::find(opened, &model.folder, &images, &images_file)?;
    let root = place.root.as_path();
    let mut warnings = Vec::new();
    if !others.is_empty() {
        let told = |other: &find::Other| format!("{} ({})", shown(&other.folder, opened), other.what);
        let others: Vec<String> = others.iter().map(told).collect();
        warnings.push(format!(
            "{} is taken, the reconstruction with the most photos ({}); others were left out: {}; open one of their \
             folders to see it",
            shown(&model.folder, opened),
            images.len(),
            some_of(&others, ", ")
        ));
    }
    let cameras = cameras(&model)?;
    let known = with_cameras(&images, &cameras, &model, &mut warnings)?;
    let listed = known.into_iter().map(|(image, lens)| listed(image, lens, &place.below)).collect();
    let mut listed = lenses::readable(listed, &model.file("cameras"), &mut warnings)?;
    Splits::beside(&[&model.folder, root])?.apply(&mut listed, &PhotoFinder::new(root)?, &mut warnings);
    let photos = photos(listed, root, &images_file, &mut warnings)?;
    warnings.extend(unlisted(&photos, images.iter().map(|image| &*image.name), root));
    let points = points(&model)?;
    if points.is_empty() {
        warnings.push("the reconstruction has no sparse points; training starts where the photos agree".into());
    }

    Ok(Dataset {
        name: files::data_set_name(root),
        root: root.into(),
        source: (root != opened).then(|| opened.into()),
        format: if model.is_binary { "COLMAP binary" } else { "COLMAP text" }.into(),
        photos,
        points,
        warnings,
        ..Dataset::default()
    })
}

/// Path of a folder relative to one that contains it.
fn shown(folder: &Path, from: &Path) -> String {
    let inside = folder.strip_prefix(from).unwrap_or(folder);
    if inside.as_os_str().is_empty() { "the folder itself".into() } else { inside.display().to_string() }
}

fn cameras(model: &ModelFolder) -> Result<Cameras, IoError> {
    let file = model.file("cameras");
    match model.is_binary {
        true => binary::cameras(&files::read(&file, u64::MAX)?, &file),
        false => text::cameras(&files::read_text(&file)?, &file),
    }
}

/// Reads the points of COLMAP's file, or else of a `.ply` beside it.
fn points(model: &ModelFolder) -> Result<Vec<SparsePoint>, IoError> {
    let file = model.file("points3D");
    let points = match file.is_file() {
        false => Vec::new(),
        true if model.is_binary => binary::points(&files::read(&file, u64::MAX)?, &file)?,
        true => text::points(&files::read_text(&file)?, &file)?,
    };
    match points_ply::beside(&model.folder).filter(|_| points.is_empty()) {
        Some(ply) => points_ply::read(&ply),
        None => Ok(points),
    }
}

/// Pairs photos with their cameras. Photos without one are left out with a warning that names them; if all are so, that
/// is an error.
fn with_cameras<'a>(
    images: &'a [Image],
    cameras: &'a Cameras,
    model: &ModelFolder,
    warnings: &mut Vec<String>,
) -> Result<Vec<(&'a Image, &'a lens::FoundLens)>, IoError> {
    let (mut known, mut others) = (Vec::new(), Vec::new());
    for image in images {
        match cameras.get(&image.camera) {
            Some(lens) => known.push((image, lens)),
            None => others.push(image),
        }
    }
    let Some(&first) = others.first() else { return Ok(known) };
    let why = |image: &Image| format!("there is no camera {}", image.camera);
    if known.is_empty() {
        return Err(IoError::syntax(&model.file("images"), format!("photo '{}'", first.name), why(first)));
    }
    let named: Vec<String> = others.iter().map(|&image| format!("{}: {}", image.name, why(image))).collect();
    warnings.push(format!(
        "{} of {} listed photos have no camera and were skipped: {}",
        others.len(),
        images.len(),
        some_of(&named, "; ")
    ));
    Ok(known)
}

/// Makes the photo, or returns the name of its camera model if that is not supported.
fn listed(image: &Image, lens: &lens::FoundLens, folder: &str) -> Result<ListedPhoto, String> {
    let lens = lens.clone()?;
    // The rows of camera_from_world are the columns of world_from_camera.
    let axes = matrix_from_quaternion(image.quaternion).map(|[x, y, z]| DMat3::from_cols(x.into(), y.into(), z.into()));
    let world_from_camera = axes.unwrap_or(DMat3::NAN);
    Ok(ListedPhoto {
        entry: image.name.clone(),
        folder: folder.into(),
        lens,
        world_from_camera,
        center: -(world_from_camera * image.translation),
        normalized: false,
        broken: None,
        test_split: false,
        background: None,
        mask: None,
    })
}

fn point(position: DVec3, rgb: [u8; 3], index: usize, path: &Path) -> Result<SparsePoint, IoError> {
    photo_list::place(position, "point", index, path).map(|position| SparsePoint { position, rgb })
}

/// Refuses two things with one id.
fn distinct(mut ids: Vec<u64>, what: &str, path: &Path) -> Result<(), IoError> {
    ids.sort_unstable();
    match ids.windows(2).find(|w| w[0] == w[1]) {
        None => Ok(()),
        Some(w) => Err(IoError::syntax(
            path,
            format!("{what} {}", w[0]),
            "its number is given twice; which of the two is meant cannot be told",
        )),
    }
}

#[cfg(test)]
mod tests;
