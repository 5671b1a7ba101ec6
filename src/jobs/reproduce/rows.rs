//! The measured rows of a table: this program's method, the paper's, and baselines made of our own components. All
//! query by embedding alone, whatever names labels have, except for those that say otherwise.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::printed::{ACCURACY, LOCALIZATION, MIOU, RECALL};
use super::{PaperTable, ReproduceSettings};
use crate::io::labels::ref_lerf::ReferredPhoto;
use crate::io::labels::stem;
use crate::jobs::JobError;
use crate::jobs::evaluate::PhotoComparison;
use crate::jobs::evaluate_masks::DrawnView;
use crate::math::stats::quantile;
use crate::models::{Encoder, ModelError};
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::by_similarity::{ALIKE, rejoined};
use crate::pipeline::semantics::evaluation::part_recall::{self, Components, objects_alone};
use crate::pipeline::semantics::evaluation::raw_features::RawFeatures;
use crate::pipeline::semantics::evaluation::{
    AskedScene, LabeledView, Unit, fastlgs_ex, langsplat, multi_class, ref_lerf, spin_nerf,
};
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::pipeline::semantics::query::query_engine::{QueryEngine, ask_by_embedding, ask_by_name};
use crate::pipeline::semantics::query::recipe::{MatchBy, PartEmbedding, QueryConfig, RelevancyScale, Strategy};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::smoothing::by_common_rule;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::{LanguageFeatures, LevelFilter, Mask, SemanticMap};

pub(super) const POOLED: &str = "running pooled IoU of FastLGS's evaluator, %";
pub(super) const ARGMAX: &str = "mean IoU by arg-max over all classes, %";
/// Shares of sentences by their IoU.
const OVER: [(&str, f64); 2] = [("sentences with IoU over 0.25, %", 0.25), ("sentences with IoU over 0.5, %", 0.5)];
pub(super) const PART_IOU: &str = "mean IoU of parts, %";

/// A row: the percentage of every query, by metric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RowResult {
    pub(super) name: String,
    pub(super) scores: BTreeMap<String, Vec<f64>>,
}

/// Milliseconds of a query, from its text to its mask in a drawn view: median, and 95th percentile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct QueryTimes {
    pub(super) whole_ms: [f64; 2],
    /// The same without encoding the text.
    pub(super) without_text_ms: [f64; 2],
}

#[derive(Default)]
pub(super) struct MeasuredRows {
    pub(super) rows: Vec<RowResult>,
    pub(super) times: QueryTimes,
    pub(super) unknown_phrases: Vec<String>,
}

/// Returns the query recipes of this program and of the paper, by embedding alone, for objects that this program found.
fn ways() -> [(&'static str, QueryConfig); 4] {
    let paper = QueryConfig::paper();
    let raw = QueryConfig { parts: PartEmbedding::Raw, ..paper.clone() };
    [
        ("this program", ours()),
        ("the paper's two steps", paper),
        ("the paper's two steps, parts not deviated", raw.clone()),
        (SINGLE_LEVEL, QueryConfig { strategy: Strategy::OneStep, ..raw }),
    ]
}

/// Returns the query recipes for sentences: this program's own, which knows names too, and by embedding alone.
fn ways_of_sentences() -> [(&'static str, QueryConfig); 3] {
    [
        ("this program", QueryConfig::default()),
        ("this program, by embedding alone", ours()),
        ("the paper's two steps", QueryConfig::paper()),
    ]
}

fn ours() -> QueryConfig {
    QueryConfig { match_by: MatchBy::Embedding, ..QueryConfig::default() }
}

const SINGLE_LEVEL: &str = "single level without deviation";
const BY_NAME: &str = "by name: labels in, labels out";

/// Measures the rows of a table, from the `views` with labels.
pub(super) fn measure(
    settings: &ReproduceSettings,
    comparison: &PhotoComparison,
    map: &SemanticMap,
    drawn: &[DrawnView],
    (query, referred): (&str, &BTreeMap<String, ReferredPhoto>),
) -> Result<MeasuredRows, JobError> {
    let language = map
        .language
        .as_ref()
        .ok_or_else(|| JobError::Protocol("the scene has no embeddings, although an encoder was given".into()))?;
    let views: Vec<LabeledView<'_>> = drawn.iter().map(DrawnView::labeled).collect();
    let encoder = crate::models::encoder(&language.encoder)?;
    let mut by = ByEmbedding { encoder, phrases: TextEmbeddings::default(), unknown: BTreeSet::new() };
    let table = Table { which: settings.table, query, classes: classes(&views), referred };
    let mut rows = Vec::new();
    if settings.table == PaperTable::PartAblation {
        for components in Components::ROWS {
            let row = part_recall::row((components, &ours()), map, language, &views, &mut *by.encoder)?;
            let recall = percent(row.units.iter().map(|u| f64::from(u.iou >= part_recall::HIT_IOU)));
            let ious = percent(row.units.iter().map(|u| u.iou));
            let scores = BTreeMap::from([(RECALL.into(), recall), (PART_IOU.into(), ious)]);
            rows.push(RowResult { name: components_name(components).into(), scores });
        }
    } else if settings.table == PaperTable::RefLerf {
        for (name, recipe) in ways_of_sentences() {
            let mut engine = QueryEngine::new(map.language.as_ref(), recipe)?;
            rows.push(table.row(name, map, &views, &mut |text| engine.ask(map, text, LevelFilter::Auto))?);
        }
    } else {
        let objects = objects_alone(language, &map.identities);
        for (name, recipe) in ways() {
            let features = if name == SINGLE_LEVEL { &objects } else { language };
            rows.push(table.row(name, map, &views, &mut |text| by.ask(map, (features, &recipe), text))?);
        }
        if let Some(joined) = rejoined(map, &comparison.cloud) {
            rows.push(similarity_row(&table, comparison, &joined, &views, &mut by)?);
        }
        rows.extend(rule_rows(&table, comparison, (map, language), &views, &mut by)?);
        if map.identities.iter().any(|(_, i)| !i.names.is_empty()) {
            let recipe = QueryConfig::default();
            let mut ask = |text: &str| {
                Ok(ask_by_name(&map.identities, text, (LevelFilter::Auto, &QueryPlace::default()), &recipe))
            };
            rows.push(table.row(BY_NAME, map, &views, &mut ask)?);
        }
    }
    let times = times(&table, (map, language), &views, &mut by)?;
    Ok(MeasuredRows { rows, times, unknown_phrases: by.unknown.into_iter().collect() })
}

fn components_name(c: Components) -> &'static str {
    match c {
        Components { joint: true, .. } => "ME + SD + part and whole at once (this program)",
        Components { localization: true, .. } => "ME + SD + ML",
        Components { deviation: true, .. } => "ME + SD",
        Components { extraction: true, .. } => "ME",
        _ => "none",
    }
}

fn classes(views: &[LabeledView<'_>]) -> Vec<String> {
    let all: BTreeSet<&String> = views.iter().flat_map(|v| v.categories.iter().map(|c| &c.name)).collect();
    all.into_iter().cloned().collect()
}

/// Queries by embedding; phrases are encoded once.
struct ByEmbedding {
    encoder: Box<dyn Encoder>,
    phrases: TextEmbeddings,
    unknown: BTreeSet<String>,
}

impl ByEmbedding {
    /// Returns the answer; `None` if the encoder knows no word, which is noted.
    fn ask(
        &mut self,
        map: &SemanticMap,
        how: (&LanguageFeatures, &QueryConfig),
        text: &str,
    ) -> Result<Option<QueryAnswer>, ModelError> {
        match ask_by_embedding(&map.identities, how, text, &mut self.phrases, &mut *self.encoder) {
            Err(ModelError::NoKnownWord { .. }) => {
                self.unknown.insert(text.to_owned());
                Ok(None)
            }
            other => other,
        }
    }
}

/// Answers a phrase; `None` if there is no answer.
type Ask<'a> = &'a mut dyn FnMut(&str) -> Result<Option<QueryAnswer>, ModelError>;
/// Relevancy of a view's pixels for a phrase, by the view's index.
type Heat<'a> = &'a mut dyn FnMut(usize, &str) -> Result<Option<Vec<f32>>, JobError>;

struct Table<'a> {
    which: PaperTable,
    /// Query if labels have no names.
    query: &'a str,
    classes: Vec<String>,
    /// Sentences by photo.
    referred: &'a BTreeMap<String, ReferredPhoto>,
}

fn percent(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    values.into_iter().map(|v| 100.0 * v).collect()
}

impl Table<'_> {
    /// Returns the queries of a view.
    fn phrases<'b>(&'b self, view: &'b LabeledView<'_>) -> Vec<&'b str> {
        match self.which {
            PaperTable::SpinNerf => vec![self.query],
            PaperTable::RefLerf => {
                let asked = self.referred(view).map(|photo| ref_lerf::asked(view, photo)).unwrap_or_default();
                asked.into_iter().map(|(_, sentence)| sentence).collect()
            }
            _ => view.categories.iter().map(|c| c.name.as_str()).collect(),
        }
    }

    fn referred(&self, view: &LabeledView<'_>) -> Option<&ReferredPhoto> {
        self.referred.get(&stem(view.name))
    }

    fn row(
        &self,
        name: &str,
        map: &SemanticMap,
        views: &[LabeledView<'_>],
        ask: Ask<'_>,
    ) -> Result<RowResult, JobError> {
        let mut failed = None;
        let mut quiet = |text: &str| {
            ask(text).unwrap_or_else(|e| {
                failed.get_or_insert(e);
                None
            })
        };
        let scene = &mut AskedScene { map, ask: &mut quiet };
        let scores = match self.which {
            PaperTable::SpinNerf => {
                let found: Vec<_> = views.iter().filter_map(|v| spin_nerf::compare(scene, v, self.query)).collect();
                spin_scores(&found)
            }
            PaperTable::Ovs3d => {
                let (own, winner): (Vec<_>, Vec<_>) =
                    views.iter().map(|v| multi_class::compare(scene, v, &self.classes)).map(|[a, b]| (a, b)).unzip();
                let ious = |units: Vec<Vec<Unit>>| percent(units.into_iter().flatten().map(|u| u.iou));
                BTreeMap::from([(MIOU.to_owned(), ious(own)), (ARGMAX.to_owned(), ious(winner))])
            }
            PaperTable::RefLerf => {
                let units = views.iter().filter_map(|v| Some(ref_lerf::compare(scene, v, self.referred(v)?)));
                let ious: Vec<f64> = units.flatten().map(|u| u.iou).collect();
                let over = |least: f64| percent(ious.iter().map(|iou| f64::from(*iou > least)));
                let shares = OVER.map(|(metric, least)| (metric.to_owned(), over(least)));
                shares.into_iter().chain([(MIOU.to_owned(), percent(ious.iter().copied()))]).collect()
            }
            PaperTable::LerfOvs | PaperTable::PartAblation => {
                let units: Vec<_> = views.iter().flat_map(|v| langsplat::compare(scene, v)).collect();
                let mut pool = fastlgs_ex::Pool::default();
                let pooled = views.iter().flat_map(|v| fastlgs_ex::compare(scene, v, &mut pool)).map(|u| u.iou);
                BTreeMap::from([
                    (LOCALIZATION.to_owned(), percent(units.iter().map(|u| f64::from(u.hit == Some(true))))),
                    (MIOU.to_owned(), percent(units.iter().map(|u| u.iou))),
                    (POOLED.to_owned(), percent(pooled)),
                ])
            }
        };
        // A failing encoder is an error, not a wrong answer.
        failed.map_or(Ok(RowResult { name: name.into(), scores }), |e| Err(e.into()))
    }

    /// Returns a row of masks that LERF's rule cuts out of relevancy.
    fn ruled_row(&self, name: &str, views: &[LabeledView<'_>], heat: Heat<'_>) -> Result<RowResult, JobError> {
        let (mut ious, mut hits, mut found) = (Vec::new(), Vec::new(), Vec::new());
        for (k, view) in views.iter().enumerate() {
            let (width_px, height_px) = (view.exact.width_px, view.exact.height_px);
            for phrase in self.phrases(view) {
                let relevancy = heat(k, phrase)?.filter(|relevancy| !relevancy.is_empty());
                let ruled = relevancy.and_then(|relevancy| by_common_rule(&[relevancy], width_px, height_px));
                let empty = || (Mask::empty(width_px, height_px), None);
                let (mask, at) = ruled.map_or_else(empty, |ruled| (ruled.mask, ruled.peak));
                found.extend(spin_nerf::of_mask(&mask, view, phrase));
                let Some(category) = view.categories.iter().find(|c| c.name == phrase) else { continue };
                let hit = |at: usize| category.boxes.iter().any(|b| b.contains(at % width_px, at / width_px));
                hits.push(f64::from(at.is_some_and(hit)));
                ious.push(mask.iou(&category.mask));
            }
        }
        let scores = match self.which {
            PaperTable::SpinNerf => spin_scores(&found),
            PaperTable::Ovs3d => BTreeMap::from([(MIOU.to_owned(), percent(ious))]),
            _ => BTreeMap::from([(LOCALIZATION.to_owned(), percent(hits)), (MIOU.to_owned(), percent(ious))]),
        };
        Ok(RowResult { name: name.into(), scores })
    }
}

fn spin_scores(found: &[spin_nerf::Foreground]) -> BTreeMap<String, Vec<f64>> {
    let (ious, accuracies) = (found.iter().map(|f| f.unit.iou), found.iter().map(|f| f.accuracy));
    BTreeMap::from([(MIOU.to_owned(), percent(ious)), (ACCURACY.to_owned(), percent(accuracies))])
}

/// Returns a row of features that are matched by similarity instead of tracked identity.
fn similarity_row(
    table: &Table<'_>,
    comparison: &PhotoComparison,
    joined: &SemanticMap,
    views: &[LabeledView<'_>],
    by: &mut ByEmbedding,
) -> Result<RowResult, JobError> {
    let mut renderer = Renderer::new();
    let PhotoComparison { cloud, settings, .. } = comparison;
    let mut maps = Vec::with_capacity(views.len());
    for view in views {
        let exact =
            ViewMap::render(&mut renderer, cloud, &joined.identity_of, &joined.identities, view.camera, settings)?;
        let blended = CodeMap::render(&mut renderer, cloud, &joined.codes, joined.has_parts(), view.camera, settings)?;
        maps.push((exact, blended));
    }
    let both = views.iter().zip(&maps);
    let views: Vec<LabeledView<'_>> = both
        .map(|(view, (exact, blended))| LabeledView {
            name: view.name,
            camera: view.camera,
            exact,
            blended,
            categories: view.categories.clone(),
        })
        .collect();
    let Some(features) = joined.language.as_ref() else {
        return Err(JobError::Protocol("the scene has no embeddings".into()));
    };
    let name = format!("features mapped by similarity (cosine {ALIKE}) instead of identity");
    let recipe = QueryConfig { strategy: Strategy::OneStep, parts: PartEmbedding::Raw, ..QueryConfig::paper() };
    table.row(&name, joined, &views, &mut |text| by.ask(joined, (features, &recipe), text))
}

/// Returns rows with LERF's rule for masks: on identities, and on raw features per Gaussian.
fn rule_rows(
    table: &Table<'_>,
    comparison: &PhotoComparison,
    (map, language): (&SemanticMap, &LanguageFeatures),
    views: &[LabeledView<'_>],
    by: &mut ByEmbedding,
) -> Result<[RowResult; 2], JobError> {
    // The rule scales relevancy itself.
    let recipe = QueryConfig { scale: RelevancyScale::Raw, ..QueryConfig::paper() };
    let ruled = table.ruled_row("the paper's two steps, LERF's mask rule", views, &mut |k, phrase| {
        Ok(by.ask(map, (language, &recipe), phrase)?.map(|a| a.heat(views[k].exact)))
    })?;
    let PhotoComparison { cloud, settings, .. } = comparison;
    let mut renderer = Renderer::new();
    let raw = RawFeatures::new(language);
    // One view at a time: weights of all would take gigabytes.
    let mut kept = None;
    let blended = table.ruled_row("raw features per Gaussian, LERF's mask rule", views, &mut |k, phrase| {
        let Some(parsed) = ParsedQuery::parse(phrase) else { return Ok(None) };
        match by.phrases.learn(&parsed, &recipe, &mut *by.encoder) {
            // The row before has noted it.
            Err(ModelError::NoKnownWord { .. }) => return Ok(None),
            learned => learned?,
        }
        let pixels = match kept.take() {
            Some((of, pixels)) if of == k => pixels,
            _ => renderer.label_weights(cloud, &map.identity_of, views[k].camera, settings)?,
        };
        let relevancy = raw.relevancy(&pixels, &parsed.text, &by.phrases, &recipe);
        kept = Some((k, pixels));
        Ok(relevancy)
    })?;
    Ok([ruled, blended])
}

/// Times this program's queries, every phrase encoded anew.
fn times(
    table: &Table<'_>,
    (map, language): (&SemanticMap, &LanguageFeatures),
    views: &[LabeledView<'_>],
    by: &mut ByEmbedding,
) -> Result<QueryTimes, JobError> {
    let (mut canonical, recipe) = (TextEmbeddings::default(), ours());
    canonical.learn_canonical(&recipe, &mut *by.encoder);
    let (mut whole, mut without) = (Vec::new(), Vec::new());
    for view in views {
        for phrase in table.phrases(view) {
            by.phrases = canonical.clone();
            let start = Instant::now();
            let answered = by.ask(map, (language, &recipe), phrase)?;
            let Some(answered) = answered else { continue };
            std::hint::black_box(answered.mask(view.exact, Some(view.blended), &map.identities, 1));
            let ms = ms_since(start);
            whole.push(ms);
            without.push(ms - answered.stages.encode);
        }
    }
    let of = |ms: &[f64]| if ms.is_empty() { [0.0; 2] } else { [0.5, 0.95].map(|q| quantile(ms, q)) };
    Ok(QueryTimes { whole_ms: of(&whole), without_text_ms: of(&without) })
}
