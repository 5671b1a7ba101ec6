//! Answers from the samples of other methods, compared with a plain reference (`tools/results/reference.py`).

use std::sync::Arc;

use super::asked::{ForeignScene, ForeignView};
use super::blend::{BlendedCodes, blend_level};
use super::click::ClickedFeature;
use super::own_rules::{ForeignMask, fair_mask};
use super::pointed::PointedPixel;
use super::*;
use crate::io::results::tests::{expected, sample, with_class_names};
use crate::io::results::{LevelValues, MethodResult, ResultOptions, open_result};
use crate::render::Renderer;

/// Largest difference from the reference.
pub(super) const TOLERANCE: f32 = 1e-4;

/// Largest difference of numbers.
pub(super) fn apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// The phrase of the samples, and its canonicals.
pub(super) struct Texts(Vec<Vec<f32>>);

impl Texts {
    fn of(path: &str, dim: usize) -> Self {
        Self(expected(path).chunks_exact(dim).map(<[f32]>::to_vec).collect())
    }

    pub(super) fn new() -> Self {
        Self::of("scene/texts.npy", 512)
    }

    pub(super) fn phrase(&self) -> ForeignPhrase<'_> {
        ForeignPhrase { query: &self.0[0], canonical: &self.0[1..], temperature: 10.0 }
    }

    pub(super) fn all(&self) -> Vec<&[f32]> {
        self.0.iter().map(Vec::as_slice).collect()
    }
}

/// A sample with a view of its first camera.
pub(super) struct Seen {
    pub(super) scene: ForeignScene,
    pub(super) view: ForeignView,
    renderer: Renderer,
}

impl Seen {
    pub(super) fn new(path: &str) -> Self {
        // LUDVIG and splat-distiller leave no cameras: those of another sample are the same.
        let camera = sample("gaussian_grouping").cameras[0].camera.clone();
        Self::of(sample(path), &camera)
    }

    pub(super) fn of(result: MethodResult, camera: &crate::scene::Camera) -> Self {
        let scene = ForeignScene::new(Arc::new(result));
        let mut renderer = Renderer::new();
        let view = scene.look(&mut renderer, camera).expect("drawn");
        Self { scene, view, renderer }
    }

    fn relevancy(&mut self, level: usize, phrase: ForeignPhrase<'_>) -> Vec<f32> {
        self.scene.pixel_relevancy(&mut self.renderer, &self.view, level, phrase).expect("answered")
    }

    /// The masks by the method's own rule and by the common one.
    pub(super) fn masks(&mut self, phrase: ForeignPhrase<'_>) -> (Result<ForeignMask, ForeignError>, ForeignMask) {
        let found = self.scene.relevancy(&mut self.renderer, &self.view, phrase).expect("answered");
        let own = self.scene.own_mask(&mut self.renderer, &self.view, phrase, &found);
        (own, fair_mask(&self.view, &found).expect("a level"))
    }

    /// Blended numbers of a level, drawn anew.
    fn blend(&mut self, level: usize) -> BlendedCodes {
        let of = &self.scene.result.levels[level];
        let LevelValues::Embedded(embedded) = &of.values else { panic!("no embeddings") };
        blend_level(&mut self.renderer, &of.cloud, embedded, &self.view.camera).expect("drawn")
    }
}

/// Blended numbers, pixel after pixel.
pub(super) fn interleaved(blended: &BlendedCodes) -> Vec<f32> {
    (0..blended.alpha.len()).flat_map(|i| blended.planes.iter().map(move |plane| plane[i])).collect()
}

/// Compares relevancy of Gaussians and pixels of a level with the reference; returns the largest difference.
pub(super) fn relevancy_apart(seen: &mut Seen, level: usize, folder: &str, suffix: &str, texts: &Texts) -> f32 {
    let gaussians = seen.scene.gaussian_relevancy(level, texts.phrase()).expect("answered");
    let pixels = seen.relevancy(level, texts.phrase());
    let of = |name: &str| expected(&format!("{folder}/expected/relevancy_{name}{suffix}.npy"));
    apart(&gaussians, &of("gaussians")).max(apart(&pixels, &of("pixels")))
}

#[test]
fn levels_of_langsplat_answer_like_the_reference() {
    let texts = Texts::new();
    for (folder, place, codes) in
        [("langsplat", "langsplat/output", "codes"), ("langsplat_v2", "langsplat_v2/output", "weights")]
    {
        let mut seen = Seen::new(place);
        for level in 0..3 {
            let blended = interleaved(&seen.blend(level));
            let wanted = expected(&format!("{folder}/expected/{codes}_pixels_{}.npy", level + 1));
            assert!(apart(&blended, &wanted) < TOLERANCE, "{folder} {level}");
            let difference = relevancy_apart(&mut seen, level, folder, &format!("_{}", level + 1), &texts);
            assert!(difference < TOLERANCE, "{folder} {level}: {difference}");
            let other = relevancy_apart(&mut seen, level, folder, &format!("_{}", (level + 1) % 3 + 1), &texts);
            assert!(other > 10.0 * TOLERANCE, "the control, a level exchanged: {other}");
        }
    }
}

#[test]
fn packed_weights_answer_like_the_blended_ones_of_the_sample() {
    use super::asked::LevelView;
    use super::blend::BlendedCosines;
    use super::cosines::CosineHead;
    use super::packed::PackedWeights;
    use super::pieces::relevancy;
    let texts = Texts::new();
    let mut seen = Seen::new("langsplat_v2/output");
    for level in 0..3 {
        assert!(matches!(seen.view.levels[level], LevelView::Packed(_)));
        let mut blended = seen.blend(level);
        let LevelValues::Embedded(embedded) = &seen.scene.result.levels[level].values else { panic!("no embeddings") };
        let head = CosineHead::new(&embedded.decoder);
        let directions = head.directions(&texts.all());
        let plain = relevancy(&BlendedCosines::new(&head, &blended, directions.clone()), 10.0);
        let found =
            seen.scene.pixel_relevancy(&mut seen.renderer, &seen.view, level, texts.phrase()).expect("answered");
        let difference = apart(&found, &plain);
        assert!(difference < 5e-5, "{level}: {difference}");
        blended.planes.rotate_left(1);
        let turned = PackedWeights::new(&head, &blended);
        let turned = relevancy(&turned.compared(&directions), 10.0);
        let difference = apart(&turned, &plain);
        assert!(difference > 10.0 * TOLERANCE, "the control, entries exchanged: {difference}");
    }
}

#[test]
fn a_layer_exchanged_or_a_codebook_turned_is_noticed() {
    use crate::io::results::{Decoder, DecoderStep, LinearLayer};
    let texts = Texts::new();
    let path = std::path::Path::new("x");
    // Two layers of LangSplat's decoder change places.
    let mut result = sample("langsplat/output");
    let LevelValues::Embedded(level) = &mut result.levels[0].values else { panic!("no embeddings") };
    let (before, last) = level.decoder.split();
    let mut steps = before.to_vec();
    steps.swap(2, 4);
    steps.push(DecoderStep::Linear(last.expect("a layer").clone()));
    level.decoder = Decoder::new(3, steps, path).expect("fits");
    let camera = result.cameras[0].camera.clone();
    let difference = relevancy_apart(&mut Seen::of(result, &camera), 0, "langsplat", "_1", &texts);
    assert!(difference > 10.0 * TOLERANCE, "{difference}");
    // LangSplatV2's codebook is read column by column.
    let mut result = sample("langsplat_v2/output");
    let LevelValues::Embedded(level) = &mut result.levels[0].values else { panic!("no embeddings") };
    let book = expected("langsplat_v2/expected/codebook_1.npy");
    let turned: Vec<f32> = (0..6 * 512).map(|i| book[i % 512 * 6 + i / 512]).collect();
    let turned = LinearLayer::of_codebook([6, 512], &turned, path).expect("fits");
    level.decoder = Decoder::new(6, vec![DecoderStep::Linear(turned)], path).expect("fits");
    let difference = relevancy_apart(&mut Seen::of(result, &camera), 0, "langsplat_v2", "_1", &texts);
    assert!(difference > 10.0 * TOLERANCE, "{difference}");
}

#[test]
fn embeddings_of_gaussians_answer_like_the_reference() {
    let texts = Texts::new();
    for (folder, place, levels) in [
        ("occams_lgs", "occams_lgs", 3),
        ("ludvig", "ludvig", 1),
        ("legaussians", "legaussians/output", 1),
        ("splat_distiller", "splat_distiller", 1),
        ("gags", "gags", 1),
        ("semantic_gaussians", "semantic_gaussians", 1),
    ] {
        let mut seen = Seen::new(place);
        for level in 0..levels {
            let suffix = if levels > 1 { format!("_{}", level + 1) } else { String::new() };
            let difference = relevancy_apart(&mut seen, level, folder, &suffix, &texts);
            // These were stored in full, and are kept in half the memory.
            let most = if ["occams_lgs", "splat_distiller"].contains(&folder) { 1e-3 } else { TOLERANCE };
            assert!(difference < most, "{folder} {level}: {difference}");
        }
    }
    let own = Texts::of("dr_splat/expected/texts.npy", 24);
    let difference = relevancy_apart(&mut Seen::new("dr_splat"), 0, "dr_splat", "", &own);
    assert!(difference < TOLERANCE, "{difference}");
    let mut seen = Seen::new("legaussians/output");
    let hot = ForeignPhrase { temperature: 100.0, ..texts.phrase() };
    let wanted = expected("legaussians/expected/relevancy_pixels_temperature_100.npy");
    assert!(apart(&seen.relevancy(0, hot), &wanted) < 10.0 * TOLERANCE);
    assert!(apart(&seen.relevancy(0, texts.phrase()), &wanted) > 0.01, "the control: another temperature");
}

#[test]
fn features_of_lseg_are_compared_like_the_reference() {
    let texts = Texts::new();
    for (place, prefix) in [("lseg", ""), ("lseg_speedup", "speedup_")] {
        let mut seen = Seen::new(&format!("feature_3dgs/{place}"));
        let all = texts.all();
        let rows = |planes: Vec<Vec<f32>>| -> Vec<f32> {
            (0..planes[0].len()).flat_map(|i| planes.iter().map(move |p| p[i]).collect::<Vec<_>>()).collect()
        };
        let wanted = |name: &str| expected(&format!("feature_3dgs/expected/{prefix}cosines_{name}.npy"));
        let gaussians = rows(seen.scene.gaussian_cosines(0, &all).expect("answered"));
        assert!(apart(&gaussians, &wanted("gaussians")) < TOLERANCE, "{place}");
        let pixels = rows(seen.scene.pixel_cosines(&mut seen.renderer, &seen.view, 0, &all).expect("answered"));
        let alpha = expected("scene/alpha_0.npy");
        // Where nothing is, the decoder's bias has a direction.
        let there = |i: usize| seen.view.blended(0).is_none() || alpha[i / 5] > 0.0;
        let kept =
            |v: Vec<f32>| v.into_iter().enumerate().filter(|(i, _)| there(*i)).map(|(_, v)| v).collect::<Vec<_>>();
        assert!(apart(&kept(pixels), &kept(wanted("pixels"))) < TOLERANCE, "{place}");
    }
}

#[test]
fn classes_of_gaussian_grouping_are_those_of_its_classifier() {
    let seen = Seen::new("gaussian_grouping");
    let LevelValues::Classes { features, classifier } = &seen.scene.result.levels[0].values else {
        panic!("no classes")
    };
    let blended = seen.view.blended(0).expect("blended");
    let at = |name: &str| expected(&format!("gaussian_grouping/expected/{name}.npy"));
    assert!(apart(&interleaved(blended), &at("features_pixels")) < TOLERANCE);
    let numbers = |v: Vec<u32>| v.into_iter().map(|c| c as f32).collect::<Vec<f32>>();
    let found = classes::of_gaussians(classifier, features);
    assert_eq!(numbers(found.iter().map(|f| f.class).collect()), at("classes_gaussians"));
    assert_eq!(numbers(classes::of_pixels(classifier, blended)), at("classes_pixels"));
    let share = classes::share_of_gaussians(classifier, features, 7);
    assert!(apart(&share, &at("probability_of_class_7_gaussians")) < TOLERANCE);
    let pixels = classes::share_at_pixels(classifier, blended, 7);
    assert!(apart(&pixels, &at("probability_of_class_7_pixels")) < TOLERANCE);
    let other = classes::share_at_pixels(classifier, blended, 3);
    assert!(apart(&other, &at("probability_of_class_7_pixels")) > 0.1, "the control: another class");
    let texts = Texts::new();
    let e = seen.scene.gaussian_relevancy(0, texts.phrase()).expect_err("no language").to_string();
    assert!(e.contains("Gaussian Grouping"), "{e}");
}

#[test]
fn a_name_of_a_class_is_answered_by_the_class() {
    let folder = tempfile::tempdir().expect("folder");
    let path = with_class_names(folder.path(), "7 kettle\n3 mug\n");
    let result = open_result(&path, &ResultOptions::default()).expect("opens");
    let camera = result.cameras[0].camera.clone();
    let seen = Seen::of(result, &camera);
    assert!(seen.scene.has_named_classes() && !Seen::new("gaussian_grouping").scene.has_named_classes());
    let alpha = &seen.view.blended(0).expect("blended").alpha;
    let mut wanted = expected("gaussian_grouping/expected/probability_of_class_7_pixels.npy");
    wanted.iter_mut().zip(alpha).filter(|(_, a)| **a == 0.0).for_each(|(w, _)| *w = 0.0);
    let share = |name: &str| seen.scene.share_of_name(&seen.view, name);
    assert!(apart(&share("the kettle").expect("a class"), &wanted) < TOLERANCE);
    assert!(apart(&share("mug").expect("a class"), &wanted) > 0.1, "the control: another class");
    let mask = seen.scene.mask_of_name(&seen.view, "kettle").expect("a class");
    // A share within the tolerance of the threshold may fall on either side.
    let sure = |w: f32| (w - 0.2).abs() > TOLERANCE;
    assert!((0..wanted.len()).filter(|i| sure(wanted[*i])).all(|i| mask.mask.contains(i) == (wanted[i] > 0.2)));
    assert!(mask.peak.is_some_and(|at| mask.mask.contains(at)));
    let e = share("lid").expect_err("no class").to_string();
    assert!(e.contains("'lid'") && e.contains("class_names.txt"), "{e}");
    let map = identities::semantic_map(&seen.scene.result, identities::USUAL_SCALE).expect("classes");
    let names: Vec<String> = map.identities.iter().map(|(id, _)| map.identities.name(id)).collect();
    assert_eq!(names, ["mug", "kettle", "class 200"]);
}

#[test]
fn a_click_in_saga_scores_like_the_reference() {
    let seen = Seen::new("saga");
    let LevelValues::Affinity { features, gate } = &seen.scene.result.levels[0].values else { panic!("no affinities") };
    let blended = seen.view.blended(0).expect("blended");
    let at: Vec<f32> = blended.planes.iter().map(|plane| plane[6 * 24 + 7]).collect();
    assert!(apart(&at, &expected("saga/expected/feature_of_pixel.npy")) < TOLERANCE);
    let wanted = expected("saga/expected/click_scores.npy");
    let clicked = ClickedFeature::at(blended, 7, 6, gate.as_ref(), 0.5).expect("something is there");
    assert!(apart(&clicked.gaussians(features), &wanted) < TOLERANCE);
    assert!(clicked.pixels(blended)[6 * 24 + 7] > 1.0 - TOLERANCE, "the pixel itself");
    let larger = ClickedFeature::at(blended, 7, 6, gate.as_ref(), 1.0).expect("something is there");
    assert!(apart(&larger.gaussians(features), &wanted) > 10.0 * TOLERANCE, "the control: another scale");
    let turned = ClickedFeature::at(blended, 6, 7, gate.as_ref(), 0.5).expect("something is there");
    assert!(apart(&turned.gaussians(features), &wanted) > 10.0 * TOLERANCE, "the control: another pixel");
    assert_eq!(ClickedFeature::at(blended, 24, 0, gate.as_ref(), 0.5), None);
}

#[test]
fn a_pixel_tells_what_it_belongs_to() {
    let pixel = |at, scale| PointedPixel { at, scale, threshold: 0.9 };
    // SAGA: what scores like the pixel.
    let saga = Seen::new("saga");
    let mask = |scale| saga.scene.pointed(&saga.view, pixel([7, 6], scale)).expect("affinities").expect("something");
    let found = mask(0.5);
    assert!(found.mask.contains(6 * 24 + 7) && found.values[6 * 24 + 7] > 1.0 - TOLERANCE);
    assert!((0..found.values.len()).all(|i| found.mask.contains(i) == (found.values[i] >= 0.9)));
    assert_ne!(found.values, mask(1.0).values, "the control: another scale");
    assert_eq!(saga.scene.pointed(&saga.view, pixel([24, 0], 0.5)).expect("affinities"), None, "outside of the view");
    // Gaussian Grouping: the pixels of its class.
    let grouping = Seen::new("gaussian_grouping");
    let classes = expected("gaussian_grouping/expected/classes_pixels.npy");
    let i = classes.iter().position(|c| *c == 7.0).expect("seen");
    let found = grouping.scene.pointed(&grouping.view, pixel([i % 24, i / 24], 0.5)).expect("classes").expect("one");
    assert!((0..classes.len()).all(|k| found.mask.contains(k) == (classes[k] == 7.0)));
    let nothing = classes.iter().position(|c| *c == 0.0).expect("background");
    assert_eq!(
        grouping.scene.pointed(&grouping.view, pixel([nothing % 24, nothing / 24], 0.5)).expect("classes"),
        None
    );
    // THGS: levels by scale; embeddings alone tell nothing.
    let thgs = Seen::new("thgs");
    let at = |place, scale| thgs.scene.pointed(&thgs.view, pixel(place, scale)).expect("clusters").map(|f| f.level);
    let (w, h) = thgs.view.size();
    let levels = (0..w * h).map(|i| [0.0, 1.0].map(|scale| at([i % w, i / w], scale)));
    let both: Vec<[Option<usize>; 2]> = levels.collect();
    assert!(both.contains(&[Some(0), Some(2)]) && both.contains(&[None, None]));
    assert!(both.iter().all(|[fine, coarse]| fine.is_none_or(|k| k == 0) && coarse.is_none_or(|k| k == 2)));
    let embeddings = Seen::new("langsplat/output");
    let none = embeddings.scene.pointed(&embeddings.view, pixel([12, 9], 0.5));
    assert!(matches!(none, Err(ForeignError::NoIdentities("LangSplat"))));
}

#[test]
fn clusters_of_open_gaussian_answer_like_the_reference() {
    let texts = Texts::new();
    let mut seen = Seen::new("opengaussian");
    let LevelValues::Clusters(clusters) = &seen.scene.result.levels[0].values else { panic!("no clusters") };
    let relevancy = seen.scene.cluster_relevancy(clusters, texts.phrase()).expect("answered");
    assert!(apart(&relevancy, &expected("opengaussian/expected/relevancy_leaves.npy")) < TOLERANCE);
    let (own, fair) = seen.masks(texts.phrase());
    let own = own.expect("a rule");
    let wanted = expected("opengaussian/expected/silhouette_pixels.npy");
    let inside: Vec<usize> = (0..wanted.len()).filter(|i| wanted[*i] > 0.7).collect();
    assert_eq!(own.mask.pixels().collect::<Vec<_>>(), inside);
    assert!(!inside.is_empty());
    // The best cluster alone covers less.
    assert!(!fair.mask.is_empty() && fair.rule != own.rule);
}

#[test]
fn segments_of_thgs_answer_like_the_reference() {
    let texts = Texts::new();
    let mut seen = Seen::new("thgs");
    for level in 0..3 {
        let LevelValues::Clusters(clusters) = &seen.scene.result.levels[level].values else { panic!("no clusters") };
        let relevancy = seen.scene.cluster_relevancy(clusters, texts.phrase()).expect("answered");
        let wanted = expected(&format!("thgs/expected/relevancy_segments_{}.npy", level + 1));
        assert!(apart(&relevancy, &wanted) < TOLERANCE, "{level}");
    }
    let wanted = expected("thgs/expected/member_of_three_best.npy");
    let members = |levels| -> Vec<f32> {
        seen.scene.members(texts.phrase().query, levels).into_iter().map(|m| f32::from(u8::from(m))).collect()
    };
    assert_eq!(members(1..3), wanted);
    assert_ne!(members(2..3), wanted, "the control: the coarse level alone");
    assert!(!seen.masks(texts.phrase()).0.expect("a rule").mask.is_empty());
}

#[test]
fn every_language_has_a_mask_by_its_own_rule_and_by_the_common_one() {
    let texts = Texts::new();
    for place in [
        "langsplat/output",
        "langsplat_v2/output",
        "occams_lgs",
        "feature_3dgs/lseg_speedup",
        "legaussians/output",
        "gags",
        "laga",
    ] {
        let mut seen = Seen::new(place);
        let (own, fair) = seen.masks(texts.phrase());
        let own = own.expect(place);
        assert!(!fair.mask.is_empty() && fair.rule != own.rule, "{place}");
        // In a picture of this size, what LangSplat finds is a speck, which its rule takes away.
        assert_eq!(own.mask.is_empty(), place == "langsplat/output", "{place}");
    }
    let mut seen = Seen::new("ludvig");
    let (none, _) = seen.masks(texts.phrase());
    assert!(matches!(none, Err(ForeignError::NoRule("LUDVIG"))));
    let short = ForeignPhrase { query: &[1.0; 24], canonical: &[], temperature: 10.0 };
    let e = seen.scene.gaussian_relevancy(0, short).expect_err("another length").to_string();
    assert!(e.contains("24") && e.contains("512") && e.contains("clip-vit-b16"), "{e}");
}
