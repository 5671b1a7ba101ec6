//! Knobs of camera paths, compared with occupied space, and with the length of the way itself.

use std::time::Instant;

use glam::{DMat3, DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::json;

use super::{StudyInput, Variants, error};
use crate::math::stats::{mean, worst};
use crate::measure::sweep::failed;
use crate::measure::{Order, Rule, Stage, StageName, Study, Trial};
use crate::navigate::curve::{Curve, bend};
use crate::navigate::graph::Graph;
use crate::navigate::pose::{RotationSpline, angle};
use crate::navigate::{CameraTrajectory, FRAMES, Navigator, Pose, Speed};
use crate::scene::{Camera, GaussianCloud};

const FLIGHTS: usize = 24;
/// A turn from one pose to the next that is seen as a jerk, radians.
const JERK: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Places between two poses that are looked at.
const BETWEEN: usize = 16;

#[derive(Clone, Copy)]
struct Variant {
    frames: usize,
    /// Places that are looked at along every leg; `None` as many as the distances demand.
    samples: Option<u32>,
    way: Way,
}

#[derive(Clone, Copy)]
enum Way {
    Ours,
    Printed,
    /// The paper's, through all keypoints of the route.
    Through,
}

/// The sweep of camera paths through `cloud`, whose photos were taken by these cameras.
pub(crate) fn study(cloud: &GaussianCloud, cameras: &[Camera], repeats: u32, mut input: StudyInput) -> Study<'static> {
    let up = Camera::up_of(cameras.iter()).unwrap_or(DVec3::NEG_Y);
    let mut navigator = Navigator::new(cloud, cameras, up);
    input.insert("keypoints".into(), navigator.graph.keypoints.len().to_string());
    input.insert("flights".into(), FLIGHTS.to_string());
    let measures = vec![
        error(
            "faults",
            "share of steps from pose to pose that come too near to occupied space or turn by more than 3 degrees",
        ),
        error("arc-length error", "by how much the way from pose to pose is off the length of the way, relative"),
        error("too near", "share of places along flights that are nearer to occupied space than wanted"),
        error("largest turn", "largest turn from one pose to the next, degrees"),
        error("no way", "share of pairs of keypoints between which none was found"),
    ];
    let rule = Rule::new("faults", 1.0, 1e-3, 1e-3);
    let words = [
        "one flight, edges that it asks for included",
        "flights are compared with occupied space between poses, and with the length of the smooth way",
    ];
    let stage = Stage::new(StageName::Path, words, (input, repeats), rule, measures);
    let study = Study::new(stage, variants().0, move |variant: &Variant, seed, observer| {
        let n = navigator.graph.keypoints.len();
        if n == 0 {
            return Err(failed("all cameras are inside occupied space: there is nowhere to fly from"));
        }
        let mut rng = Pcg64::seed_from_u64(seed);
        let pairs: Vec<[usize; 2]> = (0..FLIGHTS).map(|_| [rng.random_range(0..n), rng.random_range(0..n)]).collect();
        // Edges are looked at anew, as after opening a scene.
        navigator.graph = Graph::new(navigator.graph.keypoints.clone(), navigator.graph.clearance);
        navigator.occupancy.samples = variant.samples;
        let start = Instant::now();
        let mut flights = Vec::new();
        for pair in &pairs {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            flights.extend(fly(&navigator, *variant, *pair));
        }
        let secs = start.elapsed().as_secs_f64() / pairs.len() as f64;
        navigator.occupancy.samples = None;
        let found: Vec<Faults> = flights.iter().map(|f| faults(f, &navigator)).collect();
        let of = |value: fn(&Faults) -> f64| mean(&found.iter().map(value).collect::<Vec<_>>());
        let values = vec![
            ("faults", of(|f| f.steps)),
            ("arc-length error", of(|f| f.short)),
            ("too near", of(|f| f.near)),
            ("largest turn", worst(found.iter().map(|f| f.turn)).to_degrees()),
            ("no way", 1.0 - flights.len() as f64 / pairs.len() as f64),
        ];
        Ok(Some(Trial { secs, values, curve: Vec::new() }))
    });
    study.with_orders(|| Ok(vec![length_order(), corner_order(), turning_order()]))
}

/// A flight from one keypoint to another, if there is a way.
fn fly(navigator: &Navigator, variant: Variant, ends: [usize; 2]) -> Option<CameraTrajectory> {
    let pose = |i: usize| {
        let k = &navigator.graph.keypoints[i];
        Pose { center: k.center, world_from_camera: k.world_from_camera, fov_y_rad: 0.8 }
    };
    let [from, to] = ends.map(pose);
    match variant.way {
        Way::Printed => CameraTrajectory::of_paper(&[from, to], variant.frames),
        Way::Through => CameraTrajectory::of_paper_through(&navigator.keys(&from, &to)?, variant.frames),
        Way::Ours => navigator.fly(&from, &to, None, variant.frames, Speed::Eased).ok(),
    }
}

fn variants() -> Variants<Variant> {
    let variant = |frames, samples, way| Variant { frames, samples, way };
    let default = format!("{FRAMES} frames, steps by distance");
    let mut all = Variants::new(default, variant(FRAMES, None, Way::Ours));
    for frames in [15, 30, 75, 300, 600] {
        all.add("frames", frames.to_string(), &[("frames", json!(frames))], variant(frames, None, Way::Ours));
    }
    for samples in [1, 2, 4, 8, 16, 64] {
        let (setting, knobs) = (format!("{samples} along a leg"), [("samples", json!(samples))]);
        all.add("samples along legs", setting, &knobs, variant(FRAMES, Some(samples), Way::Ours));
    }
    for frames in [30, FRAMES] {
        for (way, words, name) in [(Way::Printed, "", "printed"), (Way::Through, "through all keypoints, ", "through")]
        {
            let (setting, knobs) = (format!("{words}{frames} frames"), [("paper", json!(name))]);
            all.add("the paper's interpolation", setting, &knobs, variant(frames, None, way));
        }
    }
    all
}

struct Faults {
    /// Share of its steps that come too near to occupied space or turn too far.
    steps: f64,
    /// Share of the places along it that are nearer to occupied space than wanted.
    near: f64,
    /// Share by which the path from pose to pose is shorter than the path itself.
    short: f64,
    /// Largest turn of a step, radians.
    turn: f64,
}

fn faults(flight: &CameraTrajectory, navigator: &Navigator) -> Faults {
    let (mut wrong, mut near, mut gone, mut largest) = (0, 0, 0.0, 0.0_f64);
    for pair in flight.poses.windows(2) {
        gone += pair[0].center.distance(pair[1].center);
        let too_near = |k: &usize| {
            let place = pair[0].center.lerp(pair[1].center, *k as f64 / BETWEEN as f64);
            navigator.occupancy.clearance(place) < 0.99 * navigator.clearance
        };
        let here = (0..BETWEEN).filter(too_near).count();
        let turn = angle(&pair[0].world_from_camera, &pair[1].world_from_camera);
        // What is no rotation turns by no angle: that is a jerk, too.
        wrong += usize::from(here > 0 || !(turn <= JERK));
        near += here;
        largest = largest.max(if turn.is_finite() { turn } else { std::f64::consts::PI });
    }
    let steps = flight.poses.len().saturating_sub(1).max(1);
    Faults {
        steps: wrong as f64 / steps as f64,
        near: near as f64 / (steps * BETWEEN) as f64,
        short: if flight.length > 0.0 { (1.0 - gone / flight.length).abs() } else { 0.0 },
        turn: largest,
    }
}

/// Order at which the length of a path over some places, corners rounded, converges to that of their curve, here a
/// quarter of a circle: chords are of second order.
fn length_order() -> Order {
    let exact = std::f64::consts::FRAC_PI_2;
    // From where on the ends, whose legs have one corner only, count for little.
    let pairs = [16_usize, 32, 64, 128, 256].map(|n| {
        let at = |i: usize| DVec3::new((exact * i as f64 / n as f64).cos(), (exact * i as f64 / n as f64).sin(), 0.0);
        let places: Vec<DVec3> = (0..=n).map(at).collect();
        let length = Curve::new(&places, None, 0.0).map_or(f64::NAN, |c| c.length());
        [n as f64, (exact - length).abs()]
    });
    let meaning = "Places along a way against the error of the length of the way over them.";
    Order::fit("samples along a way", meaning, pairs.to_vec(), 2.0, 0.1, 1e-13)
}

/// Order at which the pieces of a rounded corner converge to the parabola's own length.
fn corner_order() -> Order {
    // Of the parabola that touches two legs of length 1 at a right angle.
    let exact = 1.0 + (1.0 + 2.0_f64.sqrt()).ln() / 2.0_f64.sqrt();
    let pairs = [1_usize, 2, 4, 8, 16, 32].map(|n| {
        let points = bend(DVec3::ZERO, [DVec3::NEG_X, DVec3::Y], 1.0, n);
        let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        [n as f64, (exact - length).abs()]
    });
    let meaning = "Pieces of a rounded corner against the error of its length; 24 pieces are drawn.";
    Order::fit("pieces of a rounded corner", meaning, pairs.to_vec(), 2.0, 0.2, 1e-13)
}

/// Order at which rotations between keys converge to the smooth turn of the keys.
fn turning_order() -> Order {
    let turn = |t: f64| -> DMat3 {
        DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.9 * t.sin(), 0.7 * t * t, 1.3 * t)))
    };
    let pairs = [4_usize, 8, 16, 32, 64].map(|n| {
        let keys: Vec<(f64, DMat3)> = (0..=n).map(|i| i as f64 / n as f64).map(|t| (t, turn(t))).collect();
        let spline = RotationSpline::new(&keys, false);
        // Away from the ends, where a key has neighbors on both sides.
        let off = |k: usize| {
            let t = 0.25 + 0.5 * (f64::from(k as u32) + 0.37) / 200.0;
            spline.as_ref().map_or(f64::NAN, |s| angle(&s.at(t), &turn(t)))
        };
        [n as f64, worst((0..200).map(off))]
    });
    let meaning = "Keys of a turn against the largest error between them, in radians.";
    Order::fit("keys of a smooth turn", meaning, pairs.to_vec(), 3.0, 0.35, 1e-12)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::{ring_of_cameras, turning_ring, wall_with_hole};

    #[test]
    fn convergence_is_what_theory_says() {
        for order in [length_order(), corner_order(), turning_order()] {
            assert!(order.agrees, "{order:?}");
        }
    }

    #[test]
    fn too_few_looks_fly_through_walls_and_the_default_does_not() {
        let study = |cameras: &[Camera]| study(&wall_with_hole(0.0, 0.6), cameras, 1, StudyInput::new());
        let measured = |study: &mut Study<'_>, method: &str, setting: &str, name: &str| {
            let trial = study.measured(method, setting, 3);
            trial.values.iter().find(|v| v.0 == name).expect("measured").1
        };
        let mut ring = study(&ring_of_cameras());
        let mut value = |method: &str, setting: &str, name: &str| measured(&mut ring, method, setting, name);
        let (default, once) = (value("default", "", "too near"), value("samples along legs", "1 along", "too near"));
        // Poses in occupied space are pushed out of it, so what is left is little, but there.
        assert!(default == 0.0 && once > 0.0, "{default} {once}");
        let (few, many) = (value("frames", "15", "arc-length error"), value("frames", "600", "arc-length error"));
        assert!(few > 4.0 * many, "{few} {many}");
        let paper = value("the paper's interpolation", "150", "too near");
        assert!(paper > default, "{paper}");
        // Along the edges of the graph the paper's formula keeps clear; where cameras turn, it does so by jerks.
        let paper = "the paper's interpolation";
        assert_eq!(value(paper, "keypoints, 150", "too near"), 0.0);
        let mut turning = study(&turning_ring());
        let [own, through] =
            [("default", ""), (paper, "keypoints, 150")].map(|(m, s)| measured(&mut turning, m, s, "largest turn"));
        assert!(own < 3.0 && through > own, "{own} {through} degrees");
    }
}
