//! How well flights do in a scene: random ways, ours beside the paper's.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::flight::{Flight, Smoothness, Speed};
use super::keypoints::Keypoint;
use super::navigator::Navigator;
use super::pose::Pose;
use crate::math::stats::worst;
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
    /// The paper's as it is printed, between the same ends.
    pub paper: Sum,
    /// The paper's through all keypoints of the route, between the same ends.
    pub paper_through: Sum,
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
        w.largest_step = worst([w.largest_step, s.largest_step]);
        w.largest_turn = worst([w.largest_turn, s.largest_turn]);
        w.largest_jolt = worst([w.largest_jolt, s.largest_jolt]);
        w.rotation_error = worst([w.rotation_error, s.rotation_error]);
        w.violations = w.violations.max(s.violations);
        w.least_clearance =
            if self.flights == 1 { s.least_clearance } else { w.least_clearance.min(s.least_clearance) };
    }
}

/// Between what random flights are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Keypoints.
    Keypoints,
    /// Places close to matter: from under the table to behind the lamp.
    CloseToMatter,
}

/// Poses that flights begin and end with. Places close to matter look as the nearest keypoint does.
fn ends(navigator: &Navigator, which: Ends, count: usize, rng: &mut Pcg64) -> Vec<Pose> {
    let points = &navigator.graph.keypoints;
    let pose = |k: &Keypoint, center: DVec3| Pose { center, world_from_camera: k.world_from_camera, fov_y_rad: 0.8 };
    if points.is_empty() {
        return Vec::new();
    }
    if which == Ends::Keypoints {
        return (0..count).map(|_| &points[rng.random_range(0..points.len())]).map(|k| pose(k, k.center)).collect();
    }
    let bounds = navigator.matter.bounds();
    let mut found = Vec::with_capacity(count);
    for _ in 0..1000 * count {
        let share = DVec3::from_array([0, 0, 0].map(|_: i32| rng.random::<f64>()));
        let center = bounds.min + bounds.size() * share;
        let clearance = navigator.matter.clearance(center);
        if (navigator.clearance..3.0 * navigator.clearance).contains(&clearance)
            && let Some(near) = navigator.graph.nearest(center).next()
        {
            found.push(pose(&points[near], center));
            if found.len() == count {
                break;
            }
        }
    }
    found
}

/// Flies between `count` random pairs of places.
pub fn survey(navigator: &Navigator, which: Ends, count: usize, frames: usize, seed: u64) -> Survey {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut found = Survey::default();
    let places = ends(navigator, which, 2 * count, &mut rng);
    let mut secs = Vec::new();
    for pair in places.chunks_exact(2) {
        let (from, to) = (pair[0], pair[1]);
        let start = std::time::Instant::now();
        let flight = navigator.fly(&from, &to, None, frames, Speed::Eased);
        secs.push(start.elapsed().as_secs_f64());
        match flight {
            Ok(flight) => {
                let smoothness = |f: &Flight| f.smoothness(&navigator.matter, navigator.clearance);
                found.ours.add(&smoothness(&flight));
                let paper = Flight::of_paper(&[from, to], frames);
                paper.iter().for_each(|p| found.paper.add(&smoothness(p)));
                let through = navigator.keys(&from, &to).and_then(|keys| Flight::of_paper_through(&keys, frames));
                through.iter().for_each(|p| found.paper_through.add(&smoothness(p)));
            }
            Err(_) => found.no_way += 1,
        }
    }
    if secs.is_empty() {
        return found;
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
    use crate::navigate::testing::{turning_ring, wall_with_hole};

    #[test]
    fn ours_keep_clear_where_the_papers_do_not() {
        let cameras = turning_ring();
        let more = more_cameras(&cameras, 40, 0.3, 1);
        assert_eq!(more.len(), 40);
        let navigator = Navigator::new(&wall_with_hole(0.0, 0.6), &more, DVec3::NEG_Y);
        let survey = survey(&navigator, Ends::Keypoints, 30, 60, 7);
        assert!(survey.ours.flights > 10, "{survey:?}");
        assert_eq!(survey.ours.poses_too_near, 0, "{survey:?}");
        assert!(survey.paper.poses_too_near > 0, "the straight way leads through the wall: {survey:?}");
        // Through the keypoints of the route the paper's keep clear as well, for edges do; they are no
        // rotations, and turn by jerks.
        assert_eq!(survey.paper_through.flights, survey.ours.flights);
        assert_eq!(survey.paper_through.poses_too_near, 0, "{survey:?}");
        let [ours, paper, through] = [survey.ours, survey.paper, survey.paper_through].map(|s| s.worst);
        assert!(ours.rotation_error < 1e-9, "{ours:?}");
        assert!(paper.rotation_error > 0.1 && through.rotation_error > 1e-3, "{paper:?} {through:?}");
        assert!(through.largest_turn > 1.5 * ours.largest_turn, "{through:?} {ours:?}");
        let close = self::survey(&navigator, Ends::CloseToMatter, 10, 60, 7);
        assert!(close.ours.flights + close.no_way == 10 && close.ours.poses_too_near == 0, "{close:?}");
    }
}
