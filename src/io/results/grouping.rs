//! Gaussian Grouping, Gaga and OmniSeg3D-GS: `point_cloud.ply` with `obj_dc_0..15`, and the first two with
//! `classifier.pth` beside it, and perhaps names of its classes that people wrote.

use std::path::{Path, PathBuf};

use super::class_names;
use super::face::{Classifier, LevelValues, Method, MethodResult};
use super::folder::ResultOptions;
use super::rows;
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};

/// Start of the properties' names.
pub(super) const PREFIX: &str = "obj_dc_";
const CLASSIFIER: &str = "classifier.pth";

/// Reads a result; `splat` has the properties.
pub(super) fn read(splat: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let mut cloud = splat_ply::read(splat)?;
    let names: Vec<String> = (0..rows::count(&cloud, PREFIX)).map(|k| format!("{PREFIX}{k}")).collect();
    let features = rows::take(&mut cloud, &names, splat)?;
    let beside = classifier_beside(splat);
    let Some(file) = options.decoder.clone().or_else(|| beside.is_file().then_some(beside)) else {
        let level = ("features".to_owned(), LevelValues::Affinity { features, gate: None });
        return MethodResult::of_one_cloud(Method::OmniSeg3d, splat, cloud, vec![level]);
    };
    let classifier = classifier(&file, features.dim())?;
    let level = ("classes".to_owned(), LevelValues::Classes { features, classifier });
    MethodResult::of_one_cloud(Method::GaussianGrouping, splat, cloud, vec![level])
}

fn classifier_beside(splat: &Path) -> PathBuf {
    files::folder_of(splat).join(CLASSIFIER)
}

/// Returns whether a splat has its classifier beside it.
pub(super) fn has_classes(splat: &Path) -> bool {
    classifier_beside(splat).is_file()
}

fn classifier(file: &Path, dim: usize) -> Result<Classifier, IoError> {
    let mut tensors = Tensors::open(file)?;
    let (weight, bias) = (tensors.rows("weight")?, tensors.floats("bias")?);
    if weight.dim() != dim || weight.len() != bias.len() {
        let shape = tensors.shape("weight").unwrap_or_default().to_vec();
        let reason = format!("has the shape {shape:?}, with {} biases, for features of {dim} numbers", bias.len());
        return Err(tensors.error("weight", reason));
    }
    let names = class_names::read(&file.with_file_name(class_names::FILE), bias.len())?;
    Ok(Classifier { weight, bias, names })
}
