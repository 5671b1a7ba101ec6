//! Poses as seven parameters around a camera: move along its axes, turn about them, logarithm of the focal length.

use glam::{DMat3, DQuat, DVec3};

use crate::math::rotation::nearest_rotation;
use crate::scene::Camera;

/// Parameters of a pose: three of the move (scene units), three of the turn (radians), one of the focal length.
pub(crate) const PARAMETERS: usize = 7;

/// A change of a pose.
pub(crate) type PoseStep = [f64; PARAMETERS];

/// The camera after a step.
pub(crate) fn moved(camera: &Camera, step: &PoseStep) -> Camera {
    let [x, y, z, a, b, c, focal] = *step;
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(a, b, c)));
    Camera {
        center: camera.center + camera.world_from_camera * DVec3::new(x, y, z),
        world_from_camera: nearest_rotation(&(camera.world_from_camera * turn)),
        focal_px: camera.focal_px * focal.exp(),
        ..camera.clone()
    }
}

/// Change of the pixel position of a point at `local` in camera axes, which is in front of it, by each parameter.
pub(super) fn flow(camera: &Camera, local: DVec3) -> [PoseStep; 2] {
    let (f, z) = (camera.focal_px, local.z);
    let (x, y) = (local.x / z, local.y / z);
    [
        [-f.x / z, 0.0, f.x * x / z, f.x * x * y, -f.x * (1.0 + x * x), f.x * y, f.x * x],
        [0.0, -f.y / z, f.y * y / z, f.y * (1.0 + y * y), -f.y * x * y, -f.y * x, f.y * y],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flow_is_the_slope_of_the_projection() {
        let camera = Camera::look_at(DVec3::new(1.0, -3.0, 0.5), DVec3::ZERO, DVec3::Z, 0.9, 64, 48).expect("valid");
        let point = DVec3::new(0.3, 0.2, -0.4);
        let flow = flow(&camera, camera.camera_from_world(point));
        for k in 0..PARAMETERS {
            let h = 1e-6;
            let at = |by: f64| {
                let mut step = [0.0; PARAMETERS];
                step[k] = by;
                moved(&camera, &step).project(point).expect("in front")
            };
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!((slope.x - flow[0][k]).abs() < 1e-5 && (slope.y - flow[1][k]).abs() < 1e-5, "{k}: {slope}");
        }
    }
}
