//! Time of a typed query, stage by stage, on a made-up view with many identities.

use std::time::Instant;

use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{StageSample, StageValues};
use crate::math::vector::unit;
use crate::models::{Encoder, ModelError};
use crate::pipeline::semantics::lifting::codes::{self, TOLERANCE};
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::matching;
use crate::pipeline::semantics::query::query_engine::ask_by_embedding;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::query::timing::{STAGES, StagesMs, ms_since};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::language::MAX_VIEWS;
use crate::scene::{Identities, IdentityId, LanguageFeatures, Level, NO_IDENTITY, ViewFeatures};

const COLORS: [&str; 6] = ["red", "blue", "green", "yellow", "white", "black"];
const THINGS: [&str; 8] = ["controller", "mug", "kettle", "lamp", "camera", "book", "car", "jar"];
const PARTS: [&str; 6] = ["button", "handle", "lid", "shade", "lens", "wheel"];

/// Asks `queries` questions of a view of `size` px with `identities` objects and parts. Every text is
/// another one, so none is encoded already. The heat map is drawn.
pub(crate) fn time(
    encoder: &mut dyn Encoder,
    identities: usize,
    size: [usize; 2],
    queries: usize,
) -> Result<Vec<StageSample>, ModelError> {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let all = scene(identities);
    let features = features(&mut rng, &all, encoder);
    let map = view(&mut rng, identities, size);
    let [w, h] = size;
    let mut values = StageValues::new(format!("{identities} identities, {w}x{h}, encoder '{}'", encoder.name()));
    // Canonical phrases are encoded when a scene opens, once.
    let mut canonical = TextEmbeddings::default();
    let recipe = QueryConfig::default();
    canonical.learn_canonical(&recipe, encoder);
    for _ in 0..queries {
        let word = |list: &[&str], rng: &mut Pcg64Mcg| list.choose(rng).copied().unwrap_or("mug").to_owned();
        let (color, thing) = (word(&COLORS, &mut rng), word(&THINGS, &mut rng));
        let text = match rng.random_bool(0.5) {
            true => format!("the {} of the {color} {thing}", word(&PARTS, &mut rng)),
            false => format!("a {color} {thing}"),
        };
        let mut phrases = canonical.clone();
        let how = (&features, &recipe);
        let Some(answered) = ask_by_embedding(&all, how, &text, &mut phrases, encoder)? else { continue };
        let target = answered.answer.hits().first().map_or(NO_IDENTITY, |h| h.identity);
        let start = Instant::now();
        let pixels = matching::exact(&map, &all, target, TOLERANCE);
        let mask = ms_since(start);
        let start = Instant::now();
        let heat = answered.heat(&map);
        let draw = ms_since(start);
        std::hint::black_box((pixels, heat));
        let stages = StagesMs { mask, draw, ..answered.stages };
        values.add("query", "ms", [stages.whole()]);
        values.add("query: without encoding", "ms", [stages.whole() - stages.encode]);
        for (name, ms) in STAGES.into_iter().zip(stages.values()) {
            values.add(&format!("query: {name}"), "ms", [ms]);
        }
    }
    Ok(values.samples())
}

fn scene(identities: usize) -> Identities {
    let mut all = Identities::default();
    let mut object = NO_IDENTITY;
    for i in 0..identities {
        if i % 5 == 0 {
            object = all.add(Level::Object, NO_IDENTITY, Vec::new());
        } else {
            all.add(Level::Part, object, Vec::new());
        }
    }
    codes::assign(&mut all, &[]);
    all
}

fn features(rng: &mut Pcg64Mcg, all: &Identities, encoder: &dyn Encoder) -> LanguageFeatures {
    let dimension = encoder.dimension();
    let mut vector = || {
        let v: Vec<f32> = (0..dimension).map(|_| rng.random_range(-1.0..1.0)).collect();
        unit(&v).unwrap_or(v)
    };
    let mut views = || (0..MAX_VIEWS).map(|_| vector()).collect::<Vec<_>>();
    let of = (0..all.len()).map(|_| ViewFeatures { raw: views(), deviated: views() }).collect();
    LanguageFeatures { encoder: encoder.name().into(), dimension, by_identity: of }
}

/// A view whose pixels belong to the nearest of scattered points, one per identity.
fn view(rng: &mut Pcg64Mcg, identities: usize, [w, h]: [usize; 2]) -> ViewMap {
    let points: Vec<[i64; 2]> =
        (0..identities).map(|_| [rng.random_range(0..w as i64), rng.random_range(0..h as i64)]).collect();
    let nearest = |i: usize| -> IdentityId {
        let (x, y) = ((i % w) as i64, (i / w) as i64);
        let far = |k: &usize| (points[*k][0] - x).pow(2) + (points[*k][1] - y).pow(2);
        (0..points.len()).min_by_key(far).map_or(NO_IDENTITY, |k| k as IdentityId + 1)
    };
    ViewMap::certain(w, (0..w * h).map(nearest).collect())
}
