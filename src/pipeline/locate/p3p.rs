//! The poses from which three points are seen along three rays (Grunert 1841, in the form of Haralick et al. 1994).

use glam::{DMat3, DVec3};

/// Ratios of distances between the points that are believed.
const RATIOS: [f64; 2] = [1e-2, 1e2];

/// A pose: world_from_camera and the camera's center.
pub(super) type FoundPose = (DMat3, DVec3);

/// All poses, at most four, from which `points` are seen along `rays`, in camera axes.
pub(super) fn poses(rays: [DVec3; 3], points: [DVec3; 3]) -> Vec<FoundPose> {
    let [j1, j2, j3] = rays.map(DVec3::normalize_or_zero);
    let [p1, p2, p3] = points;
    let [a2, b2, c2] = [p2.distance_squared(p3), p1.distance_squared(p3), p1.distance_squared(p2)];
    let (cos_a, cos_b, cos_c) = (j2.dot(j3), j1.dot(j3), j1.dot(j2));
    let (Some(world), true) = (frame(points), b2 > 0.0) else { return Vec::new() };
    let (difference, sum) = ((a2 - c2) / b2, (a2 + c2) / b2);
    let (a, c) = (a2 / b2, c2 / b2);
    let quartic = [
        (1.0 + difference).powi(2) - 4.0 * a * cos_c * cos_c,
        4.0 * (-difference * (1.0 + difference) * cos_b + 2.0 * a * cos_c * cos_c * cos_b
            - (1.0 - sum) * cos_a * cos_c),
        2.0 * (difference * difference - 1.0
            + 2.0 * difference * difference * cos_b * cos_b
            + 2.0 * (1.0 - c) * cos_a * cos_a
            - 4.0 * sum * cos_a * cos_b * cos_c
            + 2.0 * (1.0 - a) * cos_c * cos_c),
        4.0 * (difference * (1.0 - difference) * cos_b - (1.0 - sum) * cos_a * cos_c + 2.0 * c * cos_a * cos_a * cos_b),
        (difference - 1.0).powi(2) - 4.0 * c * cos_a * cos_a,
    ];
    let pose = |v: f64| {
        let below = 2.0 * (cos_c - v * cos_a);
        let u = ((difference - 1.0) * v * v - 2.0 * difference * cos_b * v + 1.0 + difference) / below;
        let first = (b2 / (1.0 + v * v - 2.0 * v * cos_b)).sqrt();
        if !(u > 0.0 && u.is_finite() && first.is_finite()) {
            return None;
        }
        let seen = [j1 * first, j2 * (u * first), j3 * (v * first)];
        let rotation = world * frame(seen)?.transpose();
        Some((rotation, p1 - rotation * seen[0]))
    };
    roots(&quartic, RATIOS).into_iter().filter_map(pose).collect()
}

/// Axes that a triangle defines; `None` for one without area.
fn frame([a, b, c]: [DVec3; 3]) -> Option<DMat3> {
    let x = (b - a).try_normalize()?;
    let z = x.cross((c - a).try_normalize()?);
    let z = z.try_normalize().filter(|_| z.length_squared() > 1e-10)?;
    Some(DMat3::from_cols(x, z.cross(x), z))
}

/// The simple roots of a polynomial, constant term first, between two numbers: one in each span between neighboring
/// extrema at whose ends the signs differ.
fn roots(polynomial: &[f64], [low, high]: [f64; 2]) -> Vec<f64> {
    let value = |x: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c);
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let slope: Vec<f64> = polynomial.iter().enumerate().skip(1).map(|(k, c)| k as f64 * c).collect();
    let mut ends = vec![low];
    ends.extend(roots(&slope, [low, high]));
    ends.push(high);
    let mut found = Vec::new();
    for span in ends.windows(2) {
        let (mut from, mut to) = (span[0], span[1]);
        let rises = value(from) < 0.0;
        if (value(to) < 0.0) == rises {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (from + to);
            if (value(middle) < 0.0) == rises { from = middle } else { to = middle }
        }
        found.push(0.5 * (from + to));
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn the_true_pose_is_among_those_found() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(3);
        let mut found = 0;
        for _ in 0..200 {
            let mut v = |scale: f64| rng.random_range(-scale..scale);
            let rotation = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(v(3.0), v(3.0), v(3.0))));
            let center = DVec3::new(v(9.0), v(9.0), v(9.0));
            let seen = [0; 3].map(|_| DVec3::new(v(1.0), v(1.0), 3.0 + v(1.0)));
            let points = seen.map(|p| rotation * p + center);
            let poses = poses(seen.map(|p| p * 0.7), points);
            assert!(poses.len() <= 4);
            for (r, c) in &poses {
                // Whatever it is, it sees the points along the rays.
                for (p, ray) in points.iter().zip(seen) {
                    let there = (r.transpose() * (*p - *c)).normalize_or_zero();
                    assert!(there.distance(ray.normalize_or_zero()) < 1e-4, "{there} {ray}");
                }
            }
            found += usize::from(poses.iter().any(|(_, c)| c.distance(center) < 1e-6));
        }
        assert!(found >= 195, "{found} of 200; triangles seen edge-on lose digits");
    }

    #[test]
    fn triangles_without_area_have_no_pose() {
        let rays = [DVec3::Z, DVec3::new(0.1, 0.0, 1.0), DVec3::new(0.2, 0.0, 1.0)];
        assert!(poses(rays, [DVec3::ZERO, DVec3::X, DVec3::X * 2.0]).is_empty());
        assert!(poses(rays, [DVec3::ONE; 3]).is_empty());
    }

    #[test]
    fn roots_are_those_of_the_factors() {
        // (x - 1)(x - 2)(x - 3)(x - 50)
        let found = roots(&[300.0, -556.0, 311.0, -56.0, 1.0], RATIOS);
        assert_eq!(found.len(), 4);
        for (x, want) in found.iter().zip([1.0, 2.0, 3.0, 50.0]) {
            assert!((x - want).abs() < 1e-9, "{found:?}");
        }
        assert!(roots(&[1.0, 0.0, 1.0], RATIOS).is_empty());
    }
}
