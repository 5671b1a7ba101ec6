//! Change of a camera's pose, and how large it is expected to be.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::math::rotation::nearest_rotation;
use crate::scene::Camera;

/// Expected error of a given place, in radii of the scene.
pub(crate) const MOVE_DEVIATION: f64 = 0.01;
/// Expected error of a given rotation, radians.
pub(crate) const TURN_DEVIATION: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Change of a given pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseOffset {
    /// Move along the given camera's axes, scene units.
    pub(crate) along: DVec3,
    /// Turn about the camera's axes: axis times angle, radians.
    pub(crate) turn: DVec3,
}

impl PoseOffset {
    /// The camera at the changed pose.
    pub(crate) fn applied(&self, given: &Camera) -> Camera {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(self.turn));
        Camera {
            center: given.center + given.world_from_camera * self.along,
            world_from_camera: nearest_rotation(&(given.world_from_camera * turn)),
            ..given.clone()
        }
    }

    /// The change from a given pose to another.
    pub(crate) fn between(given: &Camera, now: &Camera) -> Self {
        let to_camera = given.world_from_camera.transpose();
        let turn = DQuat::from_mat3(&(to_camera * now.world_from_camera));
        let turn = if turn.w < 0.0 { -turn } else { turn };
        Self { along: to_camera * (now.center - given.center), turn: turn.to_scaled_axis() }
    }
}
