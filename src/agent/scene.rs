//! A scene on this machine as the agent's [`World`]: what it does is emitted to whoever shows the scene.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::camera_args::{Direction, Distance, NORMAL};
pub use super::effect::Effect;
use super::effect::Emit;
use super::relation::{Extent, Viewpoint};
pub use super::view_shares::Parts;
use super::view_shares::ViewShares;
use super::world::{Arrival, IdentityFacts, Movement, Unreachable, World, WorldError};
use crate::jobs::export;
use crate::jobs::go_to::{self, ApproachRequest, Approached, Explored};
use crate::jobs::query::QueryEngine;
use crate::navigate::approach::Approach;
use crate::navigate::target::{Side, ViewPreference};
use crate::navigate::{CameraTrajectory, FRAMES, Pose, Speed};
use crate::pipeline::semantics::answer::QueryAnswer;
use crate::pipeline::semantics::recipe::{Recipe, Understanding};
use crate::scene::undo::UndoHistory;
use crate::scene::{Bounds, Identities, IdentityId, LevelFilter, SemanticMap, text};

/// Points of a thing that its size is measured by, at most.
const MEASURED_POINTS: usize = 2048;
/// A step, as a multiple of the distance that flights keep to occupied space.
const STEP: f64 = 6.0;

/// A scene that the agent acts in.
pub struct SceneWorld {
    parts: Parts,
    engine: QueryEngine,
    eye: Pose,
    aspect: f64,
    hidden: Vec<bool>,
    bounds: Vec<Option<Bounds>>,
    shares: ViewShares,
    done: UndoHistory<Before>,
    /// What the user did last, which the window can undo.
    pub(crate) undoable: Option<String>,
    /// What is to be removed once the request is done: several things go into one scene.
    removing: Vec<IdentityId>,
    emit: Emit,
}

/// How it was before something was done.
enum Before {
    Hidden(Vec<bool>, String),
    Named(Arc<SemanticMap>, IdentityId, String),
    Eye(Pose, String),
}

impl SceneWorld {
    /// A scene, seen from `eye` in a picture of this width by height.
    ///
    /// # Errors
    /// If the encoder that looked at it cannot be loaded.
    pub fn new(parts: Parts, eye: Pose, aspect: f64, emit: Emit) -> Result<Self, WorldError> {
        let engine = engine(&parts.map, parts.recipe.clone())?;
        let n = parts.map.identities.len() + 1;
        let bounds = parts.bounds();
        Ok(Self {
            parts,
            engine,
            eye,
            aspect,
            hidden: vec![false; n],
            bounds,
            shares: ViewShares::default(),
            done: UndoHistory::default(),
            removing: Vec::new(),
            undoable: None,
            emit,
        })
    }

    /// Takes over what the user has done since: where the eye is, what is hidden, and what things are
    /// called.
    pub(crate) fn keep_up(&mut self, eye: Pose, aspect: f64, hidden: &[IdentityId], map: &Arc<SemanticMap>) {
        (self.eye, self.aspect) = (eye, aspect);
        if !Arc::ptr_eq(map, &self.parts.map) {
            // An edit of the agent's own comes back as the window's; another makes what was done stale.
            if map.identities != self.parts.map.identities {
                self.done = UndoHistory::default();
            }
            self.parts.map = Arc::clone(map);
            self.bounds = self.parts.bounds();
        }
        let hidden: Vec<bool> = (0..=map.identities.len() as IdentityId).map(|id| hidden.contains(&id)).collect();
        if hidden != self.hidden {
            self.done = UndoHistory::default();
            self.hidden = hidden;
        }
    }

    /// Answers by this recipe from now on.
    ///
    /// # Errors
    /// If the encoder that looked at the scene cannot be loaded.
    pub(crate) fn answer_by(&mut self, recipe: &Recipe) -> Result<(), WorldError> {
        if self.parts.recipe != *recipe {
            self.engine = engine(&self.parts.map, recipe.clone())?;
            self.parts.recipe = recipe.clone();
        }
        Ok(())
    }

    /// Where the eye is.
    pub(crate) fn eye(&self) -> Pose {
        self.eye
    }

    fn explored(&mut self) -> Arc<Explored> {
        if let Some(known) = self.parts.explored.as_ref().filter(|e| Arc::ptr_eq(&e.cloud, &self.parts.cloud)) {
            return Arc::clone(known);
        }
        let new = Arc::new(Explored::new(Arc::clone(&self.parts.cloud), &self.parts.cameras, self.parts.up));
        self.parts.explored = Some(Arc::clone(&new));
        (self.emit)(Effect::Explored(Arc::clone(&new)));
        new
    }

    /// Whether the user sees an identity's Gaussians, or those of any of its pieces.
    fn drawn(&self, id: IdentityId) -> bool {
        let inside = self.parts.map.identities.descendants(id);
        inside.iter().zip(&self.hidden).any(|(inside, hidden)| *inside && !hidden)
    }

    /// Share of the present view that an identity covers, pieces included.
    fn share_of(&self, id: IdentityId) -> f64 {
        self.shares.of(&self.parts, self.eye, self.aspect, &self.hidden, id)
    }

    fn fly(&mut self, flight: CameraTrajectory, about: Option<DVec3>, what: String) {
        self.done.record(Before::Eye(self.eye, what));
        if let Some(last) = flight.poses.last() {
            self.eye = *last;
        }
        (self.emit)(Effect::Fly(Box::new(flight), about));
    }

    fn hidden_list(&self) -> Vec<IdentityId> {
        (0..).zip(&self.hidden).filter(|(_, hidden)| **hidden).map(|(id, _)| id).collect()
    }

    fn set_hidden_list(&mut self, hidden: Vec<bool>, what: String) {
        let before = std::mem::replace(&mut self.hidden, hidden);
        self.done.record(Before::Hidden(before, what));
        let hidden = self.hidden_list();
        (self.emit)(Effect::Hidden(hidden));
    }

    fn name(&self, id: IdentityId) -> String {
        self.parts.map.identities.full_name(id)
    }

    fn export_file(&self, id: IdentityId) -> PathBuf {
        self.parts.exports.join(export::identity_file(&self.parts.map.identities, id, ".ply"))
    }

    /// A turn or a straight way, without looking for one.
    fn straight(&mut self, to: Pose, what: String) -> Result<f64, Unreachable> {
        let eye = self.eye;
        let flight = CameraTrajectory::new(&[eye.center, to.center], [&eye, &to], None, None, FRAMES / 2, Speed::Eased);
        let mut flight = flight.ok_or_else(|| Unreachable { reason: "the view has no place".into(), nearest: None })?;
        flight.seconds = 1.2;
        let length = flight.length;
        self.fly(flight, None, what);
        Ok(length)
    }
}

fn engine(map: &SemanticMap, recipe: Recipe) -> Result<QueryEngine, WorldError> {
    QueryEngine::new(map.language.as_ref(), recipe).map_err(|e| WorldError(e.to_string()))
}

impl World for SceneWorld {
    fn understanding(&self) -> Understanding {
        self.parts.recipe.understanding
    }

    fn identities(&self) -> &Identities {
        &self.parts.map.identities
    }

    fn locate(&mut self, query: &str, kind: LevelFilter) -> Result<QueryAnswer, WorldError> {
        let answered = self.engine.ask(&self.parts.map, query, kind).map_err(|e| WorldError(e.to_string()))?;
        Ok(answered.unwrap_or_else(|| super::world::locate_by_names(&self.parts.map.identities, query, kind)))
    }

    fn facts(&self, id: IdentityId) -> Option<IdentityFacts> {
        let identity = self.parts.map.identities.get(id)?;
        Some(IdentityFacts {
            names: identity.names.clone(),
            level: identity.level,
            parent: identity.parent,
            bounds: self.bounds.get(id as usize).copied().flatten(),
            in_view: self.share_of(id),
            hidden: !self.drawn(id),
        })
    }

    fn extent(&self, id: IdentityId) -> Option<Extent> {
        let members = self.parts.map.members(id);
        let place = |i: &usize| self.parts.cloud.world_position(*i);
        let every = members.len().div_ceil(MEASURED_POINTS).max(1);
        let points: Vec<DVec3> =
            members.iter().filter(|i| **i < self.parts.cloud.len()).step_by(every).map(place).collect();
        Extent::new(&points, self.parts.up)
    }

    fn view(&self) -> Viewpoint {
        Viewpoint { eye: self.eye.center, forward: self.eye.forward(), up: self.parts.up }
    }

    fn metres_per_unit(&self) -> Option<f64> {
        self.parts.meters
    }

    fn go_to(&mut self, id: IdentityId, from: Side, closeness: f64) -> Result<Arrival, Unreachable> {
        let explored = self.explored();
        let in_view = self.share_of(id) > 0.0;
        let eye = self.eye;
        let preference = |side: Side| ViewPreference { side, distance: NORMAL / closeness.max(0.01) };
        let visit = |side: Side| {
            let request = ApproachRequest {
                explored: Some(Arc::clone(&explored)),
                cloud: Arc::clone(&self.parts.cloud),
                cameras: Vec::new(),
                up: self.parts.up,
                settings: self.parts.settings.clone(),
                map: Arc::clone(&self.parts.map),
                id,
                preference: preference(side),
                from: eye,
                aspect: self.aspect,
                frames: FRAMES,
            };
            go_to::visit(request).1
        };
        // What is in view is seen from where it is seen now; what is not, from wherever it is seen best.
        let mut visited = visit(if from == Side::Same && !in_view { Side::Best } else { from });
        if visited.problem.is_some() && from == Side::Same && in_view {
            visited = visit(Side::Best);
        }
        let Approached { name, flight, problem } = visited;
        match (problem, flight.map(|f| *f)) {
            (None, Some(Approach { view, target, flight })) => {
                let arrival = Arrival { distance: flight.length, in_view: view.covers };
                (self.emit)(Effect::Mark(vec![id]));
                self.fly(flight, Some(target), format!("going to {name}"));
                Ok(arrival)
            }
            (problem, nearest) => {
                let center = self.bounds.get(id as usize).copied().flatten().map(|b| b.center());
                let nearest = nearest.and_then(|n| Some(n.view.pose.center.distance(center?)));
                Err(Unreachable { reason: problem.unwrap_or_default(), nearest })
            }
        }
    }

    fn look_at(&mut self, id: IdentityId) -> Result<Arrival, Unreachable> {
        let center = self.bounds.get(id as usize).copied().flatten().map(|b| b.center());
        let center = center.ok_or_else(|| Unreachable { reason: "it has no Gaussians".into(), nearest: None })?;
        let eye = self.eye;
        let to = Pose::looking_at(eye.center, center, self.parts.up, eye.fov_y_rad, &eye.world_from_camera);
        let what = format!("looking at {}", self.name(id));
        self.straight(to, what)?;
        Ok(Arrival { distance: 0.0, in_view: self.share_of(id) })
    }

    fn move_eye(&mut self, direction: Direction, distance: Distance) -> Result<Movement, Unreachable> {
        let explored = self.explored();
        let step = STEP * explored.navigator.clearance;
        let wanted = match (distance, self.parts.meters) {
            (Distance::Meters(m), Some(meters)) => m / meters.max(1e-9),
            // Nobody knows what a meter is here: the agent asks for steps then.
            (Distance::Meters(n), None) | (Distance::Relative(n), _) => n * step,
            (Distance::Default, _) => step,
        };
        let (center, stopped_by_obstacle) = explored.navigator.step(&self.eye, direction.axis(), wanted);
        let to = Pose { center, ..self.eye };
        let distance_done = self.straight(to, format!("moving {}", direction.text()))?;
        Ok(Movement { distance_done, stopped_by_obstacle })
    }

    fn turn(&mut self, direction: Direction, degrees: f64) -> Result<(), Unreachable> {
        let eye = self.eye;
        let (axis, sign) = match direction {
            Direction::Left => (self.parts.up, 1.0),
            Direction::Right => (self.parts.up, -1.0),
            Direction::Up => (eye.world_from_camera.x_axis, 1.0),
            Direction::Down => (eye.world_from_camera.x_axis, -1.0),
            Direction::Forward | Direction::Back => return Ok(()),
        };
        let axis = axis.try_normalize().unwrap_or(DVec3::Z);
        let turn = DMat3::from_axis_angle(axis, sign * degrees.to_radians());
        let to = Pose { world_from_camera: turn * eye.world_from_camera, ..eye };
        self.straight(to, format!("turning {}", direction.text())).map(|_| ())
    }

    fn highlight(&mut self, ids: &[IdentityId]) -> Result<(), WorldError> {
        (self.emit)(Effect::Mark(ids.to_vec()));
        Ok(())
    }

    fn isolate(&mut self, ids: &[IdentityId]) -> Result<(), WorldError> {
        let inside: Vec<_> = ids.iter().map(|id| self.parts.map.identities.descendants(*id)).collect();
        let hidden = (0..self.hidden.len()).map(|i| !inside.iter().any(|of| of.get(i) == Some(&true))).collect();
        let names: Vec<String> = ids.iter().map(|id| self.name(*id)).collect();
        self.set_hidden_list(hidden, format!("showing only {}", names.join(", ")));
        Ok(())
    }

    fn set_hidden(&mut self, id: IdentityId, hide: bool) -> Result<(), WorldError> {
        let all = &self.parts.map.identities;
        all.get(id).ok_or_else(|| WorldError(format!("there is no #{id}")))?;
        let now = |(inside, hidden): (bool, &bool)| if inside { hide } else { *hidden };
        let hidden = all.descendants(id).into_iter().zip(&self.hidden).map(now).collect();
        let what = format!("{} {}", if hide { "hiding" } else { "showing" }, self.name(id));
        self.set_hidden_list(hidden, what);
        Ok(())
    }

    fn show_all(&mut self) -> Result<(), WorldError> {
        self.set_hidden_list(vec![false; self.hidden.len()], "showing everything".into());
        Ok(())
    }

    fn remove(&mut self, id: IdentityId) -> Result<(), WorldError> {
        if self.parts.folder.is_none() {
            return Err(WorldError("only from a trained scene can something be removed; hide it instead".into()));
        }
        self.removing.push(id);
        Ok(())
    }

    fn carry_out(&mut self) {
        if !self.removing.is_empty() {
            (self.emit)(Effect::Remove(std::mem::take(&mut self.removing)));
        }
    }

    fn rename(&mut self, id: IdentityId, name: &str) -> Result<(), WorldError> {
        let before = Arc::clone(&self.parts.map);
        let map = Arc::make_mut(&mut self.parts.map);
        let identity = map.identities.get(id).ok_or_else(|| WorldError(format!("there is no #{id}")))?;
        let (name, old) = (text::name(name), identity.names.first().cloned().unwrap_or_default());
        map.identities.rename(id, &name);
        self.done.record(Before::Named(before, id, old));
        (self.emit)(Effect::Renamed(id, name));
        Ok(())
    }

    fn undo(&mut self) -> Result<String, WorldError> {
        let Some(done) = self.done.take() else {
            let what = self.undoable.take().ok_or_else(|| WorldError("Nothing to undo.".into()))?;
            (self.emit)(Effect::Undo);
            return Ok(what);
        };
        match done {
            Before::Hidden(hidden, what) => {
                self.hidden = hidden;
                let hidden = self.hidden_list();
                (self.emit)(Effect::HiddenUndone(hidden));
                Ok(what)
            }
            Before::Named(map, id, old) => {
                let new = self.parts.map.identities.name(id);
                self.parts.map = map;
                (self.emit)(Effect::RenameUndone(id, old));
                Ok(format!("calling it {new}"))
            }
            Before::Eye(eye, what) => {
                self.straight(eye, String::new()).map_err(|e| WorldError(e.reason))?;
                // The way back is not itself something to take back.
                self.done.take();
                Ok(what)
            }
        }
    }

    fn export(&mut self, id: IdentityId) -> Result<String, WorldError> {
        let file = self.export_file(id);
        let failed = |e: &dyn std::fmt::Display| WorldError(format!("{}: {e}", file.display()));
        let members = self.parts.map.members(id);
        if members.is_empty() {
            return Err(WorldError(format!("{} has no Gaussians", self.name(id))));
        }
        export::ply(&file, &self.parts.cloud.select(&members)).map_err(|e| failed(&e))?;
        Ok(file.display().to_string())
    }

    fn export_replaces(&self, id: IdentityId) -> Option<String> {
        let file = self.export_file(id);
        file.exists().then(|| file.display().to_string())
    }
}
