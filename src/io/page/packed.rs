//! Gaussians as few bytes: the layout of the format SPZ, version 3, in the order of a Morton curve.
//!
//! Niantic's format (github.com/nianticlabs/spz): a head of 16 bytes, then all centers (24-bit fixed point), opacities
//! (8 bits), colors (8 bits), scales (steps of 1/16 of the logarithm), rotations (the smallest three of four numbers,
//! 10 bits each) and harmonics (8 bits), axes x right, y up, z backward. Compressed by gzip it is a file of that format.

use crate::scene::GaussianCloud;

const MAGIC: u32 = 0x5053_474e;
const VERSION: u32 = 3;
/// A flag: opacities are meant for Mip-Splatting's filter.
const ANTIALIASED: u8 = 1;
/// Steps of the centers in the radius of a scene, as a power of two.
const STEPS_LOG2: i32 = 16;
/// Bits of a center's magnitude.
const CENTER_BITS: i32 = 23;
/// What colors and scales are mapped by.
const COLOR_SCALE: f32 = 0.15;
/// Harmonics of the first band and of higher ones are rounded to so many of 256 steps, which gzip makes use of.
const BAND_STEPS: [f32; 2] = [4.0, 8.0];
/// Signs that half a turn about x gives to the harmonics above the first, degree 1 to 3.
const TURNED: [f32; 15] = [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// The cloud's Gaussians as SPZ before compression, centers relative to its origin; `order` has the place in the cloud
/// of each that is written, `radius` is that of the scene in its own units.
pub(crate) fn encode(cloud: &GaussianCloud, order: &[usize], radius: f64, antialias: bool) -> Vec<u8> {
    let bits = fraction_bits(cloud, radius);
    let mut out = Vec::with_capacity(16 + order.len() * (20 + 3 * (cloud.sh_stride() - 1)));
    out.extend(MAGIC.to_le_bytes());
    out.extend(VERSION.to_le_bytes());
    out.extend((order.len() as u32).to_le_bytes());
    out.extend([cloud.sh_degree, bits as u8, if antialias { ANTIALIASED } else { 0 }, 0]);
    let most = f64::from((1 << CENTER_BITS) - 1);
    for &i in order {
        let [x, y, z] = cloud.positions[i].map(f64::from);
        for v in [x, -y, -z] {
            let fixed = (v * 2_f64.powi(bits)).round().clamp(-most, most) as i32;
            out.extend(&fixed.to_le_bytes()[..3]);
        }
    }
    out.extend(order.iter().map(|&i| byte(255.0 / (1.0 + (-cloud.opacity_logits[i]).exp()))));
    let stride = cloud.sh_stride();
    out.extend(order.iter().flat_map(|&i| cloud.sh[i * stride].map(|v| byte((v * COLOR_SCALE + 0.5) * 255.0))));
    out.extend(order.iter().flat_map(|&i| cloud.log_scales[i].map(|v| byte((v + 10.0) * 16.0))));
    out.extend(order.iter().flat_map(|&i| smallest_three(cloud.quaternions[i]).to_le_bytes()));
    for &i in order {
        for (k, rgb) in cloud.sh[i * stride + 1..(i + 1) * stride].iter().enumerate() {
            let step = BAND_STEPS[usize::from(k >= 3)];
            out.extend(rgb.map(|v| byte((v * TURNED[k] * 128.0 / step).round() * step + 128.0)));
        }
    }
    out
}

/// Places in the cloud along a Morton curve: neighbors in space come together, which gzip makes use of.
pub(crate) fn order(cloud: &GaussianCloud) -> Vec<usize> {
    let mut min = [f32::INFINITY; 3];
    let mut size = f32::MIN_POSITIVE;
    cloud.positions.iter().for_each(|p| (0..3).for_each(|a| min[a] = min[a].min(p[a])));
    cloud.positions.iter().for_each(|p| (0..3).for_each(|a| size = size.max(p[a] - min[a])));
    let key = |i: usize| {
        let cell: [u64; 3] = std::array::from_fn(|a| ((cloud.positions[i][a] - min[a]) / size * 65_535.0) as u64);
        (0..16).rev().fold(0_u64, |key, b| (0..3).fold(key, |key, a| key << 1 | (cell[a] >> b & 1)))
    };
    let mut order: Vec<usize> = (0..cloud.len()).collect();
    order.sort_by_cached_key(|&i| key(i));
    order
}

/// Numbers below 2^24 in `order`, all low bytes first, then the next ones, then the highest.
pub(crate) fn identities(of: &[u32], order: &[usize]) -> Vec<u8> {
    let plane = |k: usize| order.iter().map(move |&i| of[i].to_le_bytes()[k]);
    (0..3).flat_map(plane).collect()
}

/// How fine centers are: [`STEPS_LOG2`] to the scene's radius, and coarser where the farthest one would not fit.
fn fraction_bits(cloud: &GaussianCloud, radius: f64) -> i32 {
    let log2 = |v: f64| v.max(1e-30).log2().ceil() as i32;
    let farthest = cloud.positions.iter().flatten().fold(0.0_f32, |most, v| most.max(v.abs()));
    (STEPS_LOG2 - log2(radius)).min(CENTER_BITS - 1 - log2(f64::from(farthest))).clamp(0, 30)
}

fn byte(v: f32) -> u8 {
    // Casts keep to the range.
    v.round() as u8
}

/// A rotation `[w, x, y, z]`: the place of its largest part among x, y, z, w in two bits, then sign and 9 bits of each
/// of the others. Half a turn about x changes the signs of y and z.
fn smallest_three([w, x, y, z]: [f32; 4]) -> u32 {
    let turned = [x, -y, -z, w];
    let length = turned.iter().map(|v| v * v).sum::<f32>().sqrt();
    let unit = if length > 0.0 { turned.map(|v| v / length) } else { [0.0, 0.0, 0.0, 1.0] };
    let largest = (1..4).fold(0, |best, k| if unit[k].abs() > unit[best].abs() { k } else { best });
    let others = (0..4).filter(|k| *k != largest);
    others.fold(largest as u32, |word, k| {
        let negative = (unit[k] < 0.0) != (unit[largest] < 0.0);
        let magnitude = (511.0 * unit[k].abs() * std::f32::consts::SQRT_2).round().min(511.0) as u32;
        word << 10 | u32::from(negative) << 9 | magnitude
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// What a page's script reads: the cloud again, in the axes of the scene, centers relative to the origin.
    pub(crate) fn decode(bytes: &[u8]) -> GaussianCloud {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        assert_eq!((word(0), word(4)), (MAGIC, VERSION));
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
            cloud.sh.push(of(colors, &|v| (f32::from(v) / 255.0 - 0.5) / COLOR_SCALE));
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
            let back = decode(&encode(&cloud, &order, 3.0, false));
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
            near(&bands(&cloud, 0..1), &bands(&back, 0..1), 0.5 / 255.0 / COLOR_SCALE);
            near(&bands(&cloud, 1..4.min(stride)), &bands(&back, 1..4.min(stride)), 2.0 / 128.0);
            near(&bands(&cloud, 4.min(stride)..stride), &bands(&back, 4.min(stride)..stride), 4.0 / 128.0);
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
        let back = decode(&encode(&cloud, &order, 3.0, false));
        assert_eq!(back.positions[3][0], -4.0e5);
        assert!((back.positions[3][2] - 2.0).abs() < 0.1);
        let tiny = decode(&encode(&random(10, 0), &order, 1e-3, true));
        assert!((tiny.positions[0][0] - random(10, 0).positions[0][0]).abs() < 1e-6);
        assert!(decode(&encode(&GaussianCloud::default(), &[], 1.0, false)).is_empty());
    }

    #[test]
    fn identities_are_three_planes() {
        assert_eq!(identities(&[1, 0x0002_0304, 5], &[1, 0]), [4, 1, 3, 0, 2, 0]);
    }
}
