//! Knobs of typed queries, compared with labeled photos.

use std::time::Instant;

use serde_json::{Value, json};
use strum::VariantArray;

use super::{StudyInput, Variants, error, overlap};
use crate::math::stats::mean;
use crate::measure::sweep::failed;
use crate::measure::{Rule, Stage, StageName, Study, StudyError, Trial};
use crate::models::{Encoder, ModelError};
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::evaluation::part_recall::HIT_IOU;
use crate::pipeline::semantics::evaluation::{AskedScene, Category, LabeledView, langsplat};
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::matching::{self, MatchMode};
use crate::pipeline::semantics::query::query_engine::{ask_by_embedding, ask_by_name};
use crate::pipeline::semantics::query::recipe::{MatchBy, PartEmbedding, QueryConfig, Strategy};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, IdentityId, LanguageFeatures, Level, LevelFilter, Mask, SemanticMap};

pub(crate) struct LabeledScene {
    pub(crate) name: String,
    pub(crate) camera: Camera,
    pub(crate) categories: Vec<Category>,
}

#[derive(Clone, Copy, PartialEq)]
enum Precision {
    Stored,
    Half,
    Byte,
}

#[derive(Clone)]
struct Variant {
    recipe: QueryConfig,
    /// Maps of the view are smaller by this factor.
    smaller: u32,
    precision: Precision,
    /// Share of the objects that can be found.
    share: f64,
}

/// The sweep of queries to a scene that `encoder` has embedded, asked for what labeled views show.
pub(crate) fn study<'a>(
    (cloud, settings): (&'a GaussianCloud, &'a RenderSettings),
    map: &'a SemanticMap,
    mut encoder: Box<dyn Encoder>,
    views: Vec<LabeledScene>,
    (repeats, recipe): (u32, &QueryConfig),
    mut input: StudyInput,
) -> Result<Study<'a>, StudyError> {
    let language = map.language.as_ref().ok_or_else(|| failed("this scene has no embeddings"))?;
    let queries: usize = views.iter().map(|v| v.categories.len()).sum();
    input.insert("queries".into(), format!("{queries} in {} views", views.len()));
    input.insert("identities".into(), map.identities.len().to_string());
    input.insert("encoder".into(), language.encoder.clone());
    input.insert("recipe".into(), recipe.to_string());
    let measures = vec![
        overlap("mIoU", "mean overlap of the answer's mask with the label, over all names of the views"),
        overlap("part recall", "share of parts that are answered with an overlap of a half or more"),
        overlap("localization", "share of names whose most relevant pixel lies in their box (LangSplat's protocol)"),
        overlap("object mIoU", "mean overlap of objects"),
        overlap("part mIoU", "mean overlap of parts"),
        error("not understood", "share of names of which the encoder knows no word; they count as an overlap of 0"),
    ];
    let words = [
        "one query, from the text to the mask, maps of the view there",
        "labels of photos whose masks were not used; by embedding unless it says otherwise, the best answer whatever \
         its score; names alone measure the lifting",
    ];
    let rule = Rule::new("mIoU", 1.02, 0.0, 5e-3);
    let stage = Stage::new(StageName::Query, words, (input, repeats), rule, measures);
    Ok(Study::new(stage, variants(recipe).0, move |variant: &Variant, _seed, observer| {
        let features = reduced(language, map, variant);
        let mut canonical = TextEmbeddings::default();
        canonical.learn_canonical(&variant.recipe, &mut *encoder);
        let mut renderer = Renderer::new();
        let (mut secs, mut ious, mut hits) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let (mut not_understood, mut broken) = (Vec::new(), None);
        for view in &views {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let (w, h) = (view.camera.width_px, view.camera.height_px);
            let small = view.camera.resized((w / variant.smaller).max(1), (h / variant.smaller).max(1));
            let (of, all) = (&map.identity_of, &map.identities);
            let exact = ViewMap::render(&mut renderer, cloud, of, all, &small, settings).map_err(failed)?;
            let blended = match variant.recipe.masks == MatchMode::Codes {
                true => CodeMap::render(&mut renderer, cloud, &map.codes, true, &small, settings).map_err(failed)?,
                false => CodeMap::default(),
            };
            for category in &view.categories {
                let start = Instant::now();
                let answered = ask(&category.name, map, &features, variant, canonical.clone(), &mut *encoder)?;
                let mask = answered.map(|a| found(&a, &exact, &blended, map, variant));
                secs.push(start.elapsed().as_secs_f64());
                not_understood.push(f64::from(u8::from(mask.is_none())));
                let iou = mask.map_or(0.0, |m| m.resized(w as usize, h as usize).iou(&category.mask));
                ious[usize::from(category.level == Level::Part)].push(iou);
            }
            // An encoder that fails is no answer that misses.
            let mut again = |text: &str| {
                let answered = ask(text, map, &features, variant, canonical.clone(), &mut *encoder);
                answered.unwrap_or_else(|e| {
                    broken.get_or_insert(e);
                    None
                })
            };
            let full = ViewMap::render(&mut renderer, cloud, of, all, &view.camera, settings).map_err(failed)?;
            let labeled = LabeledView {
                name: &view.name,
                camera: &view.camera,
                exact: &full,
                blended: &CodeMap::default(),
                categories: view.categories.clone(),
            };
            let units = langsplat::compare(&mut AskedScene { map, ask: &mut again }, &labeled);
            hits.extend(units.into_iter().map(|u| f64::from(u8::from(u.hit == Some(true)))));
            if let Some(e) = broken.take() {
                return Err(e);
            }
        }
        let all: Vec<f64> = ious.iter().flatten().copied().collect();
        let recalled = ious[1].iter().map(|iou| f64::from(u8::from(*iou >= HIT_IOU))).collect::<Vec<_>>();
        let values = vec![
            ("mIoU", mean(&all)),
            ("part recall", mean(&recalled)),
            ("localization", mean(&hits)),
            ("object mIoU", mean(&ious[0])),
            ("part mIoU", mean(&ious[1])),
            ("not understood", mean(&not_understood)),
        ];
        Ok(Some(Trial { secs: mean(&secs), values, curve: Vec::new() }))
    }))
}

fn reduced(language: &LanguageFeatures, map: &SemanticMap, variant: &Variant) -> LanguageFeatures {
    let mut features = language.clone();
    let objects: Vec<IdentityId> =
        map.identities.iter().filter(|(_, i)| i.level == Level::Object).map(|(id, _)| id).collect();
    let known = (variant.share * objects.len() as f64).ceil() as usize;
    let dropped = &objects[known.min(objects.len())..];
    for ((id, _), of) in map.identities.iter().zip(&mut features.by_identity) {
        if dropped.contains(&map.identities.object_of(id)) {
            *of = Default::default();
        }
        of.raw.iter_mut().chain(&mut of.deviated).for_each(|v| round(v, variant.precision));
    }
    features
}

fn round(v: &mut [f32], precision: Precision) {
    let largest = v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
    for x in v {
        *x = match precision {
            Precision::Stored => *x,
            Precision::Half => half::f16::from_f32(*x).to_f32(),
            Precision::Byte if largest > 0.0 => (*x / largest * 127.0).round() / 127.0 * largest,
            Precision::Byte => *x,
        };
    }
}

fn variants(recipe: &QueryConfig) -> Variants<Variant> {
    let recipe = QueryConfig { match_by: MatchBy::Embedding, ..recipe.clone() };
    let base = Variant { recipe: recipe.clone(), smaller: 1, precision: Precision::Stored, share: 1.0 };
    let mut all = Variants::new(format!("{}, {}", words(recipe.strategy), recipe.masks), base.clone());
    let mut add = |method: &str, setting: &str, knob: (&str, Value), variant: Variant| {
        all.add(method, setting, &[knob], variant);
    };
    let other = |recipe: QueryConfig| Variant { recipe, ..base.clone() };
    for &strategy in Strategy::VARIANTS.iter().filter(|s| **s != recipe.strategy) {
        let words = words(strategy);
        add("localization", words, ("strategy", json!(words)), other(QueryConfig { strategy, ..recipe.clone() }));
    }
    let (parts, knob, setting) = match recipe.parts {
        PartEmbedding::Deviated => (PartEmbedding::Raw, "raw", "without deviation"),
        PartEmbedding::Raw => (PartEmbedding::Deviated, "deviated", "with deviation"),
    };
    add("part features", setting, ("parts", json!(knob)), other(QueryConfig { parts, ..recipe.clone() }));
    let names = QueryConfig { match_by: MatchBy::Names, ..recipe.clone() };
    add("encoder", "none: names alone", ("encoder", json!("names")), other(names));
    for (smaller, words) in [(2, "1/2 of the size"), (4, "1/4 of the size")] {
        let variant = Variant { smaller, ..base.clone() };
        add("map resolution", words, ("scale", json!(1.0 / f64::from(smaller))), variant);
    }
    let codes = QueryConfig { masks: MatchMode::Codes, ..recipe.clone() };
    if codes != recipe {
        add("decoding", "blended codes", ("read", json!("blend")), other(codes));
    }
    for (bits, precision) in [(16, Precision::Half), (8, Precision::Byte)] {
        let variant = Variant { precision, ..base.clone() };
        add("precision", &format!("{bits} bits"), ("precision", json!(bits)), variant);
    }
    for (share, words) in [(0.25, "a quarter of the objects"), (0.5, "half of the objects")] {
        add("identities", words, ("share", json!(share)), Variant { share, ..base.clone() });
    }
    all
}

fn words(strategy: Strategy) -> &'static str {
    match strategy {
        Strategy::Joint => "part and whole at once",
        Strategy::TwoSteps => "the paper's two steps",
        Strategy::OneStep => "one step",
        Strategy::WholeFirst => "whole first",
    }
}

/// Answers a name; `None` if there is nothing in it, or no word that the encoder knows.
fn ask(
    text: &str,
    map: &SemanticMap,
    features: &LanguageFeatures,
    variant: &Variant,
    mut phrases: TextEmbeddings,
    encoder: &mut dyn Encoder,
) -> Result<Option<QueryAnswer>, StudyError> {
    let recipe = &variant.recipe;
    if recipe.match_by == MatchBy::Names {
        return Ok(ask_by_name(&map.identities, text, (LevelFilter::Auto, &QueryPlace::default()), recipe));
    }
    match ask_by_embedding(&map.identities, (features, recipe), text, &mut phrases, encoder) {
        Err(ModelError::NoKnownWord { .. }) => Ok(None),
        answered => answered.map_err(failed),
    }
}

/// Pixels of the best answer at any score: the study measures its place, not its rejection.
fn found(answered: &QueryAnswer, exact: &ViewMap, blended: &CodeMap, map: &SemanticMap, variant: &Variant) -> Mask {
    let Some(best) = answered.answer.hits().first().map(|h| h.identity) else {
        return Mask::empty(exact.width_px, exact.height_px);
    };
    let QueryConfig { masks, tolerance, .. } = variant.recipe;
    matching::pixels((exact, Some(blended)), &map.identities, best, masks, tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stats::worst_difference;

    #[test]
    fn rounding_keeps_as_much_as_it_says() {
        let v: Vec<f32> = (0..64).map(|i| (i as f32 * 0.7).sin() / 8.0).collect();
        let off = |p: Precision| {
            let mut r = v.clone();
            round(&mut r, p);
            worst_difference(&v, &r)
        };
        assert_eq!(off(Precision::Stored), 0.0);
        assert!(off(Precision::Half) < 1e-4 && off(Precision::Byte) < 1e-3 && off(Precision::Byte) > 1e-5);
    }
}
