//! Clicks on features that are alike where Gaussians belong together (SAGA, OmniSeg3D-GS).
//!
//! SAGA weighs the channels by a scale. The feature of a pixel is the unit vector of its blend, weighed, and again of
//! unit length; a Gaussian's is its weighed feature of unit length. The score is `(1 + cosine) / 2`.

use super::blend::BlendedCodes;
use super::classes::{gaussians, pixels};
use crate::io::results::{FeatureRows, ScaleGate};
use crate::math::vector::{dot, unit};

/// A clicked feature, and the weights of the channels with which others are compared with it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClickedFeature {
    wanted: Vec<f32>,
    weights: Vec<f32>,
}

impl ClickedFeature {
    /// The feature at a pixel; `scale` is from 0 (details) to 1 (the largest things). `None` where nothing is.
    pub fn at(blended: &BlendedCodes, x: usize, y: usize, gate: Option<&ScaleGate>, scale: f32) -> Option<Self> {
        let inside = x < blended.width_px && y < blended.height_px;
        let i = inside.then(|| y * blended.width_px + x)?;
        let blend: Vec<f32> = blended.planes.iter().map(|plane| plane[i]).collect();
        let weights = gate.map_or_else(|| vec![1.0; blend.len()], |gate| gate.at(scale));
        let wanted = unit(&weighed(&unit(&blend)?, &weights))?;
        Some(Self { wanted, weights })
    }

    fn score(&self, feature: &[f32]) -> f32 {
        let own = unit(&weighed(feature, &self.weights));
        own.map_or(0.0, |own| 0.5 * (1.0 + dot(&own, &self.wanted)))
    }

    /// Scores of all Gaussians, 0 to 1.
    pub fn gaussians(&self, features: &FeatureRows) -> Vec<f32> {
        gaussians(features, |feature| self.score(feature))
    }

    /// Scores of all pixels, 0 to 1; 0 where nothing is.
    pub fn pixels(&self, blended: &BlendedCodes) -> Vec<f32> {
        pixels(blended, |blend| unit(blend).map_or(0.0, |own| self.score(&own)))
    }
}

/// A feature with its channels weighed.
pub(crate) fn weighed(feature: &[f32], weights: &[f32]) -> Vec<f32> {
    feature.iter().zip(weights).map(|(v, w)| v * w).collect()
}
