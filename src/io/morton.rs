//! Gaussians in an order in which those that lie together are near one another: quantized formats need it, and it
//! packs better.

use rayon::prelude::*;

use crate::scene::GaussianCloud;

/// Bits of a coordinate.
const BITS: u32 = 21;

/// Indices of the Gaussians along a Z-order curve through their bounds, the same for the same cloud.
pub(crate) fn order(cloud: &GaussianCloud) -> Vec<usize> {
    let ends = |end: fn(f32, f32) -> f32, from: f32| {
        cloud.positions.iter().fold([from; 3], |a, p| [0, 1, 2].map(|k| end(a[k], p[k])))
    };
    let (min, max) = (ends(f32::min, f32::INFINITY), ends(f32::max, f32::NEG_INFINITY));
    let step = [0, 1, 2].map(|k| f64::from((1 << BITS) - 1) / (f64::from(max[k]) - f64::from(min[k])).max(1e-30));
    let code = |p: &[f32; 3]| {
        let of = |k: usize| spread(((f64::from(p[k]) - f64::from(min[k])) * step[k]) as u64);
        of(0) | of(1) << 1 | of(2) << 2
    };
    let mut all: Vec<(u64, usize)> = cloud.positions.par_iter().map(code).zip(0..cloud.len()).collect();
    all.par_sort_unstable();
    all.into_iter().map(|(_, i)| i).collect()
}

/// The low 21 bits, two zeros between each.
fn spread(v: u64) -> u64 {
    let mut v = v & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        v = (v | v << shift) & mask;
    }
    v
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
        assert_eq!((spread(0b111), spread(0x1f_ffff).count_ones()), (0b1_001_001, 21));
        // All in one place: nothing is divided by nothing.
        assert_eq!(super::order(&GaussianCloud::isotropic(vec![[2.0; 3]; 3], 0.0, 0.0)), [0, 1, 2]);
        assert!(super::order(&GaussianCloud::default()).is_empty());
    }
}
