//! LaGa: several embeddings of clusters of up to three levels, beside features like SAGA's, from which the clusters
//! were made. The features themselves are not read.

use std::path::{Path, PathBuf};

use super::face::{ClusterLevel, Descriptors, LevelValues, Method, MethodResult};
use super::open_gaussian::clusters_of;
use super::saga;
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};

/// File of the embeddings.
pub(super) const DESCRIPTORS: &str = "multi_lvl_cluster_features.pth";
/// File of their weights.
pub(super) const WEIGHTS: &str = "multi_lvl_cluster_feature_weights.pth";
/// File of how alike Gaussians and clusters are.
pub(super) const SCORES: &str = "multi_lvl_seg_scores.pth";
/// Levels of the photos' masks.
const LEVELS: [&str; 3] = ["small", "medium", "large"];

/// Returns whether the embeddings lie beside features like SAGA's.
pub(super) fn is_beside(features: &Path) -> bool {
    files::folder_of(features).join(DESCRIPTORS).is_file()
}

/// Reads a result; `features` are those like SAGA's, beside its files.
pub(super) fn read(features: &Path) -> Result<MethodResult, IoError> {
    let splat = saga::needed_splat(features)?;
    let [rows, weights, scores] = [DESCRIPTORS, WEIGHTS, SCORES].map(|name| beside(features, name));
    let (rows, weights, scores) = (rows?, weights?, scores?);
    let (mut rows, mut weights, mut scores) =
        (Tensors::open(&rows)?, Tensors::open(&weights)?, Tensors::open(&scores)?);
    let count = rows.length("").unwrap_or_default();
    if !(1..=LEVELS.len()).contains(&count) {
        return Err(rows.error("", format!("has {count} levels, expected 1 to {}", LEVELS.len())));
    }
    // A scene of one level was made from whole objects.
    let names = if count == 1 { &["objects"][..] } else { &LEVELS[..count] };
    let mut levels = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let place = k.to_string();
        let (features, weights) = (rows.rows(&place)?, weights.floats(&place)?);
        let (of, clusters) = scores.largest_columns(&place)?;
        let each = features.len() / clusters;
        if each == 0 || each * clusters != features.len() || weights.len() != features.len() {
            let (have, weights) = (features.len(), weights.len());
            let reason =
                format!("has {have} embeddings with {weights} weights for {clusters} clusters of level '{name}'");
            return Err(rows.error(&place, reason));
        }
        let of = clusters_of(&of, clusters).map_err(|e| scores.error(&place, e))?;
        let several = Some(Descriptors { each, weights });
        let level = ClusterLevel { of, features, several, leaves: None };
        levels.push(((*name).to_owned(), LevelValues::Clusters(level)));
    }
    MethodResult::of_one_cloud(Method::Laga, &splat, splat_ply::read(&splat)?, levels)
}

fn beside(features: &Path, name: &str) -> Result<PathBuf, IoError> {
    let file = files::folder_of(features).join(name);
    if file.is_file() {
        return Ok(file);
    }
    let what = format!("LaGa's clusters without {name}, which was not found beside them");
    Err(IoError::Unsupported { path: features.into(), what, remedy: "copy it there; LaGa's inference.ipynb saves it" })
}
