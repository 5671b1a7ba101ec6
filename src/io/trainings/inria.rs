//! Checkpoints of 3D Gaussian Splatting and its descendants: `chkpnt<n>.pth`, a tuple and the iteration.
//!
//! Further values than those of plain Gaussians belong to results with language features, which are not read here.

use std::path::{Path, PathBuf};

use super::Training;
use super::parameters::{self, ColorMeaning, TensorNames};
use crate::io::gs_output::{self, GsOutput};
use crate::io::torch::WeightFile;
use crate::io::{IoError, files};
use crate::scene::GaussianCloud;

/// Number of values in the tuple of a plain training.
pub(super) const LEAST: usize = 12;

/// Finds the checkpoint of the latest iteration in a folder that 3D Gaussian Splatting wrote.
pub(crate) fn newest_checkpoint(folder: &Path) -> Option<PathBuf> {
    let iteration = |name: &String| name.strip_prefix("chkpnt")?.strip_suffix(".pth")?.parse::<u64>().ok();
    let names = files::names_in(folder).ok()?;
    let newest = names.iter().filter_map(|name| Some((iteration(name)?, name))).max()?;
    Some(folder.join(newest.1))
}

pub(super) fn open(path: &Path) -> Result<Training, IoError> {
    let beside = gs_output::beside(path);
    if beside.as_ref().is_some_and(|b| b.filters) {
        return Err(IoError::Unsupported {
            path: path.into(),
            what: "a checkpoint of Mip-Splatting, which lacks the filter of its Gaussians".into(),
            remedy: "open the folder's point_cloud/iteration_<n>/point_cloud.ply, which has it",
        });
    }
    let mut file = WeightFile::open(path).map_err(|e| e.of(path))?;
    let mut cloud = gaussians(path, &mut file)?;
    // Bands that the training had not turned on yet are zero, and stay so.
    if file.tree.length("0") != Some(LEAST) {
        cloud.warnings.push(super::MORE_VALUES.into());
    }
    let mut beside = beside.unwrap_or_else(|| GsOutput::of(files::folder_of(path)));
    beside.name = Some(files::folder_name(&beside.folder));
    Ok(Training { cloud, beside })
}

/// Reads the Gaussians of the tuple that `capture()` of 3D Gaussian Splatting and its descendants makes.
///
/// # Errors
/// If a tensor is missing, broken, or of another shape.
pub(crate) fn gaussians(path: &Path, file: &mut WeightFile) -> Result<GaussianCloud, IoError> {
    let name = |index: usize| format!("0.{index}");
    let names = TensorNames {
        means: name(1),
        constant: name(2),
        rest: name(3),
        scales: name(4),
        quats: name(5),
        opacities: name(6),
    };
    parameters::read(path, file, &names, ColorMeaning::Harmonics)
}
