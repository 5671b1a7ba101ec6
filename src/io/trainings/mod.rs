//! Trainings of other programs that keep their Gaussians in checkpoints: 3D Gaussian Splatting and its descendants,
//! gsplat, and nerfstudio's splatfacto.

mod cameras;
mod gsplat;
mod inria;
mod kind;
mod nerfstudio;
mod normalization;
mod parameters;
#[cfg(test)]
mod sample_tests;
mod settings;
mod similarity;
#[cfg(test)]
mod tests;

use std::path::Path;

use super::gs_output::{self, GsOutput};
use super::{IoError, files};
use crate::scene::GaussianCloud;

use kind::{CheckpointKind, kind_of};

pub(crate) use self::inria::gaussians;

/// Gaussians of another program's training, and the cameras and photos that belong to them.
#[derive(Debug)]
pub(crate) struct Training {
    pub(crate) cloud: GaussianCloud,
    pub(crate) beside: GsOutput,
}

/// Warning about a checkpoint with more values than those of Gaussians.
pub(crate) const MORE_VALUES: &str = "the checkpoint has more than Gaussians; its further values are not shown";

/// Returns whether a folder, or the file of settings in one, is a training whose Gaussians are in checkpoints.
pub(crate) fn is_training(path: &Path) -> bool {
    inria::newest_checkpoint(path).is_some() || gsplat::is_run(path) || nerfstudio::run_of(path).is_some()
}

/// Returns whether a file is called like a checkpoint of PyTorch.
pub(crate) fn is_checkpoint(name: &str) -> bool {
    [".pth", ".pt", ".ckpt"].iter().any(|ending| name.ends_with(ending))
}

/// Returns whether a file has the settings of a training whose Gaussians are in checkpoints.
pub(crate) fn is_settings(path: &Path) -> bool {
    let folder = files::folder_of(path);
    match path.file_name().and_then(|name| name.to_str()) {
        Some(name) if gs_output::is_settings(name) => {
            gs_output::latest(folder).is_none() && inria::newest_checkpoint(folder).is_some()
        }
        Some("cfg.yml") => gsplat::is_run(folder),
        Some("config.yml" | "dataparser_transforms.json") => nerfstudio::run_of(path).is_some(),
        _ => false,
    }
}

/// Opens such a folder, or a checkpoint.
///
/// # Errors
/// If the checkpoint is broken, or of something else than Gaussians, which the error names.
pub(crate) fn open(path: &Path) -> Result<Training, IoError> {
    if is_settings(path) {
        return open(files::folder_of(path));
    }
    if path.is_dir() {
        return match inria::newest_checkpoint(path) {
            Some(file) => inria::open(&file),
            None if gsplat::is_run(path) => gsplat::open(path, None),
            None => nerfstudio::open(path),
        };
    }
    match kind_of(path)? {
        CheckpointKind::Inria => inria::open(path),
        CheckpointKind::Gsplat => gsplat::open(path, Some(path)),
        CheckpointKind::Nerfstudio => nerfstudio::open(path),
    }
}

/// Error about a checkpoint of something else.
fn not_gaussians(path: &Path, what: String) -> IoError {
    let remedy = "open a training of 3D Gaussian Splatting, gsplat or splatfacto, or train the photos here";
    IoError::Unsupported { path: path.into(), what, remedy }
}
