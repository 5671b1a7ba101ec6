//! Nearest neighbors of each Gaussian, and selections that grow and shrink by them.

use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::scene::GaussianCloud;

/// Neighbors of each Gaussian.
const NEIGHBORS: usize = 8;
/// Placeholder for a missing neighbor.
const NONE: u32 = u32::MAX;
/// Gaussians in the search between two progress reports.
const BLOCK: usize = 1 << 14;

/// Nearest neighbors of each Gaussian, the nearest first; `NONE` for missing ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct SplatNeighbors(Vec<[u32; NEIGHBORS]>);

impl SplatNeighbors {
    /// Finds the neighbors.
    ///
    /// # Errors
    /// If the observer cancels.
    pub(crate) fn new(cloud: &GaussianCloud, observer: &mut dyn Observer) -> Result<Self, Interrupted> {
        let first = |of: &Vec<(u32, f32)>| std::array::from_fn(|k| of.get(k).map_or(NONE, |n| n.0));
        Ok(Self(search(cloud, observer)?.iter().map(first).collect()))
    }

    /// Adds all neighbors of the selected Gaussians to a selection.
    pub(crate) fn grown(&self, selected: &[bool]) -> Vec<bool> {
        let mut grown = selected.to_vec();
        for near in self.0.iter().zip(selected).filter(|(_, is_in)| **is_in).map(|(near, _)| near) {
            near.iter().filter(|j| **j != NONE).for_each(|j| grown[*j as usize] = true);
        }
        grown
    }

    /// Removes Gaussians with an unselected neighbor from a selection.
    pub(crate) fn shrunk(&self, selected: &[bool]) -> Vec<bool> {
        let is_inner = |near: &[u32; NEIGHBORS]| near.iter().all(|j| *j == NONE || selected[*j as usize]);
        self.0.iter().zip(selected).map(|(near, is_in)| *is_in && is_inner(near)).collect()
    }
}

/// Finds the nearest neighbors of each Gaussian with their distances, the nearest first.
pub(super) fn search(cloud: &GaussianCloud, observer: &mut dyn Observer) -> Result<Vec<Vec<(u32, f32)>>, Interrupted> {
    let place = |i: usize| cloud.positions[i].map(f64::from);
    let tree = RTree::bulk_load((0..cloud.len()).map(|i| GeomWithData::new(place(i), i as u32)).collect());
    let of = |i: usize| {
        let near = tree.nearest_neighbor_iter_with_distance_2(place(i)).filter(|(n, _)| n.data != i as u32);
        near.take(NEIGHBORS).map(|(n, d)| (n.data, d.sqrt() as f32)).collect()
    };
    let mut ticker = Ticker::new("Looking for neighbors", cloud.len());
    let mut all = Vec::with_capacity(cloud.len());
    for from in (0..cloud.len()).step_by(BLOCK) {
        ticker.tick(from, observer)?;
        let to = (from + BLOCK).min(cloud.len());
        all.par_extend((from..to).into_par_iter().map(of));
    }
    Ok(all)
}
