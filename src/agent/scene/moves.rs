//! Camera movements in a scene: flights to things, steps and turns.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::{Before, Effect, SceneWorld};
use crate::agent::camera_args::{Direction, Distance, NORMAL};
use crate::agent::world::{Arrival, Movement, Unreachable};
use crate::jobs::go_to::{self, ApproachRequest, Approached, Explored, FlightRequest};
use crate::navigate::approach::Approach;
use crate::navigate::target::{Side, ViewPreference};
use crate::navigate::{CameraTrajectory, FRAMES, Pose, Speed};
use crate::scene::IdentityId;

/// Length of a step, as a multiple of the distance that flights keep to occupied space.
const STEP: f64 = 6.0;

/// Flies to an identity, to see it from a side.
pub(super) fn fly_to(
    scene: &mut SceneWorld,
    id: IdentityId,
    from: Side,
    closeness: f64,
) -> Result<Arrival, Unreachable> {
    let explored = explored(scene);
    let in_view = scene.share_of(id) > 0.0;
    let eye = scene.eye;
    let preference = |side: Side| ViewPreference { side, distance: NORMAL / closeness.max(0.01) };
    let visit = |side: Side| {
        let request = ApproachRequest {
            explored: Some(Arc::clone(&explored)),
            cloud: Arc::clone(&scene.parts.cloud),
            cameras: Vec::new(),
            up: scene.parts.up,
            settings: scene.parts.settings.clone(),
            map: Arc::clone(&scene.parts.map),
            id,
            preference: preference(side),
            from: eye,
            aspect: scene.aspect,
            frames: FRAMES,
        };
        go_to::visit(request).1
    };
    // A target in view is approached from the current side, any other from its best side.
    let mut visited = visit(if from == Side::Same && !in_view { Side::Best } else { from });
    if visited.problem.is_some() && from == Side::Same && in_view {
        visited = visit(Side::Best);
    }
    let Approached { name, flight, problem } = visited;
    match (problem, flight.map(|f| *f)) {
        (None, Some(Approach { view, target, flight })) => {
            let arrival = Arrival { distance: flight.length, in_view: view.covers };
            scene.mark(&[id]);
            fly(scene, flight, Some(target), format!("going to {name}"));
            Ok(arrival)
        }
        (problem, nearest) => {
            let center = scene.parts.map.identities.shapes.get(id).map(|s| s.center());
            let nearest = nearest.and_then(|n| Some(n.view.pose.center.distance(center?)));
            Err(Unreachable { reason: problem.unwrap_or_default(), nearest })
        }
    }
}

/// Turns toward an identity.
pub(super) fn turn_to(scene: &mut SceneWorld, id: IdentityId) -> Result<Arrival, Unreachable> {
    let center = scene.parts.map.identities.shapes.get(id).map(|s| s.center());
    let center = center.ok_or_else(|| Unreachable { reason: "it has no Gaussians".into(), nearest: None })?;
    let eye = scene.eye;
    let to = Pose::looking_at(eye.center, center, scene.parts.up, eye.fov_y_rad, &eye.world_from_camera);
    let what = format!("looking at {}", scene.name(id));
    straight(scene, to, what)?;
    Ok(Arrival { distance: 0.0, in_view: scene.share_of(id) })
}

/// Moves the camera, up to an obstacle.
pub(super) fn step(scene: &mut SceneWorld, direction: Direction, distance: Distance) -> Result<Movement, Unreachable> {
    let explored = explored(scene);
    let step = STEP * explored.navigator.clearance;
    let wanted = match (distance, scene.parts.meters) {
        (Distance::Meters(m), Some(meters)) => m / meters.max(1e-9),
        // Without a known scale a meter counts as a step.
        (Distance::Meters(n), None) | (Distance::Relative(n), _) => n * step,
        (Distance::Default, _) => step,
    };
    let (center, stopped_by_obstacle) = explored.navigator.step(&scene.eye, direction.axis(), wanted);
    let to = Pose { center, ..scene.eye };
    let distance_done = straight(scene, to, format!("moving {}", direction.text()))?;
    Ok(Movement { distance_done, stopped_by_obstacle })
}

/// Turns the camera.
pub(super) fn turn_by(scene: &mut SceneWorld, direction: Direction, degrees: f64) -> Result<(), Unreachable> {
    let eye = scene.eye;
    let (axis, sign) = match direction {
        Direction::Left => (scene.parts.up, 1.0),
        Direction::Right => (scene.parts.up, -1.0),
        Direction::Up => (eye.world_from_camera.x_axis, 1.0),
        Direction::Down => (eye.world_from_camera.x_axis, -1.0),
        Direction::Forward | Direction::Back => return Ok(()),
    };
    let axis = axis.try_normalize().unwrap_or(DVec3::Z);
    let turn = DMat3::from_axis_angle(axis, sign * degrees.to_radians());
    let to = Pose { world_from_camera: turn * eye.world_from_camera, ..eye };
    straight(scene, to, format!("turning {}", direction.text())).map(|_| ())
}

/// Flies straight to a pose, without path planning. Returns the length of the flight, in scene units.
pub(super) fn straight(scene: &mut SceneWorld, to: Pose, what: String) -> Result<f64, Unreachable> {
    let eye = scene.eye;
    let flight = CameraTrajectory::new(&[eye.center, to.center], [&eye, &to], None, None, FRAMES / 2, Speed::Eased);
    let mut flight = flight.ok_or_else(|| Unreachable { reason: "the view has no place".into(), nearest: None })?;
    flight.seconds = 1.2;
    let length = flight.length;
    fly(scene, flight, None, what);
    Ok(length)
}

/// Flies to a pose around what is in the way; straight, if there is no way around.
pub(super) fn fly_pose(scene: &mut SceneWorld, to: Pose, what: String) -> Result<(), Unreachable> {
    let request = FlightRequest {
        explored: Some(explored(scene)),
        cloud: Arc::clone(&scene.parts.cloud),
        cameras: Vec::new(),
        up: scene.parts.up,
        from: scene.eye,
        to,
        frames: FRAMES,
    };
    let flight = go_to::fly_to_pose(request).1;
    let flight = flight.ok_or_else(|| Unreachable { reason: "the view has no place".into(), nearest: None })?;
    fly(scene, flight, None, what);
    Ok(())
}

fn fly(scene: &mut SceneWorld, flight: CameraTrajectory, about: Option<DVec3>, what: String) {
    scene.record(Before::Eye(scene.eye, what));
    if let Some(last) = flight.poses.last() {
        scene.eye = *last;
    }
    (scene.emit)(Effect::Fly(Box::new(flight), about));
}

fn explored(scene: &mut SceneWorld) -> Arc<Explored> {
    if let Some(known) = scene.parts.explored.as_ref().filter(|e| Arc::ptr_eq(&e.cloud, &scene.parts.cloud)) {
        return Arc::clone(known);
    }
    let new = Arc::new(Explored::new(Arc::clone(&scene.parts.cloud), &scene.parts.cameras, scene.parts.up));
    scene.parts.explored = Some(Arc::clone(&new));
    (scene.emit)(Effect::Explored(Arc::clone(&new)));
    new
}
