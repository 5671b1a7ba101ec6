//! A list of phrases queried in some views: scores, areas, IoU with true masks, and the masks as files.

pub(crate) mod colors;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;
use serde_json::json;

use self::colors::PhraseColors;
use super::JobError;
use super::coco::Coco;
use super::query::{ViewMaps, write_mask};
use crate::io::labels::pictures;
use crate::io::{atomic, files};
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::query::answer::{Certainty, QueryAnswer};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::query_engine::QueryEngine;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::render::{RenderSettings, Renderer};
use crate::scene::text;
use crate::scene::{Camera, GaussianCloud, LevelFilter, Mask, SemanticMap};

/// Most phrases of a list.
pub(crate) const MOST: usize = 1_000;
/// Most characters of a line that are quoted in errors.
const LONGEST_TOLD: usize = 60;

/// Masks that phrases are compared with.
#[derive(Clone, Debug, Default)]
pub(crate) enum TrueMasks {
    #[default]
    None,
    /// `FOLDER/<view>/<phrase>.png`, named as masks are exported; phrases without a file are not compared.
    Folder(PathBuf),
    /// One mask for every phrase and view.
    Mask(Arc<Mask>),
}

/// Phrases, and the scene and views to query.
#[derive(Clone, Debug)]
pub struct PhrasesRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) settings: RenderSettings,
    /// Views with their names.
    pub(crate) views: Vec<(String, Camera)>,
    pub(crate) phrases: Vec<String>,
    /// Colors that phrases have already.
    pub(crate) colors: PhraseColors,
    pub(crate) level: LevelFilter,
    /// Up direction of the scene.
    pub(crate) up: DVec3,
    /// Length of a scene unit in meters, if known.
    pub(crate) meters: Option<f64>,
    pub(crate) recipe: QueryConfig,
    /// Most answers whose pixels go into a mask.
    pub(crate) top: usize,
    pub(crate) truth: TrueMasks,
    /// Folder for masks and tables, if they are wanted.
    pub(crate) export: Option<PathBuf>,
}

/// A phrase in a view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PhraseRow {
    pub(crate) view: String,
    pub(crate) phrase: String,
    /// Color of its display, red, green and blue.
    pub(crate) color: [u8; 3],
    /// "found", "ambiguous" or "not found".
    pub(crate) verdict: &'static str,
    /// "certain", "likely" or "guess".
    pub(crate) certainty: &'static str,
    /// Full name of the answer.
    pub(crate) answer: String,
    pub(crate) score: f32,
    pub(crate) margin: f32,
    pub(crate) area_px: usize,
    /// Share of the view.
    pub(crate) share: f64,
    /// IoU with the true mask, if there is one.
    pub iou: Option<f64>,
}

/// Returns the phrases of a list, one a line, without blank lines.
///
/// # Errors
/// If there are none, or too many.
pub(crate) fn listed(text: &str) -> Result<Vec<String>, JobError> {
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, l)| !l.is_empty());
    let phrases: Vec<String> = lines.clone().map(|(_, l)| l.to_owned()).collect();
    if let Some((k, line)) = lines.clone().find(|(_, l)| !l.chars().any(char::is_alphanumeric)) {
        let (line, k) = (text::shortened(line, LONGEST_TOLD), k + 1);
        return Err(JobError::Phrases(format!("line {k}: '{line}' has no letter or digit; leave the line out")));
    }
    match phrases.len() {
        0 => Err(JobError::Phrases("the list is empty: write one phrase per line".into())),
        n if n > MOST => Err(JobError::Phrases(format!("{n} phrases exceed the limit of {MOST}: split the list"))),
        _ => Ok(phrases),
    }
}

/// Reads a list of phrases.
///
/// # Errors
/// If the file cannot be read, or holds none or too many.
pub(crate) fn read(path: &Path) -> Result<Vec<String>, JobError> {
    let named = |e: JobError| JobError::Phrases(format!("{}: {e}", path.display()));
    listed(&files::read_text(path)?).map_err(named)
}

/// Queries every phrase in every view.
///
/// # Errors
/// If an encoder fails, a view cannot be drawn, or a file cannot be read or written.
pub(crate) fn run(request: &PhrasesRequest, observer: &mut dyn Observer) -> Result<Vec<PhraseRow>, JobError> {
    let PhrasesRequest { cloud, map, settings, views, phrases, level, .. } = request;
    let mut engine = QueryEngine::new(map.language.as_ref(), request.recipe.clone())?;
    let mut readings = Vec::new();
    for phrase in phrases {
        let reading = engine.read(&map.identities, phrase);
        readings.push(reading.ok_or_else(|| JobError::Phrases(format!("'{phrase}' has no word to look for")))?);
    }
    let mut colors = request.colors.clone();
    colors.keep_all(phrases);
    let (stems, mut coco) = (stems(phrases), Coco::default());
    let (mut rows, mut renderer) = (Vec::new(), Renderer::new());
    let mut ticker = Ticker::new("Running the phrase list", views.len());
    for (k, (view, camera)) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        let blend = request.recipe.masks == MatchMode::Codes;
        let maps = ViewMaps::draw(&mut renderer, (cloud, settings), map, camera, blend, map.has_parts())?;
        coco.view(view, camera);
        engine.place = QueryPlace::new(camera, request.up, request.meters);
        for (i, reading) in readings.iter().enumerate() {
            // Left and right are those of the view.
            let answered = &engine.answer(map, reading, *level)?;
            let (ignored, _) = engine.left_out(&map.identities, reading, answered);
            let certainty = &answered.certainty(&ignored);
            let mask = maps.of_answer(map, answered, request.top);
            let place = Path::new(&stem(view)).join(format!("{}.png", stems[i]));
            let iou = truth(&request.truth, &place, &mask)?.map(|truth| mask.iou(&truth));
            if let Some(folder) = &request.export {
                write_mask(&folder.join("masks").join(&place), &mask)?;
                coco.mask(i + 1, &mask, Some(answered.answer.hits().first().map_or(0.0, |h| h.score)));
            }
            let phrase = (&*phrases[i], colors.of(&phrases[i]));
            rows.push(row(view, phrase, (*certainty, answered), map, &mask, iou));
        }
    }
    ticker.tick(views.len(), observer)?;
    if let Some(folder) = &request.export {
        let csv = csv(&rows);
        atomic::write(&folder.join("phrases.csv"), |w| w.write_all(csv.as_bytes()))?;
        // Colors as COCO's panoptic categories have them.
        let category = |(i, phrase): (usize, &String)| json!({ "id": i + 1, "name": phrase, "supercategory": "", "color": colors.of(phrase) });
        let coco = coco.document(phrases.iter().enumerate().map(category).collect());
        atomic::write(&folder.join("coco.json"), |w| Ok(serde_json::to_writer(w, &coco)?))?;
    }
    Ok(rows)
}

/// Loads the true mask, in the size of `like`.
fn truth(truth: &TrueMasks, place: &Path, like: &Mask) -> Result<Option<Mask>, JobError> {
    let read = match truth {
        TrueMasks::None => None,
        TrueMasks::Mask(mask) => Some((**mask).clone()),
        TrueMasks::Folder(folder) => {
            let path = folder.join(place);
            if path.is_file() { Some(true_mask(&path)?) } else { None }
        }
    };
    read.map(|mask| fitted(mask, like.width_px(), like.height_px(), place)).transpose()
}

/// Reads a true mask: the white pixels of a picture.
///
/// # Errors
/// If it cannot be read, or is too large.
pub(crate) fn true_mask(path: &Path) -> Result<Mask, JobError> {
    Ok(pictures::mask(path)?)
}

/// Resizes a mask to a view of the same shape.
///
/// # Errors
/// If its shape differs.
pub(crate) fn fitted(mask: Mask, width_px: usize, height_px: usize, place: &Path) -> Result<Mask, JobError> {
    let (w, h) = (mask.width_px(), mask.height_px());
    // Rounding may differ by a pixel.
    if (w * height_px).abs_diff(h * width_px) > w.max(h).max(width_px).max(height_px) {
        let shapes = format!("the mask has {w} x {h} px, the view {width_px} x {height_px}");
        let remedy = "use a mask that was drawn on this view";
        return Err(JobError::Phrases(format!("{}: {shapes}: {remedy}", place.display())));
    }
    Ok(mask.resized(width_px, height_px))
}

fn row(
    view: &str,
    (phrase, color): (&str, [u8; 3]),
    (certainty, answered): (Certainty, &QueryAnswer),
    map: &SemanticMap,
    mask: &Mask,
    iou: Option<f64>,
) -> PhraseRow {
    let chosen = answered.chosen(1);
    let names: Vec<String> = chosen.iter().map(|id| map.identities.full_name(*id)).collect();
    let best = answered.answer.hits().first();
    PhraseRow {
        view: view.into(),
        phrase: phrase.into(),
        color,
        verdict: answered.answer.verdict(),
        certainty: certainty.into(),
        answer: names.join("; "),
        score: best.map_or(0.0, |h| h.score),
        margin: best.map_or(0.0, |h| h.margin.max(0.0)),
        area_px: mask.area(),
        share: mask.area() as f64 / (mask.width_px() * mask.height_px()).max(1) as f64,
        iou,
    }
}

/// Returns the rows as a table for spreadsheets.
fn csv(rows: &[PhraseRow]) -> String {
    // Some spreadsheets take text that begins so for a formula.
    let cell = |text: &str| {
        let text = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() };
        format!("\"{}\"", text.replace('"', "\"\""))
    };
    let mut all = String::from("view,phrase,verdict,certainty,answer,score,margin,area_px,share,iou,color\n");
    for r in rows {
        let iou = r.iou.map_or_else(String::new, |v| format!("{v:.6}"));
        let [red, green, blue] = r.color;
        let texts = [&*r.view, &r.phrase, r.verdict, r.certainty, &r.answer].map(cell).join(",");
        // Writing to a text cannot fail.
        let _ = writeln!(
            all,
            "{texts},{:.6},{:.6},{},{:.8},{iou},#{red:02x}{green:02x}{blue:02x}",
            r.score, r.margin, r.area_px, r.share
        );
    }
    all
}

/// Returns a name fit for files: letters and digits in lower case, `_` between them, without the ending of a picture.
fn stem(name: &str) -> String {
    let is_ending = |e: &str| (1..=4).contains(&e.len()) && e.chars().all(char::is_alphanumeric);
    let name = name.rsplit_once('.').filter(|(_, ending)| is_ending(ending)).map_or(name, |(stem, _)| stem);
    let words: Vec<String> =
        name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(|w| w.to_lowercase()).collect();
    let stem: String = words.join("_").chars().take(60).collect();
    if stem.is_empty() { "unnamed".into() } else { stem }
}

/// Returns a file stem for each phrase; equal ones get a number.
fn stems(phrases: &[String]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut next = |phrase: &String| {
        let plain = stem(phrase);
        let numbered = (2..).map(|n| format!("{plain}_{n}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|s| !taken.contains(s)).unwrap_or_default();
        taken.insert(free.clone());
        free
    };
    phrases.iter().map(&mut next).collect()
}

#[cfg(test)]
mod tests;
