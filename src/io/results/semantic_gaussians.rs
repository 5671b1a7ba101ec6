//! Semantic Gaussians: `fusion/0.pt` with the features of the Gaussians that some photo shows, and which those are,
//! beside an unchanged splat.

use std::path::{Path, PathBuf};

use super::face::{Method, MethodResult};
use super::folder;
use super::lifted;
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};

/// Folder of the features, as it is usually called.
const FOLDER: &str = "fusion";
/// Features of the Gaussians that are shown; further files have those of fewer Gaussians.
const FIRST: &str = "0.pt";
/// Features, one for each Gaussian that is shown.
const FEATURES: &str = "feat";
/// True for each Gaussian that is shown.
const SHOWN: &str = "mask_full";
/// Folder of the trainings, as it is usually called.
const TRAININGS: &str = "output";
/// Folders above the features in which the Gaussians are looked for.
const ABOVE: usize = 2;
/// Numbers of LSeg's and of OpenSeg's features.
const LSEG: usize = 512;
const OPEN_SEG: usize = 768;

/// Finds the features: the file itself, or that of a folder.
pub(super) fn features_of(path: &Path) -> Option<PathBuf> {
    let file = match path.is_dir() {
        true => [path.join(FIRST), path.join(FOLDER).join(FIRST)].into_iter().find(|file| file.is_file())?,
        false => path.to_owned(),
    };
    let is_numbered = folder::number_in(&file.file_name()?.to_string_lossy(), "", ".pt").is_some();
    let is = is_numbered && Tensors::open(&file).is_ok_and(|t| t.shape(FEATURES).is_some() && t.shape(SHOWN).is_some());
    is.then_some(file)
}

/// Returns the method by the kind of features.
///
/// # Errors
/// If the features are of no known kind.
pub(super) fn method_of(file: &Path) -> Result<Method, IoError> {
    let tensors = Tensors::open(file)?;
    match tensors.shape(FEATURES) {
        Some([_, LSEG]) => Ok(Method::SemanticGaussians),
        Some([_, OPEN_SEG]) => Ok(Method::SemanticGaussiansOpenSeg),
        shape => {
            let shape = shape.unwrap_or_default();
            let reason =
                format!("has the shape {shape:?}, expected rows of {LSEG} (LSeg) or {OPEN_SEG} (OpenSeg) numbers");
            Err(tensors.error(FEATURES, reason))
        }
    }
}

/// Reads a result; `file` has the features.
pub(super) fn read(file: &Path) -> Result<MethodResult, IoError> {
    let splat = splat_of(file).ok_or_else(|| IoError::Unsupported {
        path: file.into(),
        what: "features of Gaussians (point_cloud.ply), which were not found".into(),
        remedy: "copy the file into the folder of the training, beside its folder 'point_cloud'",
    })?;
    let method = method_of(file)?;
    let mut tensors = Tensors::open(file)?;
    let shown: Vec<bool> = tensors.integers(SHOWN)?.into_iter().map(|v| v != 0).collect();
    let features = tensors.half_rows(FEATURES)?;
    let rows = features.spread(&shown).ok_or_else(|| {
        let marked = shown.iter().filter(|shown| **shown).count();
        tensors.error(FEATURES, format!("has {} rows, but '{SHOWN}' marks {marked} Gaussians", features.len()))
    })?;
    lifted::assembled(method, &splat, splat_ply::read(&splat)?, rows)
}

/// Finds the Gaussians: beside the features, around them, or of the same name among the trainings.
pub(super) fn splat_of(file: &Path) -> Option<PathBuf> {
    let whole = std::path::absolute(file).unwrap_or_else(|_| file.into());
    let scene = files::folder_of(&whole).file_name()?.to_owned();
    let places = |folder: &Path| {
        let trainings = folder.join(TRAININGS);
        [folder.to_owned(), trainings.join(&scene), folder.join(&scene), trainings]
    };
    let around = whole.ancestors().skip(1).take(1 + ABOVE).flat_map(places);
    around.into_iter().find_map(|folder| folder::latest(&folder, "point_cloud.ply"))
}
