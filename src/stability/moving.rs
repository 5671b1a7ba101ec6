//! Cameras and ways at their limits.

use glam::{DMat3, DVec3};

use super::drawing::{camera, one};
use super::{Case, Finding};
use crate::navigate::pose::{RotationSpline, angle};
use crate::navigate::{FRAMES, Flight, Navigator, NoWay, Pose, Speed};
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

/// A flight is whole: as many poses as wanted, finite, and rotations.
fn whole(flight: Option<Flight>) -> Finding {
    let Some(flight) = flight else { return Finding::is("there is no flight", false) };
    let error = |p: &Pose| crate::math::rotation::rotation_error(&p.world_from_camera);
    let worst = flight.poses.iter().map(error).fold(0.0, f64::max);
    let finite = flight.poses.iter().all(|p| p.center.is_finite()) && flight.poses.len() == FRAMES;
    Finding::within(format!("{} poses", flight.poses.len()), if finite { worst } else { f64::NAN }, 1e-9)
}

/// The cases of this area.
pub fn cases() -> Vec<Case> {
    let moving = |name: &'static str, run: fn() -> Finding| Case::new("moving", name, run);
    vec![
        moving("duplicate cameras", || {
            let n = navigator(&[[0.0, 0.0, -2.0]; 4]);
            Finding::is(format!("spacing {}, {} keypoints", n.spacing, n.graph.keypoints.len()), n.spacing == 0.0)
        }),
        moving("collinear cameras", || {
            let n = navigator(&[[-1.0, 0.0, -2.0], [0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]);
            whole(n.fly(&pose(-1.0, 0.0), &pose(1.0, 0.3), None, FRAMES, Speed::Eased).ok())
        }),
        moving("no cameras", || {
            let way = navigator(&[]).legs(DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.0, 0.0, 2.0));
            Finding::is(format!("{:?}", way.as_ref().err()), way.is_err())
        }),
        moving("a graph in two parts", || {
            // Cameras on both sides of a wall that ends nowhere in the known box.
            let places: Vec<[f64; 3]> = (0..18)
                .map(|i| {
                    let side = if i < 9 { -1.0 } else { 1.0 };
                    [f64::from(i % 3) - 1.0, f64::from(i / 3 % 3) - 1.0, side]
                })
                .collect();
            let n = Navigator::new(&wall(), &cameras(&places), DVec3::NEG_Y);
            let parts = n.graph.parts(&n.matter);
            let way = n.legs(DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, 0.0, 1.0));
            let parted = matches!(way, Err(NoWay::Parted { .. }));
            let same = n.legs(DVec3::new(0.0, 0.0, -1.0), DVec3::new(1.0, 0.0, -1.0));
            let count = parts.iter().max().map_or(0, |m| m + 1);
            Finding::is(format!("{count} parts; between them: {:?}", way.err()), parted && same.is_ok() && count >= 2)
        }),
        moving("a goal inside matter", || {
            let way = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]).legs(DVec3::new(0.0, 0.0, -2.0), DVec3::ZERO);
            Finding::is("refused", way == Err(NoWay::Inside))
        }),
        moving("a goal that is no number", || {
            let way = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0]]).legs(DVec3::NEG_Z * 2.0, DVec3::splat(f64::NAN));
            Finding::is("refused", way == Err(NoWay::Inside))
        }),
        moving("a flight of no length", || {
            let p = pose(0.0, 0.4);
            whole(Flight::new(&[p.center], [&p, &p], None, None, FRAMES, Speed::Eased))
        }),
        moving("a flight of half a turn on the spot", || {
            let (a, b) = (pose(0.0, 0.0), pose(0.0, std::f64::consts::PI));
            whole(Flight::new(&[a.center, b.center], [&a, &b], None, None, FRAMES, Speed::Constant))
        }),
        moving("legs over places 1e300 units away", || {
            let (a, b) = (pose(0.0, 0.0), pose(1.0, 0.5));
            let legs = [a.center, DVec3::splat(1e300), DVec3::splat(-1e300), b.center];
            whole(Flight::new(&legs, [&a, &b], None, None, FRAMES, Speed::Eased))
        }),
        moving("looking at what is 1e30 units away, from outside of the scene", || {
            let n = navigator(&[[-1.0, 0.0, -2.0], [1.0, 0.0, -2.0]]);
            let (from, far) = (Pose { center: DVec3::splat(50.0), ..pose(0.0, 0.0) }, DVec3::new(1e30, -3e29, 7.0));
            let goal = Pose { center: DVec3::new(-60.0, 0.0, 0.0), ..pose(0.0, 0.0) };
            let way = n.fly(&from, &goal, Some(far), FRAMES, Speed::Eased);
            let share = n.matter.free_share(DVec3::NEG_Z * 2.0, DVec3::splat(1e30), 0.0);
            let outcome = format!("{:?}; {share:.0e} of the way is free", way.as_ref().err());
            Finding::is(outcome, way == Err(NoWay::Inside) && share < 1e-20)
        }),
        moving("cameras 1e300 units apart", || {
            let n = navigator(&[[0.0, 0.0, -2.0], [1.0, 0.0, -2.0], [1e300, 0.0, 0.0], [-1e300, 1e300, 0.0]]);
            let places = n.graph.keypoints.iter().all(|k| k.center.is_finite());
            let error = (n.spacing - 1.0).abs();
            let finding = Finding::within(format!("spacing {} of those that are somewhere", n.spacing), error, 1e-12);
            Finding { holds: finding.holds && places && n.clearance.is_finite(), ..finding }
        }),
        moving("10,000 keypoints", || {
            let legs: Vec<DVec3> =
                (0..10_000).map(|i| DVec3::new(f64::from(i % 100), f64::from(i / 100), 0.0)).collect();
            let (a, b) = (Pose { center: legs[0], ..pose(0.0, 0.0) }, Pose { center: legs[9_999], ..pose(0.0, 1.0) });
            whole(Flight::new(&legs, [&a, &b], None, None, FRAMES, Speed::Eased))
        }),
        moving("rotations half a turn apart, in between", || {
            let ends = [DMat3::IDENTITY, DMat3::from_rotation_x(std::f64::consts::PI)];
            let spline = RotationSpline::new(&[(0.0, ends[0]), (1.0, ends[1])], false);
            let half = spline.map_or(f64::NAN, |s| angle(&s.at(0.5), &ends[0]));
            Finding::within("a quarter turn from each", (half - std::f64::consts::FRAC_PI_2).abs(), 1e-9)
        }),
        moving("the paper's interpolation is no rotation there", || {
            let keys = [pose(0.0, 0.0), pose(1.0, std::f64::consts::PI)];
            let flight = Flight::of_paper(&keys, FRAMES);
            let middle = flight.and_then(|f| f.poses.get(FRAMES / 2).copied());
            let determinant = middle.map_or(f64::NAN, |p| p.world_from_camera.determinant());
            // The negative control of this area: it must be seen to break.
            Finding::is(format!("determinant {determinant:.3} in the middle, where 1 is a rotation"), determinant < 0.1)
        }),
    ]
}
