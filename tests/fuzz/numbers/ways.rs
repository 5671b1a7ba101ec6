//! Cameras, ways and flights.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::source::Numbers;
use super::{Verdict, promise};
use fmlgs::math::rotation::rotation_error;
use fmlgs::navigate::curve::Curve;
use fmlgs::navigate::keypoints::spacing;
use fmlgs::navigate::{CameraTrajectory, Navigator, Pose, Speed};
use fmlgs::scene::{Camera, GaussianCloud};

/// Poses of a flight.
const FRAMES: usize = 24;

fn place(n: &mut Numbers) -> DVec3 {
    DVec3::new(n.wide(-2.0, 2.0), n.wide(-2.0, 2.0), n.wide(-2.0, 2.0))
}

fn rotation(n: &mut Numbers) -> DMat3 {
    let half = std::f64::consts::PI;
    match n.below(4) {
        0 => DMat3::IDENTITY,
        1 => DMat3::from_rotation_x(half),
        2 => DMat3::from_rotation_y(n.plain(-half, half)),
        _ => {
            let axis = DVec3::new(n.plain(-1.0, 1.0), n.plain(-1.0, 1.0), n.plain(-1.0, 1.0));
            DMat3::from_quat(DQuat::from_axis_angle(axis.normalize_or(DVec3::X), n.plain(-half, half)))
        }
    }
}

fn pose(n: &mut Numbers) -> Pose {
    Pose { center: place(n), world_from_camera: rotation(n), fov_y_rad: n.plain(0.1, 2.5) }
}

/// Finite poses, rotations, and so many of them.
fn whole(flight: &CameraTrajectory) -> Result<(), String> {
    if flight.poses.len() != FRAMES || !flight.seconds.is_finite() || !flight.length.is_finite() {
        return Err(format!("{} poses, {} s, length {}", flight.poses.len(), flight.seconds, flight.length));
    }
    match flight.poses.iter().position(|p| !(p.center.is_finite() && rotation_error(&p.world_from_camera) < 1e-6)) {
        Some(i) => Err(format!("pose {i} is {:?}", flight.poses[i])),
        None => Ok(()),
    }
}

/// Ways are finite; flights are whole, or there are none.
pub fn moving(n: &mut Numbers) -> Verdict {
    let legs: Vec<DVec3> = {
        let mut legs: Vec<DVec3> = (0..n.below(8)).map(|_| place(n)).collect();
        if n.chance(0.3) && !legs.is_empty() {
            legs.push(legs[0]);
        }
        legs
    };
    if let Some(curve) = Curve::new(&legs, None, 0.0) {
        promise!(curve.length().is_finite(), "the way's length is {}", curve.length());
        let at = [0.0, 1e-9, 0.3, 0.999, 1.0, f64::NAN].map(|s| curve.at(s));
        promise!(at.iter().all(|p| p.is_finite()), "a place on the way is {at:?}");
    } else {
        let nowhere = |p: &DVec3| !(p.is_finite() && p.abs().max_element() < 1e18);
        promise!(legs.iter().all(nowhere), "there is no way along {legs:?}");
    }
    let (from, to) = (pose(n), pose(n));
    let speed = n.pick(&[Speed::Constant, Speed::Eased]);
    let look_at = n.chance(0.5).then(|| (place(n), DVec3::NEG_Y));
    let mut refused = true;
    if let Some(flight) = CameraTrajectory::new(&legs, [&from, &to], look_at, None, FRAMES, speed) {
        let found = whole(&flight);
        promise!(found.is_ok(), "{}", found.err().unwrap_or_default());
        refused = false;
    }
    let cameras: Vec<Camera> = (0..n.below(7))
        .map(|_| Camera {
            width_px: 64,
            height_px: 48,
            focal_px: DVec2::splat(50.0),
            principal_px: DVec2::new(32.0, 24.0),
            world_from_camera: rotation(n),
            center: place(n),
        })
        .collect();
    let apart = spacing(&cameras);
    promise!(apart.is_finite() && apart >= 0.0, "cameras are {apart} apart");
    // A grid of what is in a scene takes long to make.
    if n.chance(0.02) {
        let mut cloud = GaussianCloud::default();
        for _ in 0..n.below(30) {
            cloud.positions.push(n.several(-1.5, 1.5));
            cloud.log_scales.push(n.several(-4.0, 0.0));
            cloud.quaternions.push(n.several(-1.0, 1.0));
            cloud.opacity_logits.push(n.around(-2.0, 6.0));
            cloud.sh.push([0.0; 3]);
        }
        if cloud.validate().is_err() {
            return Verdict::Refused;
        }
        let navigator = Navigator::new(&cloud, &cameras, DVec3::NEG_Y);
        promise!(navigator.clearance.is_finite(), "the clearance is {}", navigator.clearance);
        let standing = navigator.graph.keypoints.iter().all(|k| k.center.is_finite());
        promise!(standing, "a keypoint is nowhere");
        if let Ok(flight) = navigator.fly(&from, &to, look_at.map(|l| l.0), FRAMES, speed) {
            let found = whole(&flight);
            promise!(found.is_ok(), "through the scene: {}", found.err().unwrap_or_default());
        }
        refused = false;
    }
    if refused { Verdict::Refused } else { Verdict::Held }
}
