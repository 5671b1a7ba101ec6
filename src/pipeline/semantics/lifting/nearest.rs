//! The nearest Gaussians of every Gaussian.

use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::scene::GaussianCloud;

/// The nearest Gaussians of each, by index and squared distance, nearest first.
pub(crate) type NearestGaussians = Vec<Vec<(usize, f64)>>;

/// Returns, for every Gaussian, its `n` nearest ones, by index and squared distance, nearest first.
pub(super) fn nearest(cloud: &GaussianCloud, n: usize) -> NearestGaussians {
    let points: Vec<GeomWithData<[f64; 3], usize>> =
        cloud.positions.iter().enumerate().map(|(i, p)| GeomWithData::new(p.map(f64::from), i)).collect();
    let tree = RTree::bulk_load(points.clone());
    let around = |p: &GeomWithData<[f64; 3], usize>| {
        let near = tree.nearest_neighbor_iter_with_distance_2(*p.geom()).take(n + 1);
        near.map(|(q, far2)| (q.data, far2)).filter(|(q, _)| *q != p.data).take(n).collect()
    };
    points.par_iter().map(around).collect()
}
