//! gsplat's `simple_trainer`: `ckpts/ckpt_<step>_rank<n>.pt`, of which each GPU wrote one, and `cfg.yml`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::parameters::{self, ColorMeaning, TensorNames};
use super::settings::YamlLines;
use super::{Training, cameras, normalization, not_gaussians};
use crate::io::gs_output::GsOutput;
use crate::io::photo_source::PhotoSource;
use crate::io::torch::WeightFile;
use crate::io::{IoError, files};
use crate::scene::{GaussianCloud, SplatRenderMode};

const FOLDER: &str = "ckpts";
const CONFIG: &str = "cfg.yml";
/// Largest number of GPUs that is believed.
const MOST_RANKS: usize = 4096;

/// Checkpoints of a folder: by step, the file of each rank.
type Steps = BTreeMap<u64, BTreeMap<usize, PathBuf>>;

/// Returns whether a folder is that of a run, or of its checkpoints.
pub(super) fn is_run(folder: &Path) -> bool {
    !steps(&checkpoints(folder)).is_empty()
}

fn checkpoints(folder: &Path) -> PathBuf {
    let below = folder.join(FOLDER);
    if below.is_dir() { below } else { folder.into() }
}

/// Lists the checkpoints in a folder. The first versions wrote one a step, without rank.
fn steps(folder: &Path) -> Steps {
    let mut all = Steps::new();
    for name in files::names_in(folder).unwrap_or_default() {
        if let Some((step, rank)) = numbers(&name) {
            all.entry(step).or_default().insert(rank, folder.join(name));
        }
    }
    all
}

/// Step and rank in the name of a checkpoint.
fn numbers(name: &str) -> Option<(u64, usize)> {
    let rest = name.strip_prefix("ckpt_")?.strip_suffix(".pt")?;
    let (step, rank) = rest.split_once("_rank").unwrap_or((rest, "0"));
    Some((step.parse().ok()?, rank.parse().ok().filter(|rank| *rank < MOST_RANKS)?))
}

/// Opens the latest step of a run, or that of one of its files; the Gaussians of all ranks together.
pub(super) fn open(path: &Path, file: Option<&Path>) -> Result<Training, IoError> {
    let folder = file.map_or_else(|| checkpoints(path), |file| files::folder_of(file).to_path_buf());
    let all = steps(&folder);
    let named = file.and_then(|f| numbers(f.file_name()?.to_str()?));
    let ranks = match (file, named) {
        // Under another name there is nothing to join.
        (Some(file), None) => BTreeMap::from([(0, file.to_path_buf())]),
        (_, Some((step, _))) => all.get(&step).cloned().unwrap_or_default(),
        (None, _) => all.last_key_value().map(|(_, ranks)| ranks.clone()).unwrap_or_default(),
    };
    let most = ranks.last_key_value().map_or(0, |(rank, _)| *rank);
    if let Some(missing) = (0..most).find(|rank| !ranks.contains_key(rank)) {
        let reason = format!(
            "the file of rank {missing} is missing, and each of {} GPUs has its own Gaussians; copy it here, or open \
             another step's file",
            most + 1
        );
        let (_, last) = ranks.last_key_value().unwrap_or((&0, &folder));
        return Err(IoError::syntax(last, "ranks", reason));
    }
    let run = match folder.file_name() {
        Some(name) if name == FOLDER => files::folder_of(&folder).to_path_buf(),
        _ => folder.clone(),
    };
    let config = YamlLines::read(&run.join(CONFIG))?;
    let parts = ranks.values().map(|file| gaussians(file)).collect::<Result<Vec<_>, _>>()?;
    let warnings: Vec<String> = parts.iter().flat_map(|part| part.warnings.clone()).collect();
    let mut cloud = GaussianCloud { warnings, ..GaussianCloud::joined(parts) };
    if config.is_on("antialiased") {
        cloud.render_mode = SplatRenderMode::Mip;
    }
    if config.value("model_type").is_some_and(|model| model.starts_with("2dgs")) {
        cloud.render_mode = SplatRenderMode::Surfels;
    }
    let mut beside = GsOutput { name: Some(files::folder_name(&run)), ..GsOutput::of(&run) };
    beside.warnings.extend(differences(&config));
    let others = all.values().map(BTreeMap::len).max().unwrap_or_default();
    if others > ranks.len() && (named.is_some() || file.is_none()) {
        let here = ranks.len();
        beside.warnings.push(format!(
            "another step has files of {others} GPUs and this one of {here}, so that Gaussians may be missing; copy the \
             others into {}",
            folder.display()
        ));
    }
    beside.source = config.path("data_dir").map(|stated| PhotoSource::find(&stated, &run));
    let every = config.value("test_every").and_then(|v| v.parse().ok()).filter(|n| *n > 0).unwrap_or(8);
    let dataset = cameras::add(&mut beside, |all| (0..all).map(|i| i % every == 0).collect());
    if let Some(dataset) = dataset
        && config.value("normalize_world_space") != Some("false")
    {
        match normalization::found(&dataset, &cloud) {
            Some(trained) => cloud = trained.undone(cloud),
            None => {
                let text = "its photos do not fit the Gaussians, whose world gsplat normalized, and are left out; the \
                            reconstruction may have changed since";
                beside.warnings.push(text.into());
                (beside.source, beside.cameras) = (None, Vec::new());
            }
        }
    }
    Ok(Training { cloud, beside })
}

/// Reads the Gaussians of one file.
fn gaussians(path: &Path) -> Result<GaussianCloud, IoError> {
    let mut file = WeightFile::open(path).map_err(|e| e.of(path))?;
    let has = |name: &str| file.tensors.contains_key(&format!("splats.{name}"));
    if has("features") && has("colors") {
        let what = "Gaussians whose colors a network makes (app_opt)".into();
        let remedy = "open the .ply of the training (save_ply), which has colors of its own";
        return Err(IoError::Unsupported { path: path.into(), what, remedy });
    }
    // The first versions had another name for the positions.
    let means = if has("means") { "means" } else { "means3d" };
    if !has(means) {
        return Err(not_gaussians(path, "a checkpoint without the Gaussians of gsplat (splats.means)".into()));
    }
    let name = |tensor: &str| format!("splats.{tensor}");
    let names = TensorNames {
        means: name(means),
        scales: name("scales"),
        quats: name("quats"),
        opacities: name("opacities"),
        constant: name("sh0"),
        rest: name("shN"),
    };
    parameters::read(path, &mut file, &names, ColorMeaning::Harmonics)
}

/// Lists the settings by which the pictures of the training differ from those here.
fn differences(config: &YamlLines) -> Vec<String> {
    let mut all = Vec::new();
    if config.is_on("with_ut") || config.is_on("with_eval3d") {
        all.push("it was trained with 3DGUT's projection; here it is drawn with that of 3D Gaussian Splatting".into());
    }
    if let Some(what) = config.value("post_processing") {
        all.push(format!("the training corrected colors afterwards ({what}); they are shown without that"));
    }
    if config.is_on("pose_opt") {
        all.push("the training moved its cameras; photos are shown with their poses from before".into());
    }
    all
}
