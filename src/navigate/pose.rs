//! Poses of a viewer, and the interpolation of rotations.

use glam::{DMat3, DQuat, DVec3};

use crate::math::rotation::nearest_rotation;
use crate::scene::{Camera, PathKey};

/// A viewer's pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Center in the world.
    pub center: DVec3,
    /// Columns are right, down and forward.
    pub world_from_camera: DMat3,
    /// Vertical field of view, radians.
    pub fov_y_rad: f64,
}

impl Pose {
    /// The pose of a camera.
    pub fn of(camera: &Camera) -> Self {
        Self { center: camera.center, world_from_camera: camera.world_from_camera, fov_y_rad: camera.fov_y_rad() }
    }

    /// The pose of a key, its roll in it.
    pub(crate) fn of_key(key: &PathKey) -> Self {
        Self { center: key.center, world_from_camera: key.rotation(), fov_y_rad: key.fov_y_rad }
    }

    pub(crate) fn key(&self) -> PathKey {
        PathKey::of_pose(self.center, self.world_from_camera, self.fov_y_rad)
    }

    /// At `center`, looking at `target` with `up` upwards. Straight up and down, and at itself, it
    /// looks as `otherwise` does, turned as little as needed.
    pub(crate) fn looking_at(center: DVec3, target: DVec3, up: DVec3, fov_y_rad: f64, otherwise: &DMat3) -> Self {
        let Some(forward) = (target - center).try_normalize() else {
            return Self { center, world_from_camera: *otherwise, fov_y_rad };
        };
        let sideways = forward.cross(up);
        let right = if sideways.length() > 1e-6 * up.length() { sideways } else { otherwise.x_axis };
        let right = (right - forward * right.dot(forward)).try_normalize();
        let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
        Self { center, world_from_camera: DMat3::from_cols(right, forward.cross(right), forward), fov_y_rad }
    }

    /// The camera for a picture of this size.
    pub(crate) fn camera(&self, width_px: u32, height_px: u32) -> Camera {
        Camera::of_pose(self.center, self.world_from_camera, self.fov_y_rad, width_px.max(1), height_px.max(1))
    }

    /// Unit vector of the viewing direction.
    pub(crate) fn forward(&self) -> DVec3 {
        self.world_from_camera.z_axis
    }
}

/// The rotation as a quaternion; rounding errors of the matrix are removed.
pub(crate) fn quaternion(m: &DMat3) -> DQuat {
    unit(DQuat::from_mat3(&nearest_rotation(m)), DQuat::IDENTITY)
}

/// A quaternion of length 1; `otherwise` if it has no usable length.
fn unit(q: DQuat, otherwise: DQuat) -> DQuat {
    let length = q.length();
    if length.is_finite() && length > 1e-9 { q / length } else { otherwise }
}

/// Rotation vector (axis times angle, at most half a turn) that leads from `a` to `b` in the axes of
/// `a`. Half a turn has two axes; it is the same one every time.
pub(crate) fn between(a: DQuat, b: DQuat) -> DVec3 {
    let d = a.conjugate() * b;
    let d = if d.w < 0.0 { -d } else { d };
    let v = DVec3::new(d.x, d.y, d.z);
    let sine = v.length();
    if sine < 1e-12 { v * 2.0 } else { v / sine * (2.0 * sine.atan2(d.w)) }
}

/// `a` turned by a rotation vector in its own axes.
pub(crate) fn turned(a: DQuat, by: DVec3) -> DQuat {
    unit(a * DQuat::from_scaled_axis(by), a)
}

/// Angle between two rotations, radians, 0 to pi.
pub(crate) fn angle(a: &DMat3, b: &DMat3) -> f64 {
    between(quaternion(a), quaternion(b)).length()
}

/// Rotations at rising times, interpolated on SO(3) with continuous angular velocity: cumulative
/// cubic Bezier curves of quaternions (Kim, Kim and Shin 1995) through all of them, at rest at both
/// ends if wanted.
#[derive(Clone, Debug)]
pub(crate) struct RotationSpline {
    times: Vec<f64>,
    at: Vec<DQuat>,
    /// Angular velocity at each, in its own axes.
    velocity: Vec<DVec3>,
}

impl RotationSpline {
    /// Spline through `keys` (time, rotation); of keys at one time the last counts. `None` without keys.
    pub(crate) fn new(keys: &[(f64, DMat3)], closed: bool) -> Option<Self> {
        let mut times: Vec<f64> = Vec::with_capacity(keys.len());
        let mut at: Vec<DQuat> = Vec::with_capacity(keys.len());
        for (time, rotation) in keys.iter().filter(|(t, r)| t.is_finite() && r.is_finite()) {
            if times.last().is_some_and(|last| !(time > last)) {
                times.pop();
                at.pop();
            }
            times.push(*time);
            at.push(quaternion(rotation));
        }
        if at.is_empty() {
            return None;
        }
        let n = at.len();
        let rate = |i: usize| between(at[i], at[i + 1]) / (times[i + 1] - times[i]);
        let velocity = (0..n)
            .map(|i| {
                let (before, after) = match (i, closed && n > 2) {
                    _ if n == 1 => return DVec3::ZERO,
                    (0, true) => (n - 2, 0),
                    (0, false) => return rate(0),
                    (i, true) if i == n - 1 => (n - 2, 0),
                    (i, false) if i == n - 1 => return rate(n - 2),
                    (i, _) => (i - 1, i),
                };
                // Each rate weighted by the other's time: Catmull and Rom's choice for uneven times.
                let [a, b] = [before, after].map(|k| times[k + 1] - times[k]);
                (rate(before) * b + rate(after) * a) / (a + b)
            })
            .collect();
        Some(Self { times, at, velocity })
    }

    /// The rotation at a time; before the first and after the last key, theirs.
    pub(crate) fn at(&self, time: f64) -> DMat3 {
        let n = self.at.len();
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 || n == 1 {
            return DMat3::from_quat(self.at[0]);
        }
        if after == n {
            return DMat3::from_quat(self.at[n - 1]);
        }
        let (i, span) = (after - 1, self.times[after] - self.times[after - 1]);
        let u = (time - self.times[i]) / span;
        let first = self.velocity[i] * span / 3.0;
        let last = self.velocity[after] * span / 3.0;
        let middle = between(turned(self.at[i], first), turned(self.at[after], -last));
        let v = 1.0 - u;
        let weights = [1.0 - v * v * v, u * u * (3.0 - 2.0 * u), u * u * u];
        let q = turned(turned(turned(self.at[i], first * weights[0]), middle * weights[1]), last * weights[2]);
        DMat3::from_quat(q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::rotation_error;

    #[test]
    fn a_rotation_vector_leads_from_one_rotation_to_the_other() {
        let a = DQuat::from_rotation_x(0.4);
        for b in [DQuat::from_rotation_y(2.9), a, -a, DQuat::from_rotation_x(0.4 + std::f64::consts::PI)] {
            let v = between(a, b);
            assert!(v.length() <= std::f64::consts::PI + 1e-12);
            let back = turned(a, v);
            assert!(back.dot(b).abs() > 1.0 - 1e-12, "{b}");
        }
    }

    #[test]
    fn the_spline_passes_its_keys_without_jumps_of_velocity() {
        let keys: Vec<(f64, DMat3)> = [0.0, 1.0, 1.4, 3.0, 3.2]
            .iter()
            .enumerate()
            .map(|(i, t)| (*t, DMat3::from_rotation_y(0.9 * i as f64) * DMat3::from_rotation_x(0.3 * (i * i) as f64)))
            .collect();
        let spline = RotationSpline::new(&keys, false).expect("keys");
        for (time, rotation) in &keys {
            assert!(angle(&spline.at(*time), rotation) < 1e-9);
        }
        let h = 1e-4;
        let velocity = |t: f64| between(quaternion(&spline.at(t)), quaternion(&spline.at(t + h))) / h;
        for (time, _) in &keys[1..4] {
            let jump = (velocity(time + 1e-6) - velocity(time - h - 1e-6)).length();
            assert!(jump < 0.02, "a jump of {jump} at {time}");
        }
        for i in 0..=320 {
            assert!(rotation_error(&spline.at(0.01 * f64::from(i))) < 1e-12);
        }
    }

    #[test]
    fn degenerate_keys_are_defined() {
        assert!(RotationSpline::new(&[], false).is_none());
        let one = RotationSpline::new(&[(2.0, DMat3::IDENTITY)], true).expect("one");
        assert_eq!(one.at(-7.0), DMat3::IDENTITY);
        let half_turn = [(0.0, DMat3::IDENTITY), (1.0, DMat3::from_rotation_y(std::f64::consts::PI))];
        let spline = RotationSpline::new(&half_turn, false).expect("two");
        assert!((angle(&spline.at(0.5), &DMat3::IDENTITY) - 0.5 * std::f64::consts::PI).abs() < 1e-9);
        let twice = [(0.0, DMat3::IDENTITY), (0.0, DMat3::from_rotation_x(1.0)), (1.0, DMat3::IDENTITY)];
        assert!(angle(&RotationSpline::new(&twice, false).expect("keys").at(0.0), &twice[1].1) < 1e-9);
    }

    #[test]
    fn looking_straight_up_is_a_rotation_too() {
        for target in [DVec3::Z, DVec3::NEG_Z, DVec3::ZERO, DVec3::X] {
            let pose = Pose::looking_at(DVec3::ZERO, target, DVec3::Z, 0.8, &DMat3::IDENTITY);
            assert!(rotation_error(&pose.world_from_camera) < 1e-12, "{target}");
        }
    }
}
