//! Flights: poses along the rounded route at eased speed, turning on SO(3), every pose checked against occupied space.
//! For comparison, the paper's formula.

use glam::{DMat3, DVec3};

use super::curve::Curve;
use super::occupancy::OccupancyGrid;
use super::pose::{Pose, RotationSpline, angle};
use crate::math::stats::worst;
use crate::scene::{CameraPath, PathKey};

/// Poses of a flight (the paper's M).
pub const FRAMES: usize = 150;

/// Speed profile of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Speed {
    /// The same all the way.
    Constant,
    /// From rest to rest.
    #[default]
    Eased,
}

impl Speed {
    /// Share of the way after this share of the time.
    pub(crate) fn way(self, time: f64) -> f64 {
        let t = time.clamp(0.0, 1.0);
        match self {
            Self::Constant => t,
            Self::Eased => t * t * t * (10.0 + t * (6.0 * t - 15.0)),
        }
    }
}

/// A flight, picture by picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraTrajectory {
    /// At even times.
    pub poses: Vec<Pose>,
    /// Duration in seconds.
    pub seconds: f64,
    /// Length of its way, scene units.
    pub length: f64,
    /// Corners that had to stay sharp.
    pub(crate) sharp: usize,
    /// Poses that were moved away from occupied space.
    pub(crate) repaired: usize,
}

/// Smoothness of a flight, and its clearance to occupied space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Smoothness {
    /// Longest step from one pose to the next, scene units.
    pub(crate) largest_step: f64,
    /// Largest turn from one pose to the next, radians.
    pub(crate) largest_turn: f64,
    /// Largest change of the step (second difference), scene units.
    pub(crate) largest_jolt: f64,
    /// Least distance to matter of a pose, scene units.
    pub(crate) least_clearance: f64,
    /// Poses with less distance to occupied space than wanted.
    pub(crate) violations: usize,
    /// Largest deviation of a pose's rotation from being one.
    pub(crate) rotation_error: f64,
}

impl CameraTrajectory {
    /// The flight as a path with a key per pose.
    pub(crate) fn camera_path(&self) -> CameraPath {
        let last = (self.poses.len() - 1).max(1) as f64;
        let key = |(i, p): (usize, &Pose)| PathKey { time_secs: Some(self.seconds * i as f64 / last), ..p.key() };
        let keys = self.poses.iter().enumerate().map(key).collect();
        CameraPath { keys, closed: false, fps: last / self.seconds.max(1e-3), seconds: self.seconds }
    }

    /// Flight along `legs` from one pose to another, looking at `look_at` (target, up) on the way, if given. `None`
    /// without legs.
    pub fn new(
        legs: &[DVec3],
        ends: [&Pose; 2],
        look_at: Option<(DVec3, DVec3)>,
        occupancy: Option<(&OccupancyGrid, f64)>,
        frames: usize,
        speed: Speed,
    ) -> Option<Self> {
        let curve = Curve::new(legs, occupancy.map(|m| m.0), occupancy.map_or(0.0, |m| m.1))?;
        let [from, to] = ends;
        let mut keys = vec![(0.0, from.world_from_camera)];
        if let Some((target, up)) = look_at.filter(|_| curve.length() > 0.0) {
            // Turns to the target first, then keeps it in sight.
            for share in [0.4, 0.6, 0.8] {
                let here = curve.at(share);
                let looking = Pose::looking_at(here, target, up, from.fov_y_rad, &to.world_from_camera);
                keys.push((share, looking.world_from_camera));
            }
        }
        keys.push((1.0, to.world_from_camera));
        let turning = RotationSpline::new(&keys, false)?;
        let last = frames.max(2) - 1;
        let pose = |i: usize| {
            let share = speed.way(i as f64 / last as f64);
            let fov = from.fov_y_rad.ln() + share * (to.fov_y_rad.ln() - from.fov_y_rad.ln());
            Pose { center: curve.at(share), world_from_camera: turning.at(share), fov_y_rad: fov.exp() }
        };
        let mut poses: Vec<Pose> = (0..=last).map(pose).collect();
        let mut repaired = 0;
        if let Some((occupancy, clearance)) = occupancy {
            // Both ends stay as asked for.
            for pose in &mut poses[1..last] {
                if occupancy.clearance(pose.center) < clearance
                    && let Some(out) = occupancy.pushed_out(pose.center, clearance)
                {
                    pose.center = out;
                    repaired += 1;
                }
            }
        }
        let turned = angle(&from.world_from_camera, &to.world_from_camera);
        let seconds = seconds(curve.length(), from.center.distance(to.center), turned);
        Some(Self { poses, seconds, length: curve.length(), sharp: curve.sharp, repaired })
    }

    /// The paper's interpolation of the same keypoints, read as it is printed: the sum over the
    /// steps telescopes, so pose `i` lies on the straight line from the first to the last, and the
    /// rotation matrices are mixed entry by entry.
    pub(crate) fn of_paper(keys: &[Pose], frames: usize) -> Option<Self> {
        Self::of_paper_through(&[*keys.first()?, *keys.last()?], frames)
    }

    /// The same in the reading that makes sense: from keypoint to keypoint of the route, as many poses for
    /// each step, the rotation matrices mixed entry by entry all the same.
    pub(crate) fn of_paper_through(keys: &[Pose], frames: usize) -> Option<Self> {
        let steps = keys.len().checked_sub(1)?;
        let m = frames.max(2) - 1;
        let pose = |i: usize| {
            let at = i as f64 / m as f64 * steps as f64;
            let step = (at as usize).min(steps.saturating_sub(1));
            mixed(&keys[step], &keys[(step + 1).min(steps)], at - step as f64)
        };
        let length = keys.windows(2).map(|k| k[0].center.distance(k[1].center)).sum();
        Some(Self { poses: (0..=m).map(pose).collect(), seconds: 3.0, length, sharp: 0, repaired: 0 })
    }

    /// Measures its smoothness, and its violations of `clearance` to occupied space.
    pub(crate) fn smoothness(&self, occupancy: &OccupancyGrid, clearance: f64) -> Smoothness {
        let mut s = Smoothness { least_clearance: f64::INFINITY, ..Smoothness::default() };
        for pose in &self.poses {
            let c = occupancy.clearance(pose.center);
            s.least_clearance = s.least_clearance.min(c);
            s.violations += usize::from(!(c >= clearance));
            let m = &pose.world_from_camera;
            let off = *m * m.transpose() - DMat3::IDENTITY;
            s.rotation_error = worst([s.rotation_error, worst(off.abs().to_cols_array())]);
        }
        for pair in self.poses.windows(2) {
            s.largest_step = worst([s.largest_step, pair[0].center.distance(pair[1].center)]);
            let turn = angle(&pair[0].world_from_camera, &pair[1].world_from_camera);
            s.largest_turn = s.largest_turn.max(if turn.is_finite() { turn } else { std::f64::consts::PI });
        }
        for w in self.poses.windows(3) {
            let jolt = (w[2].center - w[1].center) - (w[1].center - w[0].center);
            s.largest_jolt = worst([s.largest_jolt, jolt.length()]);
        }
        s
    }
}

/// Mixes every number of two poses in this proportion.
fn mixed(from: &Pose, to: &Pose, share: f64) -> Pose {
    let mix = |a: DVec3, b: DVec3| a + (b - a) * share;
    let [a, b] = [&from.world_from_camera, &to.world_from_camera];
    let columns = DMat3::from_cols(mix(a.x_axis, b.x_axis), mix(a.y_axis, b.y_axis), mix(a.z_axis, b.z_axis));
    let fov_y_rad = from.fov_y_rad + (to.fov_y_rad - from.fov_y_rad) * share;
    Pose { center: mix(from.center, to.center), world_from_camera: columns, fov_y_rad }
}

/// Two to four seconds: longer for detours and for turning round.
fn seconds(length: f64, straight: f64, turned: f64) -> f64 {
    let detour = if straight > 0.0 { (length / straight - 1.0).clamp(0.0, 1.0) } else { 0.0 };
    2.0 + detour + (turned / std::f64::consts::PI).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::rotation_error;

    fn pose(center: DVec3, rotation: DMat3) -> Pose {
        Pose { center, world_from_camera: rotation, fov_y_rad: 0.8 }
    }

    #[test]
    fn a_flight_begins_and_ends_where_it_should() {
        let (a, b) = (pose(DVec3::ZERO, DMat3::IDENTITY), pose(DVec3::X * 2.0, DMat3::from_rotation_y(1.5)));
        let legs = [a.center, DVec3::new(1.0, 1.0, 0.0), b.center];
        let flight = CameraTrajectory::new(&legs, [&a, &b], None, None, FRAMES, Speed::Eased).expect("a flight");
        assert_eq!(flight.poses.len(), FRAMES);
        let ends = [&flight.poses[0], &flight.poses[FRAMES - 1]];
        for (end, wanted) in ends.into_iter().zip([&a, &b]) {
            assert!(end.center.distance(wanted.center) < 1e-12);
            assert!(angle(&end.world_from_camera, &wanted.world_from_camera) < 1e-9);
        }
        assert!((2.0..=4.0).contains(&flight.seconds));
        let first = flight.poses[0].center.distance(flight.poses[1].center);
        let middle = flight.poses[75].center.distance(flight.poses[76].center);
        assert!(first < 0.01 * middle, "it starts from rest");
        assert!(flight.poses.iter().all(|p| rotation_error(&p.world_from_camera) < 1e-12));
    }

    #[test]
    fn on_the_way_it_looks_at_the_target() {
        let (a, b) = (pose(DVec3::ZERO, DMat3::from_rotation_y(2.5)), pose(DVec3::X * 2.0, DMat3::IDENTITY));
        let target = DVec3::new(1.0, 0.0, 3.0);
        let look = Some((target, DVec3::NEG_Y));
        let flight =
            CameraTrajectory::new(&[a.center, b.center], [&a, &b], look, None, 101, Speed::Constant).expect("a flight");
        let p = &flight.poses[40];
        assert!(p.forward().angle_between(target - p.center) < 1e-6);
    }

    #[test]
    fn the_papers_formula_is_a_straight_line_and_no_rotation() {
        let keys = [
            pose(DVec3::ZERO, DMat3::IDENTITY),
            pose(DVec3::new(1.0, 5.0, 0.0), DMat3::IDENTITY),
            pose(DVec3::X * 2.0, DMat3::from_rotation_z(2.5)),
        ];
        let flight = CameraTrajectory::of_paper(&keys, 151).expect("a flight");
        assert!(flight.poses.iter().all(|p| p.center.y == 0.0), "the keypoint in between is passed by");
        assert!(rotation_error(&flight.poses[75].world_from_camera) > 0.5);
        assert!(CameraTrajectory::of_paper(&[], 150).is_none());
        // From keypoint to keypoint it passes the one in between, and turns on the second step only.
        let through = CameraTrajectory::of_paper_through(&keys, 151).expect("a flight");
        assert!(through.poses[75].center.distance(keys[1].center) < 1e-12);
        assert!(through.poses[50].center.distance(DVec3::new(2.0, 10.0, 0.0) / 3.0) < 1e-12);
        assert!(rotation_error(&through.poses[60].world_from_camera) < 1e-12);
        assert!(rotation_error(&through.poses[112].world_from_camera) > 0.5);
        let ends = [&through.poses[0], &through.poses[150]].map(|p| p.center);
        assert!(ends == [keys[0].center, keys[2].center] && (through.length - 2.0 * 26.0_f64.sqrt()).abs() < 1e-12);
        assert!(CameraTrajectory::of_paper_through(&[], 150).is_none());
        let still = CameraTrajectory::of_paper_through(&keys[..1], 3).expect("it stays");
        assert!(still.length == 0.0 && still.poses.iter().all(|p| *p == keys[0]));
    }

    #[test]
    fn degenerate_flights_are_defined() {
        let a = pose(DVec3::ONE, DMat3::IDENTITY);
        let still = CameraTrajectory::new(&[a.center], [&a, &a], None, None, 150, Speed::Eased).expect("it stays");
        assert!(still.length == 0.0 && still.poses.iter().all(|p| p.center == a.center));
        let b = pose(DVec3::ONE, DMat3::from_rotation_y(std::f64::consts::PI));
        let look = Some((DVec3::ONE, DVec3::Z));
        let turn =
            CameraTrajectory::new(&[a.center, a.center], [&a, &b], look, None, 150, Speed::Constant).expect("it turns");
        assert!(turn.poses.windows(2).all(|w| angle(&w[0].world_from_camera, &w[1].world_from_camera) < 0.03));
        let long: Vec<DVec3> = (0..10_000).map(|i| DVec3::new(f64::from(i), f64::from(i % 7), 0.0)).collect();
        let end = pose(long[9_999], DMat3::IDENTITY);
        let start = pose(long[0], DMat3::IDENTITY);
        let flight = CameraTrajectory::new(&long, [&start, &end], None, None, 150, Speed::Eased).expect("long");
        assert!(flight.poses.iter().all(|p| p.center.is_finite()));
        assert!(CameraTrajectory::new(&[], [&a, &b], None, None, 150, Speed::Eased).is_none());
    }
}
