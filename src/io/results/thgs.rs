//! THGS and ReLaGS: `sai_nag.pt` with the superpoints of four levels and embeddings of three, beside a splat of 2D
//! Gaussian Splatting.

use std::path::{Path, PathBuf};

use super::face::{ClusterLevel, LevelValues, Method, MethodResult};
use super::folder;
use super::open_gaussian::clusters_of;
use super::tensors::Tensors;
use crate::io::{IoError, splat_ply};

/// File of the hierarchy.
pub(super) const FILE: &str = "sai_nag.pt";
/// Levels with embeddings, from fine to coarse.
const LEVELS: [&str; 3] = ["fine", "medium", "coarse"];

/// Reads a result; `file` has the hierarchy.
pub(super) fn read(file: &Path) -> Result<MethodResult, IoError> {
    let splat = splat_of(file).ok_or_else(|| IoError::Unsupported {
        path: file.into(),
        what: "superpoints of Gaussians (point_cloud.ply), which were not found".into(),
        remedy: "copy the file into the folder of the run",
    })?;
    let cloud = splat_ply::read(&splat)?;
    let mut tensors = Tensors::open(file)?;
    let mut levels = Vec::new();
    for (k, name) in LEVELS.iter().enumerate() {
        let features = tensors.rows(&format!("nag_feat.{k}"))?;
        let labels = format!("nag.{}", k + 1);
        let of = clusters_of(&tensors.integers(&labels)?, features.len()).map_err(|e| tensors.error(&labels, e))?;
        levels.push((
            (*name).to_owned(),
            LevelValues::Clusters(ClusterLevel { of, features, several: None, leaves: None }),
        ));
    }
    MethodResult::of_one_cloud(Method::Thgs, &splat, cloud, levels)
}

/// Finds the Gaussians of a hierarchy.
pub(super) fn splat_of(file: &Path) -> Option<PathBuf> {
    let whole = std::path::absolute(file).unwrap_or_else(|_| file.into());
    let mut folders = whole.ancestors().skip(1).take(2);
    folders.find_map(|folder| folder::latest(folder, "point_cloud.ply"))
}
