//! Cameras and ways at their limits.

use glam::{DMat3, DVec3};

use super::drawing::{camera, one};
use super::{Case, Finding};
use crate::math::stats::worst;
use crate::navigate::pose::{RotationSpline, angle};
use crate::navigate::{CameraTrajectory, FRAMES, Navigator, NoRoute, Pose, Speed};
use crate::scene::{Camera, GaussianCloud};

fn cameras(places: &[[f64; 3]]) -> Vec<Camera> {
    places.iter().map(|p| Camera { center: DVec3::from_array(*p), ..camera(64, 48) }).collect()
}

fn navigator(places: &[[f64; 3]]) -> Navigator {
    let cloud: GaussianCloud = one([0.03; 3], [1.0, 0.0, 0.0, 0.0], 9.0).cast();
    Navigator::new(&cloud, &cameras(places), DVec3::NEG_Y)
}

/// An opaque wall across the axis.
fn wall() -> GaussianCloud {
    let one: GaussianCloud = one([0.1, 0.1, 0.01], [1.0, 0.0, 0.0, 0.0], 6.0).cast();
    let mut wall = one.select(&[0; 81 * 81]);
    for (i, p) in wall.positions.iter_mut().enumerate() {
        *p = [(i % 81) as f32 * 0.1 - 4.0, (i / 81) as f32 * 0.1 - 4.0, 0.0];
    }
    wall
}

fn pose(x: f64, turn: f64) -> Pose {
    Pose { center: DVec3::new(x, 0.0, -2.0), world_from_camera: DMat3::from_rotation_y(turn), fov_y_rad: 0.8 }
}

/// A flight is whole: as many poses as wanted, finite, and rotations. The fault is one entry of one of them
/// that is NaN.
fn whole(flight: Option<CameraTrajectory>, faulty: bool) -> Finding {
    let Some(mut flight) = flight else { return Finding::is("there is no flight", false) };
    if faulty && let Some(pose) = flight.poses.last_mut() {
        pose.world_from_camera.y_axis.z = f64::NAN;
    }
    let error = |p: &Pose| crate::math::rotation::rotation_error(&p.world_from_camera);
    let worst = worst(flight.poses.iter().map(error));
    let finite = flight.poses.iter().all(|p| p.center.is_finite()) && flight.poses.len() == FRAMES;
    Finding::within(format!("{} poses", flight.poses.len()), if finite { worst } else { f64::NAN }, 1e-9)
}

pub(crate) fn cases() -> Vec<Case> {
    let moving = |name: &'static str, run: fn(bool) -> Finding| Case::new("moving", name, run);
    vec![
        moving("duplicate cameras", |faulty| {
            let mut places = [[0.0, 0.0, -2.0]; 4];
            places[3][0] = if faulty { 1e-9 } else { 0.0 };
            let n = navigator(&places);
            Finding::is(format!("spacing {}, {} keypoints", n.spacing, n.graph.keypoints.len()), n.spacing == 0.0)
        }),
        moving("collinear cameras", |faulty| {
            let n = navigator(&[[-1.0, 0.0, -2.0], [0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]);
            whole(n.fly(&pose(-1.0, 0.0), &pose(1.0, 0.3), None, FRAMES, Speed::Eased).ok(), faulty)
        }),
        moving("no cameras", |faulty| {
            // Where cameras are is known to be free.
            let places: &[[f64; 3]] = if faulty { &[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0]] } else { &[] };
            let way = navigator(places).legs(DVec3::new(0.0, 0.0, -2.0), DVec3::new(1.0, 0.0, -2.0));
            Finding::is(format!("{:?}", way.as_ref().err()), way == Err(NoRoute::Inside))
        }),
        moving("a graph in two parts", |faulty| {
            // Cameras on both sides of a wall that ends nowhere in the known box.
            let places: Vec<[f64; 3]> = (0..18)
                .map(|i| {
                    let side = if i < 9 { -1.0 } else { 1.0 };
                    [f64::from(i % 3) - 1.0, f64::from(i / 3 % 3) - 1.0, side]
                })
                .collect();
            let hole = wall().select(&[0]);
            let n = Navigator::new(&if faulty { hole } else { wall() }, &cameras(&places), DVec3::NEG_Y);
            let parts = n.graph.parts(&n.occupancy);
            let way = n.legs(DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 1.0));
            let parted = matches!(way, Err(NoRoute::Parted { .. }));
            let same = n.legs(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, -1.0));
            let count = parts.iter().max().map_or(0, |m| m + 1);
            Finding::is(format!("{count} parts; between them: {:?}", way.err()), parted && same.is_ok() && count >= 2)
        }),
        moving("a goal inside occupied space", |faulty| {
            let goal = if faulty { DVec3::new(1.0, 0.0, -2.0) } else { DVec3::ZERO };
            let way = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]).legs(DVec3::new(0.0, 0.0, -2.0), goal);
            Finding::is("refused", way == Err(NoRoute::Inside))
        }),
        moving("a goal that is NaN", |faulty| {
            let goal = DVec3::new(if faulty { 1.0 } else { f64::NAN }, 0.0, -2.0);
            let way = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]).legs(DVec3::NEG_Z * 2.0, goal);
            Finding::is("refused", way == Err(NoRoute::Inside))
        }),
        moving("a flight of no length", |faulty| {
            let p = pose(0.0, 0.4);
            whole(CameraTrajectory::new(&[p.center], [&p, &p], None, None, FRAMES, Speed::Eased), faulty)
        }),
        moving("a flight of half a turn on the spot", |faulty| {
            let (a, b) = (pose(0.0, 0.0), pose(0.0, std::f64::consts::PI));
            whole(CameraTrajectory::new(&[a.center, b.center], [&a, &b], None, None, FRAMES, Speed::Constant), faulty)
        }),
        moving("legs over places 1e300 units away", |faulty| {
            let (a, b) = (pose(0.0, 0.0), pose(1.0, 0.5));
            let legs = [a.center, DVec3::splat(1e300), DVec3::splat(-1e300), b.center];
            whole(CameraTrajectory::new(&legs, [&a, &b], None, None, FRAMES, Speed::Eased), faulty)
        }),
        moving("looking at what is 1e30 units away, from outside of the scene", |faulty| {
            let n = navigator(&[[-1.0, 0.0, -2.0], [1.0, 0.0, -2.0]]);
            let (from, far) = (Pose { center: DVec3::splat(50.0), ..pose(0.0, 0.0) }, DVec3::new(1e30, -3e29, 7.0));
            let goal = Pose { center: DVec3::new(-60.0, 0.0, 0.0), ..pose(0.0, 0.0) };
            let way = n.fly(&from, &goal, Some(far), FRAMES, Speed::Eased);
            let share = n.occupancy.free_share(DVec3::NEG_Z * 2.0, DVec3::splat(if faulty { -1.9 } else { 1e30 }), 0.0);
            let outcome = format!("{:?}; {share:.0e} of the way is free", way.as_ref().err());
            Finding::is(outcome, way == Err(NoRoute::Inside) && share < 1e-20)
        }),
        moving("cameras 1e300 units apart", |faulty| {
            // The fault: one of them is somewhere after all.
            let far = if faulty { 5.0 } else { 1e300 };
            let n = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0], [far, 0.0, 0.0], [-1e300, 1e300, 0.0]]);
            let places = n.graph.keypoints.iter().all(|k| k.center.is_finite());
            let error = (n.spacing - 1.0).abs();
            let finding = Finding::within(format!("spacing {} of those that are somewhere", n.spacing), error, 1e-12);
            finding.and(places && n.clearance.is_finite())
        }),
        moving("10,000 keypoints", |faulty| {
            let legs: Vec<DVec3> =
                (0..10_000).map(|i| DVec3::new(f64::from(i % 100), f64::from(i / 100), 0.0)).collect();
            let (a, b) = (Pose { center: legs[0], ..pose(0.0, 0.0) }, Pose { center: legs[9_999], ..pose(0.0, 1.0) });
            whole(CameraTrajectory::new(&legs, [&a, &b], None, None, FRAMES, Speed::Eased), faulty)
        }),
        moving("rotations half a turn apart, in between", |faulty| {
            let turn = if faulty { 0.99 } else { 1.0 } * std::f64::consts::PI;
            let ends = [DMat3::IDENTITY, DMat3::from_rotation_x(turn)];
            let spline = RotationSpline::new(&[(0.0, ends[0]), (1.0, ends[1])], false);
            let half = spline.map_or(f64::NAN, |s| angle(&s.at(0.5), &ends[0]));
            Finding::within("a quarter turn from each", (half - std::f64::consts::FRAC_PI_2).abs(), 1e-9)
        }),
        moving("the paper's interpolation is no rotation there", |faulty| {
            let keys = [pose(0.0, 0.0), pose(1.0, if faulty { 0.1 } else { std::f64::consts::PI })];
            let flight = CameraTrajectory::of_paper(&keys, FRAMES);
            let middle = flight.and_then(|f| f.poses.get(FRAMES / 2).copied());
            let determinant = middle.map_or(f64::NAN, |p| p.world_from_camera.determinant());
            // The negative control of this area: it must be seen to break.
            Finding::is(format!("determinant {determinant:.3} in the middle, where 1 is a rotation"), determinant < 0.1)
        }),
    ]
}
