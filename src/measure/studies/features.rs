//! Ways of giving Gaussians their identities, compared with each other: the program's own, with more or fewer photos
//! and without each of its steps; votes alone, in one pass; and codes trained by gradients, from scratch or from the
//! votes.

use std::collections::BTreeMap;
use std::time::Instant;

use serde_json::{Value, json};

use super::{StudyInput, Variants, overlap};
use crate::math::stats::mean;
use crate::measure::sweep::failed;
use crate::measure::{Rule, Stage, StageName, Study, StudyError, Trial};
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::lifting::codes::{self, TOLERANCE};
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::pipeline::semantics::lifting::train_codes::{CodeTraining, CodeView, decode, train_codes};
use crate::pipeline::semantics::lifting::votes::{UNKNOWN, Votes};
use crate::pipeline::semantics::query::matching;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{GaussianCloud, Identities, IdentityId, Level, Mask, NO_IDENTITY};

struct Variant {
    /// Options of tracking as the program does it; `None` for votes alone.
    track: Option<TrackOptions>,
    /// Views that vote; none vote for nothing.
    views: usize,
    /// Steps of gradients after that.
    steps: u64,
    /// True if an answer is blended codes within the tolerance of the target's, not the identity of largest weight.
    blend: bool,
}

/// Finds the identity of every Gaussian as the program does; `None` if it was stopped.
pub(crate) type Tracking<'a> =
    Box<dyn Fn(&TrackOptions, &mut dyn Observer) -> Result<Option<Vec<IdentityId>>, StudyError> + 'a>;

/// The sweep of the features of the trained Gaussians `cloud`, whose labeled views `training` are learned from and
/// `held_out` compared with. Gradients are given these numbers of `steps`.
pub(crate) fn study<'a>(
    drawn: (&'a GaussianCloud, &'a RenderSettings),
    mut identities: Identities,
    (tracking, [training, held_out]): (Tracking<'a>, [Vec<CodeView>; 2]),
    steps: &[u64],
    repeats: u32,
    input: StudyInput,
) -> Result<Study<'a>, DrawError> {
    let voted = vote(drawn, &identities, &training)?;
    // Codes are chosen once it is known who is next to whom.
    let centers = codes::centers(drawn.0, &voted, &identities);
    codes::assign(&mut identities, &centers);
    let measures = vec![
        overlap("mIoU", "mean overlap of every identity's mask in the held-out photos with its label"),
        overlap("object mIoU", "the same of objects"),
        overlap("part mIoU", "the same of parts"),
    ];
    let rule = Rule::new("mIoU", 1.02, 0.0, 0.0);
    let words = ["the whole lifting", "masks in held-out photos are compared with their labels"];
    let stage = Stage::new(StageName::Features, words, (input, repeats), rule, measures);
    Ok(Study::new(stage, variants(training.len(), steps).0, move |variant: &Variant, seed, observer| {
        let start = Instant::now();
        // Views spread over all of them, not the first ones.
        let voting = super::views::spread(&training, variant.views);
        let mut of = match &variant.track {
            Some(options) => match tracking(options, observer)? {
                Some(of) => of,
                None => return Ok(None),
            },
            None if variant.views == 0 => vec![NO_IDENTITY; drawn.0.len()],
            None => vote(drawn, &identities, &voting).map_err(failed)?,
        };
        let by_id: Vec<_> = (0..=identities.len() as IdentityId).map(|id| identities.codes(id)).collect();
        let mut codes: Vec<[f32; CODE_CHANNELS]> = of.iter().map(|id| by_id[*id as usize]).collect();
        if variant.steps > 0 {
            let steps = CodeTraining { steps: variant.steps, seed };
            train_codes(drawn.0, &mut codes, &training, &identities, drawn.1, steps, observer).map_err(failed)?;
            if observer.proceed().is_err() {
                return Ok(None);
            }
            of = decode(&codes, &identities);
        }
        let secs = start.elapsed().as_secs_f64();
        let codes = variant.blend.then_some(&*codes);
        let values = score(drawn, &identities, &held_out, &of, codes).map_err(failed)?;
        Ok(Some(Trial { secs, values, curve: Vec::new() }))
    }))
}

/// Mean IoU of the masks of all identities in the held-out views, by level; of blended codes where they are given.
fn score(
    (cloud, settings): (&GaussianCloud, &RenderSettings),
    all: &Identities,
    views: &[CodeView],
    of: &[IdentityId],
    codes: Option<&[[f32; CODE_CHANNELS]]>,
) -> Result<Vec<(&'static str, f64)>, DrawError> {
    let mut renderer = Renderer::new();
    let mut ious: BTreeMap<Level, Vec<f64>> = BTreeMap::new();
    for CodeView { camera, labels } in views {
        let (w, h) = (camera.width_px as usize, camera.height_px as usize);
        let find: Box<dyn Fn(IdentityId) -> Mask + '_> = match codes {
            None => {
                let map = ViewMap::render(&mut renderer, cloud, of, all, camera, settings)?;
                Box::new(move |id| matching::exact(&map, all, id, TOLERANCE))
            }
            Some(codes) => {
                let map = CodeMap::render(&mut renderer, cloud, codes, true, camera, settings)?;
                Box::new(move |id| matching::blend(&map, all, id, TOLERANCE))
            }
        };
        for (id, identity) in all.iter() {
            let inside = all.descendants(id);
            let truth = Mask::from_fn(w, h, |i| inside.get(labels[i] as usize).copied().unwrap_or(false));
            if !truth.is_empty() {
                ious.entry(identity.level).or_default().push(find(id).iou(&truth));
            }
        }
    }
    let of = |level: Level| mean(ious.get(&level).map_or(&[], Vec::as_slice));
    let whole: Vec<f64> = ious.values().flatten().copied().collect();
    Ok(vec![("mIoU", mean(&whole)), ("object mIoU", of(Level::Object)), ("part mIoU", of(Level::Part))])
}

fn variants(views: usize, steps: &[u64]) -> Variants<Variant> {
    let base = TrackOptions::default();
    let tracked = |track: TrackOptions| Variant { track: Some(track), views: 0, steps: 0, blend: false };
    let mut all = Variants::new(format!("the program's own, {} photos at most", base.max_seeds), tracked(base.clone()));
    for max_seeds in [1, 2, 4] {
        let knobs = [("max_seeds", json!(max_seeds))];
        let setting = format!("{max_seeds} at most");
        all.add("labeled photos", setting, &knobs, tracked(TrackOptions { max_seeds, ..base.clone() }));
    }
    // What each step is good for shows where little is known.
    let one = TrackOptions { max_seeds: 1, ..base };
    let mut with = |what: &str, (knob, value): (&str, Value), track: TrackOptions| {
        let setting = if value == json!(false) { "without".to_owned() } else { value.to_string() };
        all.add(&format!("one photo, {what}"), setting, &[("max_seeds", json!(1)), (knob, value)], tracked(track));
    };
    with("growth in photos", ("by_photos", json!(false)), TrackOptions { by_photos: false, ..one.clone() });
    with("tree", ("by_tree", json!(false)), TrackOptions { by_tree: false, ..one.clone() });
    with("mirror images", ("by_mirror", json!(false)), TrackOptions { by_mirror: false, ..one.clone() });
    let neither = TrackOptions { by_photos: false, by_tree: false, ..one.clone() };
    with("both", ("spread", json!(false)), neither);
    for share in [0.0, 0.03, 0.3] {
        let one = TrackOptions { least_seen: share as f32, ..one.clone() };
        with("least area seen", ("least_seen", json!(share)), one);
    }
    for steps in [0.0, 40.0] {
        with(
            "steps to the hidden",
            ("hidden_steps", json!(steps)),
            TrackOptions { hidden_steps: steps, ..one.clone() },
        );
    }
    let mut add = |method: &str, setting: String, views: usize, steps: u64, blend: bool| {
        let read = if blend { "blend" } else { "exact" };
        let knobs = [("views", json!(views)), ("steps", json!(steps)), ("read", json!(read))];
        all.add(method, setting, &knobs, Variant { track: None, views, steps, blend });
    };
    add("votes alone", format!("votes of {views} views, exact"), views, 0, false);
    let mut fewer = views / 2;
    while fewer > 0 {
        add("views used", format!("votes of {fewer} views, exact"), fewer, 0, false);
        fewer /= 2;
    }
    add("decoding", format!("votes of {views} views, blended"), views, 0, true);
    for (blend, word) in [(true, "blended"), (false, "exact")] {
        for &steps in steps {
            add(&format!("gradients, {word}"), format!("{steps} steps"), 0, steps, blend);
            add(&format!("votes, then gradients, {word}"), format!("{steps} steps"), views, steps, blend);
        }
    }
    all
}

fn vote(
    (cloud, settings): (&GaussianCloud, &RenderSettings),
    identities: &Identities,
    views: &[CodeView],
) -> Result<Vec<IdentityId>, DrawError> {
    let mut renderer = Renderer::new();
    let mut votes = Votes::new(cloud.len());
    for view in views {
        votes.add_view(&mut renderer, cloud, &view.camera, settings, &view.labels)?;
    }
    let decided = votes.decide(identities, 0.0);
    Ok(decided.iter().map(|b| if b.identity == UNKNOWN { NO_IDENTITY } else { b.identity }).collect())
}
