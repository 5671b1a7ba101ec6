//! Questions to results of other methods: a phrase becomes relevancy of Gaussians and pixels, and masks by the method's
//! own rule and by the common one.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use super::{JobError, Scene};
use crate::io::results::{self, EmbeddedLevel, LevelCodes, LevelValues, MethodKind, MethodResult, ResultOptions};
use crate::io::{IoError, files, npy};
use crate::math::vector::unit;
use crate::models::{self, ModelError, TextSource};
use crate::pipeline::semantics::query::foreign::asked::ForeignScene;
use crate::pipeline::semantics::query::foreign::own_rules::{ForeignMask, fair_mask};
use crate::pipeline::semantics::query::foreign::{ForeignError, ForeignPhrase};
use crate::pipeline::semantics::query::recipe::{LERFS_PHRASES, TEMPERATURE};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::render::Renderer;
use crate::scene::Camera;

/// Opens the result that a scene was read from, as it is asked.
///
/// # Errors
/// If the scene is no result of another method, or it cannot be read exactly.
pub(crate) fn open(scene: &Scene, options: &ResultOptions) -> Result<ForeignScene, JobError> {
    Ok(ForeignScene::new(read(scene, options)?))
}

/// Reads the result that a scene was read from.
///
/// # Errors
/// If the scene is none, or it cannot be read exactly.
pub(super) fn read(scene: &Scene, options: &ResultOptions) -> Result<Arc<MethodResult>, JobError> {
    match &scene.result {
        Some(result) if *options == ResultOptions::default() => Ok(Arc::clone(result)),
        _ => Ok(Arc::new(results::open_result(&scene.path, options)?)),
    }
}

/// Embeddings of a phrase and of the canonical ones.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhraseVectors {
    pub(crate) query: Vec<f32>,
    pub(crate) canonical: Vec<Vec<f32>>,
    pub(crate) encode_ms: f64,
}

/// Embeds a phrase by the encoder that a result was trained with.
///
/// # Errors
/// If the result knows no language, or its encoder is not on this machine.
pub(crate) fn encoded(result: &MethodResult, text: &str) -> Result<PhraseVectors, JobError> {
    let name = result.encoder.as_deref().ok_or_else(|| ForeignError::of_silent(result.method))?;
    vectors(&mut *models::encoder(name)?, text)
}

/// Embeds a phrase by any source.
pub(crate) fn vectors<S: TextSource<Error = ModelError> + ?Sized>(
    source: &mut S,
    text: &str,
) -> Result<PhraseVectors, JobError> {
    let text = text.trim();
    if text.is_empty() {
        return Err(JobError::EmptyQuery);
    }
    let start = Instant::now();
    let phrases: Vec<&str> = std::iter::once(text).chain(LERFS_PHRASES).collect();
    let mut all = source.texts(&phrases).into_iter().collect::<Result<Vec<_>, _>>()?;
    let canonical = all.split_off(1.min(all.len()));
    let query = all.pop().ok_or(JobError::EmptyQuery)?;
    Ok(PhraseVectors { query, canonical, encode_ms: ms_since(start) })
}

/// Reads the embeddings of a phrase and of the canonical ones from a NumPy array: a row for each, the phrase first.
///
/// # Errors
/// If it is no array of two rows or more, or a row has no direction.
pub(crate) fn stored_vectors(file: &Path) -> Result<PhraseVectors, JobError> {
    let start = Instant::now();
    let bytes = files::read(file, files::MAX_PICTURE_BYTES)?;
    let array = npy::open(&bytes, file)?;
    let bad = |reason: String| IoError::syntax(file, "npy", reason);
    let expected = "expected [rows, numbers]: the phrase's embedding, and one for each canonical phrase";
    let shape = || bad(format!("its shape is {:?}; {expected}", array.shape()));
    let &[rows, dim] = array.shape() else { return Err(shape().into()) };
    if rows < 2 || dim == 0 {
        return Err(shape().into());
    }
    let (claimed, possible) = (rows.saturating_mul(dim), array.possible);
    if claimed > possible {
        return Err(IoError::Count { path: file.into(), what: "numbers".into(), claimed, possible }.into());
    }
    let values: Vec<f32> = array.values()?.into_iter().map(|v| v as f32).collect();
    let one = |(i, row): (usize, &[f32])| {
        unit(row).ok_or_else(|| bad(format!("row {i} is zero or not finite; each is the embedding of a phrase")))
    };
    let mut rows = values.chunks_exact(dim as usize).enumerate().map(one);
    let query = rows.next().ok_or(JobError::EmptyQuery)??;
    let canonical = rows.collect::<Result<Vec<_>, _>>()?;
    Ok(PhraseVectors { query, canonical, encode_ms: ms_since(start) })
}

/// Answer of a result in a view.
#[derive(Clone, Debug)]
pub(crate) struct ResultAnswer {
    /// Level of the relevancies.
    pub(crate) level: usize,
    /// Relevancy of the pixels, row-major.
    pub(crate) relevancy: Vec<f32>,
    /// Largest relevancy of a Gaussian of the level, and its number.
    pub(crate) best_gaussian: Option<(usize, f32)>,
    /// Gaussians that are more relevant than any canonical phrase.
    pub(crate) relevant_gaussians: usize,
    /// The mask by the method's own rule, or the reason for which there is none.
    pub(crate) own: Result<ForeignMask, String>,
    /// The mask by the rule that is the same for all methods.
    pub(crate) common: ForeignMask,
    /// Milliseconds of each step.
    pub(crate) times: ResultTimes,
}

/// Milliseconds of the steps of an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct ResultTimes {
    /// Drawing what all phrases need of the view.
    pub(crate) view: f64,
    /// Embedding the phrases.
    pub(crate) encode: f64,
    /// Relevancy and masks.
    pub(crate) answer: f64,
}

/// Answers a phrase in a view, at a level or at that of the largest relevancy.
///
/// # Errors
/// If the result knows no language, or the embeddings do not fit it.
pub(crate) fn ask(
    scene: &ForeignScene,
    camera: &Camera,
    vectors: &PhraseVectors,
    level: Option<usize>,
) -> Result<ResultAnswer, JobError> {
    let phrase = ForeignPhrase { query: &vectors.query, canonical: &vectors.canonical, temperature: TEMPERATURE };
    let mut renderer = Renderer::new();
    let start = Instant::now();
    let view = scene.look(&mut renderer, camera)?;
    let view_ms = ms_since(start);
    let start = Instant::now();
    let all = scene.relevancy(&mut renderer, &view, phrase)?;
    let common = fair_mask(&view, &all)?;
    let level = level.unwrap_or(common.level);
    let gaussians = scene.gaussian_relevancy(level, phrase)?;
    let own = match scene.own_mask(&mut renderer, &view, phrase, &all) {
        Ok(mask) => Ok(mask),
        Err(e @ ForeignError::NoRule(_)) => Err(e.to_string()),
        Err(e) => return Err(e.into()),
    };
    let relevancy = all.into_iter().nth(level).ok_or(ForeignError::Level(level))?;
    let best = gaussians.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
    Ok(ResultAnswer {
        level,
        relevancy,
        best_gaussian: best,
        relevant_gaussians: gaussians.iter().filter(|r| **r > 0.5).count(),
        own,
        common,
        times: ResultTimes { view: view_ms, encode: vectors.encode_ms, answer: ms_since(start) },
    })
}

/// The number of a level, by its name or its number from 1.
///
/// # Errors
/// If there is no such level; the error lists them.
pub(crate) fn level_of(result: &MethodResult, wanted: &str) -> Result<usize, JobError> {
    let names: Vec<&str> = result.levels.iter().map(|level| level.name.as_str()).collect();
    let by_name = names.iter().position(|name| name.eq_ignore_ascii_case(wanted.trim()));
    let by_number = || wanted.trim().parse::<usize>().ok()?.checked_sub(1).filter(|k| *k < names.len());
    by_name.or_else(by_number).ok_or_else(|| {
        JobError::Output(format!(
            "there is no level '{wanted}'; the levels are 1 to {}: {}",
            names.len(),
            names.join(", ")
        ))
    })
}

/// Description of a result: its values, and the questions that it answers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct ResultFacts {
    pub(crate) method: &'static str,
    /// Levels with their values, in words.
    pub(crate) levels: Vec<String>,
    /// Text encoder that phrases need, by its name in the list of models.
    pub(crate) encoder: Option<&'static str>,
    pub(crate) answers: &'static str,
    pub(crate) refuses: &'static str,
    /// Reason for which the values cannot be read, if they cannot.
    pub(crate) problem: Option<String>,
}

/// Describes the result that a scene was read from; `None` if it is none.
pub(crate) fn facts(scene: &Scene) -> Option<ResultFacts> {
    let method = scene.method?;
    let (levels, problem) = match read(scene, &ResultOptions::default()) {
        Ok(result) => (result.levels.iter().map(|l| format!("{}: {}", l.name, in_words(&l.values))).collect(), None),
        Err(e) => (Vec::new(), Some(e.to_string())),
    };
    let (answers, refuses) = match method.kind() {
        MethodKind::Classes => {
            ("clicks, and names: 'class 3', or those that you give", "phrases, until its classes have names")
        }
        MethodKind::Clusters => {
            ("phrases, clicks, and the names that you give", "phrases with relations, until its objects have names")
        }
        MethodKind::Affinities => ("nothing before 'fmlgs import' has found its objects", "phrases"),
        MethodKind::Embeddings if method.encoder().is_none() => {
            ("nothing: the text encoder of its embeddings is not in the list of models", "phrases, clicks and names")
        }
        MethodKind::Embeddings => ("phrases ('fmlgs query')", "clicks and names: it has no objects"),
    };
    Some(ResultFacts { method: method.name(), levels, encoder: method.encoder(), answers, refuses, problem })
}

fn in_words(values: &LevelValues) -> String {
    match values {
        LevelValues::Embedded(EmbeddedLevel { codes, decoder, .. }) => {
            let (own, full) = (codes.dim(), decoder.outputs());
            match codes {
                LevelCodes::Sparse(rows) => {
                    format!("{} of {own} entries of a codebook, embeddings of {full} numbers", rows.kept())
                }
                LevelCodes::Product(_) => format!("entries of codebooks, embeddings of {full} numbers"),
                LevelCodes::Dense(_) if own == full => format!("embeddings of {full} numbers"),
                LevelCodes::Dense(_) => format!("codes of {own} numbers, embeddings of {full}"),
            }
        }
        LevelValues::Classes { features, classifier } => {
            format!("features of {} numbers, {} classes", features.dim(), classifier.bias.len())
        }
        LevelValues::Clusters(clusters) => {
            let (count, dim) = (clusters.count(), clusters.features.dim());
            match &clusters.several {
                None => format!("{count} clusters, embeddings of {dim} numbers"),
                Some(several) => format!("{count} clusters, {} embeddings each of {dim} numbers", several.each),
            }
        }
        LevelValues::Affinity { features, gate } => {
            let with = if gate.is_some() { ", weighed by a scale" } else { "" };
            format!("features of {} numbers{with}", features.dim())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::{expected, sample, samples};
    use crate::jobs::{export, open as opening};

    /// Vectors of the samples in place of an encoder's.
    fn given() -> PhraseVectors {
        let all: Vec<Vec<f32>> = expected("scene/texts.npy").chunks_exact(512).map(<[f32]>::to_vec).collect();
        let mut source = |phrase: &str| -> Result<Vec<f32>, ModelError> {
            let at = LERFS_PHRASES.iter().position(|c| *c == phrase).map_or(0, |c| c + 1);
            Ok(all[at].clone())
        };
        vectors(&mut source, " the kettle ").expect("encoded")
    }

    #[test]
    fn a_phrase_is_answered_by_the_vectors_that_are_given() {
        let scene = opening::scene(&samples().join("langsplat/output")).expect("opens");
        let asked = open(&scene, &ResultOptions::default()).expect("reads");
        let camera = &scene.cameras[0].camera;
        for level in 0..3 {
            let answer = ask(&asked, camera, &given(), Some(level)).expect("answered");
            let wanted = expected(&format!("langsplat/expected/relevancy_pixels_{}.npy", level + 1));
            let other = expected(&format!("langsplat/expected/relevancy_pixels_{}.npy", (level + 1) % 3 + 1));
            let apart =
                |other: &[f32]| answer.relevancy.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart(&wanted) < 1e-4 && apart(&other) > 1e-3, "level {level}, and the control: another level");
            let gaussians = expected(&format!("langsplat/expected/relevancy_gaussians_{}.npy", level + 1));
            let most = gaussians.iter().copied().fold(0.0, f32::max);
            assert!(answer.best_gaussian.is_some_and(|(_, r)| (r - most).abs() < 1e-4));
            assert!(answer.own.as_ref().is_ok_and(|own| own.rule.contains("30 px")));
        }
        let best = ask(&asked, camera, &given(), None).expect("answered");
        assert_eq!(best.level, best.common.level);
        assert_eq!(level_of(&asked.result, "2").expect("there"), level_of(&asked.result, "Medium").expect("there"));
        assert!(level_of(&asked.result, "4").expect_err("none").to_string().contains("small, medium, large"));
    }

    #[test]
    fn vectors_of_a_file_answer_like_those_of_an_encoder() {
        let known = stored_vectors(&samples().join("scene/texts.npy")).expect("five phrases");
        let given = given();
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(&known.query, &given.query) && known.canonical.len() == 4);
        assert!(known.canonical.iter().zip(&given.canonical).all(|(a, b)| near(a, b)));
        assert!(!near(&known.query, &given.canonical[0]), "the control: another row");
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a.npy");
        let refused = |shape: &[usize], values: &[f32]| {
            export::npy_blocks(&file, shape, |_| values.to_vec()).expect("written");
            stored_vectors(&file).expect_err("refused").to_string()
        };
        assert!(refused(&[3], &[1.0; 3]).contains("[3]"));
        assert!(refused(&[1, 3], &[1.0; 3]).contains("canonical"), "a phrase alone");
        let zero = refused(&[2, 2], &[1.0, 0.0, 0.0, 0.0]);
        assert!(zero.contains("row 1") && zero.contains("a.npy"), "{zero}");
        assert!(refused(&[2, 2], &[f32::NAN, 0.0, 1.0, 0.0]).contains("row 0"));
        std::fs::write(&file, "no array").expect("written");
        assert!(stored_vectors(&file).expect_err("no array").to_string().contains("npy"));
        assert!(stored_vectors(&folder.path().join("b.npy")).is_err(), "missing");
    }

    #[test]
    fn methods_without_language_and_wrong_vectors_are_refused() {
        let saga = sample("saga");
        assert!(matches!(encoded(&saga, "kettle"), Err(JobError::Foreign(ForeignError::NoLanguage("SAGA")))));
        let mut silent = sample("semantic_gaussians");
        (silent.method, silent.encoder) = (results::Method::SemanticGaussiansOpenSeg, None);
        let silent = encoded(&silent, "kettle").expect_err("no encoder").to_string();
        assert!(silent.contains("Semantic Gaussians") && silent.contains("ViT-L/14"), "{silent}");
        assert!(silent.contains("LSeg") && silent.contains("--encoder"), "{silent}");
        let mut source = |_: &str| -> Result<Vec<f32>, ModelError> { Ok(vec![1.0, 0.0]) };
        assert!(matches!(vectors(&mut source, "  "), Err(JobError::EmptyQuery)));
        let short = vectors(&mut source, "kettle").expect("two numbers");
        let scene = opening::scene(&samples().join("opengaussian")).expect("opens");
        let asked = open(&scene, &ResultOptions::default()).expect("reads");
        let refused = ask(&asked, &scene.cameras[0].camera, &short, None).expect_err("too short").to_string();
        assert!(refused.contains("2 numbers") && refused.contains("clip-vit-b16"), "{refused}");
        // The encoder that is named is the one that encodes.
        let named = ResultOptions { encoder: Some("demo".into()), ..ResultOptions::default() };
        let asked = open(&scene, &named).expect("reads");
        let by_demo = encoded(&asked.result, "kettle").expect("part of the program");
        let refused = ask(&asked, &scene.cameras[0].camera, &by_demo, None).expect_err("narrower").to_string();
        assert!(["demo", "128 numbers", "512", "--encoder"].iter().all(|word| refused.contains(word)), "{refused}");
    }

    #[test]
    fn facts_say_what_a_result_has_and_why_it_cannot_be_read() {
        let of = |path: &str| facts(&opening::scene(&samples().join(path)).expect(path));
        let found = of("langsplat_v2/output").expect("a result");
        assert_eq!((found.method, found.levels.len(), found.encoder), ("LangSplatV2", 3, Some("clip-vit-b16")));
        assert_eq!(found.levels[0], "small: 4 of 6 entries of a codebook, embeddings of 512 numbers");
        let grouping = of("gaussian_grouping").expect("a result");
        assert_eq!(
            (grouping.levels, grouping.encoder),
            (vec!["classes: features of 16 numbers, 256 classes".into()], None)
        );
        let laga = of("laga").expect("a result");
        assert_eq!(laga.levels[2], "large: 2 clusters, 2 embeddings each of 512 numbers");
        let gags = of("gags").expect("a result");
        assert_eq!(gags.levels, ["features: codes of 16 numbers, embeddings of 512"]);
        assert_eq!(of("mip_splatting"), None, "the control");
    }
}
