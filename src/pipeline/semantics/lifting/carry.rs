//! Objects and parts carried from some Gaussians to others of the same scene, by place.
//!
//! Used when training resumes: Gaussians have moved a little, some are gone, some are new.

use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::scene::{GaussianCloud, NO_IDENTITY, SemanticMap};

/// Reach of a Gaussian, in standard deviations along its longest axis: points farther from its center take nothing
/// from it.
const REACH: f64 = 2.0;

/// Returns the map of `from` for the Gaussians `to`, and the share of `to` that is reached. Each takes identity and
/// codes of the nearest Gaussian that reaches it.
pub(crate) fn carry(map: &SemanticMap, from: &GaussianCloud, to: &GaussianCloud) -> (SemanticMap, f64) {
    let to: Vec<DVec3> = (0..to.len()).map(|i| to.world_position(i)).collect();
    carry_by(map, &nearest(from, &to))
}

/// The same for known nearest Gaussians.
pub(crate) fn carry_by(map: &SemanticMap, nearest: &[Option<usize>]) -> (SemanticMap, f64) {
    let of = nearest.iter().map(|n| n.map_or(NO_IDENTITY, |i| map.identity_of[i])).collect();
    let margin = nearest.iter().map(|n| n.map_or(0.0, |i| map.margin[i])).collect();
    let mut carried = SemanticMap::from_identities(map.identities.clone(), of, margin, map.seeds.clone());
    // Codes may have been trained, so that they are not those of the identities.
    for (codes, near) in carried.codes.iter_mut().zip(nearest) {
        *codes = near.map_or(*codes, |i| map.codes[i]);
    }
    carried.prepared = map.prepared;
    carried.removed.clone_from(&map.removed);
    carried.language.clone_from(&map.language);
    carried.findings.clone_from(&map.findings);
    let reached = nearest.iter().flatten().count();
    (carried, reached as f64 / nearest.len().max(1) as f64)
}

/// Returns, for each point, the nearest Gaussian if it reaches the point.
pub(crate) fn nearest(from: &GaussianCloud, points: &[DVec3]) -> Vec<Option<usize>> {
    let all = (0..from.len()).map(|i| GeomWithData::new(from.world_position(i).to_array(), i)).collect();
    let tree = RTree::bulk_load(all);
    let one = |at: &DVec3| -> Option<usize> {
        let (near, distance_2) = tree.nearest_neighbor_iter_with_distance_2(at.to_array()).next()?;
        let longest = from.log_scales[near.data].iter().fold(f32::NEG_INFINITY, |m, s| m.max(*s));
        (distance_2.sqrt() <= REACH * f64::from(longest).exp()).then_some(near.data)
    };
    points.par_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level};

    fn cloud(xs: &[f32], origin: DVec3) -> GaussianCloud {
        GaussianCloud {
            origin,
            log_scales: vec![[0.1_f32.ln(), -9.0, -9.0]; xs.len()],
            ..GaussianCloud::isotropic(xs.iter().map(|x| [*x, 0.0, 0.0]).collect(), 0.0, 0.0)
        }
    }

    #[test]
    fn gaussians_take_what_reaches_them() {
        let mut identities = Identities::default();
        let (a, b) =
            (identities.add(Level::Object, NO_IDENTITY, vec![]), identities.add(Level::Object, NO_IDENTITY, vec![]));
        let mut map = SemanticMap::from_identities(identities, vec![a, b], vec![0.5, 1.0], vec!["photo".into()]);
        map.codes[1][0] = 0.125;
        let from = cloud(&[0.0, 1.0], DVec3::ZERO);
        // Moved, cloned, exchanged, in another frame, and one unlabeled: 0.3 off, three deviations.
        let to = cloud(&[-8.95, -9.99, -10.19, -8.7], DVec3::X * 10.0);
        let (carried, share) = carry(&map, &from, &to);
        assert_eq!(carried.identity_of, [b, a, a, NO_IDENTITY]);
        assert_eq!(carried.margin, [1.0, 0.5, 0.5, 0.0]);
        assert_eq!((carried.codes[0], carried.codes[1]), (map.codes[1], map.codes[0]));
        assert_eq!(
            carried.codes[3],
            SemanticMap::from_identities(Identities::default(), vec![0], vec![0.0], vec![]).codes[0]
        );
        assert_eq!((share, carried.seeds), (0.75, map.seeds.clone()));
        assert_eq!(carry(&map, &from, &from).0, map, "the same Gaussians keep everything");
        assert!(carry(&map, &from, &GaussianCloud::default()).0.identity_of.is_empty());
    }
}
