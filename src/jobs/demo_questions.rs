//! The demo's queries: objects are found from the labels of a few photos, and queried in held-out views.

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::evaluate::PhotoComparison;
use super::query::{self, QueryEngine};
use super::{JobError, export};
use crate::io::SceneFolder;
use crate::io::labels::Labels;
use crate::models;
use crate::pipeline::observer::{Observer, Severity, Silent};
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::{AskedScene, LabeledView, categories, masks};
use crate::pipeline::semantics::lifting::build_map::{FindOptions, SearchModels, find_objects};
use crate::pipeline::semantics::lifting::segmenter::{FileMasks, Segmenter};
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{LevelFilter, Photo, SemanticMap};

/// Queries; the last two things are not in the scene.
const QUESTIONS: [&str; 7] = [
    "the red controller",
    "a button of the blue controller",
    "the handle of the kettle",
    "the teddy bear's nose",
    "the shade of the lamp",
    "a giraffe",
    "the trunk of the elephant",
];
/// Most photos whose labels are used if objects are found while the user waits.
const MAX_SEEDS: usize = 3;

#[derive(Debug, Serialize)]
pub(crate) struct DemoQuestion {
    pub(crate) question: String,
    /// "found", "ambiguous" or "not found".
    pub(crate) verdict: &'static str,
    /// Names of the chosen identities.
    pub(crate) answer: Vec<String>,
    /// Number of their pixels in the view.
    pub(crate) pixels: usize,
    /// Time from the text to the mask, ms.
    pub(crate) millis: f64,
}

/// Scores of every name over all held-out views, and the queries.
#[derive(Debug, Serialize)]
pub(crate) struct DemoQueries {
    /// Photos whose masks were used.
    pub(crate) seeds: Vec<String>,
    pub(crate) find_secs: f64,
    /// Mean IoU of whole objects in held-out photos, queried by name.
    pub(crate) object_miou: f64,
    pub(crate) part_miou: f64,
    pub(crate) asked: Vec<DemoQuestion>,
}

/// Finds objects from the labels of one photo in `photos`, and of more, up to `max_seeds`, if much is unlabeled.
///
/// # Errors
/// If a photo or its labels cannot be read, or the observer asks to stop.
pub(crate) fn find(
    photos: &Path,
    job: &PhotoComparison,
    max_seeds: usize,
    observer: &mut dyn Observer,
) -> Result<SemanticMap, JobError> {
    let mut segmenter = FileMasks(Labels::of_photos(photos, &job.dataset.photos)?);
    let training: Vec<Photo> = (0..job.dataset.photos.len())
        .filter(|i| !job.views.contains(i))
        .map(|i| job.dataset.photos[i].clone())
        .collect();
    let mut encoder = models::encoder(models::DEMO)?;
    let options =
        FindOptions { track: TrackOptions { max_seeds, ..TrackOptions::default() }, ..FindOptions::default() };
    let models = SearchModels { segmenter: &mut segmenter, follower: None, encoder: Some(&mut *encoder) };
    Ok(find_objects(&job.cloud, &training, &job.settings, models, &options, observer)?.map)
}

/// Runs [`find`], stores the result in the folder `scene`, and runs [`ask`].
///
/// # Errors
/// As both, and if the scene cannot be written.
pub(crate) fn find_and_ask(
    scene: &Path,
    photos: &Path,
    job: &PhotoComparison,
    pictures: &Path,
    observer: &mut dyn Observer,
) -> Result<DemoQueries, JobError> {
    let start = Instant::now();
    let map = find(photos, job, MAX_SEEDS, observer)?;
    let find_secs = start.elapsed().as_secs_f64();
    let (kept, _) = SceneFolder::hold(scene, "storing objects")?.replace_map(job.state.as_deref(), &map, &job.cloud)?;
    if let Some(kept) = kept {
        observer.note(Severity::Info, format!("The previous objects and parts are kept in {}", kept.display()));
    }
    observer.note(Severity::Info, format!("{} found", map.identities.counted()));
    Ok(DemoQueries { find_secs, ..ask(&map, photos, job, Some(pictures))? })
}

/// Queries every label of the views of `job`, which lie in `photos`, and the demo's queries in the first view. Heat
/// maps of the answers go to `pictures`.
///
/// # Errors
/// If a label cannot be read, a view cannot be drawn or a picture cannot be written.
pub(crate) fn ask(
    map: &SemanticMap,
    photos: &Path,
    job: &PhotoComparison,
    pictures: Option<&Path>,
) -> Result<DemoQueries, JobError> {
    let mut segmenter = FileMasks(Labels::of_photos(photos, &job.dataset.photos)?);
    let mut engine = QueryEngine::new(map.language.as_ref(), QueryConfig::default())?;
    let (mut units, mut asked) = (Vec::new(), Vec::new());
    let mut renderer = Renderer::new();
    for (k, &i) in job.views.iter().enumerate() {
        let photo = &job.dataset.photos[i];
        let camera = photo.camera.limited_to(job.max_side_px);
        let view =
            ViewMap::render(&mut renderer, &job.cloud, &map.identity_of, &map.identities, &camera, &job.settings)?;
        let labeled = LabeledView {
            name: &photo.name,
            camera: &camera,
            exact: &view,
            blended: &CodeMap::default(),
            categories: categories(&segmenter.segment(photo, job.max_side_px, &mut Silent)?),
        };
        let mut failed = None;
        let mut by_name = |text: &str| {
            engine.ask(map, text, LevelFilter::Auto).unwrap_or_else(|e| {
                failed.get_or_insert(e);
                None
            })
        };
        units.extend(masks::compare(&mut AskedScene { map, ask: &mut by_name }, &labeled));
        if let Some(error) = failed {
            return Err(error.into());
        }
        for (n, question) in QUESTIONS.iter().enumerate().filter(|_| k == 0) {
            let start = Instant::now();
            let Some(answered) = engine.ask(map, question, LevelFilter::Auto)? else { continue };
            let mask = answered.mask(&view, None, &map.identities, 1);
            let millis = start.elapsed().as_secs_f64() * 1e3;
            if let Some(pictures) = pictures {
                export::make_folder(pictures)?;
                let path = pictures.join(format!("{n}_{}.png", question.replace([' ', '\''], "_")));
                query::write_heat(&path, (&job.cloud, &job.settings), &camera, &answered.heat(&view))?;
            }
            asked.push(DemoQuestion {
                question: (*question).to_owned(),
                verdict: answered.answer.verdict(),
                answer: answered.chosen(1).iter().map(|id| map.identities.full_name(*id)).collect(),
                pixels: mask.area(),
                millis,
            });
        }
    }
    let [object_miou, part_miou] = masks::by_level(&units);
    Ok(DemoQueries { seeds: map.seeds.clone(), find_secs: 0.0, object_miou, part_miou, asked })
}
