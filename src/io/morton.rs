//! Morton order of Gaussians, which puts neighbors in space near one another: quantized formats need it, and it
//! compresses better.

use rayon::prelude::*;

use crate::math::morton::{BITS, interleave};
use crate::scene::GaussianCloud;

/// Returns indices of the Gaussians along a Z-order curve through their bounds. The same cloud gives the same order.
pub(crate) fn order(cloud: &GaussianCloud) -> Vec<usize> {
    let ends = |end: fn(f32, f32) -> f32, from: f32| {
        cloud.positions.iter().fold([from; 3], |a, p| [0, 1, 2].map(|k| end(a[k], p[k])))
    };
    let (min, max) = (ends(f32::min, f32::INFINITY), ends(f32::max, f32::NEG_INFINITY));
    let step = [0, 1, 2].map(|k| f64::from((1 << BITS) - 1) / (f64::from(max[k]) - f64::from(min[k])).max(1e-30));
    let code = |p: &[f32; 3]| interleave([0, 1, 2].map(|k| ((f64::from(p[k]) - f64::from(min[k])) * step[k]) as u64));
    let mut all: Vec<(u64, usize)> = cloud.positions.par_iter().map(code).zip(0..cloud.len()).collect();
    all.par_sort_unstable();
    all.into_iter().map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_come_together() {
        let cube = |i: usize| [(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32];
        // Two clusters of eight, mixed.
        let positions = (0..16).map(|i| cube(i / 2).map(|v| v + 100.0 * (i % 2) as f32)).collect();
        let cloud = GaussianCloud::isotropic(positions, 0.0, 0.0);
        let order = order(&cloud);
        assert!(order[..8].iter().all(|i| i % 2 == 0) && order[8..].iter().all(|i| i % 2 == 1), "{order:?}");
        assert_eq!(order[..8], [0, 2, 4, 6, 8, 10, 12, 14]);
        // All in one place: there is no division by the zero extent.
        assert_eq!(super::order(&GaussianCloud::isotropic(vec![[2.0; 3]; 3], 0.0, 0.0)), [0, 1, 2]);
        assert!(super::order(&GaussianCloud::default()).is_empty());
    }
}
