//! Turntable: a closed camera path around a point.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::Pose;
use crate::scene::{Bounds, CameraPath};

/// Number of keys: the smooth path through them stays within a hundredth of the circle.
const KEYS: usize = 12;
/// Seconds of one turn.
const SECONDS: f64 = 12.0;
/// Least radius of the circle, in radii of what it surrounds.
const LEAST_RADIUS: f64 = 0.2;

impl Pose {
    /// Makes a path of one turn around the middle of `around`, which every key looks at, at the height and the distance
    /// of this pose. `None` if a number is not finite.
    pub(crate) fn turntable(&self, around: &Bounds, up: DVec3) -> Option<CameraPath> {
        let (center, up) = (around.center(), up.try_normalize()?);
        let offset = self.center - center;
        let height = offset.dot(up);
        let level = offset - up * height;
        // From straight above, the image's bottom is the front.
        let below = self.world_from_camera.y_axis;
        let front = [level, below - up * below.dot(up), up.any_orthonormal_vector()];
        let front = front.into_iter().filter(|v| v.length() > 1e-9).find_map(DVec3::try_normalize)?;
        let radius = level.length().max(LEAST_RADIUS * around.radius()).max(1e-6);
        let pose = |i: usize| {
            let turn = DQuat::from_axis_angle(up, TAU * i as f64 / KEYS as f64);
            let at = center + up * height + turn * front * radius;
            Pose::looking_at(at, center, up, self.fov_y_rad, &self.world_from_camera)
        };
        let keys = (0..KEYS).map(|i| pose(i).key()).collect();
        let path = CameraPath { keys, closed: true, fps: 30.0, seconds: SECONDS };
        path.validate().is_ok().then_some(path)
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::navigate::{CameraSpline, Speed};

    fn cube() -> Bounds {
        Bounds { min: DVec3::new(1.0, 1.0, 0.0), max: DVec3::new(2.0, 2.0, 1.0) }
    }

    fn at(center: DVec3) -> Pose {
        Pose::looking_at(center, DVec3::ZERO, DVec3::Z, 0.8, &DMat3::IDENTITY)
    }

    #[test]
    fn it_turns_once_around_the_middle_at_the_same_height_and_distance() {
        let (eye, middle) = (DVec3::new(4.0, -1.0, 2.0), cube().center());
        let path = at(eye).turntable(&cube(), DVec3::Z * 3.0).expect("a path");
        assert!(path.closed && path.keys[0].center.distance(eye) < 1e-9, "it begins here");
        let spline = CameraSpline::new(&path, Speed::Constant).expect("a path");
        let radius = (eye - middle).truncate().length();
        for i in 0..=240 {
            let pose = spline.at(spline.seconds() * f64::from(i) / 240.0);
            let offset = pose.center - middle;
            assert!((offset.z - 1.5).abs() < 1e-6 && (offset.truncate().length() / radius - 1.0).abs() < 0.01);
            let aside = pose.forward().cross(-offset.normalize_or_zero()).length();
            assert!(aside < 0.02 && pose.world_from_camera.x_axis.z.abs() < 0.01, "{aside}");
        }
        let quarter = spline.at(0.25 * spline.seconds()).center;
        assert!(quarter.distance(eye) > radius, "it does turn");
    }

    #[test]
    fn it_is_defined_from_above_from_within_and_refused_for_no_numbers() {
        let middle = cube().center();
        for eye in [middle + DVec3::Z * 5.0, middle, middle - DVec3::Z] {
            let path = at(eye).turntable(&cube(), DVec3::Z).expect("a path");
            assert!(path.keys[0].center.distance(path.keys[6].center) > 0.2, "it has a radius");
        }
        assert!(at(DVec3::ONE).turntable(&cube(), DVec3::ZERO).is_none(), "there is no up");
        let nowhere = Bounds { min: DVec3::NAN, max: DVec3::NAN };
        assert!(at(DVec3::ONE).turntable(&nowhere, DVec3::Z).is_none());
    }
}
