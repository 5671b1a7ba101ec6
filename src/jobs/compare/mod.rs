//! Comparison of scenes of any method: the same phrases and views, relevancy, masks by each method's own rule and by a
//! common one, scores and times, as a table, pictures and a page.
//!
//! [`subject`] opens what is compared and answers behind one trait, [`views`] chooses cameras and labels, [`vectors`]
//! encodes phrases, [`cell`] is the result. [`protocol`] scores one scene by the protocols of the literature.

pub(crate) mod cell;
mod letters;
pub(crate) mod protocol;
mod sheet;
pub(crate) mod subject;
#[cfg(test)]
mod tests;
mod tile;
pub(crate) mod vectors;
pub(crate) mod views;
pub(crate) mod write;

use std::path::{Path, PathBuf};
use std::time::Instant;

use self::cell::{AnswerMs, ComparedCell, ComparedMethod, Comparison, RuledCell, ShownRelevancy};
use self::sheet::SheetRow;
use self::subject::CompareSubject;
use self::tile::{CellTile, TilePicture};
use self::vectors::{KnownVectors, TextFunction};
use self::views::{ComparedView, ViewChoice};
use super::{JobError, export};
use crate::io::results::ResultOptions;
use crate::math::format::things;
use crate::math::stats::median;
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::evaluation::by_rule::{CutRule, PhraseInView};
use crate::pipeline::semantics::query::foreign::ForeignError;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::relevancy::on_lerfs_scale;
use crate::pipeline::semantics::smoothing::largest;
use crate::render::{Features, Renderer};

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
                let (cell, maps) = asked.of(scene, &mut vectors)?;
                if let (Some(maps), Some(folder), true) = (&maps, &request.out, request.arrays) {
                    maps.write(&folder.join(write::ARRAYS), &format!("{p:03}_{v:03}_{}", k + 1))?;
                }
                let at = place(p, v);
                if at < sheet::MOST_ROWS {
                    let row = rows[at].get_or_insert_with(|| row_of(&colors, view, phrase));
                    row.cells.push(maps.map(|maps| maps.tile(request.shown)));
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
    ) -> Result<(ComparedCell, Option<CellMaps>), JobError> {
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
        let (answer, encode, decode) = match answered(scene, phrase, vectors, repeats) {
            Ok((levels, own, encode, decode)) => (PhraseInView { levels, own, size }, encode, decode),
            Err(e) => {
                cell.problem = Some(problem(e)?);
                return Ok((cell, None));
            }
        };
        let Some(common) = answer.mask(CutRule::Common) else {
            cell.problem = Some("the phrase has no word to look for".into());
            return Ok((cell, None));
        };
        cell.ms = AnswerMs { encode, blend, decode };
        cell.own = answer.own.as_ref().map(|found| RuledCell::new(found, view, phrase));
        cell.common = Some(RuledCell::new(&common, view, phrase));
        // The level that the method chose, if it chose one.
        let level = answer.own.as_ref().map_or(common.level, |own| own.level).min(answer.levels.len() - 1);
        let raw = answer.levels.get(level).cloned().unwrap_or_default();
        cell.most = Some(largest(&raw));
        Ok((cell, Some(CellMaps { raw, own: answer.own, common })))
    }
}

type TimedAnswer = (Vec<Vec<f32>>, Option<ForeignMask>, f64, f64);

/// Relevancy of all levels and the mask by the own rule, with the milliseconds of encoding and decoding.
fn answered(
    scene: &mut CompareSubject,
    phrase: &str,
    vectors: &mut KnownVectors<'_>,
    repeats: usize,
) -> Result<TimedAnswer, JobError> {
    let answers = &mut scene.answers;
    let encode = answers.encode(phrase, vectors)?;
    let (mut levels, mut decode) = (Vec::new(), Vec::with_capacity(repeats));
    for _ in 0..repeats {
        let start = Instant::now();
        levels = answers.levels(phrase, vectors)?;
        decode.push(ms_since(start));
    }
    let own = answers.own_mask(phrase, &levels, vectors)?;
    Ok((levels, own, encode, median(&decode)))
}

/// Returns why a scene has no answer; other errors stay errors.
fn problem(e: JobError) -> Result<String, JobError> {
    match e {
        JobError::Foreign(
            e @ (ForeignError::NoLanguage(_)
            | ForeignError::NoIdentities(_)
            | ForeignError::NoRule(_)
            | ForeignError::Dimension { .. }),
        ) => Ok(e.to_string()),
        e => Err(e),
    }
}

/// Relevancy and masks of a cell.
struct CellMaps {
    raw: Vec<f32>,
    own: Option<ForeignMask>,
    common: ForeignMask,
}

impl CellMaps {
    fn on_lerfs_scale(&self) -> Vec<f32> {
        let most = largest(&self.raw);
        self.raw.iter().map(|r| on_lerfs_scale(*r, most).clamp(0.0, 1.0)).collect()
    }

    fn tile(&self, shown: ShownRelevancy) -> CellTile {
        let mask = &self.own.as_ref().unwrap_or(&self.common).mask;
        match (shown, &self.own) {
            (ShownRelevancy::Raw, _) => CellTile::new(&self.raw, mask),
            (ShownRelevancy::Own, Some(own)) => CellTile::new(&own.values, mask),
            (ShownRelevancy::Lerf | ShownRelevancy::Own, _) => CellTile::new(&self.on_lerfs_scale(), mask),
        }
    }

    /// Writes the arrays of all three kinds.
    fn write(&self, folder: &Path, name: &str) -> Result<(), JobError> {
        export::make_folder(folder)?;
        let size = [self.common.mask.width_px() as u32, self.common.mask.height_px() as u32];
        let write = |what: &str, values: &[f32]| export::npy(&folder.join(format!("{name}_{what}.npy")), values, size);
        write("raw", &self.raw)?;
        write("lerf", &self.on_lerfs_scale())?;
        if let Some(own) = &self.own {
            write("own", &own.values)?;
        }
        Ok(())
    }
}
