//! LaGa's choice of Gaussians.
//!
//! A Gaussian's relevancy is the mean over the levels of that of its cluster, and its cosine the largest. LaGa takes
//! relevancies under the lower quartile for the quartile, spreads them over 0 to 1, and keeps those of 0.6 or more
//! whose cosine is 0.23 or more. It then smooths the choice over neighbors of like color, if the scene is not too large
//! for that; here it is not smoothed.

use super::asked::ForeignScene;
use super::descriptors::DescriptorAnswer;
use super::{ForeignError, ForeignPhrase};
use crate::io::results::LevelValues;
use crate::math::stats::quantile;

/// Share of the Gaussians that is irrelevant.
const IRRELEVANT: f64 = 0.25;
/// Least relevancy of a chosen Gaussian, from 0 for the irrelevant ones to 1 for the largest.
const LEAST_SCORE: f32 = 0.6;
/// Least cosine of a chosen Gaussian.
const LEAST_COSINE: f32 = 0.23;

impl ForeignScene {
    /// Answers of the Gaussians over all levels.
    pub(crate) fn descriptor_answers(&self, phrase: ForeignPhrase<'_>) -> Result<Vec<DescriptorAnswer>, ForeignError> {
        let nothing = DescriptorAnswer { relevancy: 0.0, cosine: f32::NEG_INFINITY };
        let mut all = vec![nothing; self.result.cloud.len()];
        let levels = self.result.levels.len() as f32;
        for level in &self.result.levels {
            let LevelValues::Clusters(clusters) = &level.values else { continue };
            let of_clusters = self.cluster_answers(clusters, phrase)?;
            for (all, of) in all.iter_mut().zip(&clusters.of) {
                if let Some(own) = of.map(|k| of_clusters[k as usize]) {
                    all.relevancy += own.relevancy / levels;
                    all.cosine = all.cosine.max(own.cosine);
                }
            }
        }
        Ok(all)
    }

    /// Returns for each Gaussian whether LaGa chooses it.
    pub(crate) fn chosen_by_descriptors(&self, phrase: ForeignPhrase<'_>) -> Result<Vec<bool>, ForeignError> {
        let answers = self.descriptor_answers(phrase)?;
        let relevancy: Vec<f64> = answers.iter().map(|a| f64::from(a.relevancy)).collect();
        let least = quantile(&relevancy, IRRELEVANT) as f32;
        let range = answers.iter().map(|a| a.relevancy).fold(0.0, f32::max) - least;
        let is = |a: &DescriptorAnswer| {
            range > 0.0 && (a.relevancy - least) / range >= LEAST_SCORE && a.cosine >= LEAST_COSINE
        };
        Ok(answers.iter().map(is).collect())
    }
}
