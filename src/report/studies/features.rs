//! Ways of giving Gaussians their identities, against each other: votes in one pass, from more or
//! fewer photos, and codes trained by gradients, from scratch or from the votes.

use std::collections::BTreeMap;
use std::time::Instant;

use serde_json::json;

use super::{Input, Plans, overlap, stage};
use crate::math::stats::mean;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::codes::{self, TOLERANCE};
use crate::pipeline::semantics::find::centers;
use crate::pipeline::semantics::matching;
use crate::pipeline::semantics::train_codes::{CodeTraining, CodeView, decode, train_codes};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::pipeline::semantics::votes::{UNKNOWN, Votes};
use crate::render::cpu::Renderer;
use crate::render::{RenderError, RenderSettings};
use crate::report::sweep::failed;
use crate::report::{Case, Rule, Stage, StageName, Study, StudyError, Trial};
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{GaussianCloud, Identities, IdentityId, Level, Mask, NOBODY};

/// How a result is read.
#[derive(Clone, Copy, PartialEq)]
enum Read {
    /// The identity of largest weight.
    Exact,
    /// Blended codes within the tolerance of the target's.
    Blend,
}

/// What is drawn of a view to be read.
enum Map {
    Exact(ViewMap),
    Blend(CodeMap),
}

/// One way.
#[derive(Clone, Copy)]
struct Plan {
    /// Views that vote; none vote for nothing.
    views: usize,
    /// Steps of gradients after that.
    steps: u64,
    read: Read,
}

/// What is compared on what.
pub struct FeatureStudy<'a> {
    cloud: &'a GaussianCloud,
    settings: &'a RenderSettings,
    identities: Identities,
    training: &'a [CodeView],
    held_out: &'a [CodeView],
    input: Input,
    repeats: u32,
    plans: Plans<Plan>,
}

impl<'a> FeatureStudy<'a> {
    /// Of the trained Gaussians `cloud`, whose labelled views `training` are learnt from and `held_out`
    /// compared with. Gradients are given these numbers of `steps`.
    ///
    /// # Errors
    /// If a camera is not usable.
    pub fn new(
        (cloud, settings): (&'a GaussianCloud, &'a RenderSettings),
        mut identities: Identities,
        [training, held_out]: [&'a [CodeView]; 2],
        steps: &[u64],
        repeats: u32,
        input: Input,
    ) -> Result<Self, RenderError> {
        let voted = vote(cloud, settings, &identities, training)?;
        // Codes are chosen once it is known who is next to whom.
        let centers = centers(cloud, &voted, &identities);
        codes::assign(&mut identities, &centers);
        let plans = plans(training.len(), steps);
        Ok(Self { cloud, settings, identities, training, held_out, input, repeats, plans })
    }

    /// Mean IoU of the masks of all identities in the held-out views, by level.
    fn score(
        &self,
        of: &[IdentityId],
        codes: &[[f32; CODE_CHANNELS]],
        read: Read,
    ) -> Result<Vec<(&'static str, f64)>, RenderError> {
        let mut renderer = Renderer::new();
        let mut ious: BTreeMap<Level, Vec<f64>> = BTreeMap::new();
        for view in self.held_out {
            let (w, h) = (view.camera.width_px as usize, view.camera.height_px as usize);
            let (all, camera) = (&self.identities, &view.camera);
            let map = match read {
                Read::Exact => Map::Exact(ViewMap::render(&mut renderer, self.cloud, of, all, camera, self.settings)?),
                Read::Blend => {
                    Map::Blend(CodeMap::render(&mut renderer, self.cloud, codes, true, camera, self.settings)?)
                }
            };
            for (id, identity) in self.identities.iter() {
                let inside = self.identities.within(id);
                let truth = Mask::from_fn(w, h, |i| inside.get(view.labels[i] as usize).copied().unwrap_or(false));
                if truth.is_empty() {
                    continue;
                }
                let found = match &map {
                    Map::Exact(map) => matching::exact(map, all, id, TOLERANCE),
                    Map::Blend(map) => matching::blend(map, all, id, TOLERANCE),
                };
                ious.entry(identity.level).or_default().push(found.iou(&truth));
            }
        }
        let of = |level: Level| mean(ious.get(&level).map_or(&[], Vec::as_slice));
        let all: Vec<f64> = ious.values().flatten().copied().collect();
        Ok(vec![("mIoU", mean(&all)), ("object mIoU", of(Level::Object)), ("part mIoU", of(Level::Part))])
    }
}

fn plans(views: usize, steps: &[u64]) -> Plans<Plan> {
    let plan = |views, steps, read| Plan { views, steps, read };
    let mut all = vec![(Case::default(format!("votes of {views} views, exact")), plan(views, 0, Read::Exact))];
    let mut add = |method: &str, setting: String, p: Plan| {
        let read = if p.read == Read::Exact { "exact" } else { "blend" };
        let knobs = [("views", json!(p.views)), ("steps", json!(p.steps)), ("read", json!(read))];
        all.push((Case::new(method, setting, &knobs), p));
    };
    let mut fewer = views / 2;
    while fewer > 0 {
        add("views used", format!("votes of {fewer} views, exact"), plan(fewer, 0, Read::Exact));
        fewer /= 2;
    }
    add("decoding", format!("votes of {views} views, blended"), plan(views, 0, Read::Blend));
    for (read, word) in [(Read::Blend, "blended"), (Read::Exact, "exact")] {
        for &steps in steps {
            add(&format!("gradients, {word}"), format!("{steps} steps"), plan(0, steps, read));
            add(&format!("votes, then gradients, {word}"), format!("{steps} steps"), plan(views, steps, read));
        }
    }
    Plans(all)
}

/// The identity of each Gaussian by votes.
fn vote(
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    identities: &Identities,
    views: &[CodeView],
) -> Result<Vec<IdentityId>, RenderError> {
    let mut renderer = Renderer::new();
    let mut votes = Votes::new(cloud.len());
    for view in views {
        votes.add_view(&mut renderer, cloud, &view.camera, settings, &view.labels)?;
    }
    let decided = votes.decide(identities, 0.0);
    Ok(decided.iter().map(|b| if b.identity == UNKNOWN { NOBODY } else { b.identity }).collect())
}

impl Study for FeatureStudy<'_> {
    fn stage(&self) -> Stage {
        let measures = vec![
            overlap("mIoU", "mean overlap of every identity's mask in the held-out photos with its label"),
            overlap("object mIoU", "the same of objects"),
            overlap("part mIoU", "the same of parts"),
        ];
        let rule = Rule { measure: "mIoU".into(), times: 1.02, floor: 0.0, spare_secs: 0.0 };
        let reference = "masks in held-out photos are held against their labels";
        stage(StageName::Features, "the whole lifting", reference, &self.input, self.repeats, rule, measures)
    }

    fn cases(&self) -> Vec<Case> {
        self.plans.cases()
    }

    fn run(&mut self, case: &Case, seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
        let Some(&Plan { views, steps, read }) = self.plans.of(case) else { return Ok(None) };
        let start = Instant::now();
        // Views spread over all of them, not the first ones.
        let every = self.training.len() as f64 / views.max(1) as f64;
        let voting: Vec<CodeView> = (0..views).map(|k| self.training[(k as f64 * every) as usize].clone()).collect();
        let mut of = match views {
            0 => vec![NOBODY; self.cloud.len()],
            _ => vote(self.cloud, self.settings, &self.identities, &voting).map_err(failed)?,
        };
        let by_id: Vec<_> = (0..=self.identities.len() as IdentityId).map(|id| self.identities.codes(id)).collect();
        let mut codes: Vec<[f32; CODE_CHANNELS]> = of.iter().map(|id| by_id[*id as usize]).collect();
        if steps > 0 {
            let training = CodeTraining { steps, seed };
            let (cloud, all) = (self.cloud, self.training);
            train_codes(cloud, &mut codes, all, &self.identities, self.settings, training, observer).map_err(failed)?;
            if observer.proceed().is_err() {
                return Ok(None);
            }
            of = decode(&codes, &self.identities);
        }
        let secs = start.elapsed().as_secs_f64();
        let values = self.score(&of, &codes, read).map_err(failed)?;
        Ok(Some(Trial { secs, values, curve: Vec::new() }))
    }
}
