//! Objects of features that are alike where Gaussians belong together, as SAGA finds them: HDBSCAN on a sample, and the
//! most alike center for all others.

use std::collections::HashSet;

use hdbscan::{Hdbscan, HdbscanHyperParams};
use rand::SeedableRng;
use rand::seq::index;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::classes::gaussians;
use super::click::weighed;
use crate::io::results::{FeatureRows, ScaleGate};
use crate::math::vector::{dot, unit};

/// Share of the Gaussians that is clustered.
const SAMPLED: f64 = 0.02;
/// Bounds of the sample: the time grows with its square.
const FEWEST: usize = 1_000;
const MOST: usize = 10_000;
/// Fewest samples of an object.
const LEAST_SIZE: usize = 10;
/// Distance under which clusters are not split.
const EPSILON: f64 = 0.01;
const SEED: u64 = 0;

/// Finds objects at a scale from 0 (details) to 1 (the largest things): the number of each Gaussian's, from 0; `None`
/// for features without direction. All `None` if nothing stands out.
pub fn objects(features: &FeatureRows, gate: Option<&ScaleGate>, scale: f32) -> Vec<Option<u32>> {
    let n = features.len();
    let weights = gate.map_or_else(|| vec![1.0; features.dim()], |gate| gate.at(scale));
    let mut rng = Pcg64Mcg::seed_from_u64(SEED);
    let amount = ((n as f64 * SAMPLED) as usize).clamp(FEWEST, MOST).min(n);
    let mut chosen = index::sample(&mut rng, n, amount).into_vec();
    chosen.sort_unstable();
    let direction = |feature: &[f32]| unit(&weighed(feature, &weights));
    let mut sample: Vec<Vec<f32>> = chosen.iter().filter_map(|i| direction(&features.row(*i))).collect();
    // Equal ones have no distance, by which the algorithm divides.
    let mut known = HashSet::new();
    sample.retain(|v| known.insert(v.iter().map(|x| x.to_bits()).collect::<Vec<u32>>()));
    let centers = centers(&sample);
    let nearest = |feature: &[f32]| {
        let own = direction(feature)?;
        let alike = centers.iter().map(|c| dot(c, &own)).enumerate();
        alike.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|(k, _)| k as u32)
    };
    gaussians(features, nearest)
}

/// Unit vectors in the middle of the clusters of a sample.
fn centers(sample: &[Vec<f32>]) -> Vec<Vec<f32>> {
    if sample.len() < 2 * LEAST_SIZE {
        return Vec::new();
    }
    let choices = HdbscanHyperParams::builder().min_cluster_size(LEAST_SIZE).epsilon(EPSILON).build();
    let labels = Hdbscan::new(sample, choices).cluster().unwrap_or_default();
    let count = labels.iter().max().map_or(0, |most| usize::try_from(*most + 1).unwrap_or(0));
    let mean = |k: usize| {
        let members = sample.iter().zip(&labels).filter(|(_, label)| **label == k as i32).map(|(v, _)| v);
        let mut sum = vec![0.0; sample[0].len()];
        members.for_each(|v| sum.iter_mut().zip(v).for_each(|(s, v)| *s += v));
        unit(&sum)
    };
    (0..count).into_par_iter().filter_map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Features of 300 Gaussians in `kinds` directions with a little noise, and one without direction.
    fn in_directions(kinds: usize) -> FeatureRows {
        let row = |i: usize| {
            let noise = [3_u64, 5, 7].map(|k| ((i as u64 * 7919 * k) % 101) as f32 * 1e-4);
            std::array::from_fn::<f32, 3, _>(|c| noise[c] + f32::from(u8::from(c == i % kinds)))
        };
        let mut values: Vec<f32> = (0..300).flat_map(row).collect();
        values.extend([0.0; 3]);
        FeatureRows::new(3, values).expect("whole rows")
    }

    #[test]
    fn features_of_one_direction_are_an_object() {
        for kinds in [2, 3] {
            let found = objects(&in_directions(kinds), None, 0.5);
            assert_eq!(found[300], None);
            let mut numbers: Vec<Option<u32>> = found[..kinds].to_vec();
            numbers.sort_unstable();
            numbers.dedup();
            assert_eq!(numbers.len(), kinds, "{numbers:?}");
            assert!((0..300).all(|i| found[i] == found[i % kinds]));
        }
    }

    #[test]
    fn equal_features_are_no_reason_to_fail() {
        let equal = FeatureRows::new(2, [1.0, 0.0].repeat(200)).expect("whole rows");
        assert!(objects(&equal, None, 0.5).iter().all(|id| *id == objects(&equal, None, 0.5)[0]));
        assert!(objects(&FeatureRows::default(), None, 0.5).is_empty());
    }
}
