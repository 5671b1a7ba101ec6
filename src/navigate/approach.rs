//! Views of an identity: the best one that can be reached, and the flight to it.

use glam::DVec3;

use super::flight::{CameraTrajectory, Speed};
use super::navigator::{Navigator, NoRoute};
use super::pose::Pose;
use super::target::{Search, TargetGaussians, TargetView, ViewPreference};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Bounds, GaussianCloud, IdentityId, SemanticMap};

/// Share of a target that has to be seen for a view to be one of it.
const LEAST_VISIBLE: f64 = 0.05;

/// A scene with its identities.
#[derive(Clone, Copy)]
pub(crate) struct SceneRef<'a> {
    pub(crate) cloud: &'a GaussianCloud,
    /// Settings that the Gaussians are drawn with.
    pub(crate) settings: &'a RenderSettings,
    pub(crate) map: &'a SemanticMap,
}

/// A flight to a target, and the view at its end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Approach {
    /// The view at its end.
    pub(crate) view: TargetView,
    /// The middle of the target.
    pub(crate) target: DVec3,
    pub(crate) flight: CameraTrajectory,
}

/// Error of a target that cannot be visited.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ApproachError {
    /// It has no Gaussians.
    #[error("it has no Gaussians, so there is nothing to look at")]
    Nothing,
    /// It is hidden from every reachable viewpoint.
    #[error("it is not visible from any reachable viewpoint")]
    Unseen,
    /// There is no route; the nearest view that can be reached is offered, if a flight leads there.
    #[error("{why}")]
    NoRoute {
        why: NoRoute,
        /// A flight to the nearest place.
        nearest: Option<Box<Approach>>,
    },
    /// A view cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// The Gaussians of an identity as a target; `None` if it has none.
pub(crate) fn target(place: SceneRef<'_>, id: IdentityId) -> Option<(TargetGaussians, Bounds)> {
    let bounds = |id: IdentityId| {
        let members = place.map.members(id);
        let inside = members.iter().filter(|i| **i < place.cloud.len());
        let bounds = Bounds::robust(inside.map(|i| place.cloud.world_position(*i)))?;
        Some((members, bounds))
    };
    let (members, own) = bounds(id)?;
    let object = place.map.identities.object_of(id);
    let whole = (object != id).then(|| bounds(object)).flatten().map(|(_, b)| b.center());
    Some((TargetGaussians { members, whole }, own))
}

impl Navigator {
    /// Flies from `eye` to the best view of an identity; `aspect` is the picture's width by height.
    ///
    /// # Errors
    /// If it cannot be seen or reached.
    pub(crate) fn visit(
        &self,
        place: SceneRef<'_>,
        id: IdentityId,
        preference: ViewPreference,
        eye: &Pose,
        aspect: f64,
        frames: usize,
    ) -> Result<Approach, ApproachError> {
        let (target, bounds) = target(place, id).ok_or(ApproachError::Nothing)?;
        let search = Search {
            cloud: place.cloud,
            settings: place.settings,
            occupancy: &self.occupancy,
            cameras: &self.cameras,
            up: self.up,
            clearance: self.clearance,
        };
        let center = bounds.center();
        let views = search.views(&target, preference, eye, aspect)?;
        let seen: Vec<TargetView> = views.into_iter().filter(|v| v.visible >= LEAST_VISIBLE).collect();
        let mut first = None;
        for view in seen {
            match self.fly(eye, &view.pose, Some(center), frames, Speed::Eased) {
                Ok(flight) => return Ok(Approach { view, target: center, flight }),
                Err(why) => first = first.or(Some(why)),
            }
        }
        let why = first.ok_or(ApproachError::Unseen)?;
        let nearest = match &why {
            NoRoute::Parted { nearest, .. } => {
                let at = self.graph.keypoints[*nearest].center;
                let pose = Pose::looking_at(at, center, self.up, eye.fov_y_rad, &eye.world_from_camera);
                let flight = self.fly(eye, &pose, Some(center), frames, Speed::Eased).ok();
                let clearance = self.occupancy.clearance(at);
                let view = TargetView { pose, visible: 0.0, covers: 0.0, clearance, score: 0.0 };
                flight.map(|flight| Box::new(Approach { view, target: center, flight }))
            }
            _ => None,
        };
        Err(ApproachError::NoRoute { why, nearest })
    }
}
