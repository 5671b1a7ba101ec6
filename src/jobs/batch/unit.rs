//! A unit of a batch: one scene with one of the settings and one seed; its folder, and its request.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::BatchRequest;
use super::file::{BatchFile, BatchScene, BatchSetting};
use crate::io::IoError;
use crate::io::files::{self, hex};
use crate::jobs::experiment::difference;
use crate::jobs::{JobError, open};
use crate::pipeline::train::TrainConfig;
use crate::pipeline::train::inputs::{Compare, TrainInputs};

/// File name of a unit's request, in its folder.
pub(super) const FILE: &str = "unit.json";
/// Levels of folders of labels that are searched.
const DEEPEST: usize = 16;
/// Prefix of checksums of photos that [`TrainInputs`] makes; those of earlier versions have none.
const OWN: &str = "2:";

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BatchUnit<'a> {
    pub(super) scene: &'a BatchScene,
    pub(super) setting: &'a BatchSetting,
    pub(super) seed: u64,
}

/// Request of a unit: a unit with any other value has another result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct UnitRequest {
    pub(crate) scene: String,
    pub(crate) setting: String,
    pub(crate) seed: u64,
    /// Checksum of the photos' names, sizes and cameras, and of the sparse points.
    pub(crate) photos: String,
    pub(crate) config: TrainConfig,
    /// Changes to the scene's plan.
    pub(crate) plan: Value,
    /// Checksum of the names and sizes of the labels' files.
    pub(crate) masks: Option<String>,
    pub(crate) query: Option<String>,
    pub(crate) objects: Value,
    pub(crate) eval: Value,
}

impl UnitRequest {
    /// Returns a name such as "garden/fast/seed-0".
    pub(crate) fn name(&self) -> String {
        name(&self.scene, &self.setting, self.seed)
    }

    /// Returns whether both may have the same photos: checksums of different versions cannot be compared.
    pub(super) fn may_have_photos_of(&self, other: &Self) -> bool {
        self.photos == other.photos || self.photos.starts_with(OWN) != other.photos.starts_with(OWN)
    }

    /// Returns the first difference to the request `now`, in words.
    pub(super) fn difference(&self, now: &Self) -> Option<String> {
        if !self.may_have_photos_of(now) {
            return Some("the photos' names, sizes or cameras, or the sparse points, were others".into());
        }
        let there = Self { photos: now.photos.clone(), ..self.clone() };
        let told = || difference(&json!(there), &json!(now));
        (there != *now).then(|| told().unwrap_or_else(|| "of another version of the program".into()))
    }
}

fn name(scene: &str, setting: &str, seed: u64) -> String {
    format!("{scene}/{setting}/seed-{seed}")
}

/// Returns all units in the order of shards: scenes, in each its settings, in each the seeds.
pub(super) fn units(batch: &BatchFile) -> Vec<BatchUnit<'_>> {
    let of_scene = |scene| batch.settings.iter().map(move |setting| (scene, setting));
    let of_setting = |(scene, setting)| batch.seeds.iter().map(move |&seed| BatchUnit { scene, setting, seed });
    batch.scenes.iter().flat_map(of_scene).flat_map(of_setting).collect()
}

impl BatchUnit<'_> {
    /// Returns its name, which is its folder below that of the results.
    pub(super) fn name(self) -> String {
        name(&self.scene.name, &self.setting.name, self.seed)
    }

    /// Returns the settings of its training, before the scene's plan.
    pub(super) fn config(self) -> TrainConfig {
        TrainConfig { seed: self.seed, ..self.setting.train.config.clone() }
    }

    /// Returns its request, if its scene's files are `inputs`.
    pub(super) fn asked(self, batch: &BatchFile, inputs: &SceneInputs) -> UnitRequest {
        let (usual, eval) = (TrainConfig::default(), &batch.eval);
        UnitRequest {
            scene: self.scene.name.clone(),
            setting: self.setting.name.clone(),
            seed: self.seed,
            photos: inputs.photos.clone(),
            // Evaluations and checkpoints in between do not change the result.
            config: TrainConfig {
                eval_every: usual.eval_every,
                checkpoint_secs: usual.checkpoint_secs,
                ..self.config()
            },
            plan: json!(self.setting.train.plan),
            masks: inputs.masks.clone(),
            query: self.scene.query.clone(),
            objects: json!(batch.objects),
            eval: json!({
                "max_side_px": eval.max_side_px,
                "keep_borders": eval.keep_borders,
                "protocol": eval.protocol.name(),
                "recipe": eval.recipe,
            }),
        }
    }
}

/// Checksums of a scene's inputs. Contents of photos are left out: reading all of them on each start of each shard
/// takes long. Sizes mostly differ if contents do, and training compares contents when it resumes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SceneInputs {
    pub(super) photos: String,
    pub(super) masks: Option<String>,
}

impl SceneInputs {
    /// Opens the scene, so that one that cannot be opened is reported before anything runs.
    pub(super) fn of(scene: &BatchScene) -> Result<Self, JobError> {
        let inputs = TrainInputs::of(&open::dataset(&scene.path)?, Compare::Sizes)?;
        let masks = scene.masks.as_deref().map(|masks| {
            let mut all = Vec::new();
            list(masks, "", &mut all, DEEPEST)?;
            all.sort();
            Ok::<_, IoError>(hex(&Sha256::digest(json!(all).to_string())))
        });
        Ok(Self { photos: format!("{OWN}{}", inputs.digest()), masks: masks.transpose()? })
    }
}

/// Adds the names and sizes of the files in `folder`, or of the one file that it is.
fn list(folder: &Path, name: &str, all: &mut Vec<(String, u64)>, deepest: usize) -> Result<(), IoError> {
    let unread = |cause| IoError::Read { path: folder.into(), cause };
    if !folder.is_dir() {
        all.push((name.into(), folder.metadata().map_err(unread)?.len()));
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(unread)?;
    for entry in entries.flatten().filter(|_| deepest > 0) {
        list(&entry.path(), &format!("{name}/{}", entry.file_name().to_string_lossy()), all, deepest - 1)?;
    }
    Ok(())
}

/// Refuses results inside the inputs, and inputs inside the results.
pub(super) fn check_places(request: &BatchRequest, units: &[BatchUnit<'_>]) -> Result<(), JobError> {
    let file = request.batch.path.display();
    for unit in units {
        let (scene, folder) = (unit.scene, request.out.join(unit.name()));
        let refuse = |why: String| Err(JobError::Batch(format!("{file}, [[scene]] '{}': {why}", scene.name)));
        let real_folder = real(&folder);
        for input in std::iter::once(&scene.path).chain(&scene.masks) {
            let places = format!("({} of {}); give another folder with --out", folder.display(), input.display());
            if !input.exists() {
                return refuse(format!("{} does not exist; paths are relative to {file}", input.display()));
            }
            let read = real(if input.is_dir() { input } else { files::folder_of(input) });
            if real_folder.starts_with(&read) {
                return refuse(format!("its results would lie among what is read {places}"));
            }
            if read.starts_with(&real_folder) {
                return refuse(format!("what is read lies in the folder of its results {places}"));
            }
        }
    }
    Ok(())
}

/// Resolves a path, even if its end does not exist yet.
fn real(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    let there = path.ancestors().find_map(|a| Some((a.canonicalize().ok()?, path.strip_prefix(a).ok()?)));
    there.map_or_else(|| path.clone(), |(real, rest)| if rest == Path::new("") { real } else { real.join(rest) })
}
