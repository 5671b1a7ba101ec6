//! A result with what is computed once of it, and a view of it with what every phrase needs.

use std::sync::Arc;

use rayon::prelude::*;

use super::blend::{self, BlendedCodes, BlendedCosines};
use super::cosines::CosineHead;
use super::descriptors::{self, DescriptorAnswer};
use super::packed::PackedWeights;
use super::pieces::{self, KnownCosines, PieceCosines};
use super::{ForeignError, ForeignPhrase};
use crate::io::results::{ClusterLevel, LevelCodes, LevelValues, MethodResult, ResultLevel};
use crate::math::vector::{dot, unit};
use crate::pipeline::semantics::relevancy::{nearest, score};
use crate::render::{LabelWinner, RenderSettings, Renderer};
use crate::scene::Camera;

/// Relevancy of what is alike to nothing, as the methods compute it.
const UNDECIDED: f32 = 0.5;
/// Numbers of an embedding over which its blend is not kept.
const WIDE: usize = 128;

/// A result that is asked.
pub struct ForeignScene {
    /// The result.
    pub result: Arc<MethodResult>,
    /// By level; `None` for those without a decoder.
    heads: Vec<Option<CosineHead>>,
}

/// Numbers of a level in a view that phrases are compared with.
#[derive(Clone, Debug)]
pub(crate) enum LevelView {
    /// The blended numbers.
    Blended(BlendedCodes),
    /// The blended weights of a codebook's entries.
    Packed(PackedWeights),
    /// Cluster of largest weight at each pixel, numbered from 1; 0 for none.
    Winners(Vec<LabelWinner>),
    /// Embeddings that are blended anew for every question.
    Wide,
}

/// A view of a result.
#[derive(Clone, Debug)]
pub struct ForeignView {
    /// Its camera.
    pub camera: Camera,
    pub(crate) levels: Vec<LevelView>,
}

impl ForeignView {
    /// Blended numbers of a level, if it has some that are kept.
    pub fn blended(&self, level: usize) -> Option<&BlendedCodes> {
        match self.levels.get(level)? {
            LevelView::Blended(blended) => Some(blended),
            LevelView::Packed(_) | LevelView::Winners(_) | LevelView::Wide => None,
        }
    }

    /// Share of the pixels of a level that a Gaussian reaches; only these are decoded.
    pub(crate) fn reached(&self, level: usize) -> Option<f64> {
        let reached = match self.levels.get(level)? {
            LevelView::Blended(blended) => blended.alpha.iter().filter(|a| **a != 0.0).count(),
            LevelView::Packed(packed) => packed.reached(),
            LevelView::Winners(winners) => winners.iter().filter(|w| w.label != 0).count(),
            LevelView::Wide => return None,
        };
        let (w, h) = self.size();
        Some(reached as f64 / (w * h).max(1) as f64)
    }

    /// Memory of what is kept of the view.
    pub(crate) fn bytes(&self) -> usize {
        let of = |level: &LevelView| match level {
            LevelView::Blended(blended) => (blended.planes.len() + 1) * size_of_val(&blended.alpha[..]),
            LevelView::Packed(packed) => packed.bytes(),
            LevelView::Winners(winners) => size_of_val(&winners[..]),
            LevelView::Wide => 0,
        };
        self.levels.iter().map(of).sum()
    }

    pub(crate) fn size(&self) -> (usize, usize) {
        (self.camera.width_px as usize, self.camera.height_px as usize)
    }
}

impl ForeignScene {
    /// Prepares a result.
    pub fn new(result: Arc<MethodResult>) -> Self {
        let head = |level: &ResultLevel| match &level.values {
            LevelValues::Embedded(embedded) => Some(CosineHead::new(&embedded.decoder)),
            _ => None,
        };
        let heads = result.levels.par_iter().map(head).collect();
        Self { result, heads }
    }

    fn level(&self, level: usize) -> Result<&ResultLevel, ForeignError> {
        self.result.levels.get(level).ok_or(ForeignError::Level(level))
    }

    /// Renders what phrases need of a view, once.
    pub fn look(&self, renderer: &mut Renderer, camera: &Camera) -> Result<ForeignView, ForeignError> {
        let mut levels = Vec::with_capacity(self.result.levels.len());
        for (level, head) in self.result.levels.iter().zip(&self.heads) {
            levels.push(match (&level.values, head) {
                (LevelValues::Embedded(e), Some(head)) if head.is_plain() && e.codes.dim() > WIDE => LevelView::Wide,
                (LevelValues::Embedded(e), head) => {
                    let blended = blend::blend_level(renderer, &level.cloud, e, camera)?;
                    match (&e.codes, head) {
                        (LevelCodes::Sparse(_), Some(head)) if head.is_codebook() => {
                            LevelView::Packed(PackedWeights::new(head, &blended))
                        }
                        _ => LevelView::Blended(blended),
                    }
                }
                (LevelValues::Classes { features, .. } | LevelValues::Affinity { features, .. }, _) => {
                    LevelView::Blended(blend::blend_rows(renderer, &level.cloud, features, camera)?)
                }
                (LevelValues::Clusters(clusters), _) => {
                    let of: Vec<u32> = clusters.of.iter().map(|c| c.map_or(0, |c| c + 1)).collect();
                    let groups: Vec<u32> = (0..=clusters.count() as u32).collect();
                    let settings = RenderSettings::of_mode(level.cloud.render_mode);
                    LevelView::Winners(renderer.label_winners(&level.cloud, (&of, &groups), camera, &settings)?)
                }
            });
        }
        Ok(ForeignView { camera: camera.clone(), levels })
    }

    /// Checks that embeddings of phrases have the numbers of a level.
    fn fits(&self, want: usize, phrases: &[&[f32]]) -> Result<(), ForeignError> {
        let method = self.result.method;
        match phrases.iter().map(|p| p.len()).find(|have| *have != want) {
            None => Ok(()),
            Some(have) => {
                let missing = || method.missing_encoder().map(str::to_owned);
                let encoder = self.result.encoder.clone().or_else(missing).unwrap_or_default();
                Err(ForeignError::Dimension { have, want, method: method.name(), encoder })
            }
        }
    }

    fn no_language(&self) -> ForeignError {
        ForeignError::of_silent(self.result.method)
    }

    /// Cosines of each Gaussian of a level with each phrase.
    pub fn gaussian_cosines(&self, level: usize, phrases: &[&[f32]]) -> Result<Vec<Vec<f32>>, ForeignError> {
        match (&self.level(level)?.values, &self.heads[level]) {
            (LevelValues::Embedded(embedded), Some(head)) => {
                self.fits(head.outputs(), phrases)?;
                Ok(blend::gaussian_cosines(head, embedded, &head.directions(phrases)))
            }
            (LevelValues::Clusters(clusters), _) => {
                self.fits(clusters.features.dim(), phrases)?;
                let of_rows = cluster_cosines(clusters, phrases);
                let of_clusters = of_rows.iter().map(|cosines| descriptors::nearest(clusters, cosines));
                let of = |cosines: Vec<f32>| {
                    let one = |c: &Option<u32>| c.map_or(0.0, |c| cosines[c as usize]);
                    clusters.of.par_iter().map(one).collect()
                };
                Ok(of_clusters.map(of).collect())
            }
            _ => Err(self.no_language()),
        }
    }

    /// Relevancy of each Gaussian of a level, 0 to 1.
    pub fn gaussian_relevancy(&self, level: usize, phrase: ForeignPhrase<'_>) -> Result<Vec<f32>, ForeignError> {
        if let LevelValues::Clusters(clusters) = &self.level(level)?.values {
            let relevancy = self.cluster_relevancy(clusters, phrase)?;
            let one = |c: &Option<u32>| c.map_or(0.0, |c| relevancy[c as usize]);
            return Ok(clusters.of.par_iter().map(one).collect());
        }
        Ok(relevancy_of(&self.gaussian_cosines(level, &all_of(phrase))?, phrase.temperature))
    }

    /// Relevancy of each cluster, times its weight if it has several embeddings; 0 for those without one.
    pub(crate) fn cluster_relevancy(
        &self,
        clusters: &ClusterLevel,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<f32>, ForeignError> {
        Ok(self.cluster_answers(clusters, phrase)?.into_iter().map(|answer| answer.relevancy).collect())
    }

    /// Relevancy of each cluster with the cosine that it comes from.
    pub(crate) fn cluster_answers(
        &self,
        clusters: &ClusterLevel,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<DescriptorAnswer>, ForeignError> {
        let all = all_of(phrase);
        self.fits(clusters.features.dim(), &all)?;
        let cosines = cluster_cosines(clusters, &all);
        Ok(descriptors::answers(clusters, &relevancy_of(&cosines, phrase.temperature), &cosines[0]))
    }

    /// Prepares the comparison of the pixels of a view with phrases, by the codes of a level.
    fn compared<'a>(
        &'a self,
        renderer: &mut Renderer,
        view: &'a ForeignView,
        level: usize,
        phrases: &[&[f32]],
    ) -> Result<Box<dyn PieceCosines + 'a>, ForeignError> {
        let of = self.level(level)?;
        let (LevelValues::Embedded(embedded), Some(head)) = (&of.values, &self.heads[level]) else {
            return Err(self.no_language());
        };
        self.fits(head.outputs(), phrases)?;
        match view.levels.get(level) {
            Some(LevelView::Wide) => {
                let cosines = blend::wide_cosines(renderer, &of.cloud, embedded, &view.camera, phrases)?;
                Ok(Box::new(KnownCosines(cosines)))
            }
            Some(LevelView::Blended(blended)) => {
                Ok(Box::new(BlendedCosines::new(head, blended, head.directions(phrases))))
            }
            Some(LevelView::Packed(packed)) => Ok(Box::new(packed.compared(&head.directions(phrases)))),
            Some(LevelView::Winners(_)) | None => Err(self.no_language()),
        }
    }

    /// Cosines of each pixel of a view with each phrase, by the blended codes of a level.
    pub fn pixel_cosines(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        level: usize,
        phrases: &[&[f32]],
    ) -> Result<Vec<Vec<f32>>, ForeignError> {
        Ok(pieces::planes(&*self.compared(renderer, view, level, phrases)?))
    }

    /// Relevancy of each pixel of a view, 0 to 1: of its blended embedding, or of the cluster of largest weight. It is 0
    /// where nothing is.
    pub fn pixel_relevancy(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        level: usize,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<f32>, ForeignError> {
        if let (LevelValues::Clusters(clusters), Some(LevelView::Winners(winners))) =
            (&self.level(level)?.values, view.levels.get(level))
        {
            let relevancy = self.cluster_relevancy(clusters, phrase)?;
            let of = |w: &LabelWinner| w.label.checked_sub(1).and_then(|c| relevancy.get(c as usize)).copied();
            return Ok(winners.iter().map(|w| of(w).unwrap_or(0.0)).collect());
        }
        let cosines = self.compared(renderer, view, level, &all_of(phrase))?;
        Ok(pieces::relevancy(&*cosines, phrase.temperature))
    }

    /// Relevancy of all levels, of which masks are made.
    pub fn relevancy(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<Vec<f32>>, ForeignError> {
        (0..self.result.levels.len()).map(|level| self.pixel_relevancy(renderer, view, level, phrase)).collect()
    }

    /// Relevancy that the methods compute where nothing is.
    pub(crate) fn of_nothing(&self, view: &ForeignView, level: usize, phrase: ForeignPhrase<'_>) -> f32 {
        match (view.levels.get(level), self.heads.get(level)) {
            (Some(LevelView::Winners(_)), _) => 0.0,
            (Some(LevelView::Blended(blended)), Some(Some(head))) => {
                let compared = BlendedCosines::new(head, blended, head.directions(&all_of(phrase)));
                match compared.of_nothing() {
                    [query, canonical @ ..] if compared.of_nothing().iter().any(|c| *c != 0.0) => {
                        score(query - nearest(canonical.iter().copied()), phrase.temperature)
                    }
                    _ => UNDECIDED,
                }
            }
            _ => UNDECIDED,
        }
    }
}

/// The phrase and its canonical ones.
fn all_of<'a>(phrase: ForeignPhrase<'a>) -> Vec<&'a [f32]> {
    std::iter::once(phrase.query).chain(phrase.canonical.iter().map(Vec::as_slice)).collect()
}

/// Relevancy from the cosines with the phrase, and those with the canonical phrases; 0 for what has no direction, and so
/// cosines of 0 with all.
fn relevancy_of(cosines: &[Vec<f32>], temperature: f32) -> Vec<f32> {
    let Some((query, canonical)) = cosines.split_first() else { return Vec::new() };
    let one = |i: usize| match cosines.iter().all(|c| c[i] == 0.0) {
        true => 0.0,
        false => score(query[i] - nearest(canonical.iter().map(|c| c[i])), temperature),
    };
    (0..query.len()).into_par_iter().with_min_len(1 << 12).map(one).collect()
}

/// Cosines of the embeddings of clusters with phrases; 0 for those of no length.
pub(crate) fn cluster_cosines(clusters: &ClusterLevel, phrases: &[&[f32]]) -> Vec<Vec<f32>> {
    let units: Vec<Option<Vec<f32>>> = (0..clusters.features.len()).map(|k| unit(&clusters.features.row(k))).collect();
    let of = |phrase: &&[f32]| units.iter().map(|u| u.as_ref().map_or(0.0, |u| dot(u, phrase))).collect();
    phrases.iter().map(of).collect()
}
