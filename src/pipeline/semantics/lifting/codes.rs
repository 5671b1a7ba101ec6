//! Points in code space, one per identity, that stay apart when they are blended.
//!
//! Codes lie on the sphere around the middle of the unit cube, the background's code. A blend of two codes lies
//! inside the sphere, so it cannot be mistaken for a third. Neighbors in the scene, which are blended most, are put
//! far apart on it.

use glam::{DVec3, Vec3};

use crate::math::finite::{all_finite, insist};
use crate::scene::{GaussianCloud, Identities, IdentityId};

/// Radius of the sphere.
pub const RADIUS: f32 = 0.5;
/// Largest difference per channel at which a blended code still counts as a code: the paper's tolerance.
pub(crate) const TOLERANCE: f32 = 5.0 / 255.0;

const RELAXATIONS: usize = 30;

/// `n` directions spread evenly: a Fibonacci sphere relaxed by repulsion.
pub(crate) fn sphere(n: usize) -> Vec<Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    };
    let mut points: Vec<Vec3> = (0..n).map(point).collect();
    // Steps of a share of the spacing, getting smaller.
    let spacing = (4.0 * std::f32::consts::PI / n.max(1) as f32).sqrt();
    for round in 0..RELAXATIONS {
        let length = 0.15 * spacing * (1.0 - round as f32 / RELAXATIONS as f32);
        let pushed = |i: usize| {
            let push: Vec3 = (0..n)
                .filter(|&j| j != i)
                .map(|j| {
                    let away = points[i] - points[j];
                    away / away.length_squared().max(1e-6).powi(2)
                })
                .sum();
            let along = push - points[i] * push.dot(points[i]);
            (points[i] + along.normalize_or_zero() * length).normalize_or(points[i])
        };
        points = (0..n).map(pushed).collect();
    }
    points
}

/// Gives every identity a code. `centers` are the places of identities, by number less one; identities near each
/// other get codes far apart.
pub fn assign(identities: &mut Identities, centers: &[DVec3]) {
    let n = identities.len();
    let mut free = sphere(n);
    let mut given: Vec<(usize, Vec3)> = Vec::with_capacity(n);
    for i in 0..n {
        // The nearest in the scene matter most.
        let nearness = |j: usize| match (centers.get(i), centers.get(j)) {
            (Some(a), Some(b)) => 1.0 / (a.distance_squared(*b) + 1e-12),
            _ => 1.0,
        };
        let mut weights: Vec<(f64, Vec3)> = given.iter().map(|&(j, code)| (nearness(j), code)).collect();
        weights.sort_by(|a, b| b.0.total_cmp(&a.0));
        weights.truncate(12);
        let crowding = |p: &Vec3| weights.iter().map(|(w, code)| w * f64::from(1.0 + p.dot(*code))).sum::<f64>();
        let best = (0..free.len()).min_by(|&a, &b| crowding(&free[a]).total_cmp(&crowding(&free[b])));
        let Some(best) = best else { return };
        let code = free.swap_remove(best);
        given.push((i, code));
        if let Some(identity) = identities.get_mut(i as IdentityId + 1) {
            identity.code = (code * RADIUS + Vec3::splat(0.5)).to_array();
            insist(|| all_finite("codes", "channel", &identity.code));
        }
    }
}

/// Returns whether a code blended with alpha and divided by it is `code`, within `tolerance` per channel.
pub fn matches(blended: [f32; 3], code: [f32; 3], tolerance: f32) -> bool {
    blended.iter().zip(code).all(|(b, c)| (b - c).abs() <= tolerance)
}

/// Mean position of each identity's Gaussians, pieces included, by number less one.
pub(crate) fn centers(cloud: &GaussianCloud, of: &[IdentityId], identities: &Identities) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); identities.len()];
    for (i, &id) in of.iter().enumerate() {
        for id in identities.ancestors(id) {
            let sum = &mut sums[id as usize - 1];
            *sum = (sum.0 + cloud.world_position(i), sum.1 + 1.0);
        }
    }
    sums.iter().map(|(sum, n)| if *n > 0.0 { *sum / *n } else { DVec3::ZERO }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn no_blend_of_two_codes_is_a_third() {
        let mut all = Identities::objects(100);
        let centers: Vec<DVec3> = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0)).collect();
        assign(&mut all, &centers);
        let codes: Vec<[f32; 3]> =
            all.iter().map(|(_, i)| i.code).chain([crate::scene::semantic_map::BACKGROUND_CODE]).collect();
        let (mut blends, mut wrong) = (0, 0);
        for a in 0..codes.len() {
            for b in 0..a {
                for share in [0.2, 0.35, 0.5, 0.65, 0.8] {
                    let blend = std::array::from_fn(|c| codes[a][c] * share + codes[b][c] * (1.0 - share));
                    blends += 1;
                    let third = |(k, code): (usize, &[f32; 3])| k != a && k != b && matches(blend, *code, TOLERANCE);
                    // Two opposite codes pass through the background's, which is in no mask.
                    wrong += usize::from(codes[..100].iter().enumerate().any(third));
                }
            }
        }
        assert!(f64::from(wrong as u32) < 1e-3 * f64::from(blends), "{wrong} of {blends}");
        // Negative control: random codes in the cube do collide.
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let random: Vec<[f32; 3]> = (0..100).map(|_| std::array::from_fn(|_| next())).collect();
        let mut collisions = 0;
        for a in 0..100 {
            for b in 0..a {
                let blend: [f32; 3] = std::array::from_fn(|c| (random[a][c] + random[b][c]) * 0.5);
                collisions += usize::from((0..100).any(|k| k != a && k != b && matches(blend, random[k], TOLERANCE)));
            }
        }
        assert!(collisions > 5, "{collisions}");
    }

    #[test]
    fn neighbors_get_distant_codes() {
        let mut all = Identities::objects(60);
        let centers: Vec<DVec3> = (0..60).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        assign(&mut all, &centers);
        let code = |i: u32| Vec3::from(all.get(i).expect("there").code);
        let next: f32 = (1..60).map(|i| code(i).distance(code(i + 1))).sum::<f32>() / 59.0;
        let far: f32 = (1..31).map(|i| code(i).distance(code(i + 30))).sum::<f32>() / 30.0;
        assert!(next > far && next > 0.7, "{next} {far}");
    }

    #[test]
    fn the_first_directions_are_where_they_repel_each_other_to() {
        // Two are opposite, four a tetrahedron, six an octahedron: least cosines known by hand.
        for (n, cosine) in [(2, -1.0), (4, -1.0 / 3.0), (6, 0.0)] {
            let points = sphere(n);
            let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
            let nearest = pairs.map(|(i, j)| points[i].dot(points[j])).fold(-1.0, f32::max);
            assert!((nearest - cosine).abs() < 0.2, "{n}: {nearest}");
        }
        assert!(sphere(0).is_empty() && sphere(1).len() == 1);
        // Of many, none is much nearer to another than they are on average.
        let points = sphere(120);
        assert!(points.len() == 120 && points.iter().all(|p| (p.length() - 1.0).abs() < 1e-4));
        let next = |i: usize| (0..120).filter(|j| *j != i).map(|j| points[i].distance(points[j])).fold(9.0, f32::min);
        let spacing = (4.0 * std::f32::consts::PI / 120.0_f32).sqrt();
        let (least, mean) = (0..120).map(next).fold((9.0_f32, 0.0), |(l, m), d| (l.min(d), m + d / 120.0));
        assert!(least > 0.85 * spacing && mean > 0.92 * spacing, "{least} {mean} of {spacing}");
    }

    #[test]
    fn of_three_the_near_pair_is_farther_apart_in_code_space() {
        for (place, near, far) in [(1.0, [1, 2], [1, 3]), (9.0, [2, 3], [1, 2])] {
            let mut all = Identities::objects(8);
            let mut centers: Vec<DVec3> = (0..8).map(|i| DVec3::new(0.0, 100.0 * f64::from(i), 0.0)).collect();
            (centers[0], centers[1], centers[2]) =
                (DVec3::ZERO, DVec3::new(place, 0.0, 0.0), DVec3::new(10.0, 0.0, 0.0));
            assign(&mut all, &centers);
            let apart = |pair: [u32; 2]| {
                let code = |i: u32| Vec3::from(all.get(i).expect("there").code);
                code(pair[0]).distance(code(pair[1]))
            };
            assert!(apart(near) > apart(far) - 0.05 && apart(near) > 0.7, "{place}: {} {}", apart(near), apart(far));
            let on_sphere = |c: [f32; 3]| ((Vec3::from(c) - Vec3::splat(0.5)).length() - RADIUS).abs() < 1e-5;
            assert!(all.iter().all(|(_, i)| on_sphere(i.code)));
        }
    }

    #[test]
    fn centers_are_means_and_wholes_count_their_pieces() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        all.add(Level::Object, NO_IDENTITY, vec![]);
        let cloud = GaussianCloud {
            origin: DVec3::new(10.0, 0.0, 0.0),
            positions: vec![[1.0, 0.0, 0.0], [3.0, 6.0, 0.0], [5.0, 0.0, 3.0], [9.0; 3]],
            ..GaussianCloud::default()
        };
        let found = centers(&cloud, &[doll, eye, eye, NO_IDENTITY], &all);
        assert_eq!(found, [DVec3::new(13.0, 2.0, 1.0), DVec3::new(14.0, 3.0, 1.5), DVec3::ZERO]);
    }
}
