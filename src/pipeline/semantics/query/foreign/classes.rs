//! Classes of Gaussians and pixels by a linear classifier (Gaussian Grouping, Gaga).

use rayon::prelude::*;

use super::blend::BlendedCodes;
use crate::io::results::{Classifier, FeatureRows};
use crate::math::vector::dot;

/// Rows per thread.
const ROWS_PER_TASK: usize = 1 << 8;

/// The most likely class, and its share over that of the second, by a softmax over all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LikelyClass {
    /// Number of the class.
    pub class: u32,
    /// Difference of the largest two shares.
    pub margin: f32,
}

/// A classifier as it is used.
struct ReadyClassifier<'a> {
    dim: usize,
    weight: Vec<f32>,
    bias: &'a [f32],
}

impl<'a> ReadyClassifier<'a> {
    fn new(classifier: &'a Classifier) -> Self {
        Self { dim: classifier.weight.dim(), weight: classifier.weight.to_vec(), bias: &classifier.bias }
    }

    /// Shares of all classes: a softmax over their scores.
    fn shares(&self, feature: &[f32]) -> Vec<f32> {
        let scores = self.weight.chunks_exact(self.dim).zip(self.bias);
        let mut all: Vec<f32> = scores.map(|(w, b)| dot(w, feature) + b).collect();
        let most = all.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        all.iter_mut().for_each(|v| *v = (*v - most).exp());
        let sum: f32 = all.iter().sum();
        all.iter_mut().for_each(|v| *v /= sum);
        all
    }

    fn share(&self, feature: &[f32], class: u32) -> f32 {
        self.shares(feature).get(class as usize).copied().unwrap_or(0.0)
    }
}

fn likely(shares: &[f32]) -> LikelyClass {
    let class = (0..shares.len()).reduce(|a, b| if shares[b] > shares[a] { b } else { a }).unwrap_or(0);
    let second = (0..shares.len()).filter(|c| *c != class).map(|c| shares[c]).fold(0.0, f32::max);
    LikelyClass { class: class as u32, margin: shares.get(class).copied().unwrap_or(0.0) - second }
}

/// The most likely class of each Gaussian; of equal ones, the first.
pub fn of_gaussians(classifier: &Classifier, features: &FeatureRows) -> Vec<LikelyClass> {
    let ready = ReadyClassifier::new(classifier);
    gaussians(features, |feature| likely(&ready.shares(feature)))
}

/// The most likely class of each pixel.
pub fn of_pixels(classifier: &Classifier, blended: &BlendedCodes) -> Vec<u32> {
    let ready = ReadyClassifier::new(classifier);
    pixels(blended, |feature| likely(&ready.shares(feature)).class)
}

/// The share of a class at each pixel.
pub fn share_at_pixels(classifier: &Classifier, blended: &BlendedCodes, class: u32) -> Vec<f32> {
    let ready = ReadyClassifier::new(classifier);
    pixels(blended, |feature| ready.share(feature, class))
}

/// The share of a class of each Gaussian.
pub fn share_of_gaussians(classifier: &Classifier, features: &FeatureRows, class: u32) -> Vec<f32> {
    let ready = ReadyClassifier::new(classifier);
    gaussians(features, |feature| ready.share(feature, class))
}

/// Answers each Gaussian from its feature.
pub(crate) fn gaussians<T: Send>(features: &FeatureRows, of: impl Fn(&[f32]) -> T + Sync) -> Vec<T> {
    let one = |own: &mut Vec<f32>, i: usize| {
        features.copy(i, 0, own);
        of(own)
    };
    let all = (0..features.len()).into_par_iter().with_min_len(ROWS_PER_TASK);
    all.map_init(|| vec![0.0; features.dim()], one).collect()
}

/// Answers each pixel from its blended numbers.
pub(crate) fn pixels<T: Send>(blended: &BlendedCodes, of: impl Fn(&[f32]) -> T + Sync) -> Vec<T> {
    let one = |own: &mut Vec<f32>, i: usize| {
        own.iter_mut().zip(&blended.planes).for_each(|(v, plane)| *v = plane[i]);
        of(own)
    };
    let all = (0..blended.alpha.len()).into_par_iter().with_min_len(ROWS_PER_TASK);
    all.map_init(|| vec![0.0; blended.planes.len()], one).collect()
}
