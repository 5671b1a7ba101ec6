//! Ways of giving Gaussians their identities, against each other: votes in one pass, and codes
//! trained by gradients, from scratch or from the votes.

use std::collections::BTreeMap;
use std::time::Instant;

use super::{Point, Report, VERSION};
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
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{GaussianCloud, Identities, IdentityId, Level, Mask, NOBODY};

/// Seed of the order in which views are trained on.
const SEED: u64 = 0;

/// What is compared on what.
pub struct FeatureStudy<'a> {
    /// The trained Gaussians.
    pub cloud: &'a GaussianCloud,
    /// How they are drawn.
    pub settings: &'a RenderSettings,
    /// Objects and parts; their codes are chosen here, once it is known who is next to whom.
    pub identities: Identities,
    /// Labelled views to learn from.
    pub training: &'a [CodeView],
    /// Labelled views to compare with.
    pub held_out: &'a [CodeView],
    /// Numbers of steps of the trainings.
    pub steps: &'a [u64],
}

/// How a result is read.
#[derive(Clone, Copy, PartialEq)]
enum Read {
    /// The identity of largest weight.
    Exact,
    /// Blended codes within the tolerance of the target's.
    Blend,
}

/// Runs all methods.
///
/// # Errors
/// If a camera is not usable.
pub fn study(
    mut study: FeatureStudy<'_>,
    input: BTreeMap<String, String>,
    observer: &mut dyn Observer,
) -> Result<Report, RenderError> {
    let mut points = Vec::new();
    let n = study.cloud.len();
    let start = Instant::now();
    let mut renderer = Renderer::new();
    let mut votes = Votes::new(n);
    for view in study.training {
        votes.add_view(&mut renderer, study.cloud, &view.camera, study.settings, &view.labels)?;
    }
    let voted: Vec<IdentityId> = votes
        .decide(&study.identities, 0.0)
        .iter()
        .map(|b| if b.identity == UNKNOWN { NOBODY } else { b.identity })
        .collect();
    let vote_secs = start.elapsed().as_secs_f64();
    let centers = centers(study.cloud, &voted, &study.identities);
    codes::assign(&mut study.identities, &centers);
    let by_id: Vec<_> = (0..=study.identities.len() as IdentityId).map(|id| study.identities.codes(id)).collect();
    let voted_codes: Vec<[f32; CODE_CHANNELS]> = voted.iter().map(|id| by_id[*id as usize]).collect();
    let setting = format!("{} views", study.training.len());
    points.push(point("votes, exact", &setting, vote_secs, study.score(&voted, &voted_codes, Read::Exact)?));
    points.push(point("votes, blended", &setting, vote_secs, study.score(&voted, &voted_codes, Read::Blend)?));
    let background = by_id[NOBODY as usize];
    for &steps in study.steps {
        for (series, from, before) in [("gradient", None, 0.0), ("votes, then gradient", Some(&voted_codes), vote_secs)]
        {
            let start = Instant::now();
            let mut codes = from.cloned().unwrap_or_else(|| vec![background; n]);
            let training = CodeTraining { steps, seed: SEED };
            train_codes(
                study.cloud,
                &mut codes,
                study.training,
                &study.identities,
                study.settings,
                training,
                observer,
            )?;
            let secs = before + start.elapsed().as_secs_f64();
            let setting = format!("{steps} steps");
            let of = decode(&codes, &study.identities);
            points.push(point(&format!("{series}, blended"), &setting, secs, study.score(&of, &codes, Read::Blend)?));
            points.push(point(&format!("{series}, exact"), &setting, secs, study.score(&of, &codes, Read::Exact)?));
        }
    }
    Ok(Report { version: VERSION, stage: "features".into(), input, points })
}

fn point(series: &str, setting: &str, secs: f64, quality: BTreeMap<String, f64>) -> Point {
    Point { series: series.into(), setting: setting.into(), secs, quality }
}

impl FeatureStudy<'_> {
    /// Mean IoU of the masks of all identities in the held-out views, by level.
    fn score(
        &self,
        of: &[IdentityId],
        codes: &[[f32; CODE_CHANNELS]],
        read: Read,
    ) -> Result<BTreeMap<String, f64>, RenderError> {
        let mut renderer = Renderer::new();
        let mut ious: BTreeMap<Level, Vec<f64>> = BTreeMap::new();
        for view in self.held_out {
            let (w, h) = (view.camera.width_px as usize, view.camera.height_px as usize);
            let exact = ViewMap::render(&mut renderer, self.cloud, of, &self.identities, &view.camera, self.settings)?;
            let blended = CodeMap::render(&mut renderer, self.cloud, codes, true, &view.camera, self.settings)?;
            for (id, identity) in self.identities.iter() {
                let inside = self.identities.within(id);
                let truth = Mask::from_fn(w, h, |i| inside.get(view.labels[i] as usize).copied().unwrap_or(false));
                if truth.is_empty() {
                    continue;
                }
                let found = match read {
                    Read::Exact => matching::exact(&exact, &self.identities, id, TOLERANCE),
                    Read::Blend => matching::blend(&blended, &self.identities, id, TOLERANCE),
                };
                ious.entry(identity.level).or_default().push(found.iou(&truth));
            }
        }
        let name = |level: Level| if level == Level::Object { "object mIoU" } else { "part mIoU" };
        Ok(ious.into_iter().map(|(level, ious)| (name(level).to_owned(), mean(&ious))).collect())
    }
}
