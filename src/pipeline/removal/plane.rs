//! Planes through points, by random trials and least squares.

use glam::{DMat3, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use crate::math::stats::median;

/// Trials for each plane.
const TRIALS: usize = 600;
/// Distance at which a point counts for a trial, in radii of the thing.
const NEAR: f64 = 0.03;
/// Least share of all points on a plane.
const LEAST: f64 = 0.06;
/// Median distances within which a point belongs to a plane; within [`NEAR`] it does in any case.
const SPREAD: f64 = 4.0;

/// A flat surface.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    /// A point of the plane.
    pub(super) origin: DVec3,
    /// Unit vectors along it; with [`Self::normal`] they are a rotation.
    pub(super) u: DVec3,
    pub(super) v: DVec3,
    /// Unit normal, toward the photos.
    pub(super) normal: DVec3,
    /// Median distance of its points.
    pub(super) residual: f64,
    /// Largest distance of a point on it.
    pub(super) tolerance: f64,
}

impl Plane {
    fn through(origin: DVec3, normal: DVec3, toward: DVec3) -> Self {
        let normal = if normal.dot(toward - origin) < 0.0 { -normal } else { normal };
        let (u, v) = normal.any_orthonormal_pair();
        let v = if u.cross(v).dot(normal) < 0.0 { -v } else { v };
        Self { origin, u, v, normal, residual: 0.0, tolerance: 0.0 }
    }

    /// Distance from the plane, positive on the side of the photos.
    pub(super) fn height(&self, p: DVec3) -> f64 {
        (p - self.origin).dot(self.normal)
    }
}

/// Returns the planes through most of the points beside a thing of this radius, the largest first.
pub(super) fn planes(points: &[DVec3], toward: DVec3, radius: f64, most: usize, seed: u64) -> Vec<Plane> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let (near, least) = (NEAR * radius, ((LEAST * points.len() as f64) as usize).max(12));
    let mut left = points.to_vec();
    let mut found = Vec::new();
    while found.len() < most && left.len() >= least {
        let mut best: (usize, Option<Plane>) = (0, None);
        for _ in 0..TRIALS {
            let [a, b, c] = [(); 3].map(|()| left[rng.random_range(0..left.len())]);
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let plane = Plane::through(a, normal, toward);
            let count = left.iter().filter(|p| plane.height(**p).abs() <= near).count();
            if count > best.0 {
                best = (count, Some(plane));
            }
        }
        let (count, Some(mut plane)) = best else { break };
        if count < least {
            break;
        }
        let mut reach = near;
        for _ in 0..4 {
            let own: Vec<DVec3> = left.iter().copied().filter(|p| plane.height(*p).abs() <= reach).collect();
            plane = fitted(&own, &plane, toward);
            let distances: Vec<f64> = own.iter().map(|p| plane.height(*p).abs()).collect();
            plane.residual = median(&distances);
            reach = (SPREAD * plane.residual).clamp(0.25 * near, near);
        }
        plane.tolerance = near.max(SPREAD * plane.residual);
        left.retain(|p| plane.height(*p).abs() > plane.tolerance);
        found.push(plane);
    }
    found
}

/// Least squares of the distances along the plane's normal.
fn fitted(points: &[DVec3], plane: &Plane, toward: DVec3) -> Plane {
    let n = points.len() as f64;
    let middle = points.iter().sum::<DVec3>() / n;
    // Height over the plane as a linear function of the place on it: [uu uv; uv vv] slope = [uh; vh].
    let [mut uu, mut uv, mut vv, mut uh, mut vh] = [0.0; 5];
    for p in points {
        let d = *p - middle;
        let (u, v, h) = (d.dot(plane.u), d.dot(plane.v), d.dot(plane.normal));
        (uu, uv, vv, uh, vh) = (uu + u * u, uv + u * v, vv + v * v, uh + u * h, vh + v * h);
    }
    let m = DMat3::from_cols(DVec3::new(uu, uv, 0.0), DVec3::new(uv, vv, 0.0), DVec3::Z);
    if m.determinant() <= 1e-9 * uu * vv {
        // All on a line: the trial's plane stays.
        return Plane { origin: middle, ..plane.clone() };
    }
    let slope = m.inverse() * DVec3::new(uh, vh, 0.0);
    let normal = plane.normal - plane.u * slope.x - plane.v * slope.y;
    Plane::through(middle, normal.normalize_or(plane.normal), toward)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_and_a_wall_are_found_among_stray_points() {
        let mut rng = Pcg32::seed_from_u64(1);
        let mut any = |reach: f64| rng.random_range(-reach..reach);
        let mut points: Vec<DVec3> = (0..600).map(|_| DVec3::new(any(2.0), 0.1 + any(0.01), any(2.0))).collect();
        points.extend((0..400).map(|_| DVec3::new(any(2.0), 1.0 + any(1.0), -1.5 + any(0.01))).collect::<Vec<_>>());
        points.extend((0..150).map(|_| DVec3::new(any(2.0), 1.0 + any(1.0), any(2.0))).collect::<Vec<_>>());
        let found = planes(&points, DVec3::new(0.0, 3.0, 4.0), 1.0, 3, 7);
        let [floor, wall] = [&found[0], &found[1]];
        assert!(floor.normal.dot(DVec3::Y) > 0.9999 && floor.height(DVec3::new(0.3, 0.1, 0.2)).abs() < 0.003);
        assert!(wall.normal.dot(DVec3::Z) > 0.9999 && wall.height(DVec3::new(0.0, 1.0, -1.5)).abs() < 0.003);
        assert!(floor.residual < 0.01, "{}", floor.residual);
        assert!((floor.u.cross(floor.v) - floor.normal).length() < 1e-9);
        assert!(
            found.get(2).is_none_or(|p| p.residual > 2.0 * floor.residual),
            "a plane through stray points is as good"
        );
    }

    #[test]
    fn points_in_one_place_or_on_a_line_are_no_plane() {
        assert_eq!(planes(&[DVec3::ONE; 50], DVec3::Y, 1.0, 2, 0).len(), 0);
        let line: Vec<DVec3> = (0..50).map(|k| DVec3::X * f64::from(k)).collect();
        assert!(planes(&line, DVec3::Y, 1.0, 2, 0).iter().all(|p| p.normal.is_finite()));
        assert_eq!(planes(&[], DVec3::Y, 1.0, 2, 0).len(), 0);
    }
}
