//! Masks of phrases as each method makes them, and as this program does.

use super::asked::{ForeignScene, ForeignView, cluster_cosines};
use super::blend::{self, BlendSource};
use super::{ForeignError, ForeignPhrase};
use crate::io::results::{ClusterLevel, LevelValues, Method, ResultLevel};
use crate::pipeline::semantics::relevancy::{LERFS_SHARE, on_lerfs_scale};
use crate::pipeline::semantics::smoothing::{cut, largest, smoothed};
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::Mask;

/// Opacity that belongs to a silhouette (OpenGaussian).
const SILHOUETTE: f32 = 0.7;
/// Blended membership that belongs to a segment (THGS).
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
    /// The rule in words.
    pub rule: &'static str,
}

impl ForeignScene {
    /// The mask by the method's own rule.
    pub fn own_mask(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        phrase: ForeignPhrase<'_>,
    ) -> Result<ForeignMask, ForeignError> {
        let (w, h) = view.size();
        let method = self.result.method;
        let threshold = |relevancy: &[f32], inside: fn(f32) -> bool| Mask::from_fn(w, h, |i| inside(relevancy[i]));
        match method {
            Method::LangSplat | Method::LangSplatV2 | Method::OccamsLgs => {
                let mut best: Option<(f32, usize, Vec<f32>)> = None;
                for level in 0..self.result.levels.len() {
                    let relevancy = self.relevancy_of_method(renderer, view, level, phrase)?;
                    let v = smoothed(&relevancy, w, h).1;
                    let most = largest(&v);
                    if best.as_ref().is_none_or(|(before, ..)| most > *before) {
                        best = Some((most, level, v));
                    }
                }
                let (_, level, v) = best.ok_or(ForeignError::Level(0))?;
                let rule = "smoothed by 30 px, normalized, over 0.4; level of the largest value";
                Ok(ForeignMask { mask: cut(&v, w, h), level, rule })
            }
            Method::LeGaussians => {
                let phrase = ForeignPhrase { temperature: LEGAUSSIANS_TEMPERATURE, ..phrase };
                let relevancy = self.relevancy_of_method(renderer, view, 0, phrase)?;
                let rule = "relevancy of 0.5 or more";
                Ok(ForeignMask { mask: threshold(&relevancy, |r| r >= 0.5), level: 0, rule })
            }
            Method::Feature3dgs => {
                let relevancy = self.relevancy_of_method(renderer, view, 0, phrase)?;
                let rule = "more alike to the phrase than to any canonical phrase";
                Ok(ForeignMask { mask: threshold(&relevancy, |r| r > 0.5), level: 0, rule })
            }
            Method::OpenGaussian => {
                let of = self.result.levels.first().ok_or(ForeignError::Level(0))?;
                let LevelValues::Clusters(clusters) = &of.values else { return Err(ForeignError::Level(0)) };
                let chosen = leaves(clusters, phrase.query);
                let inside = |i: usize| clusters.of[i].is_some_and(|c| chosen.contains(&(c as usize)));
                let mask = silhouette(renderer, of, view, inside)?;
                Ok(ForeignMask { mask, level: 0, rule: "best cluster and like ones of its root; silhouette over 0.7" })
            }
            Method::Thgs => {
                let levels = self.result.levels.len();
                let mask = self.segments(renderer, view, phrase.query, levels.saturating_sub(2)..levels)?;
                let rule = "best 3 segments of the two coarse levels; membership over 0.5";
                Ok(ForeignMask { mask, level: levels.saturating_sub(2), rule })
            }
            Method::DrSplat => {
                let of = self.result.levels.first().ok_or(ForeignError::Level(0))?;
                let relevancy = self.gaussian_relevancy(0, phrase)?;
                let mask = silhouette(renderer, of, view, |i| relevancy[i] > 0.5)?;
                Ok(ForeignMask { mask, level: 0, rule: "Gaussians of relevancy over 0.5; silhouette over 0.7" })
            }
            Method::GaussianGrouping | Method::OmniSeg3d | Method::Saga => Err(ForeignError::NoLanguage(method.name())),
            Method::SplatDistiller | Method::Ludvig => Err(ForeignError::NoRule(method.name())),
        }
    }

    /// The mask by this program's rule, the same for all methods: over a fifth of LERF's scale, at the level of the
    /// largest relevancy.
    pub fn fair_mask(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        phrase: ForeignPhrase<'_>,
    ) -> Result<ForeignMask, ForeignError> {
        let (w, h) = view.size();
        let mut best: Option<(f32, usize, Vec<f32>)> = None;
        for level in 0..self.result.levels.len() {
            let relevancy = self.pixel_relevancy(renderer, view, level, phrase)?;
            let most = largest(&relevancy);
            if best.as_ref().is_none_or(|(before, ..)| most > *before) {
                best = Some((most, level, relevancy));
            }
        }
        let (most, level, relevancy) = best.ok_or(ForeignError::Level(0))?;
        let mask = Mask::from_fn(w, h, |i| on_lerfs_scale(relevancy[i], most) > LERFS_SHARE);
        Ok(ForeignMask { mask, level, rule: "over 20 % of LERF's scale; level of the largest relevancy" })
    }

    /// Pixels whose blended membership in the best segments of these levels is over a half.
    fn segments(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        query: &[f32],
        levels: std::ops::Range<usize>,
    ) -> Result<Mask, ForeignError> {
        let members = self.members(query, levels);
        let copy = |i: usize, _: usize, out: &mut [f32]| out.fill(f32::from(u8::from(members[i])));
        let blended = blend::blend(renderer, &self.result.cloud, BlendSource { dim: 1, copy: &copy }, &view.camera)?;
        let (w, h) = view.size();
        Ok(Mask::from_fn(w, h, |i| blended.planes[0][i] > MEMBERSHIP))
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

/// Pixels that these Gaussians alone cover.
fn silhouette(
    renderer: &mut Renderer,
    level: &ResultLevel,
    view: &ForeignView,
    inside: impl Fn(usize) -> bool,
) -> Result<Mask, ForeignError> {
    let chosen: Vec<usize> = (0..level.cloud.len()).filter(|i| inside(*i)).collect();
    let alone = level.cloud.select(&chosen);
    let settings = RenderSettings { sh_degree: 0, ..RenderSettings::of_mode(alone.render_mode) };
    let frame = renderer.render(&alone, Features::NONE, &view.camera, &settings)?;
    Ok(Mask::from_fn(frame.width_px, frame.height_px, |i| frame.alpha[i] > SILHOUETTE))
}
