//! Comparison of scenes of any method: the same phrases and views, relevancy, masks by each method's own rule and by a
//! common one, scores and times, as a table, pictures and a page.
//!
//! [`subject`] opens what is compared and answers behind one trait, [`answer`] asks it, [`views`] chooses cameras and
//! labels, [`vectors`] encodes phrases, [`cell`] is the result. [`protocol`] scores one scene by the protocols of the literature.

pub(crate) mod answer;
pub(crate) mod cell;
mod classes;
mod letters;
mod phrase_answers;
pub(crate) mod protocol;
mod sheet;
pub(crate) mod subject;
#[cfg(test)]
mod tests;
mod tile;
pub(crate) mod vectors;
pub(crate) mod views;
pub(crate) mod write;

use std::path::PathBuf;
use std::time::Instant;

use self::answer::PhraseAnswer;
use self::cell::{AnswerMs, ComparedCell, ComparedMethod, Comparison, RuledCell, ShownRelevancy};
use self::sheet::SheetRow;
use self::subject::CompareSubject;
use self::tile::{CellTile, TilePicture};
use self::vectors::{KnownVectors, TextFunction};
use self::views::{ComparedView, ViewChoice, WantedViews};
use super::JobError;
use crate::io::results::ResultOptions;
use crate::math::format::things;
use crate::math::stats::median;
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::smoothing::largest;
use crate::render::{Features, Renderer};

/// Longer side of the views of a sheet, px.
const MAX_SIDE_PX: u32 = 1_008;

/// Scenes that are compared at most.
pub(crate) const MOST_SCENES: usize = 4;

/// Request for a comparison.
#[derive(Clone, Debug)]
pub(crate) struct CompareRequest {
    pub(crate) scenes: Vec<(PathBuf, ResultOptions)>,
    pub(crate) phrases: Vec<String>,
    pub(crate) views: ViewChoice,
    /// Runs that times are medians of.
    pub(crate) repeats: usize,
    pub(crate) shown: ShownRelevancy,
    /// Folder of the results, if they are wanted.
    pub(crate) out: Option<PathBuf>,
    /// Write the relevancy of every cell as arrays.
    pub(crate) arrays: bool,
}

impl CompareRequest {
    /// Comparison of one phrase in the view of a photo, for a folder of results.
    pub(crate) fn of_view(
        scenes: Vec<PathBuf>,
        phrase: String,
        view: String,
        photos: Option<PathBuf>,
        folder: PathBuf,
    ) -> Self {
        Self {
            scenes: scenes.into_iter().map(|path| (path, ResultOptions::default())).collect(),
            phrases: vec![phrase],
            views: ViewChoice { wanted: WantedViews::Named(vec![view]), photos, truth: None, max_side_px: MAX_SIDE_PX },
            repeats: 1,
            shown: ShownRelevancy::default(),
            out: Some(folder),
            arrays: false,
        }
    }
}

/// Compares scenes; `encode` gives the vectors of phrases.
///
/// # Errors
/// If a scene cannot be opened or drawn, a phrase cannot be encoded, or a file cannot be read or written.
pub(crate) fn run(
    request: &CompareRequest,
    encode: TextFunction<'_>,
    observer: &mut dyn Observer,
) -> Result<Comparison, JobError> {
    if let Some(folder) = &request.out {
        let reads = request.scenes.iter().map(|(path, _)| path.as_path());
        let others = [&request.views.photos, &request.views.truth].into_iter().flatten().map(PathBuf::as_path);
        write::check(folder, &reads.chain(others).collect::<Vec<_>>())?;
    }
    let opened = request.scenes.iter().map(|(path, options)| CompareSubject::open(path, options));
    let scenes = opened.collect::<Result<Vec<_>, _>>()?;
    of_scenes(scenes, request, encode, observer)
}

/// Compares scenes that are open.
fn of_scenes(
    mut scenes: Vec<CompareSubject>,
    request: &CompareRequest,
    encode: TextFunction<'_>,
    observer: &mut dyn Observer,
) -> Result<Comparison, JobError> {
    subject::name_apart(&mut scenes);
    let (views, mut notes) = views::choose(&scenes, &request.views)?;
    let repeats = request.repeats.max(1);
    let mut vectors = KnownVectors::new(encode, repeats);
    let (phrases, sheet_rows) = (&request.phrases, request.phrases.len() * views.len());
    // By phrase, then view, then scene; filled view by view, for a scene looks at one view at a time.
    let place = |p: usize, v: usize| p * views.len() + v;
    let mut cells: Vec<Vec<ComparedCell>> = vec![Vec::new(); sheet_rows];
    let mut rows: Vec<Option<SheetRow>> = (0..sheet_rows).map(|_| None).collect();
    let count = scenes.len();
    let mut ticker = Ticker::new("Comparing", views.len() * count);
    for (v, view) in views.iter().enumerate() {
        let colors = colors(&scenes, view)?;
        for (k, scene) in scenes.iter_mut().enumerate() {
            ticker.tick(v * count + k, observer)?;
            let mut blend = Vec::with_capacity(repeats);
            for _ in 0..repeats {
                let start = Instant::now();
                scene.answers.look(&view.cameras[k])?;
                blend.push(ms_since(start));
            }
            for (p, phrase) in phrases.iter().enumerate() {
                let asked = Asked { view, phrase, camera: k, blend: median(&blend), repeats };
                let (cell, answer) = asked.of(scene, &mut vectors)?;
                if let (Some(answer), Some(folder), true) = (&answer, &request.out, request.arrays) {
                    answer.write(&folder.join(write::ARRAYS), &format!("{p:03}_{v:03}_{}", k + 1))?;
                }
                let at = place(p, v);
                if at < sheet::MOST_ROWS {
                    let row = rows[at].get_or_insert_with(|| row_of(&colors, view, phrase));
                    row.cells
                        .push(answer.map(|answer| CellTile::new(&answer.values(request.shown), &answer.mask().mask)));
                }
                cells[at].push(cell);
            }
        }
    }
    if sheet_rows > sheet::MOST_ROWS {
        notes.push(format!("the sheet shows the first {} of {}", sheet::MOST_ROWS, things(sheet_rows, "row")));
    }
    let rows: Vec<SheetRow> = rows.into_iter().flatten().collect();
    let cells: Vec<ComparedCell> = cells.into_iter().flatten().collect();
    notes.extend(unlabeled(&views, phrases));
    let methods = scenes.iter().map(|scene| method(scene).with_means(&cells)).collect();
    let size = |view: &ComparedView| view.cameras.first().map_or([0; 2], |c| [c.width_px, c.height_px]);
    let comparison = Comparison {
        program: env!("CARGO_PKG_VERSION"),
        methods,
        views: views.iter().map(|view| view.name.clone()).collect(),
        phrases: phrases.clone(),
        sizes_px: views.iter().map(size).collect(),
        repeats,
        shown: request.shown,
        range: sheet::range_of(request.shown, &rows),
        notes,
        cells,
    };
    if let Some(folder) = &request.out {
        write::write(folder, &comparison, &sheet::sheet(&comparison, &rows))?;
    }
    Ok(comparison)
}

/// Notes on phrases that no label of a labeled view names.
fn unlabeled(views: &[ComparedView], phrases: &[String]) -> Vec<String> {
    let labeled = || views.iter().filter(|view| view.truth.is_some());
    let is_unknown = |phrase: &&String| labeled().next().is_some() && labeled().all(|v| v.category(phrase).is_none());
    phrases.iter().filter(is_unknown).map(|phrase| format!("no label of these views is called '{phrase}'")).collect()
}

fn method(scene: &CompareSubject) -> ComparedMethod {
    ComparedMethod {
        method: scene.name.clone(),
        path: scene.path.display().to_string(),
        gaussians: scene.cloud.len(),
        encoder: scene.encoder.clone(),
        own_rule: None,
        compared: 0,
        own_miou: None,
        common_miou: None,
        own_localization: None,
        common_localization: None,
        ms: AnswerMs::default(),
    }
}

/// Colors of the first scene in a view.
fn colors(scenes: &[CompareSubject], view: &ComparedView) -> Result<TilePicture, JobError> {
    let (Some(scene), Some(camera)) = (scenes.first(), view.cameras.first()) else {
        return Err(JobError::Phrases("there is nothing to compare".into()));
    };
    let frame = Renderer::new().render(&scene.cloud, Features::NONE, camera, &scene.settings)?;
    Ok(TilePicture::of_view(&frame.to_rgb8(), (frame.width_px, frame.height_px)))
}

fn row_of(colors: &TilePicture, view: &ComparedView, phrase: &str) -> SheetRow {
    let mut colors = colors.clone();
    if let Some(category) = view.category(phrase) {
        colors.label(&category.mask);
    }
    SheetRow { view: colors, cells: Vec::new() }
}

/// A phrase to be asked of a scene that looks at a view.
struct Asked<'a> {
    view: &'a ComparedView,
    phrase: &'a str,
    camera: usize,
    blend: f64,
    repeats: usize,
}

impl Asked<'_> {
    fn of(
        &self,
        scene: &mut CompareSubject,
        vectors: &mut KnownVectors<'_>,
    ) -> Result<(ComparedCell, Option<PhraseAnswer>), JobError> {
        let Self { view, phrase, camera, blend, repeats } = *self;
        let mut cell = ComparedCell {
            view: view.name.clone(),
            phrase: phrase.to_owned(),
            method: scene.name.clone(),
            problem: None,
            most: None,
            own: None,
            common: None,
            ms: AnswerMs { blend, ..AnswerMs::default() },
        };
        let camera = &view.cameras[camera];
        let size = (camera.width_px as usize, camera.height_px as usize);
        let answer = match PhraseAnswer::of(scene, phrase, size, vectors, repeats)? {
            Ok(answer) => answer,
            Err(why) => {
                cell.problem = Some(why);
                return Ok((cell, None));
            }
        };
        cell.ms = AnswerMs { blend, ..answer.ms };
        cell.own = answer.own.as_ref().map(|found| RuledCell::new(found, view, phrase));
        cell.common = Some(RuledCell::new(&answer.common, view, phrase));
        cell.most = Some(largest(&answer.raw));
        Ok((cell, Some(answer)))
    }
}
