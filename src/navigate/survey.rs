//! How well flights do in a scene: random ways between keypoints, ours beside the paper's.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::flight::{Flight, Smoothness, Speed};
use super::navigator::Navigator;
use super::pose::Pose;
use crate::scene::Camera;

/// Flights of one kind, taken together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// Flights.
    pub flights: usize,
    /// Flights of which a pose has less distance to matter than wanted.
    pub flights_too_near: usize,
    /// Poses that have.
    pub poses_too_near: usize,
    /// The worst of each over all flights.
    pub worst: Smoothness,
}

/// What a survey found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Survey {
    /// Ours.
    pub ours: Sum,
    /// The paper's, between the same ends.
    pub paper: Sum,
    /// Pairs of keypoints that are not connected.
    pub no_way: usize,
    /// Times that a route took to find, seconds, rising.
    pub least_secs: f64,
    /// The middle one.
    pub median_secs: f64,
    /// The longest.
    pub most_secs: f64,
}

impl Sum {
    fn add(&mut self, s: &Smoothness) {
        self.flights += 1;
        self.flights_too_near += usize::from(s.violations > 0);
        self.poses_too_near += s.violations;
        let w = &mut self.worst;
        w.largest_step = w.largest_step.max(s.largest_step);
        w.largest_turn = w.largest_turn.max(s.largest_turn);
        w.largest_jolt = w.largest_jolt.max(s.largest_jolt);
        w.rotation_error = w.rotation_error.max(s.rotation_error);
        w.violations = w.violations.max(s.violations);
        w.least_clearance =
            if self.flights == 1 { s.least_clearance } else { w.least_clearance.min(s.least_clearance) };
    }
}

/// Flies between `count` random pairs of keypoints.
pub fn survey(navigator: &Navigator, count: usize, frames: usize, seed: u64) -> Survey {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut found = Survey::default();
    let points = &navigator.graph.keypoints;
    let mut secs = Vec::new();
    if points.is_empty() {
        return found;
    }
    for _ in 0..count {
        let [a, b] = [0, 0].map(|_: i32| &points[rng.random_range(0..points.len())]);
        let pose = |k: &super::keypoints::Keypoint| Pose {
            center: k.center,
            world_from_camera: k.world_from_camera,
            fov_y_rad: 0.8,
        };
        let (from, to) = (pose(a), pose(b));
        let start = std::time::Instant::now();
        let flight = navigator.fly(&from, &to, None, frames, Speed::Eased);
        secs.push(start.elapsed().as_secs_f64());
        match flight {
            Ok(flight) => {
                found.ours.add(&flight.smoothness(&navigator.matter, navigator.clearance));
                let paper = Flight::of_paper(&[from, to], frames);
                paper.iter().for_each(|p| found.paper.add(&p.smoothness(&navigator.matter, navigator.clearance)));
            }
            Err(_) => found.no_way += 1,
        }
    }
    secs.sort_by(f64::total_cmp);
    (found.least_secs, found.median_secs, found.most_secs) = (secs[0], secs[secs.len() / 2], secs[secs.len() - 1]);
    found
}

/// As many cameras as wanted: those that there are, and more of them close by, shifted by up to half
/// of `spread` along each axis.
pub fn more_cameras(cameras: &[Camera], count: usize, spread: f64, seed: u64) -> Vec<Camera> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut all: Vec<Camera> = cameras.iter().take(count).cloned().collect();
    while all.len() < count && !cameras.is_empty() {
        let mut camera = cameras[rng.random_range(0..cameras.len())].clone();
        camera.center += DVec3::from_array([0, 0, 0].map(|_: i32| (rng.random::<f64>() - 0.5) * spread));
        all.push(camera);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::{camera_at, wall_with_hole};

    #[test]
    fn ours_keep_clear_where_the_papers_do_not() {
        let ring = (0..16).map(|i| {
            let angle = f64::from(i) / 16.0 * std::f64::consts::TAU;
            camera_at(DVec3::new(1.3 * angle.cos(), 0.2, 1.3 * angle.sin()))
        });
        let cameras: Vec<Camera> = ring.collect();
        let more = more_cameras(&cameras, 40, 0.3, 1);
        assert_eq!(more.len(), 40);
        let navigator = Navigator::new(&wall_with_hole(0.0, 0.6), &more, DVec3::NEG_Y);
        let survey = survey(&navigator, 30, 60, 7);
        assert!(survey.ours.flights > 10, "{survey:?}");
        assert_eq!(survey.ours.poses_too_near, 0, "{survey:?}");
        assert!(survey.paper.poses_too_near > 0, "the straight way leads through the wall: {survey:?}");
        assert!(survey.paper.worst.rotation_error >= survey.ours.worst.rotation_error);
    }
}
