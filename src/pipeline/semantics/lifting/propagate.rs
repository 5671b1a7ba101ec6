//! Identities of Gaussians that no labeled photo saw, inherited from nearby Gaussians.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::nearest::{NearestGaussians, nearest};
use super::votes::{Assignment, UNKNOWN};
use crate::math::sh::SH_C0;
use crate::math::stats::median;
use crate::scene::{GaussianCloud, NO_IDENTITY};

/// Neighbors of a Gaussian.
const NEIGHBORS: usize = 8;
/// Length of a full step in color, in typical distances between neighbors.
const COLOR_WEIGHT: f64 = 12.0;

/// Labels every Gaussian without a vote like the nearest one with a vote along the graph of neighbors, up to
/// `farthest` typical distances between neighbors. Steps are longer the more the colors differ. Unlabeled Gaussians
/// are inherited from like the rest; without any near vote, a Gaussian becomes unlabeled. `known` are at least
/// [`NEIGHBORS`] nearest Gaussians of each, if they have been sought.
pub(crate) fn extend(
    cloud: &GaussianCloud,
    known: Option<NearestGaussians>,
    assignments: &mut [Assignment],
    farthest: f64,
) {
    if assignments.iter().all(|b| b.identity != UNKNOWN) {
        return;
    }
    let near = known.unwrap_or_else(|| nearest(cloud, NEIGHBORS));
    let spacing =
        median(&near.iter().filter_map(|n| n.first()).map(|n| n.1.sqrt()).filter(|d| *d > 0.0).collect::<Vec<_>>());
    let spacing = if spacing.is_finite() { spacing } else { 1.0 };
    let stride = cloud.sh_stride();
    let color = |i: usize| cloud.sh[i * stride].map(|c| f64::from(c) * SH_C0);
    let step = |i: usize, j: usize, d: f64| {
        let (a, b) = (color(i), color(j));
        d / spacing + COLOR_WEIGHT * a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };

    // Edges count in both directions: isolated Gaussians have neighbors that do not have them.
    let mut edges: Vec<Vec<(usize, f64)>> = vec![Vec::new(); near.len()];
    for (i, neighbors) in near.iter().enumerate() {
        for &(j, far2) in neighbors.iter().take(NEIGHBORS) {
            let length = step(i, j, far2.sqrt());
            edges[i].push((j, length));
            edges[j].push((i, length));
        }
    }
    let mut distance: Vec<f64> =
        assignments.iter().map(|b| if b.identity == UNKNOWN { f64::INFINITY } else { 0.0 }).collect();
    // Non-negative floats order like their bits.
    let mut open: BinaryHeap<Reverse<(u64, usize)>> =
        (0..near.len()).filter(|&i| distance[i] == 0.0).map(|i| Reverse((0, i))).collect();
    while let Some(Reverse((bits, i))) = open.pop() {
        if f64::from_bits(bits) > distance[i] {
            continue;
        }
        for &(j, length) in &edges[i] {
            let far = distance[i] + length;
            if far < distance[j] && far <= farthest {
                distance[j] = far;
                assignments[j] = Assignment { identity: assignments[i].identity, margin: 0.0 };
                open.push(Reverse((far.to_bits(), j)));
            }
        }
    }
    for b in assignments.iter_mut().filter(|b| b.identity == UNKNOWN) {
        b.identity = NO_IDENTITY;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of Gaussians, red up to `edge`, blue from there.
    fn row(n: usize, edge: usize) -> GaussianCloud {
        GaussianCloud {
            sh: (0..n).map(|i| if i < edge { [1.5, -1.5, -1.5] } else { [-1.5, -1.5, 1.5] }).collect(),
            ..GaussianCloud::isotropic((0..n).map(|i| [i as f32 * 0.01, 0.0, 0.0]).collect(), -5.0, 2.0)
        }
    }

    #[test]
    fn identities_spread_up_to_a_change_of_color() {
        let cloud = row(30, 18);
        let mut b = vec![Assignment { identity: UNKNOWN, margin: 0.0 }; 30];
        b[0].identity = 1;
        b[29].identity = NO_IDENTITY;
        extend(&cloud, None, &mut b, 40.0);
        assert!(b[..18].iter().all(|b| b.identity == 1), "{b:?}");
        assert!(b[18..].iter().all(|b| b.identity == NO_IDENTITY));
        // More neighbors than are needed, sought for something else, change nothing.
        let mut again = vec![Assignment { identity: UNKNOWN, margin: 0.0 }; 30];
        (again[0].identity, again[29].identity) = (1, NO_IDENTITY);
        let mut control = again.clone();
        extend(&cloud, Some(nearest(&cloud, NEIGHBORS + 2)), &mut again, 40.0);
        assert_eq!(again, b);
        extend(&cloud, Some(vec![Vec::new(); 30]), &mut control, 40.0);
        assert_ne!(control, b, "the control, without neighbors");
    }

    #[test]
    fn nothing_is_inherited_from_afar_or_overwritten() {
        let mut cloud = row(30, 30);
        for p in &mut cloud.positions[15..] {
            p[0] += 9.0;
        }
        let mut b = vec![Assignment { identity: UNKNOWN, margin: 0.0 }; 30];
        b[3] = Assignment { identity: 2, margin: 0.5 };
        extend(&cloud, None, &mut b, 40.0);
        assert!(b[..15].iter().all(|b| b.identity == 2) && b[15..].iter().all(|b| b.identity == NO_IDENTITY));
        assert_eq!((b[3].margin, b[4].margin), (0.5, 0.0));
        extend(&GaussianCloud::default(), None, &mut [], 40.0);
    }

    #[test]
    fn inheritance_ends_after_so_many_steps_and_a_change_of_color_costs_some() {
        // One step a Gaussian; half of red more costs six.
        for (jump, reach) in [(0.0, 40), (0.5, 34)] {
            let mut cloud = row(60, 60);
            cloud.sh[5..].iter_mut().for_each(|c| c[0] += (jump / SH_C0) as f32);
            let mut b = vec![Assignment { identity: UNKNOWN, margin: 0.0 }; 60];
            b[0].identity = 3;
            extend(&cloud, None, &mut b, 40.0);
            let reached = b.iter().filter(|b| b.identity == 3).count();
            // Half a step either way for rounding; the first one counts.
            assert!((reach..=reach + 1).contains(&reached), "{jump}: {reached}");
            assert!(
                b[..reached].iter().all(|b| b.identity == 3) && b[reached..].iter().all(|b| b.identity == NO_IDENTITY)
            );
        }
    }
}
