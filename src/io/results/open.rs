//! One opening for all results: by the properties of a splat, by the files beside it, by the shapes in a checkpoint.

use std::path::{Path, PathBuf};

use super::face::MethodResult;
use super::folder::{self, ResultOptions};
use super::{feature_3dgs, grouping, langsplat, legaussians, level_runs, lifted, open_gaussian, saga, thgs};
use crate::io::ply::Ply;
use crate::io::{IoError, files};

/// Most bytes of a splat's header.
const HEADER_BYTES: u64 = 64 << 10;

type Reader = fn(&Path, &ResultOptions) -> Result<MethodResult, IoError>;

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
    if let Some(file) = named(path, |name| name == thgs::FILE) {
        return thgs::read(&file);
    }
    if let Some(file) = features_of_saga(path) {
        return saga::read(&file);
    }
    if let Some(splat) = splat_of(path)
        && let Some(read) = reader_of(&splat)?
    {
        return read(&splat, options);
    }
    if let Some(runs) = level_runs::find(path)? {
        return langsplat::read(&runs, options);
    }
    if let Some(file) = named(path, |name| name == lifted::FEATURES) {
        return lifted::ludvig(&file);
    }
    if let Some(file) = named(path, |name| name.ends_with(lifted::DISTILLED)) {
        return lifted::distilled(&file);
    }
    Err(IoError::Unsupported {
        path: path.into(),
        what: "files of no method that is known".into(),
        remedy: "known are Gaussian Grouping, Gaga, OmniSeg3D-GS, OpenGaussian, Feature 3DGS, SAGA, LEGaussians, \
                 LangSplat, LangSplatV2, Occam's LGS, Dr.Splat, THGS, ReLaGS, splat-distiller and LUDVIG",
    })
}

/// The file itself, or the first in the folder, whose name `is` accepts.
fn named(path: &Path, is: impl Fn(&str) -> bool) -> Option<PathBuf> {
    if path.is_file() {
        let name = path.file_name()?.to_string_lossy();
        return is(&name).then(|| path.to_owned());
    }
    files::names_in(path).ok()?.into_iter().find(|name| is(name)).map(|name| path.join(name))
}

/// SAGA's features, from any of its files or its folder.
fn features_of_saga(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        return folder::latest(path, saga::FEATURES);
    }
    let name = path.file_name()?.to_string_lossy().into_owned();
    let is_own = name == saga::FEATURES || name == "scene_point_cloud.ply" || name == "scale_gate.pt";
    let beside = || folder::latest(files::folder_of(path), saga::FEATURES);
    let above = || folder::latest(&folder::run_of(path), saga::FEATURES);
    if is_own { beside().or_else(above) } else { None }
}

/// The splat that a path means.
fn splat_of(path: &Path) -> Option<PathBuf> {
    const SPLAT: &str = "point_cloud.ply";
    let is_splat = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
    match path.is_dir() {
        true => folder::latest(path, SPLAT),
        false if is_splat => Some(path.to_owned()),
        false => folder::latest(files::folder_of(path), SPLAT),
    }
}

/// The reader of a splat with these properties.
fn reader_of(splat: &Path) -> Result<Option<Reader>, IoError> {
    let start = files::read_start(splat, HEADER_BYTES)?;
    let ply = Ply::parse(&start, splat)?;
    let Some(vertex) = ply.element("vertex") else { return Ok(None) };
    let has = |name: &str| vertex.properties.iter().any(|p| p.name == name);
    let first = |prefix: &str| has(&format!("{prefix}0"));
    Ok(if first(grouping::PREFIX) {
        Some(grouping::read)
    } else if has(open_gaussian::PROPERTY) {
        Some(open_gaussian::read)
    } else if first(feature_3dgs::PREFIX) {
        Some(feature_3dgs::read)
    } else if first(legaussians::PREFIX) {
        Some(legaussians::read)
    } else {
        None
    })
}
