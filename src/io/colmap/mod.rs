//! COLMAP reconstructions, binary and text: `cameras`, `images` and `points3D` in `sparse/0`,
//! `sparse` or the dataset's folder, photos in `images` (or a reduced `images_<factor>`).
//!
//! Poses are camera_from_world with the axes that this program uses (x right, y down, z forward).

mod binary;
mod lens;
mod text;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use super::photo_list::{Lens, ListedPhoto, photos};
use super::{IoError, files, photo_list};
use crate::math::rotation::matrix_from_quaternion;
use crate::scene::{CameraError, Dataset, SparsePoint};

pub use binary::{check_cameras, check_images, check_points};
pub use text::{check_text_cameras, check_text_images, check_text_points};

/// Where a reconstruction may lie, relative to the dataset's folder.
const FOLDERS: [&str; 3] = ["sparse/0", "sparse", "."];

struct Image {
    name: String,
    camera: u32,
    /// camera_from_world, w x y z.
    quaternion: [f64; 4],
    /// camera_from_world.
    translation: DVec3,
}

type Cameras = HashMap<u32, Lens>;

/// The folder of the reconstruction of the dataset in `root`, and whether it is binary.
fn find(root: &Path) -> Option<(PathBuf, bool)> {
    let has = |folder: &Path, ending: &str| {
        ["cameras", "images"].iter().all(|n| folder.join(format!("{n}.{ending}")).is_file())
    };
    FOLDERS.iter().map(|f| root.join(f)).find_map(|folder| {
        let binary = has(&folder, "bin");
        (binary || has(&folder, "txt")).then_some((folder, binary))
    })
}

pub(crate) fn is_colmap(root: &Path) -> bool {
    find(root).is_some()
}

/// Reads the dataset in `root`.
pub fn read(root: &Path) -> Result<Dataset, IoError> {
    let Some((folder, is_binary)) = find(root) else {
        let cause = std::io::Error::from(std::io::ErrorKind::NotFound);
        return Err(IoError::Read { path: root.join("sparse/0/cameras.bin"), cause });
    };
    let ending = if is_binary { "bin" } else { "txt" };
    let file = |name: &str| folder.join(format!("{name}.{ending}"));
    let (cameras_file, images_file, points_file) = (file("cameras"), file("images"), file("points3D"));
    let load = |path: &Path| files::read(path, u64::MAX);
    let (cameras, images) = if is_binary {
        let cameras = binary::cameras(&load(&cameras_file)?, &cameras_file)?;
        (cameras, binary::images(&load(&images_file)?, &images_file)?)
    } else {
        let cameras = text::cameras(&files::read_text(&cameras_file)?, &cameras_file)?;
        (cameras, text::images(&files::read_text(&images_file)?, &images_file)?)
    };
    let mut warnings = Vec::new();
    let points = match points_file.is_file() {
        false => Vec::new(),
        true if is_binary => binary::points(&load(&points_file)?, &points_file)?,
        true => text::points(&files::read_text(&points_file)?, &points_file)?,
    };
    if points.is_empty() {
        warnings.push("the reconstruction has no sparse points; training starts where the photos agree".into());
    }
    let photo_folder = photo_list::photo_folder(root, &images_file)?;
    let listed =
        images.iter().map(|i| listed(i, &cameras, root, &photo_folder, &images_file)).collect::<Result<_, _>>()?;
    Ok(Dataset {
        name: files::folder_name(root),
        root: root.into(),
        format: if is_binary { "COLMAP binary" } else { "COLMAP text" }.into(),
        photos: photos(listed, root, &images_file, &mut warnings)?,
        points,
        warnings,
        ..Dataset::default()
    })
}

fn listed(image: &Image, cameras: &Cameras, root: &Path, folder: &str, source: &Path) -> Result<ListedPhoto, IoError> {
    let Some(lens) = cameras.get(&image.camera) else {
        return Err(IoError::syntax(
            source,
            format!("photo '{}'", image.name),
            format!("there is no camera {}", image.camera),
        ));
    };
    let bad = |cause| IoError::Camera { path: source.into(), photo: image.name.clone(), cause };
    let [x, y, z] = matrix_from_quaternion(image.quaternion).ok_or_else(|| bad(CameraError::Rotation(f64::NAN)))?;
    // The rows of camera_from_world are the columns of world_from_camera.
    let world_from_camera = DMat3::from_cols(x.into(), y.into(), z.into());
    let name = files::relative(root, &image.name, source)?;
    Ok(ListedPhoto {
        entry: format!("{folder}/{name}"),
        name,
        lens: lens.clone(),
        world_from_camera,
        center: -(world_from_camera * image.translation),
        test_split: false,
        background: None,
        mask: None,
    })
}

fn point(position: DVec3, rgb: [u8; 3], index: usize, path: &Path) -> Result<SparsePoint, IoError> {
    photo_list::place(position, "point", index, path).map(|position| SparsePoint { position, rgb })
}

/// An error where a number that names one thing names two.
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
