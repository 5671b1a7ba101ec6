//! Routes of a camera through a scene.

use glam::{DQuat, DVec3};

use super::curve::shortened;
use super::flight::{CameraTrajectory, Speed};
use super::graph::{Graph, Route};
use super::is_place;
use super::keypoints::{keypoints, spacing};
use super::occupancy::OccupancyGrid;
use super::pose::Pose;
use crate::scene::{Bounds, Camera, GaussianCloud};

/// Distance kept to occupied space, as a share of the spread of the cameras.
const CLEARANCE: f64 = 0.02;
/// Nearest keypoints that are tried as entries for the camera and its goal.
const ENTRIES: usize = 48;
/// Factor of the edges' clearance over that of flights, so that corners can be rounded.
const SPARE: f64 = 1.05;

/// Data for moving through a scene.
pub struct Navigator {
    /// Occupied space.
    pub(crate) occupancy: OccupancyGrid,
    /// Keypoints and their connections.
    pub graph: Graph,
    /// The photos' cameras.
    pub(crate) cameras: Vec<Camera>,
    /// Mean distance between cameras, scene units.
    pub(crate) spacing: f64,
    /// Distance that flights keep to occupied space, scene units.
    pub clearance: f64,
    /// World up direction.
    pub(crate) up: DVec3,
    /// Keypoints that were left out because they are in occupied space.
    pub(crate) in_occupied: usize,
}

/// Error of a route that does not exist.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoRoute {
    /// There are no keypoints.
    #[error("no reachable viewpoint: the scene has no cameras, or all of them are inside occupied space")]
    NoKeypoints,
    /// The camera cannot leave its place.
    #[error("the camera is enclosed by occupied space")]
    Enclosed,
    /// The goal lies in a part that cannot be reached.
    #[error("no route avoids occupied space; the nearest reachable viewpoint is {distance:.2} units away")]
    Parted {
        /// The nearest keypoint to it that can be reached.
        nearest: usize,
        /// Its distance from the goal, scene units.
        distance: f64,
    },
    /// The goal is inside occupied space, or outside of the known space.
    #[error("that place is not reachable: it is inside occupied space or outside the scene")]
    Inside,
}

impl Navigator {
    /// Builds the occupancy grid and the graph. Takes about a second: once per scene, at the first flight.
    pub fn new(cloud: &GaussianCloud, cameras: &[Camera], up: DVec3) -> Self {
        let eyes: Vec<DVec3> = cameras.iter().map(|c| c.center).filter(|c| is_place(*c)).collect();
        let spread = Bounds::of(eyes.iter().copied()).map_or(0.0, |b| b.radius());
        let scene = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))).map_or(1.0, |b| b.radius());
        let spacing = spacing(cameras);
        let wanted = CLEARANCE * if spread > 0.01 * scene { spread } else { scene };
        let occupancy = OccupancyGrid::of(cloud, &eyes, (0.5 * spacing).min(2.0 * wanted));
        let clearance = wanted.max(occupancy.voxel());
        let (keypoints, in_occupied) = keypoints(cameras, &occupancy, SPARE * clearance);
        let graph = Graph::new(keypoints, SPARE * clearance);
        let up = up.try_normalize().unwrap_or(DVec3::NEG_Y);
        Self { occupancy, graph, cameras: cameras.to_vec(), spacing, clearance, up, in_occupied }
    }

    /// Bytes that its occupancy grid takes, by far the largest part.
    pub(crate) fn bytes(&self) -> u64 {
        self.occupancy.bytes()
    }

    /// Keypoints that can be reached straight from a place, nearest first. From a place with less clearance than
    /// wanted, no more of it is lost.
    fn entries(&self, place: DVec3) -> Vec<usize> {
        let here = self.occupancy.clearance(place);
        let keep = self.clearance.min(here - 0.01 * self.occupancy.voxel());
        let near: Vec<usize> = self.graph.nearest(place).take(ENTRIES).collect();
        let all = near.iter().copied();
        if keep < 0.5 * self.occupancy.voxel() {
            // Inside occupied space any way out is better than none.
            return all.take(4).collect();
        }
        all.filter(|i| self.occupancy.is_free(place, self.graph.keypoints[*i].center, keep)).take(8).collect()
    }

    /// Keypoints of the shortest way through the graph from one pose to another, both ends included: the input of the
    /// paper's interpolation. `None` if there is none.
    pub(crate) fn keys(&self, from: &Pose, to: &Pose) -> Option<Vec<Pose>> {
        let route = self.route([from.center, to.center], [&self.entries(from.center), &self.entries(to.center)])?;
        let keys = route.through.iter().map(|i| &self.graph.keypoints[*i]);
        let on_the_way =
            keys.map(|k| Pose { center: k.center, world_from_camera: k.world_from_camera, fov_y_rad: to.fov_y_rad });
        // An end that is a keypoint is visited once.
        let mut all: Vec<Pose> = std::iter::once(*from).chain(on_the_way).chain([*to]).collect();
        all.dedup_by(|a, b| a.center == b.center);
        Some(all)
    }

    /// Shortest way between two places through keypoints that each of them can reach.
    fn route(&self, ends: [DVec3; 2], entries: [&[usize]; 2]) -> Option<Route> {
        let place = |i: usize| self.graph.keypoints[i].center;
        let with_way = |all: &[usize], end: DVec3| -> Vec<(usize, f64)> {
            all.iter().map(|i| (*i, place(*i).distance(end))).collect()
        };
        let (near_start, near_goal) = (with_way(entries[0], ends[0]), with_way(entries[1], ends[1]));
        self.graph.route_between(&near_start, &near_goal, &self.occupancy)
    }

    /// The straight legs of the shortest way from one place to another that keeps clear of occupied space.
    ///
    /// # Errors
    /// If there is none.
    pub(crate) fn legs(&self, from: DVec3, to: DVec3) -> Result<Vec<DVec3>, NoRoute> {
        if self.occupancy.is_inside(to) {
            return Err(NoRoute::Inside);
        }
        if !is_place(from) {
            return Err(NoRoute::Enclosed);
        }
        let ends = self.occupancy.clearance(from).min(self.occupancy.clearance(to));
        if !self.occupancy.is_inside(from) && self.occupancy.is_free(from, to, self.clearance.min(0.99 * ends)) {
            return Ok(vec![from, to]);
        }
        if self.graph.keypoints.is_empty() {
            return Err(NoRoute::NoKeypoints);
        }
        let (starts, goals) = (self.entries(from), self.entries(to));
        if starts.is_empty() {
            return Err(NoRoute::Enclosed);
        }
        let place = |i: usize| self.graph.keypoints[i].center;
        if let Some(route) = self.route([from, to], [&starts, &goals]) {
            let legs: Vec<DVec3> =
                std::iter::once(from).chain(route.through.iter().map(|i| place(*i))).chain([to]).collect();
            return Ok(shortened(&legs, &self.occupancy, self.clearance.min(0.99 * ends)));
        }
        let parts = self.graph.parts(&self.occupancy);
        let reached = |i: &usize| starts.iter().any(|s| parts[*s] == parts[*i]);
        let nearest = self.graph.nearest(to).find(reached).unwrap_or(starts[0]);
        Err(NoRoute::Parted { nearest, distance: place(nearest).distance(to) })
    }

    /// A way around a target instead of over it, if there is room: it can be kept in sight at even speed. `None` if the
    /// straight way does not turn much, or there is no room.
    fn around(&self, from: DVec3, to: DVec3, target: DVec3) -> Option<Vec<DVec3>> {
        const PIECES: usize = 8;
        let level = |p: DVec3| (p - target) - self.up * (p - target).dot(self.up);
        let (a, b) = (level(from), level(to));
        let (ra, rb) = (a.length(), b.length());
        let angle = a.angle_between(b);
        if !(angle > 0.8) || ra <= 0.0 || rb <= 0.0 {
            return None;
        }
        // The shorter way round; for opposite sides, the one to the right.
        let sign = if a.cross(b).dot(self.up) < 0.0 { -1.0 } else { 1.0 };
        let start = a / ra;
        let at = |i: usize| {
            let u = i as f64 / PIECES as f64;
            let turned = DQuat::from_axis_angle(self.up, sign * angle * u) * start;
            let height = (from - target).dot(self.up) * (1.0 - u) + (to - target).dot(self.up) * u;
            target + turned * (ra + (rb - ra) * u) + self.up * height
        };
        let legs: Vec<DVec3> = std::iter::once(from).chain((1..PIECES).map(at)).chain([to]).collect();
        let ends = self.occupancy.clearance(from).min(self.occupancy.clearance(to));
        let keep = self.clearance.min(0.99 * ends);
        let free = !self.occupancy.is_inside(from) && legs.windows(2).all(|w| self.occupancy.is_free(w[0], w[1], keep));
        free.then_some(legs)
    }

    /// A flight from one pose to another that looks at `look_at` on the way, if given.
    ///
    /// # Errors
    /// If there is no way.
    pub fn fly(
        &self,
        from: &Pose,
        to: &Pose,
        look_at: Option<DVec3>,
        frames: usize,
        speed: Speed,
    ) -> Result<CameraTrajectory, NoRoute> {
        let around = look_at.and_then(|target| self.around(from.center, to.center, target));
        let legs = match around {
            Some(legs) => legs,
            None => self.legs(from.center, to.center)?,
        };
        let ends = self.occupancy.clearance(from.center).min(self.occupancy.clearance(to.center));
        let clearance = self.clearance.min(0.99 * ends);
        let look_at = look_at.map(|target| (target, self.up));
        let flight =
            CameraTrajectory::new(&legs, [from, to], look_at, Some((&self.occupancy, clearance)), frames, speed);
        flight.ok_or(NoRoute::Inside)
    }

    /// End of a step from a pose in a direction of its own (right, down, forward), of at most `distance` scene units,
    /// and whether occupied space ends it.
    pub(crate) fn step(&self, from: &Pose, direction: DVec3, distance: f64) -> (DVec3, bool) {
        let Some(direction) = (from.world_from_camera * direction).try_normalize() else { return (from.center, false) };
        let goal = from.center + direction * distance.max(0.0);
        let here = self.occupancy.clearance(from.center);
        // A camera that is too near already may move away from occupied space, not nearer.
        let keep = self.clearance.min(here - 0.01 * self.occupancy.voxel());
        if keep < 0.5 * self.occupancy.voxel() {
            let out = self.occupancy.clearance(goal) > here;
            return if out { (goal, false) } else { (from.center, true) };
        }
        let share = self.occupancy.free_share(from.center, goal, keep);
        (from.center.lerp(goal, share), share < 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::flight::FRAMES;
    use crate::navigate::testing::{camera_at, cloud_of_wall, joined, wall_with_hole};
    use glam::DMat3;

    fn cameras() -> Vec<Camera> {
        let ring = (0..24).map(|i| {
            let angle = f64::from(i) / 24.0 * std::f64::consts::TAU;
            DVec3::new(1.3 * angle.cos(), 0.3 * (3.0 * angle).sin(), 1.3 * angle.sin())
        });
        ring.map(camera_at).collect()
    }

    fn pose(center: DVec3) -> Pose {
        Pose { center, world_from_camera: DMat3::IDENTITY, fov_y_rad: 0.8 }
    }

    #[test]
    fn flights_keep_their_distance_where_the_papers_do_not() {
        let n = Navigator::new(&wall_with_hole(0.0, 0.6), &cameras(), DVec3::NEG_Y);
        let (from, to) = (pose(DVec3::new(0.9, 0.1, -1.0)), pose(DVec3::new(1.0, 0.0, 1.0)));
        let flight = n.fly(&from, &to, None, FRAMES, Speed::Eased).expect("through the hole");
        let ours = flight.smoothness(&n.occupancy, n.clearance);
        assert_eq!(ours.violations, 0, "{ours:?}");
        let keys = [from, to];
        let paper = CameraTrajectory::of_paper(&keys, FRAMES).expect("a line").smoothness(&n.occupancy, n.clearance);
        assert!(paper.violations > 0, "straight through the wall: {paper:?}");
    }

    #[test]
    fn a_closed_wall_has_no_way_and_the_nearest_place_is_offered() {
        let mut walls = cloud_of_wall(0.0);
        for far in [-1.9, 1.9] {
            walls = joined(&walls, &cloud_of_wall(far));
        }
        let close: Vec<Camera> =
            cameras().into_iter().map(|c| camera_at(c.center * 0.6)).filter(|c| c.center.z.abs() > 0.2).collect();
        let n = Navigator::new(&walls, &close, DVec3::NEG_Y);
        let (from, to) = (DVec3::new(0.0, 0.0, -0.7), DVec3::new(0.0, 0.0, 0.7));
        match n.legs(from, to) {
            Err(NoRoute::Parted { nearest, distance }) => {
                let place = n.graph.keypoints[nearest].center;
                assert!(place.z < 0.0 && (place.distance(to) - distance).abs() < 1e-9);
            }
            other => panic!("{other:?}"),
        }
        assert_eq!(n.legs(from, DVec3::ZERO), Err(NoRoute::Inside));
        assert_eq!(n.legs(from, DVec3::splat(99.0)), Err(NoRoute::Inside));
    }

    #[test]
    fn steps_end_before_occupancy() {
        let n = Navigator::new(&cloud_of_wall(0.0), &cameras(), DVec3::NEG_Y);
        let from = pose(DVec3::new(0.0, 0.0, -1.0));
        let (short, stopped) = n.step(&from, DVec3::Z, 0.2);
        assert!((short.z + 0.8).abs() < 1e-9 && !stopped);
        let (long, stopped) = n.step(&from, DVec3::Z, 5.0);
        assert!(stopped && long.z < 0.0 && long.z > -0.3, "{long}");
        assert!(n.occupancy.clearance(long) >= 0.9 * n.clearance);
        let (back, stopped) = n.step(&pose(long), DVec3::NEG_Z, 0.2);
        assert!(!stopped && back.z < long.z, "away from the wall");
        assert_eq!(n.step(&from, DVec3::ZERO, 1.0), (from.center, false));
    }

    #[test]
    fn scenes_without_cameras_say_so() {
        let n = Navigator::new(&cloud_of_wall(0.0), &[], DVec3::ZERO);
        // On either side of the wall, and both where nothing is.
        let ends = [-0.5, 0.5].map(|z| DVec3::new(0.0, 0.0, z));
        assert!(ends.iter().all(|p| !n.occupancy.is_inside(*p)), "{:?}", ends.map(|p| n.occupancy.clearance(p)));
        assert_eq!(n.legs(ends[0], ends[1]), Err(NoRoute::NoKeypoints));
        assert_eq!(n.legs(ends[0], DVec3::ZERO), Err(NoRoute::Inside));
        let one = Navigator::new(&cloud_of_wall(0.0), &[camera_at(DVec3::Z)], DVec3::Y);
        assert_eq!(one.graph.keypoints.len(), 1);
    }
}
