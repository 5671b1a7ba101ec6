//! Embeddings of Gaussians beside an unchanged splat: splat-distiller's `<checkpoint>_features.pt`, and LUDVIG's
//! `features.npy` beside `gaussians.ply`.

use std::path::{Path, PathBuf};

use super::decoder::Decoder;
use super::face::{EmbeddedLevel, LevelCodes, LevelValues, Method, MethodResult};
use super::numpy;
use super::rows::FeatureRows;
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply, trainings};
use crate::scene::GaussianCloud;

/// LUDVIG's files.
pub(super) const FEATURES: &str = "features.npy";
const GAUSSIANS: &str = "gaussians.ply";
/// End of the names of splat-distiller's files.
pub(super) const DISTILLED: &str = "_features.pt";
/// Numbers of an OpenCLIP embedding.
const CLIP: usize = 512;

/// Place of LUDVIG's Gaussians.
pub(super) fn gaussians_of(file: &Path) -> PathBuf {
    files::folder_of(file).join(GAUSSIANS)
}

/// Reads LUDVIG's result.
pub(super) fn ludvig(file: &Path) -> Result<MethodResult, IoError> {
    let splat = gaussians_of(file);
    let features = numpy::read(file)?.rows(file, "features")?;
    if features.dim() != CLIP {
        let what = format!(
            "features of {} numbers, with which no phrase can be compared (CLIP's have {CLIP})",
            features.dim()
        );
        return Err(IoError::Unsupported { path: file.into(), what, remedy: "open its Gaussians alone" });
    }
    assembled(Method::Ludvig, &splat, splat_ply::read(&splat)?, features)
}

/// Reads splat-distiller's result.
pub(super) fn distilled(file: &Path) -> Result<MethodResult, IoError> {
    let mut tensors = Tensors::open(file)?;
    let name = tensors.names().next().unwrap_or_default().to_owned();
    let features = tensors.half_rows(&name)?;
    if features.dim() != CLIP {
        let what = format!(
            "features of {} numbers, with which no phrase can be compared (CLIP's have {CLIP})",
            features.dim()
        );
        return Err(IoError::Unsupported { path: file.into(), what, remedy: "distill SAMOpenCLIP's features" });
    }
    let splat = splat_of(file).ok_or_else(|| IoError::Unsupported {
        path: file.into(),
        what: "features of Gaussians, whose checkpoint was not found".into(),
        remedy: "put the checkpoint, or its .ply, beside the features, with the same name",
    })?;
    let is_splat = splat.extension().is_some_and(|e| e == "ply");
    let cloud = if is_splat { splat_ply::read(&splat)? } else { trainings::open(&splat)?.cloud };
    assembled(Method::SplatDistiller, &splat, cloud, features)
}

/// Makes the result of a splat with an embedding for each Gaussian.
pub(super) fn assembled(
    method: Method,
    splat: &Path,
    cloud: GaussianCloud,
    rows: FeatureRows,
) -> Result<MethodResult, IoError> {
    let decoder = Decoder::none(rows.dim());
    let level = EmbeddedLevel { codes: LevelCodes::Dense(rows), is_unit: false, decoder };
    MethodResult::of_one_cloud(method, splat, cloud, vec![("features".into(), LevelValues::Embedded(level))])
}

/// The splat or checkpoint that the features were made for.
pub(super) fn splat_of(file: &Path) -> Option<PathBuf> {
    let name = file.file_name()?.to_string_lossy();
    let mut stem = name.strip_suffix(DISTILLED)?;
    for end in ["_refined", "_filtered"] {
        stem = stem.strip_suffix(end).unwrap_or(stem);
    }
    let beside = |ending| files::folder_of(file).join(format!("{stem}.{ending}"));
    ["ply", "pt"].into_iter().map(beside).find(|splat| splat.is_file())
}
