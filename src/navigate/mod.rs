//! Routes through a scene: occupied space, reachable keypoints, paths between them, and the best views of a target (the
//! paper's Interactive Agent; Scene Initialization and Visible Interaction).
//!
//! In the order of the data: [`occupancy`] from the Gaussians, [`keypoints`] from the cameras, [`graph`]
//! of both; [`target`] chooses a view, [`navigator`] finds the way to it, [`curve`] rounds it, and
//! [`approach`] does all of that for an identity; [`flight`] makes poses of frames of it. [`camera_spline`] does the
//! same for a path that the user has put together, [`turntable`] makes one around an object.

pub(crate) mod approach;
pub(crate) mod camera_spline;
pub mod curve;
pub(crate) mod flight;
pub(crate) mod graph;
pub mod keypoints;
pub(crate) mod navigator;
pub(crate) mod occupancy;
pub(crate) mod pose;
mod preference;
pub mod target;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod turntable;

pub(crate) use camera_spline::CameraSpline;
pub use flight::{CameraTrajectory, FRAMES, Speed};
pub use navigator::{Navigator, NoRoute};
pub use pose::Pose;

use glam::DVec3;

/// No place has a coordinate as far from 0, scene units: squares of distances must stay numbers, in
/// single precision too.
const FARTHEST: f64 = 1e18;

/// Returns whether a point is a place: finite coordinates, not absurdly far.
fn is_place(p: DVec3) -> bool {
    p.is_finite() && p.abs().max_element() < FARTHEST
}
