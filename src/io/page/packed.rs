//! Compact encoding of Gaussians for a page: SPZ before its compression, in Morton order.

use std::io;

use glam::DVec3;

pub(crate) use crate::io::morton::order;
use crate::io::spz;
use crate::scene::{Axes, GaussianCloud, SplatRenderMode};

/// Encodes the cloud's Gaussians with the axes of browsers (x right, y up, z backward), centers relative to its origin;
/// `order` has the index in the cloud of each written Gaussian.
///
/// # Errors
/// If the cloud exceeds the range of the format.
pub(crate) fn encode(cloud: &GaussianCloud, order: &[usize], antialias: bool) -> io::Result<Vec<u8>> {
    let render_mode = if antialias { SplatRenderMode::Mip } else { SplatRenderMode::default() };
    let part = GaussianCloud { origin: DVec3::ZERO, render_mode, ..cloud.select(order) };
    spz::unpacked(&part.turned(&Axes::SPZ.scene_from_file().transpose(), true), &mut |_| Ok(()))
}

/// Encodes numbers below 2^24 in `order`, all low bytes first, then the middle ones, then the highest.
pub(crate) fn identities(of: &[u32], order: &[usize]) -> Vec<u8> {
    let plane = |k: usize| order.iter().map(move |&i| of[i].to_le_bytes()[k]);
    (0..3).flat_map(plane).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Signs of the harmonics of degree 1 to 3 under a half turn about x.
    const TURNED: [f32; 15] = [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

    /// Decodes like a page's script: the cloud in the axes of the scene, centers relative to the origin.
    pub(crate) fn decode(bytes: &[u8]) -> GaussianCloud {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        assert_eq!((&bytes[..4], word(4)), (&b"NGSP"[..], 3));
        let (n, sh_degree, bits) = (word(8) as usize, bytes[12], i32::from(bytes[13]));
        let stride = crate::math::sh::coefficients(sh_degree);
        let mut rest = &bytes[16..];
        let mut take = |each: usize| {
            let (part, after) = rest.split_at(each * n);
            rest = after;
            part
        };
        let (centers, alphas, colors, scales, turns) = (take(9), take(1), take(3), take(3), take(4));
        let bands = take(3 * (stride - 1));
        assert!(rest.is_empty());
        let fixed = |b: &[u8]| (i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8) as f32 * 2_f32.powi(-bits);
        let mut cloud = GaussianCloud { sh_degree, ..GaussianCloud::default() };
        for i in 0..n {
            let c: Vec<f32> = centers[9 * i..9 * i + 9].chunks(3).map(fixed).collect();
            cloud.positions.push([c[0], -c[1], -c[2]]);
            let alpha = (f32::from(alphas[i]) / 255.0).clamp(1e-4, 0.9999);
            cloud.opacity_logits.push((alpha / (1.0 - alpha)).ln());
            let of = |all: &[u8], f: &dyn Fn(u8) -> f32| std::array::from_fn(|a| f(all[3 * i + a]));
            cloud.log_scales.push(of(scales, &|v| f32::from(v) / 16.0 - 10.0));
            cloud.sh.push(of(colors, &|v| (f32::from(v) / 255.0 - 0.5) / 0.15));
            for k in 0..stride - 1 {
                let at = 3 * (i * (stride - 1) + k);
                cloud.sh.push(std::array::from_fn(|a| TURNED[k] * (f32::from(bands[at + a]) - 128.0) / 128.0));
            }
            let mut word = u32::from_le_bytes(turns[4 * i..4 * i + 4].try_into().expect("four bytes"));
            let largest = (word >> 30) as usize;
            let (mut q, mut left) = ([0.0_f32; 4], 1.0);
            for k in (0..4).rev().filter(|k| *k != largest) {
                let v = (word & 511) as f32 / 511.0 * std::f32::consts::FRAC_1_SQRT_2;
                q[k] = if word & 512 > 0 { -v } else { v };
                left -= v * v;
                word >>= 10;
            }
            q[largest] = left.max(0.0).sqrt();
            cloud.quaternions.push([q[3], q[0], -q[1], -q[2]]);
        }
        cloud
    }

    fn random(n: usize, sh_degree: u8) -> GaussianCloud {
        use rand::{RngExt, SeedableRng};
        let mut r = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        let mut v = |most: f32| r.random_range(-most..most);
        let mut cloud = GaussianCloud { sh_degree, ..GaussianCloud::default() };
        for _ in 0..n {
            cloud.positions.push([v(3.0), v(3.0), v(3.0)]);
            cloud.log_scales.push([v(2.0) - 4.0, v(2.0) - 4.0, v(2.0) - 4.0]);
            cloud.quaternions.push([v(2.0), v(2.0), v(2.0), v(2.0)]);
            cloud.opacity_logits.push(v(4.0));
            cloud.sh.push([v(1.5), v(1.5), v(1.5)]);
            (1..crate::math::sh::coefficients(sh_degree)).for_each(|_| cloud.sh.push([v(0.9), v(0.9), v(0.9)]));
        }
        cloud
    }

    #[test]
    fn what_is_packed_is_read_again_within_its_steps() {
        for degree in 0..=3 {
            let cloud = random(500, degree);
            let order = order(&cloud);
            assert!(order.iter().copied().ne(0..500), "the curve has an order of its own");
            let back = decode(&encode(&cloud, &order, false).expect("packed"));
            let cloud = cloud.select(&order);
            let near = |a: &[[f32; 3]], b: &[[f32; 3]], most: f32| {
                assert_eq!(a.len(), b.len());
                let off = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(off <= most * 1.001, "{off} is over {most}");
            };
            near(&cloud.positions, &back.positions, 0.5 / 2_f32.powi(14));
            near(&cloud.log_scales, &back.log_scales, 0.5 / 16.0);
            let stride = cloud.sh_stride();
            let bands = |c: &GaussianCloud, of: std::ops::Range<usize>| -> Vec<[f32; 3]> {
                c.sh.chunks(stride).flat_map(|all| all[of.start..of.end.min(stride)].to_vec()).collect()
            };
            near(&bands(&cloud, 0..1), &bands(&back, 0..1), 0.5 / 255.0 / 0.15);
            near(&bands(&cloud, 1..4.min(stride)), &bands(&back, 1..4.min(stride)), 4.5 / 128.0);
            near(&bands(&cloud, 4.min(stride)..stride), &bands(&back, 4.min(stride)..stride), 8.5 / 128.0);
            let alpha = |v: f32| 1.0 / (1.0 + (-v).exp());
            for i in 0..500 {
                assert!((alpha(cloud.opacity_logits[i]) - alpha(back.opacity_logits[i])).abs() < 0.51 / 255.0);
                let q = cloud.quaternions[i];
                let l = q.iter().map(|v| v * v).sum::<f32>().sqrt();
                let cos = q.iter().zip(back.quaternions[i]).map(|(a, b)| a * b / l).sum::<f32>().abs();
                assert!(cos > 1.0 - 3e-6, "{q:?} and {:?}", back.quaternions[i]);
            }
        }
    }

    #[test]
    fn the_farthest_center_fits_and_the_nearest_stay_apart() {
        let mut cloud = random(10, 0);
        cloud.positions[3] = [-4.0e5, 0.0, 2.0];
        let order: Vec<usize> = (0..10).collect();
        let back = decode(&encode(&cloud, &order, false).expect("packed"));
        assert_eq!(back.positions[3][0], -4.0e5);
        assert!((back.positions[3][2] - 2.0).abs() < 0.1);
        let tiny = decode(&encode(&random(10, 0), &order, true).expect("packed"));
        assert!((tiny.positions[0][0] - random(10, 0).positions[0][0]).abs() < 1e-6);
        assert!(decode(&encode(&GaussianCloud::default(), &[], false).expect("packed")).is_empty());
    }

    #[test]
    fn identities_are_three_planes() {
        assert_eq!(identities(&[1, 0x0002_0304, 5], &[1, 0]), [4, 1, 3, 0, 2, 0]);
    }
}
