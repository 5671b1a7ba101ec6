//! Local scene as the agent's [`World`]: its changes are emitted to the window or the command line.

mod moves;
mod photos;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

pub use self::photos::ScenePhotos;

use super::camera_args::{Direction, Distance};
use super::effect::Emit;
pub use super::effect::{Effect, UndoneRequest};
use super::relation::Viewpoint;
pub use super::view_shares::AgentScene;
use super::view_shares::ViewShares;
use super::world::{Arrival, IdentityFacts, Movement, PhotoSight, QueryPlace, Unreachable, World, WorldError};
use crate::jobs::query::QueryEngine;
use crate::jobs::{export, export_splat, render};
use crate::math::format;
use crate::navigate::Pose;
use crate::navigate::target::Side;
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::recipe::{MatchBy, QueryConfig};
use crate::scene::undo::UndoHistory;
use crate::scene::{Camera, Identities, IdentityId, LevelFilter, SemanticMap, text};

/// Scene that the agent acts in.
pub struct SceneWorld {
    parts: AgentScene,
    engine: QueryEngine,
    eye: Pose,
    aspect: f64,
    hidden: Vec<bool>,
    marked: Vec<IdentityId>,
    shares: ViewShares,
    /// States before the changes of each request, oldest first.
    done: UndoHistory<Vec<Before>>,
    /// True if the request that runs has changed something.
    has_changed: bool,
    /// Last edit of the user, which the window can undo.
    pub(crate) undoable: Option<String>,
    /// Identities to remove at the end of the request: one new scene lacks all of them.
    removing: Vec<IdentityId>,
    /// Photos that the user asks about.
    pub(crate) photos: ScenePhotos,
    emit: Emit,
}

/// State before a change, with a description of the change.
enum Before {
    /// The last one is true if what was hidden or shown before does not matter any more.
    Hidden(Vec<bool>, String, bool),
    Named(Arc<SemanticMap>, IdentityId, String),
    Eye(Pose, String),
}

impl SceneWorld {
    /// Returns a scene seen from `eye` in a picture of this aspect ratio, width by height.
    ///
    /// # Errors
    /// If the encoder of its embeddings cannot be loaded.
    pub fn new(mut parts: AgentScene, eye: Pose, aspect: f64, emit: Emit) -> Result<Self, WorldError> {
        let engine = engine(&parts.map, parts.recipe.clone())?;
        if !parts.map.identities.shapes.are_known() {
            Arc::make_mut(&mut parts.map).look_at(&parts.cloud);
        }
        let n = parts.map.identities.len() + 1;
        Ok(Self {
            parts,
            engine,
            eye,
            aspect,
            hidden: vec![false; n],
            marked: Vec::new(),
            shares: ViewShares::default(),
            done: UndoHistory::default(),
            has_changed: false,
            removing: Vec::new(),
            photos: ScenePhotos::default(),
            undoable: None,
            emit,
        })
    }

    /// Takes over the user's changes since the last request: camera pose, hidden identities and names.
    pub(crate) fn keep_up(&mut self, eye: Pose, aspect: f64, hidden: &[IdentityId], map: &Arc<SemanticMap>) {
        (self.eye, self.aspect) = (eye, aspect);
        if !Arc::ptr_eq(map, &self.parts.map) {
            // The agent's own edit returns from the window with equal identities; any other makes the history stale.
            if map.identities != self.parts.map.identities {
                self.done = UndoHistory::default();
            }
            self.parts.map = Arc::clone(map);
        }
        let hidden: Vec<bool> = (0..=map.identities.len() as IdentityId).map(|id| hidden.contains(&id)).collect();
        if hidden != self.hidden {
            self.done = UndoHistory::default();
            self.hidden = hidden;
        }
    }

    /// Sets the recipe of queries.
    ///
    /// # Errors
    /// If the encoder of the scene's embeddings cannot be loaded.
    pub(crate) fn answer_by(&mut self, recipe: &QueryConfig) -> Result<(), WorldError> {
        if self.parts.recipe != *recipe {
            self.engine = engine(&self.parts.map, recipe.clone())?;
            self.parts.recipe = recipe.clone();
        }
        Ok(())
    }

    /// Camera pose.
    pub(crate) fn eye(&self) -> Pose {
        self.eye
    }

    /// Draws what is shown as PNG: without the hidden identities, with the marked ones outlined.
    ///
    /// # Errors
    /// If it cannot be drawn.
    pub(crate) fn picture(&self, camera: &Camera) -> Result<Vec<u8>, WorldError> {
        let AgentScene { cloud, map, settings, .. } = &self.parts;
        let (cloud, map) = match self.parts.drawn(&self.hidden) {
            Some(kept) => (Arc::new(cloud.select(&kept)), Arc::new(map.select(&kept))),
            None => (Arc::clone(cloud), Arc::clone(map)),
        };
        render::png(&cloud, camera, settings, (&map, &self.marked)).map_err(|e| WorldError(e.to_string()))
    }

    fn mark(&mut self, ids: &[IdentityId]) {
        self.marked = ids.to_vec();
        (self.emit)(Effect::Mark(ids.to_vec()));
    }

    /// Returns whether Gaussians of an identity or of any of its parts are drawn.
    fn drawn(&self, id: IdentityId) -> bool {
        let inside = self.parts.map.identities.descendants(id);
        inside.iter().zip(&self.hidden).any(|(inside, hidden)| *inside && !hidden)
    }

    /// Share of the current view that an identity covers, parts included.
    fn share_of(&self, id: IdentityId) -> f64 {
        self.shares.of(&self.parts, self.eye, self.aspect, &self.hidden, id)
    }

    fn hidden_list(&self) -> Vec<IdentityId> {
        (0..).zip(&self.hidden).filter(|(_, hidden)| **hidden).map(|(id, _)| id).collect()
    }

    /// Records the state before a change: those of one request are undone together.
    fn record(&mut self, before: Before) {
        let goes_on = std::mem::replace(&mut self.has_changed, true);
        let mut request = if goes_on { self.done.take() } else { None }.unwrap_or_default();
        request.push(before);
        self.done.record(request);
    }

    fn set_hidden_list(&mut self, hidden: Vec<bool>, what: String, is_of_all: bool) {
        let before = std::mem::replace(&mut self.hidden, hidden);
        self.record(Before::Hidden(before, what, is_of_all));
        let hidden = self.hidden_list();
        (self.emit)(Effect::Hidden(hidden));
    }

    fn name(&self, id: IdentityId) -> String {
        self.parts.map.identities.full_name(id)
    }

    fn export_file(&self, id: IdentityId) -> PathBuf {
        self.parts.exports.join(export::identity_file(&self.parts.map.identities, id, ".ply"))
    }
}

fn engine(map: &SemanticMap, recipe: QueryConfig) -> Result<QueryEngine, WorldError> {
    QueryEngine::new(map.language.as_ref(), recipe).map_err(|e| WorldError(e.to_string()))
}

impl World for SceneWorld {
    fn match_by(&self) -> MatchBy {
        self.parts.recipe.match_by
    }

    fn identities(&self) -> &Identities {
        &self.parts.map.identities
    }

    fn locate(&mut self, query: &str, kind: LevelFilter, place: &QueryPlace) -> Result<QueryAnswer, WorldError> {
        self.engine.place = place.clone();
        let answered = self.engine.ask(&self.parts.map, query, kind).map_err(|e| WorldError(e.to_string()))?;
        Ok(answered.unwrap_or_else(|| super::world::locate_by_names(&self.parts.map.identities, query, kind, place)))
    }

    fn facts(&self, id: IdentityId) -> Option<IdentityFacts> {
        let identity = self.parts.map.identities.get(id)?;
        Some(IdentityFacts {
            names: identity.names.clone(),
            level: identity.level,
            parent: identity.parent,
            bounds: self.parts.map.identities.shapes.get(id).map(|s| s.bounds),
            in_view: self.share_of(id),
            hidden: !self.drawn(id),
        })
    }

    fn view(&self) -> Viewpoint {
        Viewpoint { eye: self.eye.center, forward: self.eye.forward(), up: self.parts.up }
    }

    fn meters_per_unit(&self) -> Option<f64> {
        self.parts.meters
    }

    fn go_to(&mut self, id: IdentityId, from: Side, closeness: f64) -> Result<Arrival, Unreachable> {
        moves::fly_to(self, id, from, closeness)
    }

    fn look_at(&mut self, id: IdentityId) -> Result<Arrival, Unreachable> {
        moves::turn_to(self, id)
    }

    fn move_eye(&mut self, direction: Direction, distance: Distance) -> Result<Movement, Unreachable> {
        moves::step(self, direction, distance)
    }

    fn turn(&mut self, direction: Direction, degrees: f64) -> Result<(), Unreachable> {
        moves::turn_by(self, direction, degrees)
    }

    fn highlight(&mut self, ids: &[IdentityId]) -> Result<(), WorldError> {
        self.mark(ids);
        Ok(())
    }

    fn isolate(&mut self, ids: &[IdentityId]) -> Result<(), WorldError> {
        let inside: Vec<_> = ids.iter().map(|id| self.parts.map.identities.descendants(*id)).collect();
        let hidden = (0..self.hidden.len()).map(|i| !inside.iter().any(|of| of.get(i) == Some(&true))).collect();
        let names: Vec<String> = ids.iter().map(|id| self.name(*id)).collect();
        self.set_hidden_list(hidden, format!("showing only {}", format::list(&names)), true);
        Ok(())
    }

    fn set_hidden(&mut self, id: IdentityId, hide: bool) -> Result<(), WorldError> {
        let all = &self.parts.map.identities;
        all.get(id).ok_or_else(|| WorldError(format!("there is no #{id}")))?;
        let now = |(inside, hidden): (bool, &bool)| if inside { hide } else { *hidden };
        let hidden = all.descendants(id).into_iter().zip(&self.hidden).map(now).collect();
        let what = format!("{} {}", if hide { "hiding" } else { "showing" }, self.name(id));
        self.set_hidden_list(hidden, what, false);
        Ok(())
    }

    fn show_all(&mut self) -> Result<(), WorldError> {
        self.set_hidden_list(vec![false; self.hidden.len()], "showing everything".into(), true);
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

    fn begin(&mut self) {
        self.has_changed = false;
    }

    fn rename(&mut self, id: IdentityId, name: &str) -> Result<(), WorldError> {
        let before = Arc::clone(&self.parts.map);
        let map = Arc::make_mut(&mut self.parts.map);
        let identity = map.identities.get(id).ok_or_else(|| WorldError(format!("there is no #{id}")))?;
        let (name, old) = (text::name(name), identity.names.first().cloned().unwrap_or_default());
        map.identities.rename(id, &name);
        self.record(Before::Named(before, id, old));
        (self.emit)(Effect::Renamed(id, name));
        Ok(())
    }

    fn undo(&mut self) -> Result<String, WorldError> {
        let Some(done) = self.done.take() else {
            let what = self.undoable.take().ok_or_else(|| WorldError("Nothing to undo.".into()))?;
            (self.emit)(Effect::Undo);
            return Ok(what);
        };
        self.has_changed = false;
        let (mut undone, mut eye) = (UndoneRequest::default(), None);
        let mut said: Vec<(String, bool)> = Vec::new();
        for before in done.into_iter().rev() {
            match before {
                Before::Hidden(hidden, what, is_of_all) => {
                    self.hidden = hidden;
                    // What the request had hidden before a later step chose what to draw was not seen.
                    let is_outdated = said.iter().any(|(_, is_of_all)| *is_of_all);
                    undone.hidden = Some(self.hidden_list());
                    if !is_outdated {
                        said.push((what, is_of_all));
                    }
                }
                Before::Named(map, id, old) => {
                    self.parts.map = map;
                    said.push((format!("it is \u{201c}{}\u{201d} again", self.parts.map.identities.name(id)), false));
                    undone.names.push((id, old));
                }
                Before::Eye(pose, what) => {
                    eye = Some(pose);
                    said.push((what, false));
                }
            }
        }
        if undone.hidden.is_some() || !undone.names.is_empty() {
            (self.emit)(Effect::Undone(undone));
        }
        if let Some(eye) = eye {
            moves::straight(self, eye, String::new()).map_err(|e| WorldError(e.reason))?;
            // The flight back must not be undone itself.
            self.done.take();
            self.has_changed = false;
        }
        let said: Vec<String> = said.into_iter().rev().map(|(what, _)| what).collect();
        Ok(format::list(&said))
    }

    fn export(&mut self, id: IdentityId) -> Result<String, WorldError> {
        let file = self.export_file(id);
        let failed = |e: &dyn std::fmt::Display| WorldError(format!("{}: {e}", file.display()));
        let members = self.parts.map.members(id);
        if members.is_empty() {
            return Err(WorldError(format!("{} has no Gaussians", self.name(id))));
        }
        let cloud = Arc::new(self.parts.cloud.select(&members));
        let done = export_splat::run(&cloud, &file, None, &mut Silent).map_err(|e| failed(&e))?;
        let shift = done.shift.map(|shift| format!("; {}", export_splat::shift_line(shift)));
        Ok(format!("{}{}", file.display(), shift.unwrap_or_default()))
    }

    fn locate_photo(&mut self, photo: Option<&str>, cancel: &AtomicBool) -> Result<PhotoSight, WorldError> {
        photos::locate(self, photo, false, cancel)
    }

    fn show_changes(&mut self, cancel: &AtomicBool) -> Result<PhotoSight, WorldError> {
        photos::locate(self, None, true, cancel)
    }

    fn add_photos(&mut self, photos: Option<&str>) -> Result<String, WorldError> {
        photos::add(self, photos)
    }

    fn export_replaces(&self, id: IdentityId) -> Option<String> {
        let file = self.export_file(id);
        file.exists().then(|| file.display().to_string())
    }
}
