//! One opening for all results: by the properties of a splat, by the files beside it, by the shapes in a checkpoint.

use std::path::{Path, PathBuf};

use super::face::MethodResult;
use super::folder::{self, ResultOptions};
use super::level_runs::LevelRuns;
use super::{
    feature_3dgs, gags, grouping, laga, langsplat, legaussians, level_runs, lifted, open_gaussian, saga,
    semantic_gaussians, thgs,
};
use crate::io::ply::Ply;
use crate::io::{IoError, files};

/// Most bytes of a splat's header.
const HEADER_BYTES: u64 = 64 << 10;

/// Place of a result of another method, by the files that it consists of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ResultPlace {
    /// THGS's hierarchy.
    Thgs(PathBuf),
    /// SAGA's features.
    Saga(PathBuf),
    /// LaGa's features, with clusters beside them.
    Laga(PathBuf),
    /// A splat with the features of a method as properties.
    Splat(PathBuf, SplatFeatures),
    /// Checkpoints of levels.
    Levels(LevelRuns),
    /// LUDVIG's features.
    Ludvig(PathBuf),
    /// splat-distiller's features.
    Distilled(PathBuf),
    /// Features of Semantic Gaussians.
    Fused(PathBuf),
}

/// Features in the properties of a splat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SplatFeatures {
    Grouping,
    OpenGaussian,
    /// Of Feature 3DGS, or of GAGS, whose decoder tells it.
    Feature3dgs,
    LeGaussians,
}

/// Opens the result of another method: its folder, or one of its files.
///
/// # Errors
/// If there is none, or it cannot be read exactly; the error says why.
pub fn open_result(path: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ckpt")) {
        let what = "a checkpoint of nerfstudio (LERF and GARField are radiance fields without Gaussians)".into();
        return Err(IoError::Unsupported { path: path.into(), what, remedy: "open the folder of a splatfacto run" });
    }
    if !path.exists() {
        let cause = std::io::ErrorKind::NotFound.into();
        return Err(IoError::Read { path: path.into(), cause });
    }
    let result = match place(path)? {
        Some(ResultPlace::Thgs(file)) => thgs::read(&file),
        Some(ResultPlace::Saga(file)) => saga::read(&file),
        Some(ResultPlace::Laga(file)) => laga::read(&file),
        Some(ResultPlace::Splat(splat, features)) => match features {
            SplatFeatures::Grouping => grouping::read(&splat, options),
            SplatFeatures::OpenGaussian => open_gaussian::read(&splat, options),
            SplatFeatures::Feature3dgs if gags::is_result(&splat, options) => gags::read(&splat, options),
            SplatFeatures::Feature3dgs => feature_3dgs::read(&splat, options),
            SplatFeatures::LeGaussians => legaussians::read(&splat, options),
        },
        Some(ResultPlace::Levels(runs)) => langsplat::read(&runs, options),
        Some(ResultPlace::Ludvig(file)) => lifted::ludvig(&file),
        Some(ResultPlace::Distilled(file)) => lifted::distilled(&file),
        Some(ResultPlace::Fused(file)) => semantic_gaussians::read(&file),
        None => Err(IoError::Unsupported {
            path: path.into(),
            what: "files of no method that is known".into(),
            remedy: "known are Gaussian Grouping, Gaga, OmniSeg3D-GS, OpenGaussian, Feature 3DGS, SAGA, LaGa, \
                     LEGaussians, GAGS, LangSplat, LangSplatV2, Occam's LGS, Dr.Splat, THGS, ReLaGS, \
                     splat-distiller, LUDVIG and Semantic Gaussians",
        }),
    }?;
    with_encoder(result, options)
}

/// A result whose phrases are encoded by the encoder of the options, if they name one.
///
/// # Errors
/// If it knows no language.
fn with_encoder(result: MethodResult, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let knows_language = result.encoder.is_some() || result.method.missing_encoder().is_some();
    match &options.encoder {
        Some(_) if !knows_language => Err(IoError::Unsupported {
            what: format!("a text encoder for a result of {} (it knows no language)", result.method.name()),
            path: result.path,
            remedy: "leave out --encoder",
        }),
        Some(name) => Ok(MethodResult { encoder: Some(name.clone()), ..result }),
        None => Ok(result),
    }
}

/// Finds the files of a result; `None` if there are none.
///
/// # Errors
/// If a splat's header is broken, or the levels of several results are there.
pub(super) fn place(path: &Path) -> Result<Option<ResultPlace>, IoError> {
    if let Some(file) = named(path, |name| name == thgs::FILE) {
        return Ok(Some(ResultPlace::Thgs(file)));
    }
    if let Some(file) = features_of_saga(path) {
        let place = if laga::is_beside(&file) { ResultPlace::Laga } else { ResultPlace::Saga };
        return Ok(Some(place(file)));
    }
    if let Some(splat) = splat_of(path)
        && let Some(features) = features_of(&splat)?
    {
        return Ok(Some(ResultPlace::Splat(splat, features)));
    }
    if path.is_file() && is_splat(path) {
        return Ok(None);
    }
    if let Some(file) = semantic_gaussians::features_of(path) {
        return Ok(Some(ResultPlace::Fused(file)));
    }
    if let Some(runs) = level_runs::find(path)? {
        return Ok(Some(ResultPlace::Levels(runs)));
    }
    if let Some(file) = named(path, |name| name == lifted::FEATURES) {
        return Ok(Some(ResultPlace::Ludvig(file)));
    }
    let is = |name: &str| name.ends_with(lifted::DISTILLED);
    let distilled = named(path, is).or_else(|| named(&path.join("ckpts"), is));
    Ok(distilled.map(ResultPlace::Distilled))
}

/// The file itself, or the first in the folder, whose name `is` accepts.
fn named(path: &Path, is: impl Fn(&str) -> bool) -> Option<PathBuf> {
    if path.is_file() {
        let name = path.file_name()?.to_string_lossy();
        return is(&name).then(|| path.to_owned());
    }
    files::names_in(path).ok()?.into_iter().find(|name| is(name)).map(|name| path.join(name))
}

/// Features of SAGA or LaGa, from any of their files or their folder.
fn features_of_saga(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        return folder::latest(path, saga::FEATURES);
    }
    let name = path.file_name()?.to_string_lossy().into_owned();
    let own =
        [saga::FEATURES, "scene_point_cloud.ply", "scale_gate.pt", laga::DESCRIPTORS, laga::WEIGHTS, laga::SCORES];
    let is_own = own.contains(&name.as_str());
    let beside = || folder::latest(files::folder_of(path), saga::FEATURES);
    let above = || folder::latest(&folder::run_of(path), saga::FEATURES);
    if is_own { beside().or_else(above) } else { None }
}

/// The splat that a path means.
fn splat_of(path: &Path) -> Option<PathBuf> {
    const SPLAT: &str = "point_cloud.ply";
    match path.is_dir() {
        true => folder::latest(path, SPLAT),
        false if is_splat(path) => Some(path.to_owned()),
        false => folder::latest(files::folder_of(path), SPLAT),
    }
}

fn is_splat(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"))
}

/// The features among the properties of a splat.
fn features_of(splat: &Path) -> Result<Option<SplatFeatures>, IoError> {
    let start = files::read_start(splat, HEADER_BYTES)?;
    let ply = Ply::parse(&start, splat)?;
    let Some(vertex) = ply.element("vertex") else { return Ok(None) };
    let has = |name: &str| vertex.properties.iter().any(|p| p.name == name);
    let first = |prefix: &str| has(&format!("{prefix}0"));
    Ok(if first(grouping::PREFIX) {
        Some(SplatFeatures::Grouping)
    } else if has(open_gaussian::PROPERTY) {
        Some(SplatFeatures::OpenGaussian)
    } else if first(feature_3dgs::PREFIX) {
        Some(SplatFeatures::Feature3dgs)
    } else if first(legaussians::PREFIX) {
        Some(SplatFeatures::LeGaussians)
    } else {
        None
    })
}
