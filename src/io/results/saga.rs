//! SAGA: `contrastive_feature_point_cloud.ply` with `f_0..31` and `scale_gate.pt` of one iteration, and the Gaussians
//! with their colors in `scene_point_cloud.ply` of another.

use std::path::{Path, PathBuf};

use super::face::{LevelValues, Method, MethodResult, ScaleGate};
use super::folder;
use super::rows::FeatureRows;
use super::tensors::Tensors;
use crate::io::ply::{Column, Ply, Table};
use crate::io::{IoError, files, memory, splat_ply};

/// File of the features.
pub(super) const FEATURES: &str = "contrastive_feature_point_cloud.ply";
/// Start of the properties' names.
const PREFIX: &str = "f_";
const GATE: &str = "scale_gate.pt";

/// Reads a result; `file` has the features.
pub(super) fn read(file: &Path) -> Result<MethodResult, IoError> {
    let features = features(file)?;
    let splat = needed_splat(file)?;
    let cloud = splat_ply::read(&splat)?;
    let gate = files::folder_of(file).join(GATE);
    let gate = if gate.is_file() { Some(scale_gate(&gate, features.dim())?) } else { None };
    let level = LevelValues::Affinity { features, gate };
    MethodResult::of_one_cloud(Method::Saga, &splat, cloud, vec![("affinities".into(), level)])
}

/// Folder of saved selections.
const SELECTIONS: &str = "segmentation_res";
/// Folders above the run in which selections are looked for: SAGA writes them where it is started.
const ABOVE: usize = 2;

/// Reads the selections that were saved beside a result, with their names and the numbers of their Gaussians. Those of
/// other results have another number of values, and are passed over.
///
/// # Errors
/// If one is broken.
pub fn saved_selections(result: &MethodResult) -> Result<Vec<(String, Vec<u32>)>, IoError> {
    let run = folder::run_of(&result.path);
    let Some(folder) = run.ancestors().take(1 + ABOVE).map(|a| a.join(SELECTIONS)).find(|f| f.is_dir()) else {
        return Ok(Vec::new());
    };
    let mut names = files::names_in(&folder).unwrap_or_default();
    names.retain(|name| name.ends_with(".pt"));
    names.sort();
    let mut all = Vec::new();
    for name in &names {
        let file = folder.join(name);
        let mut tensors = Tensors::open(&file)?;
        let Some(tensor) = tensors.names().next().map(str::to_owned) else { continue };
        if tensors.is_float(&tensor) || tensors.shape(&tensor) != Some(&[result.cloud.len()]) {
            continue;
        }
        let chosen = (0..).zip(tensors.integers(&tensor)?).filter(|(_, v)| *v != 0).map(|(i, _)| i).collect();
        all.push((name.trim_end_matches(".pt").to_owned(), chosen));
    }
    Ok(all)
}

/// Finds the Gaussians with their colors.
pub(super) fn splat_of(file: &Path) -> Option<PathBuf> {
    let run = folder::run_of(file);
    let names = ["scene_point_cloud.ply", "point_cloud.ply"];
    names.iter().find_map(|name| folder::latest(&run, name).or_else(|| folder::latest(files::folder_of(file), name)))
}

/// Finds the Gaussians with their colors; the error says where they are looked for.
pub(super) fn needed_splat(file: &Path) -> Result<PathBuf, IoError> {
    splat_of(file).ok_or_else(|| IoError::Unsupported {
        path: file.into(),
        what: "Gaussians without colors, whose colored ones (scene_point_cloud.ply) were not found".into(),
        remedy: "open the folder of the run",
    })
}

fn features(file: &Path) -> Result<FeatureRows, IoError> {
    let bytes = files::read(file, u64::MAX)?;
    let ply = Ply::parse(&bytes, file)?;
    let table = ply.table("vertex")?.ok_or_else(|| ply.syntax("vertex", "missing".into()))?;
    let columns: Vec<&Column> = (0..).map_while(|k| table.column(&format!("{PREFIX}{k}"))).collect();
    let (bytes, limit) = ((table.rows * columns.len() * size_of::<f32>()) as u64, memory::budget());
    if bytes > limit {
        let remedy = "free some memory";
        return Err(IoError::OverBudget { path: file.into(), what: "its features", bytes, limit, remedy });
    }
    let rows = FeatureRows::new(columns.len(), values(&table, &columns));
    rows.ok_or_else(|| ply.syntax("vertex", "no properties f_0, f_1, ...".into()))?.finite(file, PREFIX)
}

fn values(table: &Table<'_>, columns: &[&Column]) -> Vec<f32> {
    (0..table.rows).flat_map(|i| columns.iter().map(move |c| c.f32(table.row(i)))).collect()
}

fn scale_gate(file: &Path, dim: usize) -> Result<ScaleGate, IoError> {
    let mut tensors = Tensors::open(file)?;
    let (weight, bias) = (tensors.floats("0.weight")?, tensors.floats("0.bias")?);
    if weight.len() != dim || bias.len() != dim {
        let reason = format!("has {} weights and {} biases for features of {dim} numbers", weight.len(), bias.len());
        return Err(tensors.error("0.weight", reason));
    }
    Ok(ScaleGate { weight, bias })
}
