//! Masks of phrases as each method makes them, and as this program does.

use super::asked::{ForeignScene, ForeignView, cluster_cosines};
use super::blend::{self, BlendSource};
use super::{ForeignError, ForeignPhrase};
use crate::io::results::{ClusterLevel, LevelValues, Method, ResultLevel};
use crate::pipeline::semantics::smoothing::{
    BY_COMMON_RULE, BY_SMOOTHING, LeveledMask, by_common_rule, by_smoothing_filled, peak,
};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::Mask;

/// Opacity that belongs to a silhouette (OpenGaussian).
const SILHOUETTE: f32 = 0.7;
/// Blended membership that belongs to a mask (THGS, LaGa).
const MEMBERSHIP: f32 = 0.5;
/// Segments of an answer (THGS).
const SEGMENTS: usize = 3;
/// Best clusters that may join the answer, and the distance of their instance features (OpenGaussian).
const JOINING: (usize, f32) = (10, 0.9);
/// Temperature of LEGaussians.
const LEGAUSSIANS_TEMPERATURE: f32 = 100.0;

/// A mask of a phrase in a view.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignMask {
    /// Its pixels.
    pub mask: Mask,
    /// Level that it was taken from, or the first of several.
    pub level: usize,
    /// Values that the rule cuts, row-major, 0 to 1.
    pub values: Vec<f32>,
    /// Pixel that the rule points at; `None` if it points at none.
    pub peak: Option<usize>,
    /// The rule in words.
    pub rule: &'static str,
}

impl ForeignMask {
    fn of_level(found: Option<LeveledMask>, rule: &'static str) -> Result<Self, ForeignError> {
        let LeveledMask { mask, level, values, peak } = found.ok_or(ForeignError::Level(0))?;
        Ok(Self { mask, level, values, peak, rule })
    }
}

impl ForeignScene {
    /// The mask by the method's own rule, from the relevancy of all levels ([`Self::relevancy`]).
    pub fn own_mask(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        phrase: ForeignPhrase<'_>,
        relevancy: &[Vec<f32>],
    ) -> Result<ForeignMask, ForeignError> {
        let (w, h) = view.size();
        let method = self.result.method;
        let threshold = |values: Vec<f32>, inside: fn(f32) -> bool, rule| {
            let mask = Mask::from_fn(w, h, |i| inside(values[i]));
            ForeignMask { mask, level: 0, peak: peak(&values), values, rule }
        };
        let filled = |mut relevancy: Vec<f32>, phrase| {
            let of_nothing = self.of_nothing(view, 0, phrase);
            relevancy.iter_mut().filter(|r| **r == 0.0).for_each(|r| *r = of_nothing);
            relevancy
        };
        let covered = |(mask, values), level, rule| ForeignMask { mask, level, values, peak: None, rule };
        match method {
            Method::LangSplat | Method::LangSplatV2 | Method::OccamsLgs | Method::Gags => {
                let of_nothing: Vec<f32> =
                    (0..relevancy.len()).map(|level| self.of_nothing(view, level, phrase)).collect();
                ForeignMask::of_level(by_smoothing_filled(relevancy, &of_nothing, w, h), BY_SMOOTHING)
            }
            Method::LeGaussians => {
                let phrase = ForeignPhrase { temperature: LEGAUSSIANS_TEMPERATURE, ..phrase };
                let relevancy = self.pixel_relevancy(renderer, view, 0, phrase)?;
                Ok(threshold(filled(relevancy, phrase), |r| r >= 0.5, "relevancy of 0.5 or more"))
            }
            Method::Feature3dgs => {
                let relevancy = relevancy.first().cloned().ok_or(ForeignError::Level(0))?;
                Ok(threshold(
                    filled(relevancy, phrase),
                    |r| r > 0.5,
                    "more alike to the phrase than to any canonical phrase",
                ))
            }
            Method::OpenGaussian => {
                let of = self.result.levels.first().ok_or(ForeignError::Level(0))?;
                let LevelValues::Clusters(clusters) = &of.values else { return Err(ForeignError::Level(0)) };
                let chosen = leaves(clusters, phrase.query);
                let inside = |i: usize| clusters.of[i].is_some_and(|c| chosen.contains(&(c as usize)));
                let found = silhouette(renderer, of, view, inside)?;
                Ok(covered(found, 0, "best cluster and like ones of its root; silhouette over 0.7"))
            }
            Method::Thgs => {
                let levels = self.result.levels.len();
                let members = self.members(phrase.query, levels.saturating_sub(2)..levels);
                let found = self.membership(renderer, view, &members)?;
                let rule = "best 3 segments of the two coarse levels; membership over 0.5";
                Ok(covered(found, levels.saturating_sub(2), rule))
            }
            Method::DrSplat => {
                let of = self.result.levels.first().ok_or(ForeignError::Level(0))?;
                let relevancy = self.gaussian_relevancy(0, phrase)?;
                let found = silhouette(renderer, of, view, |i| relevancy[i] > 0.5)?;
                Ok(covered(found, 0, "Gaussians of relevancy over 0.5; silhouette over 0.7"))
            }
            Method::Laga => {
                let chosen = self.chosen_by_descriptors(phrase)?;
                let found = self.membership(renderer, view, &chosen)?;
                let rule = "Gaussians over 0.6 of the range of relevancy and of a cosine of 0.23 or more, unfiltered; \
                            membership over 0.5";
                Ok(covered(found, 0, rule))
            }
            Method::GaussianGrouping | Method::OmniSeg3d | Method::Saga => Err(ForeignError::of_silent(method)),
            Method::SplatDistiller | Method::Ludvig | Method::SemanticGaussians | Method::SemanticGaussiansOpenSeg => {
                Err(ForeignError::NoRule(method.name()))
            }
        }
    }

    /// Pixels of which these Gaussians make more than a half, and how much they do.
    fn membership(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        members: &[bool],
    ) -> Result<(Mask, Vec<f32>), ForeignError> {
        let copy = |i: usize, _: usize, out: &mut [f32]| out.fill(f32::from(u8::from(members[i])));
        let mut blended =
            blend::blend(renderer, &self.result.cloud, BlendSource { dim: 1, copy: &copy }, &view.camera)?;
        let (w, h) = view.size();
        let membership = blended.planes.swap_remove(0);
        Ok((Mask::from_fn(w, h, |i| membership[i] > MEMBERSHIP), membership))
    }

    /// Returns for each Gaussian whether it is in one of the segments of these levels that are most alike to a phrase.
    pub(crate) fn members(&self, query: &[f32], levels: std::ops::Range<usize>) -> Vec<bool> {
        let clusters = levels.filter_map(|level| match &self.result.levels[level].values {
            LevelValues::Clusters(clusters) => Some(clusters),
            _ => None,
        });
        let clusters: Vec<&ClusterLevel> = clusters.collect();
        let mut all: Vec<(f32, usize, u32)> = Vec::new();
        for (level, clusters) in clusters.iter().enumerate() {
            let cosines = cluster_cosines(clusters, &[query]).swap_remove(0);
            all.extend((0..).zip(cosines).map(|(k, cosine)| (cosine, level, k)));
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.truncate(SEGMENTS);
        let is_in = |i: usize| all.iter().any(|(_, level, k)| clusters[*level].of[i] == Some(*k));
        (0..self.result.cloud.len()).map(is_in).collect()
    }
}

/// The mask by this program's rule, the same for all methods: over a fifth of LERF's scale, at the level of the largest
/// relevancy of the phrase.
pub fn fair_mask(view: &ForeignView, relevancy: &[Vec<f32>]) -> Result<ForeignMask, ForeignError> {
    let (w, h) = view.size();
    ForeignMask::of_level(by_common_rule(relevancy, w, h), BY_COMMON_RULE)
}

/// OpenGaussian's clusters of an answer: the best one, and of the ten best those near it that have a larger number in
/// the same root, as its code counts.
fn leaves(clusters: &ClusterLevel, query: &[f32]) -> Vec<usize> {
    let cosines = cluster_cosines(clusters, &[query]).swap_remove(0);
    let mut order: Vec<usize> = (0..cosines.len()).collect();
    order.sort_by(|a, b| cosines[*b].total_cmp(&cosines[*a]));
    let Some(&best) = order.first() else { return Vec::new() };
    let mut chosen = vec![best];
    if let Some(leaves) = &clusters.leaves
        && let Some(codes) = &leaves.codes
    {
        let own = codes.row(best);
        let is_near = |k: usize| {
            let distance = codes.row(k).iter().zip(&own).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt();
            // A signed difference: smaller numbers always pass.
            distance < JOINING.1 && (k as i64 - best as i64) < leaves.in_root as i64
        };
        chosen.extend(order.iter().take(JOINING.0).copied().filter(|k| *k != best && is_near(*k)));
    }
    chosen
}

/// Pixels that these Gaussians alone cover, and how much they do.
fn silhouette(
    renderer: &mut Renderer,
    level: &ResultLevel,
    view: &ForeignView,
    inside: impl Fn(usize) -> bool,
) -> Result<(Mask, Vec<f32>), ForeignError> {
    let chosen: Vec<usize> = (0..level.cloud.len()).filter(|i| inside(*i)).collect();
    let alone = level.cloud.select(&chosen);
    let settings = RenderSettings { sh_degree: 0, ..RenderSettings::of_mode(alone.render_mode) };
    let frame = renderer.render(&alone, Features::NONE, &view.camera, &settings)?;
    Ok((Mask::from_fn(frame.width_px, frame.height_px, |i| frame.alpha[i] > SILHOUETTE), frame.alpha))
}
