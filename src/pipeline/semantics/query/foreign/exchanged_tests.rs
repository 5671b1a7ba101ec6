//! Answers of GAGS, LaGa and Semantic Gaussians, and what they are if skips, weights or rows are exchanged.

use std::sync::Arc;

use super::ForeignError;
use super::asked::ForeignScene;
use super::tests::{Seen, TOLERANCE, Texts, apart, interleaved, relevancy_apart};
use crate::io::results::tests::{expected, sample};
use crate::io::results::{Decoder, DecoderStep, FeatureRows, LevelCodes, LevelValues};

#[test]
fn a_decoder_without_what_skips_its_layers_is_noticed() {
    let texts = Texts::new();
    let blended = interleaved(Seen::new("gags").view.blended(0).expect("blended"));
    assert!(apart(&blended, &expected("gags/expected/codes_pixels.npy")) < TOLERANCE);
    let mut result = sample("gags");
    let camera = result.cameras[0].camera.clone();
    let LevelValues::Embedded(level) = &mut result.levels[0].values else { panic!("no embeddings") };
    let (before, last) = level.decoder.split();
    let mut steps = before.to_vec();
    steps.retain(|step| !matches!(step, DecoderStep::Keep | DecoderStep::AddKept));
    steps.push(DecoderStep::Linear(last.expect("a layer").clone()));
    level.decoder = Decoder::new(16, steps, std::path::Path::new("x")).expect("fits");
    let difference = relevancy_apart(&mut Seen::of(result, &camera), 0, "gags", "", &texts);
    assert!(difference > 10.0 * TOLERANCE, "{difference}");
}

#[test]
fn descriptors_of_laga_answer_like_the_reference() {
    let texts = Texts::new();
    let mut seen = Seen::new("laga");
    let at = |name: &str| expected(&format!("laga/expected/{name}.npy"));
    for level in 0..3 {
        let found = seen.scene.gaussian_relevancy(level, texts.phrase()).expect("answered");
        let of = |level: usize| at(&format!("relevancy_gaussians_{}", level + 1));
        assert!(apart(&found, &of(level)) < TOLERANCE, "{level}");
        assert!(apart(&found, &of((level + 1) % 3)) > 10.0 * TOLERANCE, "the control: another level");
    }
    let parts = |scene: &ForeignScene| -> (Vec<f32>, Vec<f32>) {
        let answers = scene.descriptor_answers(texts.phrase()).expect("answered");
        answers.into_iter().map(|answer| (answer.relevancy, answer.cosine)).unzip()
    };
    let (relevancy, cosines) = parts(&seen.scene);
    assert!(apart(&relevancy, &at("relevancy_gaussians")) < TOLERANCE);
    assert!(apart(&cosines, &at("cosine_gaussians")) < TOLERANCE);
    let chosen = seen.scene.chosen_by_descriptors(texts.phrase()).expect("answered");
    let chosen: Vec<f32> = chosen.into_iter().map(|chosen| f32::from(u8::from(chosen))).collect();
    assert_eq!(chosen, at("chosen_gaussians"));
    let own = seen.masks(texts.phrase()).0.expect("a rule");
    let membership = at("membership_pixels");
    assert!(apart(&own.values, &membership) < TOLERANCE);
    let inside: Vec<usize> = (0..membership.len()).filter(|i| membership[*i] > 0.5).collect();
    assert_eq!(own.mask.pixels().collect::<Vec<_>>(), inside);
    assert!(!inside.is_empty());
    // The weights of a level in another order.
    let mut result = sample("laga");
    let LevelValues::Clusters(clusters) = &mut result.levels[0].values else { panic!("no clusters") };
    clusters.several.as_mut().expect("several").weights.reverse();
    let (turned, _) = parts(&ForeignScene::new(Arc::new(result)));
    assert!(apart(&turned, &at("relevancy_gaussians")) > 10.0 * TOLERANCE, "the control: weights exchanged");
}

#[test]
fn rows_of_semantic_gaussians_that_are_exchanged_are_noticed() {
    let (texts, mut result) = (Texts::new(), sample("semantic_gaussians"));
    let camera = result.cameras[0].camera.clone();
    let mut seen = Seen::of(sample("semantic_gaussians"), &camera);
    let found = seen.scene.gaussian_cosines(0, &texts.all()).expect("answered");
    let rows: Vec<f32> = (0..32).flat_map(|i| found.iter().map(move |of| of[i]).collect::<Vec<_>>()).collect();
    assert!(apart(&rows, &expected("semantic_gaussians/expected/cosines_gaussians.npy")) < TOLERANCE);
    let (none, _) = seen.masks(texts.phrase());
    assert!(matches!(none, Err(ForeignError::NoRule("Semantic Gaussians"))));
    // Each Gaussian gets the row of the one before.
    let LevelValues::Embedded(level) = &mut result.levels[0].values else { panic!("no embeddings") };
    let LevelCodes::Dense(codes) = &level.codes else { panic!("no rows") };
    let turned = (0..32).flat_map(|i| codes.row((i + 31) % 32)).collect();
    level.codes = LevelCodes::Dense(FeatureRows::new(512, turned).expect("whole rows"));
    let difference = relevancy_apart(&mut Seen::of(result, &camera), 0, "semantic_gaussians", "", &texts);
    assert!(difference > 10.0 * TOLERANCE, "{difference}");
}
