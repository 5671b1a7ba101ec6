//! Clusters with several embeddings, each with a weight (LaGa's descriptors): for each cluster, the embedding of the
//! largest weighed relevancy answers a phrase.

use crate::io::results::ClusterLevel;
use crate::math::vector::unit;

/// Answer of the best embedding of a cluster, or of those of a Gaussian's clusters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DescriptorAnswer {
    /// Relevancy times weight, 0 or more.
    pub(crate) relevancy: f32,
    /// Cosine with the phrase.
    pub(crate) cosine: f32,
}

/// Answers of clusters from the relevancy of all embeddings and their cosines with the phrase.
pub(crate) fn answers(clusters: &ClusterLevel, relevancy: &[f32], cosines: &[f32]) -> Vec<DescriptorAnswer> {
    let of = |k: usize| {
        let weighed = clusters.weighted(k).map(|(row, weight)| (row, relevancy[row] * weight));
        let best = weighed.reduce(|best, other| if other.1 > best.1 { other } else { best });
        let answer = |(row, value): (usize, f32)| DescriptorAnswer { relevancy: value.max(0.0), cosine: cosines[row] };
        best.map_or(DescriptorAnswer { relevancy: 0.0, cosine: 0.0 }, answer)
    };
    (0..clusters.count()).map(of).collect()
}

/// The largest cosine of each cluster's embeddings; 0 for clusters without any of weight.
pub(crate) fn nearest(clusters: &ClusterLevel, cosines: &[f32]) -> Vec<f32> {
    let of = |k: usize| {
        let counting = clusters.weighted(k).filter(|(_, weight)| *weight > 0.0);
        counting.map(|(row, _)| cosines[row]).reduce(f32::max).unwrap_or(0.0)
    };
    (0..clusters.count()).map(of).collect()
}

/// The direction of a cluster: its embedding, or the weighed mean of several; `None` if it has none.
pub(crate) fn direction(clusters: &ClusterLevel, k: usize) -> Option<Vec<f32>> {
    let mut sum = vec![0.0; clusters.features.dim()];
    for (row, weight) in clusters.weighted(k) {
        sum.iter_mut().zip(clusters.features.row(row)).for_each(|(sum, v)| *sum += weight * v);
    }
    unit(&sum)
}
