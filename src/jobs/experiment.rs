//! An experiment: Gaussians are trained on photos, their objects are found, and both are compared with held-out photos.
//! Batches, the paper's tables and the demo are experiments; each compares objects with labels in its own way, and
//! stores its results in its own form.
//!
//! A stopped experiment is resumed: training at its checkpoint, a later stage at the file that it leaves at its end
//! ([`once`]).

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::evaluate::{self, EvaluateOptions, PhotoComparison};
use super::find_objects::{self, FindRequest, FindSettings};
use super::train::{self, IfChanged, Trained};
use super::{JobError, Scene, export};
use crate::io::{IoError, files, semantic_map};
use crate::pipeline::observer::{Evaluation, Observer};
use crate::pipeline::train::{TrainConfig, TrainOutcome};
use crate::scene::{Dataset, Level, SemanticMap};

/// Posed photos, and the folder of the scene that is trained on them. The methods are the three stages, in their order.
pub(crate) struct Experiment<'a> {
    pub(crate) dataset: Arc<Dataset>,
    /// Folder of the trained scene.
    pub(crate) folder: &'a Path,
}

impl Experiment<'_> {
    /// Trains, or resumes training; a finished run is returned as it is.
    pub(crate) fn train(
        &self,
        config: &TrainConfig,
        if_changed: IfChanged,
        observer: &mut dyn Observer,
    ) -> Result<Trained, JobError> {
        train::run(&self.dataset, config, [self.folder.to_path_buf()], &if_changed.into(), observer)
    }

    /// Finds the objects of the trained `scene`, from the masks in a folder if one is given, and stores them with it.
    pub(crate) fn find(
        &self,
        scene: &Scene,
        masks: Option<&Path>,
        side_px: u32,
        with: FindSettings,
        observer: &mut dyn Observer,
    ) -> Result<FoundFacts, JobError> {
        let request = FindRequest {
            folder: self.folder.into(),
            cloud: Arc::clone(&scene.cloud),
            settings: scene.settings.clone(),
            dataset: Arc::clone(&self.dataset),
            holdout_every: scene.config.holdout_every,
            masks: masks.map(Path::to_path_buf),
            known: None,
            side_px,
            with,
        };
        let done = find_objects::run(&request, scene.state.as_deref(), observer)?;
        let file = self.folder.join(semantic_map::FILE);
        let size = std::fs::metadata(&file).map_err(|cause| IoError::Read { path: file, cause })?;
        Ok(FoundFacts {
            counts: ObjectCounts::of(&done.found.map),
            secs: done.secs,
            map_bytes: size.len(),
            state: Some(done.state),
        })
    }

    /// Compares the colors of `scene` with the photos that were held out. The comparison is returned, too, for labels.
    ///
    /// # Errors
    /// [`JobError::NothingHeldOut`] if there are no such photos.
    pub(crate) fn compare(
        &self,
        scene: &Scene,
        options: EvaluateOptions,
        observer: &mut dyn Observer,
    ) -> Result<(PhotoComparison, Evaluation), JobError> {
        let comparison = PhotoComparison::of(scene, Arc::clone(&self.dataset), options)?;
        let evaluation = evaluate::photometric(&comparison, observer)?;
        Ok((comparison, evaluation))
    }
}

/// Result of training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TrainedFacts {
    pub(crate) gaussians: usize,
    /// Seconds of training, those of interrupted runs included.
    pub(crate) secs: f64,
    /// PSNR on held-out photos, if there are any.
    pub(crate) psnr: Option<f64>,
}

impl TrainedFacts {
    pub(crate) fn of(outcome: &TrainOutcome) -> Self {
        let psnr = outcome.evaluations.last().map(|e| e.psnr).filter(|v| v.is_finite());
        Self { gaussians: outcome.cloud.len(), secs: outcome.secs, psnr }
    }
}

/// Result of finding objects.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FoundFacts {
    #[serde(flatten)]
    pub(crate) counts: ObjectCounts,
    pub(crate) secs: f64,
    /// Size of the semantic map's file, bytes.
    pub(crate) map_bytes: u64,
    /// Id of the scene's save with its objects; not stored.
    #[serde(skip)]
    pub(crate) state: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ObjectCounts {
    pub(crate) objects: usize,
    pub(crate) parts: usize,
    /// Photos whose masks were used.
    pub(crate) seeds: Vec<String>,
}

impl ObjectCounts {
    fn of(map: &SemanticMap) -> Self {
        let [objects, parts] = [Level::Object, Level::Part].map(|level| map.identities.count(level));
        Self { objects, parts, seeds: map.seeds.clone() }
    }
}

/// Reads a stage's result, if it is stored.
pub(crate) fn stored<T: DeserializeOwned>(file: &Path) -> Result<Option<T>, IoError> {
    match files::read_json(file) {
        Err(IoError::Read { cause, .. }) if cause.kind() == std::io::ErrorKind::NotFound => Ok(None),
        read => read.map(Some),
    }
}

/// Returns the `earlier` result of a stage; without one it is made, and stored in `file`.
pub(crate) fn once<T: Serialize>(
    file: &Path,
    earlier: Option<T>,
    make: impl FnOnce() -> Result<T, JobError>,
) -> Result<T, JobError> {
    if let Some(earlier) = earlier {
        return Ok(earlier);
    }
    let made = make()?;
    export::json(file, &made)?;
    Ok(made)
}

/// Returns the first setting of `now` that is another one `there`, with both values.
pub(crate) fn difference(there: &Value, now: &Value) -> Option<String> {
    let keys = now.as_object().into_iter().flatten();
    keys.filter(|(key, value)| there.get(key) != Some(value)).find_map(|(key, value)| match there.get(key) {
        Some(old) if old.is_object() && value.is_object() => difference(old, value),
        Some(old) => Some(format!("{key}: {old} there, {value} now")),
        None => Some(format!("{key} is not among them")),
    })
}
