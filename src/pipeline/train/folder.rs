//! Output folder of a training run: earlier content is resumed, transferred or left alone.

use std::path::Path;
use std::sync::Arc;

use super::TrainConfig;
use super::checkpoint::{self, Checkpoint, CheckpointError};
use super::inputs::TrainInputs;
use super::outcome::{TrainEnd, TrainError, TrainOutcome};
use crate::io::trained::{self, CLOUD_FILE};
use crate::io::{IoError, SceneFolder, semantic_map};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::carry;
use crate::scene::{Dataset, GaussianCloud, SemanticMap};

/// Permissions of a training run in its output folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct FolderUse {
    /// True if a checkpoint is resumed even if photos, poses or sparse points have changed.
    pub(crate) anyway: bool,
    /// True if the folder is made again when it vanishes during training; false if the program may have moved it
    /// itself.
    pub(crate) remake: bool,
    /// True if a checkpoint of the same settings with fewer steps is resumed.
    pub(crate) more_steps: bool,
}

/// Makes and locks the folder again if it has vanished, with a warning.
pub(super) fn remade(scene: SceneFolder, observer: &mut dyn Observer) -> Result<SceneFolder, TrainError> {
    let folder = scene.path().to_path_buf();
    if folder.is_dir() {
        return Ok(scene);
    }
    // Dropped first: otherwise it would remove the lock of the new folder.
    drop(scene);
    let held = SceneFolder::hold(&folder, "training").map_err(TrainError::Save)?;
    let text = format!("{} went away during the training and is made again; what was in it is gone", folder.display());
    observer.note(Severity::Warning, text);
    Ok(held)
}

/// Locks the output folder, which must not contain anything that would be lost.
pub(super) fn claim(folder: &Path, dataset: &Dataset) -> Result<SceneFolder, TrainError> {
    let occupied = |what| Err(TrainError::Save(IoError::Occupied { folder: folder.into(), what }));
    let real = |p: &Path| std::fs::canonicalize(p).ok();
    if real(folder).is_some_and(|f| Some(f) == real(&dataset.root)) {
        return occupied("holds the photos");
    }
    let there = |name: &str| folder.join(name).exists();
    if !there(checkpoint::FILE) {
        if trained::is_scene(folder) {
            return Err(CheckpointError::Missing { folder: folder.into() }.into());
        }
        if there(CLOUD_FILE) || there(semantic_map::FILE) {
            return occupied("holds Gaussians or objects that are no part of a trained scene");
        }
    }
    SceneFolder::hold(folder, "training").map_err(TrainError::Save)
}

/// Returns the result of a run that was finished and saved before.
pub(super) fn finished(
    folder: &Path,
    saved: &Checkpoint,
    config: &TrainConfig,
) -> Result<Option<TrainOutcome>, TrainError> {
    if saved.header.step < config.steps || !trained::is_scene(folder) {
        return Ok(None);
    }
    let scene = trained::load(folder).map_err(TrainError::Save)?;
    // A kill between the last checkpoint and the scene leaves the scene of an earlier stop.
    let same = scene.info.history.steps == saved.header.history.steps;
    Ok(same.then(|| TrainOutcome {
        cloud: Arc::new(scene.cloud),
        evaluations: scene.info.history.evaluations,
        end: TrainEnd::Finished,
        steps: saved.header.step,
        secs: saved.header.secs,
    }))
}

/// Returns the checkpoint in `folder`, if there is one. It must be of this run, with inputs equal to those `now`,
/// unless the run may go on `anyway`.
pub(super) fn resumable(
    folder: &Path,
    dataset: &Dataset,
    (config, train): (&TrainConfig, &[usize]),
    (now, may): (&TrainInputs, FolderUse),
    observer: &mut dyn Observer,
) -> Result<Option<Checkpoint>, CheckpointError> {
    let path = folder.join(checkpoint::FILE);
    let Some(saved) = checkpoint::load(&path)? else { return Ok(None) };
    let h = &saved.header;
    let goes_on = may.more_steps && h.config.is_same_but_for_steps(config) && config.steps > h.step;
    if !h.config.is_same_run(config) && !goes_on {
        return Err(CheckpointError::OtherRun { path, what: "settings" });
    }
    let changes = match &h.inputs {
        Some(before) => before.changes(now),
        None if h.photos != photo_names(dataset, train) => vec!["photos of other names".into()],
        None => {
            let text = "The checkpoint is of an earlier version, which did not store poses and checksums of the photos: \
                        nobody can tell whether they are the same now";
            observer.note(Severity::Warning, text.into());
            Vec::new()
        }
    };
    if !changes.is_empty() && !may.anyway {
        return Err(CheckpointError::OtherInputs { folder: folder.into(), changes });
    }
    if !changes.is_empty() {
        let text = format!("The training goes on, but not with what it began with: {}", changes.join("; "));
        observer.note(Severity::Warning, text);
    }
    Ok(Some(saved))
}

/// Transfers the objects and parts of the scene that is about to be replaced to the present Gaussians.
pub(super) fn objects_for(
    scene: &SceneFolder,
    cloud: &GaussianCloud,
    observer: &mut dyn Observer,
) -> Result<Option<SemanticMap>, IoError> {
    let folder = scene.path();
    if !folder.join(semantic_map::FILE).exists() || !trained::is_scene(folder) {
        return Ok(None);
    }
    let before = trained::load(folder)
        .and_then(|s| Ok((semantic_map::load(folder, s.state.as_deref(), &s.cloud)?, s.cloud)))
        .inspect_err(|e| {
            observer.note(Severity::Warning, format!("The scene's objects and parts cannot be transferred: {e}"))
        });
    let before = before.ok().and_then(|(map, cloud)| Some((map?, cloud)));
    if let Some((map, old)) = &before
        && (old.origin, &old.positions) == (cloud.origin, &cloud.positions)
    {
        return Ok(Some(map.clone()));
    }
    if let Some(kept) = scene.keep_earlier()? {
        observer.note(Severity::Info, format!("The scene as it was before is kept in {}", kept.display()));
    }
    Ok(before.map(|(map, old)| {
        let (map, share) = carry::carry(&map, &old, cloud);
        let text = format!(
            "The scene's objects and parts were transferred to {:.1} % of the Gaussians, by place; 'fmlgs preprocess' finds \
             them again",
            100.0 * share
        );
        observer.note(Severity::Info, text);
        map
    }))
}

fn photo_names(dataset: &Dataset, indices: &[usize]) -> Vec<String> {
    indices.iter().map(|&i| dataset.photos[i].name.clone()).collect()
}
