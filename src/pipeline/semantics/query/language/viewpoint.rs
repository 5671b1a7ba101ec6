//! Place from which a scene is asked, with the axes of its sides.

use glam::DVec3;

/// Camera position, view direction and up direction of the scene, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Camera position.
    pub eye: DVec3,
    /// View direction; of any length.
    pub forward: DVec3,
    /// Up direction of the scene; of any length.
    pub up: DVec3,
}

/// Upright unit axes of a view: right, up and ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UprightAxes {
    /// Right.
    pub right: DVec3,
    /// Up direction of the scene.
    pub up: DVec3,
    /// Ahead, parallel to the ground.
    pub ahead: DVec3,
}

impl Viewpoint {
    /// Upright axes of the view. For a view straight up or down, or without a direction, the level axes are arbitrary.
    pub fn frame(&self) -> UprightAxes {
        let up = self.up.try_normalize().unwrap_or(DVec3::Z);
        let level = self.forward.try_normalize().map(|f| f - up * f.dot(up)).filter(|l| l.length() > 1e-3);
        let ahead = level.and_then(DVec3::try_normalize).unwrap_or_else(|| up.any_orthonormal_vector());
        UprightAxes { right: ahead.cross(up), up, ahead }
    }
}
