//! OpenGaussian: `point_cloud.ply` with `ins_feat_*` and codebooks beside it, and `cluster_lang.npz` in the folder of the
//! run.

use std::path::Path;

use super::face::{ClusterLevel, Leaves, LevelValues, Method, MethodResult};
use super::folder::{self, ResultOptions};
use super::numpy::{NumpyArchive, NumpyArray};
use super::rows::{self, FeatureRows};
use super::tensors::Tensors;
use crate::io::{IoError, files, splat_ply};

/// First of the properties.
pub(super) const PROPERTY: &str = "ins_feat_r";
/// Start of the properties' names.
pub(super) const PREFIX: &str = "ins_feat_";
/// File of the clusters.
pub(super) const CLUSTERS: &str = "cluster_lang.npz";
/// Clusters seen in fewer photos than this have no embedding.
const LEAST_SEEN: f32 = 5.0;
/// Large clusters of the published settings.
const USUAL_ROOTS: usize = 64;

/// Reads a result; `splat` has the properties.
pub(super) fn read(splat: &Path, options: &ResultOptions) -> Result<MethodResult, IoError> {
    let mut cloud = splat_ply::read(splat)?;
    let unwanted = |name: &str| name.starts_with(PREFIX) || ["red", "green", "blue"].contains(&name);
    rows::drop_extras(&mut cloud, |e| unwanted(&e.name));
    let run = folder::run_of(splat);
    let beside = run.join(CLUSTERS);
    let found = beside.is_file().then_some(beside);
    let what = "embeddings of clusters (cluster_lang.npz in the folder of the run)";
    let file = folder::helper(options.decoder.as_deref(), found, splat, what)?;
    let mut archive = NumpyArchive::open(&file)?;
    let features = archive.array("leaf_feat")?.rows(&file, "leaf_feat")?;
    let seen = archive.array("occu_count")?.floats();
    let of = numbers(&archive.array("leaf_ind")?, features.len(), &file)?;
    if seen.len() != features.len() {
        let (claimed, possible) = (seen.len() as u64, features.len() as u64);
        return Err(IoError::Count { path: file, what: "values of 'occu_count'".into(), claimed, possible });
    }
    let book = |name: &str| book(&[files::folder_of(splat), run.as_path()], name);
    let codes = book("leaf_code_book")?.filter(|codes| codes.len() == features.len());
    let roots = book("root_code_book")?.map_or(USUAL_ROOTS, |r| r.len());
    let in_root = features.len() / roots.max(1);
    let leaves = (in_root > 0 && in_root * roots == features.len()).then_some(Leaves { in_root, codes });
    let dim = features.dim();
    let mut values = features.to_vec();
    for (row, seen) in values.chunks_exact_mut(dim).zip(&seen) {
        if *seen < LEAST_SEEN {
            row.fill(0.0);
        }
    }
    let features = FeatureRows::new(dim, values).unwrap_or_default();
    let level = LevelValues::Clusters(ClusterLevel { of, features, several: None, leaves });
    MethodResult::of_one_cloud(Method::OpenGaussian, splat, cloud, vec![("clusters".into(), level)])
}

/// Cluster of each Gaussian.
fn numbers(array: &NumpyArray, clusters: usize, file: &Path) -> Result<Vec<Option<u32>>, IoError> {
    let all =
        array.integers().ok_or_else(|| IoError::syntax(file, "leaf_ind", "fractions instead of whole numbers"))?;
    clusters_of(&all, clusters).map_err(|reason| IoError::syntax(file, "leaf_ind", reason))
}

/// Checks numbers of clusters; negative ones are none.
pub(super) fn clusters_of(numbers: &[i64], clusters: usize) -> Result<Vec<Option<u32>>, String> {
    let known = |n: &i64| usize::try_from(*n).is_ok_and(|n| n < clusters);
    match numbers.iter().position(|n| *n >= 0 && !known(n)) {
        Some(i) => Err(format!("Gaussian {i} is in cluster {}, but there are {clusters}", numbers[i])),
        None => Ok(numbers.iter().map(|n| u32::try_from(*n).ok()).collect()),
    }
}

/// Centers of a codebook, if it is in one of these folders.
fn book(folders: &[&Path], name: &str) -> Result<Option<FeatureRows>, IoError> {
    let file = folders.iter().map(|f| f.join(name).join("kmeans_centers.pth")).find(|file| file.is_file());
    file.map(|file| Tensors::open(&file)?.rows("ins_feat")).transpose()
}
