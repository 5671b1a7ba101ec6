//! Camera navigation in a scene: prepared data, and the flight to the best view of an identity.

use std::sync::Arc;

use glam::DVec3;

use super::Scene;
use crate::measure::survey::{Surveyed, surveyed};
use crate::navigate::approach::{Approach, ApproachError, SceneRef};
use crate::navigate::flight::Smoothness;
use crate::navigate::target::ViewPreference;
use crate::navigate::{CameraTrajectory, Navigator, NoRoute, Pose, Speed};
use crate::render::RenderSettings;
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

/// A scene prepared for camera navigation.
pub struct Explored {
    pub(crate) navigator: Navigator,
    pub(crate) cloud: Arc<GaussianCloud>,
    /// Index of the connected part of each keypoint, the largest part first.
    pub(crate) parts: Vec<usize>,
}

impl std::fmt::Debug for Explored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Explored({} keypoints)", self.parts.len())
    }
}

impl Explored {
    pub(crate) fn new(cloud: Arc<GaussianCloud>, cameras: &[Camera], up: DVec3) -> Self {
        let navigator = Navigator::new(&cloud, cameras, up);
        resource_log::record(
            ResourceKind::Paths,
            "occupancy grid, graph of keypoints",
            "the camera is to fly",
            navigator.bytes(),
        );
        let parts = navigator.graph.parts(&navigator.occupancy);
        Self { navigator, cloud, parts }
    }

    /// Returns the flight from one pose to another, `frames` poses long.
    pub(crate) fn fly(&self, from: &Pose, to: &Pose, frames: usize) -> Result<CameraTrajectory, NoRoute> {
        self.navigator.fly(from, to, None, frames, Speed::Eased)
    }

    /// Smoothness of the paper's interpolation between a flight's ends, and of that through all keypoints of the route.
    pub(crate) fn of_paper(&self, flight: &CameraTrajectory) -> [Option<Smoothness>; 2] {
        let [first, .., last] = flight.poses.as_slice() else { return [None, None] };
        let (navigator, frames) = (&self.navigator, flight.poses.len());
        let keys = navigator.keys(first, last).unwrap_or_default();
        [CameraTrajectory::of_paper(&[*first, *last], frames), CameraTrajectory::of_paper_through(&keys, frames)]
            .map(|p| p.map(|p| p.smoothness(&navigator.occupancy, navigator.clearance)))
    }

    /// Describes why there is no route, with the number of the scene's connected parts.
    pub(crate) fn no_route(&self, why: &NoRoute) -> String {
        let count = self.parts.iter().max().map_or(0, |m| m + 1);
        format!("{why} ({} keypoints in {count} parts that are not connected)", self.parts.len())
    }
}

/// Surveys flights through a scene, for each of these numbers of cameras.
pub(crate) fn survey(scene: &Scene, counts: &[u32], flights: usize, frames: usize) -> Vec<Surveyed> {
    let own = scene.views();
    counts.iter().map(|count| surveyed(&scene.cloud, &own, *count as usize, flights, frames)).collect()
}

/// Request of a flight to an identity.
#[derive(Clone, Debug)]
pub struct ApproachRequest {
    /// The prepared scene, if there is one.
    pub(crate) explored: Option<Arc<Explored>>,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) up: DVec3,
    pub(crate) settings: RenderSettings,
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) id: IdentityId,
    pub(crate) preference: ViewPreference,
    pub(crate) from: Pose,
    pub(crate) aspect: f64,
    pub(crate) frames: usize,
}

/// Finds the flight to an identity. Returns the prepared scene, too.
pub(crate) fn visit(request: ApproachRequest) -> (Arc<Explored>, Approached) {
    let ApproachRequest { explored, cloud, cameras, up, settings, map, id, preference, from, aspect, frames } = request;
    let explored = prepared(explored, Arc::clone(&cloud), &cameras, up);
    let place = SceneRef { cloud: &cloud, settings: &settings, map: &map };
    let name = map.identities.full_name(id);
    let visit = match explored.navigator.visit(place, id, preference, &from, aspect, frames) {
        Ok(visit) => Approached { name, flight: Some(Box::new(visit)), problem: None },
        Err(ApproachError::NoRoute { why, nearest }) => {
            Approached { name, flight: nearest, problem: Some(explored.no_route(&why)) }
        }
        Err(e) => Approached { name, flight: None, problem: Some(e.to_string()) },
    };
    (explored, visit)
}

/// Request of a flight from one pose to another.
#[derive(Clone, Debug)]
pub(crate) struct FlightRequest {
    /// The prepared scene, if there is one.
    pub(crate) explored: Option<Arc<Explored>>,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) up: DVec3,
    pub(crate) from: Pose,
    pub(crate) to: Pose,
    pub(crate) frames: usize,
}

/// Finds the flight to a pose: around what is in the way, or else straight. Returns the prepared scene, too.
pub(crate) fn fly_to_pose(request: FlightRequest) -> (Arc<Explored>, Option<CameraTrajectory>) {
    let FlightRequest { explored, cloud, cameras, up, from, to, frames } = request;
    let explored = prepared(explored, cloud, &cameras, up);
    let legs = [from.center, to.center];
    let straight = || CameraTrajectory::new(&legs, [&from, &to], None, None, frames, Speed::Eased);
    let flight = explored.fly(&from, &to, frames).ok().or_else(straight);
    (explored, flight)
}

/// The prepared scene, if it is of these Gaussians; else it is prepared now.
fn prepared(
    explored: Option<Arc<Explored>>,
    cloud: Arc<GaussianCloud>,
    cameras: &[Camera],
    up: DVec3,
) -> Arc<Explored> {
    let known = explored.filter(|e| Arc::ptr_eq(&e.cloud, &cloud));
    known.unwrap_or_else(|| Arc::new(Explored::new(cloud, cameras, up)))
}

/// Outcome of a visit.
#[derive(Clone, Debug)]
pub struct Approached {
    pub(crate) name: String,
    /// The flight there, or to the nearest place that can be reached.
    pub(crate) flight: Option<Box<Approach>>,
    /// Reason that it does not lead there.
    pub(crate) problem: Option<String>,
}
