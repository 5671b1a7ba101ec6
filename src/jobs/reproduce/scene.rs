//! One scene of a table: trained, its objects found, queried. Each stage leaves a file at its end.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::layout::SceneInput;
use super::rows::{self, QueryTimes, RowResult};
use super::{LABELS, ReproduceSettings};
use crate::io::labels::Labels;
use crate::io::semantic_map;
use crate::jobs::changed::ChangedScene;
use crate::jobs::evaluate::PhotoComparison;
use crate::jobs::find_objects::{self, FindRequest, FindSettings};
use crate::jobs::{JobError, evaluate_masks, export, open, train};
use crate::pipeline::observer::{Interrupted, Observer, Severity};
use crate::pipeline::semantics::segmenter::FileMasks;
use crate::scene::{Dataset, Level};

/// If all photos have labels, every n-th one is held out.
const HOLDOUT_EVERY: usize = 8;

/// Result of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SceneResult {
    pub(super) scene: String,
    pub(super) photos: usize,
    /// Labeled photos that were compared.
    pub(super) views: Vec<String>,
    /// True if the compared photos were trained on.
    pub(super) trained_on: bool,
    /// Size of the compared views, px.
    pub(super) size_px: [u32; 2],
    pub(super) trained: TrainedFacts,
    pub(super) found: FoundFacts,
    pub(super) times: QueryTimes,
    pub(super) rows: Vec<RowResult>,
    /// Phrases with no word that the encoder knows; they count as not answered.
    pub(super) unknown_phrases: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TrainedFacts {
    pub(super) gaussians: usize,
    pub(super) secs: f64,
    /// PSNR on held-out photos, if there are any.
    pub(super) psnr: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FoundFacts {
    pub(super) objects: usize,
    pub(super) parts: usize,
    pub(super) secs: f64,
    /// Size of the semantic map's file, bytes.
    pub(super) map_bytes: u64,
    /// Photos whose masks were used.
    pub(super) seeds: Vec<String>,
}

/// Returns a stage's result: reads it if it exists, else makes and stores it.
fn once<T: Serialize + DeserializeOwned>(
    file: &Path,
    make: impl FnOnce() -> Result<T, JobError>,
) -> Result<T, JobError> {
    if file.exists() {
        return Ok(crate::io::files::read_json(file)?);
    }
    let made = make()?;
    export::json(file, &made)?;
    Ok(made)
}

pub(super) fn run(
    input: &SceneInput,
    out: &Path,
    settings: &ReproduceSettings,
    observer: &mut dyn Observer,
) -> Result<SceneResult, JobError> {
    once(&out.join("result.json"), || {
        export::make_folder(out)?;
        let mut dataset = open::dataset(&input.photos)?;
        let labels = Labels::of_photos(&input.labels, &dataset.photos)?;
        let split = Split::new(&dataset, &labels, settings, input)?;
        for (i, photo) in dataset.photos.iter_mut().enumerate() {
            photo.test_split = !split.trained_on && split.compared.contains(&i);
        }
        for warning in dataset.warnings.iter().chain(labels.notes()) {
            observer.note(Severity::Warning, warning.clone());
        }
        let (dataset, folder) = (Arc::new(dataset), out.join("scene"));
        let trained = once(&out.join("trained.json"), || gaussians(&dataset, &folder, settings, observer))?;
        let found = once(&out.join("objects.json"), || objects(&dataset, &folder, input, settings, observer))?;
        compare(input, &dataset, &folder, split, settings, (trained, found))
    })
}

/// Photos that are compared.
struct Split {
    compared: Vec<usize>,
    trained_on: bool,
}

impl Split {
    fn new(
        dataset: &Dataset,
        labels: &Labels,
        settings: &ReproduceSettings,
        input: &SceneInput,
    ) -> Result<Self, JobError> {
        let photos = &dataset.photos;
        let labeled: Vec<usize> = (0..photos.len()).filter(|&i| labels.has(&photos[i])).collect();
        let Some(first) = labeled.first() else {
            let (labels, photos) = (input.labels.display(), input.photos.display());
            let text = format!(
                "{labels}: no label is named like a photo of {photos} (such as '{}'); labels are matched by name",
                dataset.photos.first().map_or("-", |p| p.name.as_str())
            );
            return Err(JobError::Protocol(text));
        };
        // If labels are the masks, those of the first labeled photo start the search.
        let seed = (settings.masks == LABELS).then_some(*first);
        let mut compared: Vec<usize> = labeled.iter().copied().filter(|i| Some(*i) != seed).collect();
        let trained_on = settings.labeled_in_training;
        if !trained_on && 2 * compared.len() > photos.len() {
            compared = compared.into_iter().step_by(HOLDOUT_EVERY).collect();
        }
        if compared.is_empty() {
            let text = format!(
                "{}: the masks of its only labeled photo begin, so there is none to compare with; label another one, \
                 or find masks with --masks regions or a network",
                input.labels.display()
            );
            return Err(JobError::Protocol(text));
        }
        Ok(Self { compared, trained_on })
    }
}

fn gaussians(
    dataset: &Dataset,
    folder: &Path,
    settings: &ReproduceSettings,
    observer: &mut dyn Observer,
) -> Result<TrainedFacts, JobError> {
    let done = train::run(dataset, &settings.train, [folder.to_path_buf()], &train::IfChanged::Ask.into(), observer)?;
    if !done.is_finished() {
        return Err(Interrupted.into());
    }
    let outcome = &done.outcome;
    let psnr = outcome.evaluations.last().map(|e| e.psnr).filter(|v| v.is_finite());
    Ok(TrainedFacts { gaussians: outcome.cloud.len(), secs: outcome.secs, psnr })
}

fn objects(
    dataset: &Arc<Dataset>,
    folder: &Path,
    input: &SceneInput,
    settings: &ReproduceSettings,
    observer: &mut dyn Observer,
) -> Result<FoundFacts, JobError> {
    let scene = open::scene(folder)?;
    let mut with = FindSettings { encoder: Some(settings.encoder.clone()), ..FindSettings::default() };
    let mut masks: Option<PathBuf> = None;
    if settings.masks == LABELS {
        masks = Some(input.labels.clone());
        // More seeds could leave no photo to compare with.
        with.max_seeds = if settings.labeled_in_training { 1 } else { with.max_seeds };
    } else {
        with.segmenter = Some(settings.masks.clone());
    }
    let request = FindRequest {
        folder: folder.into(),
        cloud: Arc::clone(&scene.cloud),
        settings: scene.settings.clone(),
        dataset: Arc::clone(dataset),
        holdout_every: 0,
        masks,
        known: None,
        side_px: settings.train.max_side_px,
        with,
    };
    let done = find_objects::run(&request, scene.state.as_deref(), observer)?;
    let map = &done.found.map;
    let count = |level: Level| map.identities.iter().filter(|(_, i)| i.level == level).count();
    let file = folder.join(semantic_map::FILE);
    let size = std::fs::metadata(&file).map_err(|cause| crate::io::IoError::Read { path: file, cause })?;
    Ok(FoundFacts {
        objects: count(Level::Object),
        parts: count(Level::Part),
        secs: done.secs,
        map_bytes: size.len(),
        seeds: map.seeds.clone(),
    })
}

fn compare(
    input: &SceneInput,
    dataset: &Arc<Dataset>,
    folder: &Path,
    split: Split,
    settings: &ReproduceSettings,
    (trained, found): (TrainedFacts, FoundFacts),
) -> Result<SceneResult, JobError> {
    let scene = open::scene(folder)?;
    let map = scene.semantics()?;
    // A photo whose labels were used is no test of them.
    let is_seed = |i: &usize| settings.masks == LABELS && map.seeds.contains(&dataset.photos[*i].name);
    let compared: Vec<usize> = split.compared.into_iter().filter(|i| !is_seed(i)).collect();
    let comparison = PhotoComparison {
        cloud: Arc::clone(&scene.cloud),
        settings: scene.settings.clone(),
        dataset: Arc::clone(dataset),
        views: compared.clone(),
        trained_on: vec![split.trained_on; compared.len()],
        max_side_px: settings.train.max_side_px,
        borders: None,
        pictures: None,
        state: scene.state.clone(),
        changed: ChangedScene::default(),
    };
    let mut labels = FileMasks(Labels::of_photos(&input.labels, &dataset.photos)?);
    let views = evaluate_masks::draw(&comparison, &map, &mut labels, &compared, split.trained_on)?;
    let query = settings.queries.get(&input.name).cloned();
    let query = query.unwrap_or_else(|| input.name.replace(['_', '-'], " "));
    let asked = rows::measure(settings, &comparison, &map, &views, &query)?;
    Ok(SceneResult {
        scene: input.name.clone(),
        photos: dataset.photos.len(),
        views: compared.iter().map(|&i| dataset.photos[i].name.clone()).collect(),
        trained_on: split.trained_on,
        size_px: views.first().map_or([0; 2], |v| [v.camera.width_px, v.camera.height_px]),
        trained,
        found,
        times: asked.times,
        rows: asked.rows,
        unknown_phrases: asked.unknown_phrases,
    })
}
