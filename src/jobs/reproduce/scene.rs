//! One scene of a table: trained, its objects found, queried. Each stage leaves a file at its end.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::layout::SceneInput;
use super::rows::{self, QueryTimes, RowResult};
use super::{LABELS, ReproduceSettings};
use crate::io::labels::{Labels, stem};
use crate::jobs::changed::ChangedScene;
use crate::jobs::evaluate::PhotoComparison;
use crate::jobs::experiment::{Experiment, FoundFacts, TrainedFacts, once, stored};
use crate::jobs::find_objects::FindSettings;
use crate::jobs::train::IfChanged;
use crate::jobs::{JobError, evaluate_masks, export, open};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::segmenter::FileMasks;
use crate::scene::Dataset;

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

pub(super) fn run(
    input: &SceneInput,
    out: &Path,
    settings: &ReproduceSettings,
    observer: &mut dyn Observer,
) -> Result<SceneResult, JobError> {
    let [result, trained, found] = ["result.json", "trained.json", "objects.json"].map(|name| out.join(name));
    once(&result, stored(&result)?, || {
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
        let experiment = Experiment { dataset, folder: &folder };
        let trained = once(&trained, stored(&trained)?, || {
            let done = experiment.train(&settings.train, IfChanged::Ask, observer)?;
            Ok(TrainedFacts::of(&done.finished()?))
        })?;
        let found = once(&found, stored(&found)?, || find(&experiment, input, settings, observer))?;
        compare(input, &experiment, split, settings, (trained, found))
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
        let tested = |i: &usize| input.referred.get(&stem(&photos[*i].name)).is_some_and(|photo| photo.is_test);
        let labeled = (0..photos.len()).filter(|&i| labels.has(&photos[i]));
        let (labeled, others): (Vec<usize>, Vec<usize>) = labeled.partition(|i| input.referred.is_empty() || tested(i));
        let Some(first) = labeled.first() else {
            let (labels, photos) = (input.labels.display(), input.photos.display());
            let text = format!(
                "{labels}: no label is named like a photo of {photos} (such as '{}'); labels are matched by name",
                dataset.photos.first().map_or("-", |p| p.name.as_str())
            );
            return Err(JobError::Protocol(text));
        };
        // If labels are the masks, and all are of photos to compare, those of the first start the search.
        let seed = (settings.masks == LABELS && others.is_empty()).then_some(*first);
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

fn find(
    experiment: &Experiment<'_>,
    input: &SceneInput,
    settings: &ReproduceSettings,
    observer: &mut dyn Observer,
) -> Result<FoundFacts, JobError> {
    let mut with = FindSettings { encoder: Some(settings.encoder.clone()), ..FindSettings::default() };
    let mut masks = None;
    if settings.masks == LABELS {
        masks = Some(&*input.labels);
        // More seeds could leave no photo to compare with.
        with.max_seeds = if settings.labeled_in_training { 1 } else { with.max_seeds };
    } else {
        with.segmenter = Some(settings.masks.clone());
    }
    let scene = open::scene(experiment.folder)?;
    experiment.find(&scene, masks, settings.train.max_side_px, with, observer)
}

fn compare(
    input: &SceneInput,
    experiment: &Experiment<'_>,
    split: Split,
    settings: &ReproduceSettings,
    (trained, found): (TrainedFacts, FoundFacts),
) -> Result<SceneResult, JobError> {
    let (dataset, scene) = (&experiment.dataset, open::scene(experiment.folder)?);
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
        fit: None,
    };
    let mut labels = FileMasks(Labels::of_photos(&input.labels, &dataset.photos)?);
    let views = evaluate_masks::draw(&comparison, &map, &mut labels, &compared, split.trained_on)?;
    let query = settings.queries.get(&input.name).cloned();
    let query = query.unwrap_or_else(|| input.name.replace(['_', '-'], " "));
    let asked = rows::measure(settings, &comparison, &map, &views, (query.as_str(), &input.referred))?;
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
