//! Time of phrases asked of other methods' results, step by step.

use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{StageSample, StageValues};
use crate::io::results::{LevelValues, MethodResult};
use crate::math::vector::unit;
use crate::models::{Encoder, ModelError};
use crate::pipeline::semantics::query::foreign::asked::ForeignScene;
use crate::pipeline::semantics::query::foreign::own_rules::fair_mask;
use crate::pipeline::semantics::query::foreign::{ForeignError, ForeignPhrase};
use crate::pipeline::semantics::query::recipe::{LERFS_PHRASES, TEMPERATURE};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::render::Renderer;
use crate::scene::Camera;

/// Embeddings of phrases, of unit length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BenchPhrases {
    pub(crate) queries: Vec<Vec<f32>>,
    pub(crate) canonical: Vec<Vec<f32>>,
}

/// A result with the phrases that are asked.
pub(crate) struct AskedResult {
    pub(crate) result: MethodResult,
    pub(crate) phrases: BenchPhrases,
}

impl BenchPhrases {
    /// Phrases of random directions, as long as those that a result is compared with.
    pub(crate) fn random(result: &MethodResult, count: usize) -> Self {
        let dim = |values: &LevelValues| match values {
            LevelValues::Embedded(embedded) => embedded.decoder.outputs(),
            LevelValues::Clusters(clusters) => clusters.features.dim(),
            // They are compared with no phrase.
            LevelValues::Classes { .. } | LevelValues::Affinity { .. } => 1,
        };
        let dim = result.levels.first().map_or(1, |level| dim(&level.values));
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let mut vectors = |count: usize| (0..count).map(|_| direction(&mut rng, dim)).collect();
        Self { queries: vectors(count), canonical: vectors(LERFS_PHRASES.len()) }
    }
}

/// A random vector of unit length.
pub(super) fn direction(rng: &mut Pcg64Mcg, dim: usize) -> Vec<f32> {
    let v: Vec<f32> = (0..dim).map(|_| rng.random_range(-1.0..1.0)).collect();
    unit(&v).unwrap_or(v)
}

/// Returns whether each phrase runs a network for every pixel, which takes seconds.
fn is_slow(result: &MethodResult) -> bool {
    let has_network = |values: &LevelValues| match values {
        LevelValues::Embedded(embedded) => !embedded.decoder.split().0.is_empty(),
        _ => false,
    };
    result.levels.iter().any(|level| has_network(&level.values))
}

/// Looks at views and asks phrases of them in turn, if that is slow one of each. The time of a phrase is that of the
/// relevancy of all levels and of both masks, after the first look and without encoding.
///
/// # Errors
/// If the result knows no language, or cannot be drawn.
pub(crate) fn time(
    name: &str,
    scene: &ForeignScene,
    cameras: &[Camera],
    phrases: &BenchPhrases,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Vec<StageSample>, ForeignError> {
    let (result, views) = (&scene.result, cameras.len().max(1));
    let size = cameras.first().map_or([0; 2], |c| [c.width_px, c.height_px]);
    let mut values = StageValues::on_scene(name, result.cloud.len(), size);
    let mut renderer = Renderer::new();
    let count = if is_slow(result) { phrases.queries.len().min(views) } else { phrases.queries.len() };
    for (v, camera) in cameras.iter().enumerate() {
        let view = values.time("first view", || scene.look(&mut renderer, camera))?;
        values.add("first view: memory", "MB", [view.bytes() as f64 / 1e6]);
        let reached = (0..result.levels.len()).filter_map(|level| view.reached(level));
        values.add("first view: pixels that phrases decode", "%", reached.map(|share| 100.0 * share));
        for query in phrases.queries[..count].iter().skip(v).step_by(views) {
            if !go_on() {
                return Ok(values.samples());
            }
            let phrase = ForeignPhrase { query, canonical: &phrases.canonical, temperature: TEMPERATURE };
            let start = Instant::now();
            let found = scene.relevancy(&mut renderer, &view, phrase)?;
            let relevancy = ms_since(start);
            let own = match scene.own_mask(&mut renderer, &view, phrase, &found) {
                Err(ForeignError::NoRule(_)) => None,
                own => Some(own?),
            };
            let with_own = ms_since(start);
            let common = fair_mask(&view, &found)?;
            let whole = ms_since(start);
            std::hint::black_box((&own, &common));
            values.add("phrase", "ms", [whole]);
            values.add("phrase: relevancy of all levels", "ms", [relevancy]);
            if own.is_some() {
                values.add("phrase: mask by its own rule", "ms", [with_own - relevancy]);
            }
            values.add("phrase: mask by the common rule", "ms", [whole - with_own]);
        }
    }
    Ok(values.samples())
}

/// Times the encoding of single phrases, each another one.
pub(crate) fn encoding(encoder: &mut dyn Encoder, phrases: usize) -> Result<Vec<StageSample>, ModelError> {
    let mut values = StageValues::new(format!("encoder '{}'", encoder.name()));
    for k in 0..phrases {
        let text = format!("a red mug with the number {k}");
        values.time("phrase: encoding", || encoder.text(&text))?;
    }
    Ok(values.samples())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::made_up_results::{lang_splat, lang_splat_v2};
    use super::*;

    fn small_cameras(result: &MethodResult) -> Vec<Camera> {
        result.cameras.iter().map(|c| c.camera.limited_to(96)).collect()
    }

    fn timed(made_up: AskedResult) -> Vec<StageSample> {
        let cameras = small_cameras(&made_up.result);
        let scene = ForeignScene::new(Arc::new(made_up.result));
        time("x", &scene, &cameras, &made_up.phrases, &mut || true).expect("answered")
    }

    #[test]
    fn every_step_of_a_phrase_is_timed() {
        let stages = |samples: &[StageSample]| samples.iter().map(|s| (s.stage.clone(), s.n)).collect::<Vec<_>>();
        let quick = timed(lang_splat_v2(2_000, 7).expect("made"));
        let wanted = |phrases| {
            let all = ["first view", "first view: memory", "first view: pixels that phrases decode", "phrase"];
            let parts = ["relevancy of all levels", "mask by its own rule", "mask by the common rule"];
            let views = all[..3].iter().zip([3, 3, 9]).map(|(stage, n)| ((*stage).to_owned(), n));
            let parts = parts.map(|part| (format!("phrase: {part}"), phrases));
            views.chain([(all[3].to_owned(), phrases)]).chain(parts).collect::<Vec<_>>()
        };
        assert_eq!(stages(&quick), wanted(7));
        let slow = timed(lang_splat(2_000, 7).expect("made"));
        assert_eq!(stages(&slow), wanted(3), "a slow one is asked once in each view");
        for samples in [quick, slow] {
            let of = |stage: &str| samples.iter().find(|s| s.stage == stage).expect("measured").median;
            let parts: f64 = samples.iter().filter(|s| s.stage.starts_with("phrase: ")).map(|s| s.median).sum();
            assert!(of("phrase") > 0.0 && parts > 0.0 && of("first view") > 0.0 && of("first view: memory") > 0.0);
            let decoded = of("first view: pixels that phrases decode");
            assert!((50.0..100.0).contains(&decoded), "a small part of the view is empty: {decoded}");
        }
    }

    #[test]
    fn nothing_is_asked_after_a_stop() {
        let made_up = lang_splat_v2(500, 7).expect("made");
        let cameras = small_cameras(&made_up.result);
        let scene = ForeignScene::new(Arc::new(made_up.result));
        let samples = time("x", &scene, &cameras, &made_up.phrases, &mut || false).expect("stopped");
        assert!(samples.len() == 3 && samples.iter().all(|s| s.stage.starts_with("first view")), "{samples:?}");
    }

    #[test]
    fn phrases_are_as_long_as_the_embeddings() {
        let result = lang_splat(100, 1).expect("made").result;
        let phrases = BenchPhrases::random(&result, 5);
        assert_eq!((phrases.queries.len(), phrases.canonical.len()), (5, LERFS_PHRASES.len()));
        assert!(phrases.queries.iter().chain(&phrases.canonical).all(|v| v.len() == 512));
        assert_ne!(phrases.queries[0], phrases.queries[1]);
    }
}
