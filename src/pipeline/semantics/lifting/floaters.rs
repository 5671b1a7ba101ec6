//! Floaters carry no identity: small pieces of a connected object that hang apart in the air become unknown, whatever
//! votes or their neighbors say.

use std::collections::HashMap;

use rstar::RTree;

use super::votes::Assignment;
use crate::math::stats::median;
use crate::scene::{GaussianCloud, Identities, IdentityId, NO_IDENTITY};

/// Typical distances between Gaussians that connect an object.
const REACH: f64 = 12.0;
/// Neighbor that gives the typical distance.
const NEIGHBOR: usize = 3;
/// Gaussians sampled for the typical distance.
const SAMPLE: usize = 4_096;
/// Least share of its Gaussians in the largest piece of a connected object: a pile of leaves has less.
const WHOLE: f64 = 0.97;
/// Share of its Gaussians under which a piece is a floater.
const CRUMB: f64 = 0.005;

/// Takes the identity from floaters, so that they become unknown.
pub(crate) fn drop_floaters(cloud: &GaussianCloud, identities: &Identities, assignments: &mut [Assignment]) {
    let place = |i: usize| cloud.positions[i].map(f64::from);
    let tree = RTree::bulk_load((0..cloud.len()).map(place).collect());
    let far = |i: usize| tree.nearest_neighbor_iter_with_distance_2(place(i)).nth(NEIGHBOR).map(|(_, d)| d.sqrt());
    let step = cloud.len().div_ceil(SAMPLE).max(1);
    let reach = REACH * median(&(0..cloud.len()).step_by(step).filter_map(far).collect::<Vec<_>>());
    if !(reach > 0.0 && reach.is_finite()) {
        return;
    }
    let mut members: HashMap<IdentityId, Vec<usize>> = HashMap::new();
    for (i, a) in assignments.iter().enumerate() {
        let object = identities.object_of(a.identity);
        if object != NO_IDENTITY {
            members.entry(object).or_default().push(i);
        }
    }
    for all in members.values() {
        let pieces = pieces(all, place, reach);
        let largest = pieces.iter().map(Vec::len).max().unwrap_or(0);
        if (largest as f64) < WHOLE * all.len() as f64 {
            continue;
        }
        for crumb in pieces.iter().filter(|p| (p.len() as f64) < CRUMB * all.len() as f64) {
            crumb.iter().for_each(|&i| assignments[i] = Assignment { identity: NO_IDENTITY, margin: 0.0 });
        }
    }
}

/// Returns the connected components of `all` in steps of at most `reach`.
fn pieces(all: &[usize], place: impl Fn(usize) -> [f64; 3], reach: f64) -> Vec<Vec<usize>> {
    let cell = |p: [f64; 3]| p.map(|v| (v / reach).floor() as i64);
    // Gaussians in no piece yet; none is visited again once it is in one, however dense they lie.
    let mut left: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    all.iter().for_each(|&i| left.entry(cell(place(i))).or_default().push(i));
    let mut pieces = Vec::new();
    for &first in all {
        let Some(own) = left.get_mut(&cell(place(first))) else { continue };
        let Some(at) = own.iter().position(|i| *i == first) else { continue };
        own.swap_remove(at);
        let (mut piece, mut next) = (vec![first], 0);
        while let Some(&i) = piece.get(next) {
            next += 1;
            let (p, [x, y, z]) = (place(i), cell(place(i)));
            let around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
            for key in around {
                let Some(others) = left.get_mut(&key) else { continue };
                let is_near = |j: &usize| {
                    let d = place(*j);
                    (0..3).map(|c| (d[c] - p[c]).powi(2)).sum::<f64>() <= reach * reach
                };
                piece.extend(others.extract_if(.., |j| is_near(j)));
            }
        }
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    /// A dense block of `n` Gaussians, and others in the air.
    fn block(n: usize, apart: &[[f32; 3]]) -> GaussianCloud {
        let at = |i: usize| [(i % 10) as f32 * 0.01, (i / 10 % 10) as f32 * 0.01, (i / 100) as f32 * 0.01];
        GaussianCloud::isotropic((0..n).map(at).chain(apart.iter().copied()).collect(), -5.0, 2.0)
    }

    fn dropped(cloud: &GaussianCloud, of: impl Fn(usize) -> IdentityId) -> Vec<usize> {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        all.add(Level::Part, doll, vec![]);
        all.add(Level::Object, NO_IDENTITY, vec![]);
        let before: Vec<Assignment> = (0..cloud.len()).map(|i| Assignment { identity: of(i), margin: 0.9 }).collect();
        let mut after = before.clone();
        drop_floaters(cloud, &all, &mut after);
        let gone = |i: &usize| after[*i] != before[*i];
        let list: Vec<usize> = (0..cloud.len()).filter(gone).collect();
        assert!(
            list.iter().all(|&i| after[i] == Assignment { identity: NO_IDENTITY, margin: 0.0 }),
            "they are unknown"
        );
        list
    }

    #[test]
    fn crumbs_in_the_air_lose_their_identity_and_what_is_near_keeps_it() {
        // Eleven and thirteen usual distances above the block, and one beside that.
        let cloud = block(1_000, &[[0.0, 0.0, 0.2], [0.0, 0.0, 0.33], [0.0, 0.0, 0.335], [2.0, 0.0, 0.0]]);
        assert_eq!(dropped(&cloud, |_| 1), [1_001, 1_002, 1_003]);
        assert_eq!(dropped(&cloud, |i| if i % 2 == 0 { 1 } else { 2 }), [1_001, 1_002, 1_003], "parts hang together");
        assert_eq!(dropped(&cloud, |i| if i < 1_000 { 1 } else { NO_IDENTITY }), [0; 0]);
        // As an object of their own they are all there is of it.
        assert_eq!(dropped(&cloud, |i| if i < 1_000 { 1 } else { 3 }), [0; 0]);
        assert!(dropped(&GaussianCloud::default(), |_| 1).is_empty());
    }

    #[test]
    fn what_does_not_hang_together_and_what_is_no_crumb_stays() {
        // Thirty of a thousand lie apart: three percent and more.
        let away: Vec<[f32; 3]> = (0..40).map(|i| [1.0 + i as f32, 0.0, 0.0]).collect();
        assert_eq!(dropped(&block(1_000, &away), |_| 1), [0; 0], "it lies about");
        assert_eq!(dropped(&block(1_000, &away[..20]), |_| 1).len(), 20, "the control");
        // Six of a thousand in one place are a piece.
        let six = [[2.0, 0.0, 0.0]; 6];
        assert_eq!(dropped(&block(1_000, &six), |_| 1), [0; 0]);
        assert_eq!(dropped(&block(1_000, &six[..5]), |_| 1).len(), 5);
    }
}
