//! Quality of flights in a scene: random flights, ours beside the paper's, and times against the number of cameras
//! (`fmlgs path --survey`).

use std::time::Instant;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

use super::document::Sample;
use super::table::{Rows, rows};
use crate::math::stats::worst;
use crate::navigate::flight::Smoothness;
use crate::navigate::keypoints::{Keypoint, spacing};
use crate::navigate::{CameraTrajectory, Navigator, Pose, Speed};
use crate::scene::{Camera, GaussianCloud};

/// Seed of the pairs of places and of added cameras.
const SEED: u64 = 1;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sum {
    pub(crate) flights: usize,
    /// Flights of which a pose has less distance to occupied space than wanted.
    pub(crate) flights_too_near: usize,
    pub(crate) poses_too_near: usize,
    pub(crate) worst: Smoothness,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Survey {
    pub(crate) ours: Sum,
    /// The paper's flights as printed, between the same ends.
    pub(crate) paper: Sum,
    /// The paper's flights through all keypoints of the route, between the same ends.
    pub(crate) paper_through: Sum,
    /// Pairs of keypoints that are not connected.
    pub(crate) no_route: usize,
    /// Seconds that a route took to find.
    pub(crate) secs: Sample,
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
pub(crate) enum Ends {
    Keypoints,
    /// Places close to occupied space: from under the table to behind the lamp.
    CloseToSurface,
}

/// Poses that flights begin and end with. Places close to occupied space look as the nearest keypoint does.
fn ends(navigator: &Navigator, which: Ends, count: usize, rng: &mut Pcg64) -> Vec<Pose> {
    let points = &navigator.graph.keypoints;
    let pose = |k: &Keypoint, center: DVec3| Pose { center, world_from_camera: k.world_from_camera, fov_y_rad: 0.8 };
    if points.is_empty() {
        return Vec::new();
    }
    if which == Ends::Keypoints {
        return (0..count).map(|_| &points[rng.random_range(0..points.len())]).map(|k| pose(k, k.center)).collect();
    }
    let bounds = navigator.occupancy.bounds();
    let mut found = Vec::with_capacity(count);
    for _ in 0..1000 * count {
        let share = DVec3::from_array([0, 0, 0].map(|_: i32| rng.random::<f64>()));
        let center = bounds.min + bounds.size() * share;
        let clearance = navigator.occupancy.clearance(center);
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
pub(crate) fn survey(navigator: &Navigator, which: Ends, count: usize, frames: usize, seed: u64) -> Survey {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut found = Survey::default();
    let places = ends(navigator, which, 2 * count, &mut rng);
    for pair in places.chunks_exact(2) {
        let (from, to) = (pair[0], pair[1]);
        let start = Instant::now();
        let flight = navigator.fly(&from, &to, None, frames, Speed::Eased);
        found.secs.add(start.elapsed().as_secs_f64());
        match flight {
            Ok(flight) => {
                let smoothness = |f: &CameraTrajectory| f.smoothness(&navigator.occupancy, navigator.clearance);
                found.ours.add(&smoothness(&flight));
                let paper = CameraTrajectory::of_paper(&[from, to], frames);
                paper.iter().for_each(|p| found.paper.add(&smoothness(p)));
                let through =
                    navigator.keys(&from, &to).and_then(|keys| CameraTrajectory::of_paper_through(&keys, frames));
                through.iter().for_each(|p| found.paper_through.add(&smoothness(p)));
            }
            Err(_) => found.no_route += 1,
        }
    }
    found
}

/// Returns `count` cameras: the given ones, and more of them close by, shifted by up to half of `spread` along each
/// axis.
pub(crate) fn more_cameras(cameras: &[Camera], count: usize, spread: f64, seed: u64) -> Vec<Camera> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut all: Vec<Camera> = cameras.iter().take(count).cloned().collect();
    while all.len() < count && !cameras.is_empty() {
        let mut camera = cameras[rng.random_range(0..cameras.len())].clone();
        camera.center += DVec3::from_array([0, 0, 0].map(|_: i32| (rng.random::<f64>() - 0.5) * spread));
        all.push(camera);
    }
    all
}

/// Surveys of a scene with a number of cameras, by the kind of the flights' ends.
pub(crate) struct Surveyed {
    cameras: usize,
    navigator: Navigator,
    parts: usize,
    occupancy_secs: f64,
    build_secs: f64,
    found: [(&'static str, Survey); 2],
}

/// Surveys a scene with `count` cameras: its own, and more if needed.
pub(crate) fn surveyed(cloud: &GaussianCloud, own: &[Camera], count: usize, flights: usize, frames: usize) -> Surveyed {
    let cameras = more_cameras(own, count, 2.0 * spacing(own), SEED);
    let start = Instant::now();
    let navigator = Navigator::new(cloud, &cameras, Camera::up_of(cameras.iter()).unwrap_or(DVec3::NEG_Y));
    let occupancy_secs = start.elapsed().as_secs_f64();
    navigator.graph.look_at_all(&navigator.occupancy);
    let build_secs = start.elapsed().as_secs_f64();
    let parts = navigator.graph.parts(&navigator.occupancy).into_iter().max().map_or(0, |p| p + 1);
    let kinds = [("keypoints", Ends::Keypoints), ("close to occupied space", Ends::CloseToSurface)];
    let found = kinds.map(|(between, ends)| (between, survey(&navigator, ends, flights, frames, SEED)));
    Surveyed { cameras: count, navigator, parts, occupancy_secs, build_secs, found }
}

pub(crate) fn table(all: &[Surveyed]) -> Rows {
    let head = [
        "cameras",
        "keypoints",
        "parts",
        "built in",
        "route (median, most)",
        "way of",
        "flights",
        "too near",
        "poses",
        "least clearance",
        "largest step",
        "largest turn",
    ];
    let mut body = Vec::new();
    for s in all {
        for (between, found) in &s.found {
            let kinds =
                [("this", &found.ours), ("paper", &found.paper), ("paper, through keypoints", &found.paper_through)];
            body.extend(kinds.map(|(name, sum)| {
                let w = &sum.worst;
                vec![
                    s.cameras.to_string(),
                    s.navigator.graph.keypoints.len().to_string(),
                    s.parts.to_string(),
                    format!("{:.0} ms", s.build_secs * 1e3),
                    format!("{between}: {:.2}, {:.2} ms", found.secs.median * 1e3, found.secs.most * 1e3),
                    name.to_owned(),
                    sum.flights.to_string(),
                    sum.flights_too_near.to_string(),
                    sum.poses_too_near.to_string(),
                    format!("{:.4}", w.least_clearance),
                    format!("{:.4}", w.largest_step),
                    format!("{:.2}\u{b0}", w.largest_turn.to_degrees()),
                ]
            }));
        }
    }
    rows(&head, body)
}

/// The same as JSON, a document for each kind of ends.
pub(crate) fn documents(all: &[Surveyed]) -> Value {
    let sum = |s: &Sum| {
        json!({
            "flights": s.flights,
            "flights_too_near": s.flights_too_near,
            "poses_too_near": s.poses_too_near,
            "worst": smoothness(&s.worst),
        })
    };
    let document = |s: &Surveyed, between: &str, found: &Survey| {
        json!({
            "cameras": s.cameras,
            "between": between,
            "keypoints": s.navigator.graph.keypoints.len(),
            "keypoints_in_matter": s.navigator.in_occupied,
            "parts": s.parts,
            "edges": s.navigator.graph.looked_at().1,
            "voxel": s.navigator.occupancy.voxel(),
            "clearance": s.navigator.clearance,
            "matter_secs": s.occupancy_secs,
            "build_secs": s.build_secs,
            "route_secs": { "least": found.secs.least, "median": found.secs.median, "most": found.secs.most },
            "no_way": found.no_route,
            "ours": sum(&found.ours),
            "paper": sum(&found.paper),
            "paper_through_keypoints": sum(&found.paper_through),
        })
    };
    all.iter().flat_map(|s| s.found.iter().map(move |(between, found)| document(s, between, found))).collect()
}

pub(crate) fn smoothness(s: &Smoothness) -> Value {
    json!({
        "largest_step": s.largest_step,
        "largest_turn_deg": s.largest_turn.to_degrees(),
        "largest_jolt": s.largest_jolt,
        "least_clearance": s.least_clearance,
        "poses_too_near": s.violations,
        "rotation_error": s.rotation_error,
    })
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
        let close = self::survey(&navigator, Ends::CloseToSurface, 10, 60, 7);
        assert!(close.ours.flights + close.no_route == 10 && close.ours.poses_too_near == 0, "{close:?}");
    }
}
