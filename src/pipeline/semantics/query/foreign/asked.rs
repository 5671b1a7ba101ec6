//! A result with what is computed once of it, and a view of it with what every phrase needs.

use std::sync::Arc;

use rayon::prelude::*;

use super::blend::{self, BlendedCodes};
use super::cosines::CosineHead;
use super::{ForeignError, ForeignPhrase};
use crate::io::results::{ClusterLevel, LevelValues, MethodResult, ResultLevel};
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
            LevelView::Winners(_) | LevelView::Wide => None,
        }
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
                (LevelValues::Embedded(e), _) => {
                    LevelView::Blended(blend::blend_level(renderer, &level.cloud, e, camera)?)
                }
                (LevelValues::Classes { features, .. } | LevelValues::Affinity { features, .. }, _) => {
                    LevelView::Blended(blend::blend_rows(renderer, &level.cloud, features, camera)?)
                }
                (LevelValues::Clusters(clusters), _) => {
                    let of: Vec<u32> = clusters.of.iter().map(|c| c.map_or(0, |c| c + 1)).collect();
                    let groups: Vec<u32> = (0..=clusters.features.len() as u32).collect();
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
                let encoder = self.result.encoder.clone().unwrap_or_default();
                Err(ForeignError::Dimension { have, want, method: method.name(), encoder })
            }
        }
    }

    fn no_language(&self) -> ForeignError {
        ForeignError::NoLanguage(self.result.method.name())
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
                let of_clusters = cluster_cosines(clusters, phrases);
                let of = |cosines: &Vec<f32>| {
                    let one = |c: &Option<u32>| c.map_or(0.0, |c| cosines[c as usize]);
                    clusters.of.par_iter().map(one).collect()
                };
                Ok(of_clusters.iter().map(of).collect())
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
        Ok(relevancy_of(&self.gaussian_cosines(level, &all_of(phrase))?, phrase.temperature, 0.0))
    }

    /// Relevancy of each cluster; 0 for those without an embedding.
    pub(crate) fn cluster_relevancy(
        &self,
        clusters: &ClusterLevel,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<f32>, ForeignError> {
        let all = all_of(phrase);
        self.fits(clusters.features.dim(), &all)?;
        Ok(relevancy_of(&cluster_cosines(clusters, &all), phrase.temperature, 0.0))
    }

    /// Cosines of each pixel of a view with each phrase, by the blended codes of a level.
    pub fn pixel_cosines(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        level: usize,
        phrases: &[&[f32]],
    ) -> Result<Vec<Vec<f32>>, ForeignError> {
        let of = self.level(level)?;
        match (&of.values, view.levels.get(level), &self.heads[level]) {
            (LevelValues::Embedded(embedded), Some(LevelView::Wide), Some(head)) => {
                self.fits(head.outputs(), phrases)?;
                blend::wide_cosines(renderer, &of.cloud, embedded, &view.camera, phrases)
            }
            (LevelValues::Embedded(_), Some(LevelView::Blended(blended)), Some(head)) => {
                self.fits(head.outputs(), phrases)?;
                Ok(blend::pixel_cosines(head, blended, &head.directions(phrases)))
            }
            _ => Err(self.no_language()),
        }
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
        let mut relevancy = self.relevancy_everywhere(renderer, view, level, phrase, 0.0)?;
        if let Some(blended) = view.blended(level) {
            relevancy.iter_mut().zip(&blended.alpha).filter(|(_, a)| **a == 0.0).for_each(|(r, _)| *r = 0.0);
        }
        Ok(relevancy)
    }

    /// As [`Self::pixel_relevancy`], with the relevancy that the methods compute where nothing is.
    pub(crate) fn relevancy_of_method(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        level: usize,
        phrase: ForeignPhrase<'_>,
    ) -> Result<Vec<f32>, ForeignError> {
        self.relevancy_everywhere(renderer, view, level, phrase, UNDECIDED)
    }

    fn relevancy_everywhere(
        &self,
        renderer: &mut Renderer,
        view: &ForeignView,
        level: usize,
        phrase: ForeignPhrase<'_>,
        of_nothing: f32,
    ) -> Result<Vec<f32>, ForeignError> {
        if let (LevelValues::Clusters(clusters), Some(LevelView::Winners(winners))) =
            (&self.level(level)?.values, view.levels.get(level))
        {
            let relevancy = self.cluster_relevancy(clusters, phrase)?;
            let of = |w: &LabelWinner| w.label.checked_sub(1).and_then(|c| relevancy.get(c as usize)).copied();
            return Ok(winners.iter().map(|w| of(w).unwrap_or(0.0)).collect());
        }
        let cosines = self.pixel_cosines(renderer, view, level, &all_of(phrase))?;
        Ok(relevancy_of(&cosines, phrase.temperature, of_nothing))
    }
}

/// The phrase and its canonical ones.
fn all_of<'a>(phrase: ForeignPhrase<'a>) -> Vec<&'a [f32]> {
    std::iter::once(phrase.query).chain(phrase.canonical.iter().map(Vec::as_slice)).collect()
}

/// Relevancy from the cosines with the phrase, and those with the canonical phrases. What has no direction, and so
/// cosines of 0 with all, gets `of_nothing`.
fn relevancy_of(cosines: &[Vec<f32>], temperature: f32, of_nothing: f32) -> Vec<f32> {
    let Some((query, canonical)) = cosines.split_first() else { return Vec::new() };
    let one = |i: usize| match cosines.iter().all(|c| c[i] == 0.0) {
        true => of_nothing,
        false => score(query[i] - nearest(canonical.iter().map(|c| c[i])), temperature),
    };
    (0..query.len()).into_par_iter().with_min_len(1 << 12).map(one).collect()
}

/// Cosines of clusters with phrases; 0 for clusters without an embedding.
pub(crate) fn cluster_cosines(clusters: &ClusterLevel, phrases: &[&[f32]]) -> Vec<Vec<f32>> {
    let units: Vec<Option<Vec<f32>>> = (0..clusters.features.len()).map(|k| unit(&clusters.features.row(k))).collect();
    let of = |phrase: &&[f32]| units.iter().map(|u| u.as_ref().map_or(0.0, |u| dot(u, phrase))).collect();
    phrases.iter().map(of).collect()
}
