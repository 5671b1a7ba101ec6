//! Results of LangSplatV2 and LangSplat that are made up, the same at every call: things on a floor, three levels each.

use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::results::{AskedResult, BenchPhrases, direction};
use crate::io::IoError;
use crate::io::results::{
    Decoder, DecoderStep, EmbeddedLevel, FeatureRows, LevelCodes, LevelValues, LinearLayer, Method, MethodResult,
    ResultLevel, SparseRows,
};
use crate::io::trained::SceneCamera;
use crate::math::vector::unit;
use crate::pipeline::semantics::query::recipe::LERFS_PHRASES;
use crate::scene::{Camera, GaussianCloud};

/// Things on the floor, and to a row.
const THINGS: usize = 60;
const IN_ROW: usize = 10;
/// Tiles along a side of the floor, which differ in what they are.
const TILES: usize = 4;
/// Half a side of the floor, and the radius of a thing.
const FLOOR: f32 = 12.0;
const RADIUS: f32 = 0.8;
const LEVELS: [&str; 3] = ["small", "medium", "large"];
/// Numbers of an embedding.
const DIM: usize = 512;
/// Entries of LangSplatV2's codebook, and those of them that a Gaussian keeps.
const ENTRIES: usize = 64;
const KEPT: usize = 4;
/// Entries that a thing's Gaussians mostly have. One of each Gaussian's is any of all.
const USUAL: usize = 6;
/// Numbers of LangSplat's codes, and between the layers of its decoder.
const LAYERS: [usize; 8] = [3, 16, 32, 64, 128, 256, 256, DIM];
/// Angle around the middle, distance and height of the cameras. The floor and the things fill most of their pictures.
const CAMERAS: [[f64; 3]; 3] = [[0.3, 9.0, 6.0], [2.4, 7.0, 5.0], [4.4, 10.0, 7.0]];
/// Size of these pictures in px.
const PICTURE: [u32; 2] = [1_008, 567];
/// Place of the result in errors.
const NOWHERE: &str = "made-up result";

/// Makes up a result of LangSplatV2, and phrases that are near to entries of its first codebook.
pub(crate) fn lang_splat_v2(gaussians: usize, phrases: usize) -> Result<AskedResult, IoError> {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let (cloud, groups) = scene(&mut rng, gaussians);
    // Embeddings of pictures and texts have much in common.
    let common = direction(&mut rng, DIM);
    let near = |rng: &mut Pcg64Mcg, to: &[f32], share: f32| -> Vec<f32> {
        let other = direction(rng, DIM);
        let mixed: Vec<f32> = to.iter().zip(&other).map(|(a, b)| share * a + (1.0 - share) * b).collect();
        unit(&mixed).unwrap_or(mixed)
    };
    let (mut levels, mut first) = (Vec::new(), Vec::new());
    for level in 0..LEVELS.len() {
        let book: Vec<Vec<f32>> = (0..ENTRIES).map(|_| near(&mut rng, &common, 0.4)).collect();
        let layer = LinearLayer::of_codebook([ENTRIES, DIM], &book.concat(), Path::new(NOWHERE))?;
        let decoder = Decoder::new(ENTRIES, vec![DecoderStep::Linear(layer)], Path::new(NOWHERE))?;
        let codes = LevelCodes::Sparse(weights(&mut rng, &groups, level)?);
        levels.push(EmbeddedLevel { codes, is_unit: false, decoder });
        if level == 0 {
            first = book;
        }
    }
    let queries = (0..phrases).map(|k| near(&mut rng, &first[k % ENTRIES], 0.8)).collect();
    let canonical = (0..LERFS_PHRASES.len()).map(|_| near(&mut rng, &common, 0.5)).collect();
    let result = result(Method::LangSplatV2, cloud, levels);
    Ok(AskedResult { result, phrases: BenchPhrases { queries, canonical } })
}

/// Makes up a result of LangSplat, and phrases of random directions.
pub(crate) fn lang_splat(gaussians: usize, phrases: usize) -> Result<AskedResult, IoError> {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let (cloud, groups) = scene(&mut rng, gaussians);
    let mut steps = Vec::new();
    for (inputs, outputs) in LAYERS.into_iter().zip(&LAYERS[1..]) {
        if !steps.is_empty() {
            steps.push(DecoderStep::Relu);
        }
        // Keeps the size of what goes through.
        let most = (6.0 / inputs as f32).sqrt();
        let weight = (0..inputs * outputs).map(|_| rng.random_range(-most..most)).collect();
        let bias = (0..*outputs).map(|_| rng.random_range(-0.1..0.1)).collect();
        let layer = LinearLayer::new([*outputs, inputs], weight, Some(bias), Path::new(NOWHERE))?;
        steps.push(DecoderStep::Linear(layer));
    }
    let decoder = Decoder::new(LAYERS[0], steps, Path::new(NOWHERE))?;
    let mut levels = Vec::new();
    for level in 0..LEVELS.len() {
        let code = |group: &usize| {
            let at = *group as f32 + 0.3 * level as f32;
            let noise: [f32; 3] = std::array::from_fn(|_| rng.random_range(-0.1..0.1));
            [(1.7 * at).sin() + noise[0], (2.3 * at).cos() + noise[1], (0.9 * at).sin() + noise[2]]
        };
        let codes = FeatureRows::new(LAYERS[0], groups.iter().flat_map(code).collect());
        let codes = LevelCodes::Dense(codes.ok_or_else(|| broken("codes"))?);
        levels.push(EmbeddedLevel { codes, is_unit: true, decoder: decoder.clone() });
    }
    let result = result(Method::LangSplat, cloud, levels);
    let phrases = BenchPhrases::random(&result, phrases);
    Ok(AskedResult { result, phrases })
}

fn broken(what: &str) -> IoError {
    IoError::syntax(Path::new(NOWHERE), what, "do not fill whole rows")
}

fn result(method: Method, cloud: GaussianCloud, levels: Vec<EmbeddedLevel>) -> MethodResult {
    let cloud = Arc::new(cloud);
    let level = |(name, level): (&str, EmbeddedLevel)| ResultLevel {
        name: name.into(),
        cloud: Arc::clone(&cloud),
        values: LevelValues::Embedded(level),
    };
    let levels = LEVELS.into_iter().zip(levels).map(level).collect();
    MethodResult {
        method,
        path: PathBuf::from(NOWHERE),
        encoder: method.encoder().map(str::to_owned),
        cloud: Arc::clone(&cloud),
        cameras: cameras(),
        levels,
    }
}

fn cameras() -> Vec<SceneCamera> {
    let camera = |[angle, distance, height]: [f64; 3]| {
        let eye = DVec3::new(distance * angle.cos(), -height, distance * angle.sin());
        let target = DVec3::new(0.0, -0.4, 0.0);
        let camera = Camera::look_at(eye, target, DVec3::NEG_Y, 0.8, PICTURE[0], PICTURE[1])?;
        Some(SceneCamera { name: format!("{angle}"), camera, held_out: false })
    };
    CAMERAS.into_iter().filter_map(camera).collect()
}

/// Gaussians on a floor and on things, y downwards, half of them on each; and what each belongs to: a thing, or a tile of
/// the floor.
fn scene(rng: &mut Pcg64Mcg, gaussians: usize) -> (GaussianCloud, Vec<usize>) {
    let place = |i: usize| -> ([f32; 3], usize) {
        let k = i / 2;
        if i % 2 == 0 {
            let [x, z] = [(); 2].map(|()| rng.random_range(0.0..1.0_f32));
            let tile = |at: f32| ((at * TILES as f32) as usize).min(TILES - 1);
            let group = THINGS + tile(z) * TILES + tile(x);
            return ([(2.0 * x - 1.0) * FLOOR, 0.0, (2.0 * z - 1.0) * FLOOR], group);
        }
        let thing = k % THINGS;
        let center = [(thing % IN_ROW) as f32 * 2.2 - 9.9, -RADIUS, (thing / IN_ROW) as f32 * 3.6 - 9.0];
        let (y, turn) = (rng.random_range(-1.0..1.0_f32), rng.random_range(0.0..TAU));
        let ring = (1.0 - y * y).sqrt();
        let on = [ring * turn.cos(), y, ring * turn.sin()];
        (std::array::from_fn(|c| center[c] + RADIUS * on[c]), thing)
    };
    let (positions, groups): (Vec<[f32; 3]>, Vec<usize>) = (0..gaussians).map(place).unzip();
    // Neighbors overlap.
    let area = 4.0 * FLOOR * FLOOR + THINGS as f32 * 2.0 * TAU * RADIUS * RADIUS;
    let apart = (area / gaussians.max(1) as f32).sqrt();
    let mut cloud = GaussianCloud::isotropic(positions, (0.7 * apart).ln(), 0.0);
    cloud.opacity_logits.iter_mut().for_each(|logit| *logit = rng.random_range(-1.0..4.0));
    (cloud, groups)
}

/// Weights of entries: mostly those that are usual where a Gaussian belongs, and one of all.
fn weights(rng: &mut Pcg64Mcg, groups: &[usize], level: usize) -> Result<SparseRows, IoError> {
    let mut logits: Vec<f32> = Vec::with_capacity(groups.len() * ENTRIES);
    for group in groups {
        let mut row: [f32; ENTRIES] = std::array::from_fn(|_| rng.random_range(0.0..1.0));
        for k in 0..USUAL {
            row[(group * 7 + k * (5 + 2 * level) + level * 13) % ENTRIES] += 2.0;
        }
        row[rng.random_range(0..ENTRIES)] += 2.5;
        logits.extend(row);
    }
    SparseRows::largest_shares(ENTRIES, &logits, KEPT).ok_or_else(|| broken("weights"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::query::foreign::ForeignPhrase;
    use crate::pipeline::semantics::query::foreign::asked::ForeignScene;
    use crate::pipeline::semantics::query::foreign::own_rules::fair_mask;
    use crate::pipeline::semantics::query::recipe::TEMPERATURE;
    use crate::render::Renderer;

    #[test]
    fn results_are_the_same_at_every_call() {
        for make in [lang_splat_v2, lang_splat] {
            let (a, b, other) = (make(300, 2).expect("made"), make(300, 2).expect("made"), make(301, 2).expect("made"));
            assert_eq!((a.result.levels.len(), a.result.cloud.len()), (3, 300));
            assert_eq!((&a.result.levels[2].values, &a.phrases), (&b.result.levels[2].values, &b.phrases));
            assert_ne!(a.result.levels[2].values, other.result.levels[2].values, "the control");
            assert_ne!(a.result.levels[0].values, a.result.levels[1].values);
        }
    }

    #[test]
    fn a_phrase_near_an_entry_finds_some_of_the_view() {
        let AskedResult { result, phrases } = lang_splat_v2(3_000, 3).expect("made");
        let camera = result.cameras[0].camera.limited_to(96);
        let scene = ForeignScene::new(Arc::new(result));
        let mut renderer = Renderer::new();
        let view = scene.look(&mut renderer, &camera).expect("drawn");
        let mut mask = |query: &[f32]| {
            let phrase = ForeignPhrase { query, canonical: &phrases.canonical, temperature: TEMPERATURE };
            let found = scene.relevancy(&mut renderer, &view, phrase).expect("answered");
            fair_mask(&view, &found).expect("a level").mask
        };
        let [first, second] = [mask(&phrases.queries[0]), mask(&phrases.queries[1])];
        assert!(!first.is_empty() && first.area() < 96 * 54 / 2, "{}", first.area());
        assert_ne!(first, second, "the control: another phrase");
    }
}
