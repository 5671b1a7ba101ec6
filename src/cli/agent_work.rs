//! Work that the agent's sentences make: names are stored in the scene, and what is removed makes a scene beside it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::CliError;
use crate::agent::scene::{AgentScene, Effect};
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::error::chain;
use crate::jobs::remove::{self, RemovalOptions, RemoveRequest};
use crate::jobs::{JobError, add};
use crate::pipeline::observer::Silent;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{GaussianCloud, IdentityId, SemanticMap};

/// A scene whose changes are stored as they are made, as the window stores them.
pub(super) struct SceneWork {
    folder: Option<PathBuf>,
    /// Id of its last save.
    state: Option<String>,
    cloud: Arc<GaussianCloud>,
    map: Arc<SemanticMap>,
    /// The maps before each new name that was not taken back.
    before: Vec<Arc<SemanticMap>>,
    /// Lines on the work done since they were last taken.
    pub(super) done: Vec<String>,
    /// The last error, if something could not be done.
    pub(super) failure: Option<CliError>,
}

impl SceneWork {
    /// The scene of `parts`, which lies in its folder in the state `state`.
    pub(super) fn new(parts: &AgentScene, state: Option<String>) -> Self {
        Self {
            folder: parts.folder.clone(),
            state,
            cloud: Arc::clone(&parts.cloud),
            map: Arc::clone(&parts.map),
            before: Vec::new(),
            done: Vec::new(),
            failure: None,
        }
    }

    /// Carries out a decision of the agent that changes more than the view.
    pub(super) fn carry_out(&mut self, effect: &Effect) {
        let hides = |ids: &[IdentityId]| format!("hides {} of them", ids.len());
        let line = match effect {
            Effect::Fly(flight, _) => {
                let (length, secs) = (flight.length, flight.seconds);
                format!("flies {length:.2} units in {secs:.1} s, {} poses", flight.poses.len())
            }
            Effect::Mark(ids) => format!("marks {} of them", ids.len()),
            Effect::Hidden(ids) => hides(ids),
            Effect::Located(photo, differs) => {
                let what = if *differs { "shows the difference from" } else { "compares the view with" };
                format!("{what} {}", photo.name())
            }
            Effect::Renamed(id, name) => self.renamed(*id, name),
            Effect::Undone(undone) => {
                let names = undone.names.iter().map(|(id, name)| self.rename_undone(*id, name));
                let said: Vec<String> = undone.hidden.iter().map(|ids| hides(ids)).chain(names).collect();
                said.join(", ")
            }
            Effect::Remove(ids) => match self.folder.clone() {
                Some(folder) => self.removed(&folder, ids),
                None => return,
            },
            Effect::AddPhotos(photos) => match self.folder.clone() {
                Some(folder) => self.added(&folder, photos),
                None => return,
            },
            Effect::Undo | Effect::Explored(_) => return,
        };
        self.done.push(line);
    }

    fn renamed(&mut self, id: IdentityId, name: &str) -> String {
        self.before.push(Arc::clone(&self.map));
        let request = EditRequest::Apply(Edit::Rename(id, name.to_owned()));
        match edit::apply(&self.cloud, &self.map, &request) {
            Ok(map) => {
                self.map = map;
                self.stored(&format!("calls #{id} {name}"))
            }
            Err(e) => self.failed(e),
        }
    }

    fn rename_undone(&mut self, id: IdentityId, name: &str) -> String {
        if let Some(before) = self.before.pop() {
            self.map = before;
        }
        self.stored(&format!("calls #{id} {name} again"))
    }

    /// Stores the current names, and returns a line that reports it.
    fn stored(&mut self, what: &str) -> String {
        let stored = match &self.folder {
            Some(folder) => edit::store(folder, self.state.as_deref(), &self.map, &self.cloud),
            None => Ok(None),
        };
        match stored {
            Ok(Some(state)) => {
                self.state = Some(state);
                format!("{what}, stored in the scene")
            }
            Ok(None) => {
                format!("{what}, which is stored nowhere: only a trained scene keeps names ('fmlgs import' makes one)")
            }
            Err(e) => self.failed(e),
        }
    }

    /// Makes a new scene from the one in `folder` without these, and returns a line with its path.
    fn removed(&mut self, folder: &Path, ids: &[IdentityId]) -> String {
        let request = RemoveRequest { folder: folder.into(), options: RemovalOptions::of(ids), retrain: false };
        match remove::run_request(&request, &mut Silent) {
            Ok(done) => format!("{}: {}", done.folder.display(), remove::summary(&done.name, &done.report)),
            Err(e) => self.failed(e),
        }
    }

    /// Makes a scene of the one in `folder` and these photos, and returns a line with its path.
    fn added(&mut self, folder: &Path, photos: &[PathBuf]) -> String {
        match add::beside(folder, photos, &mut Silent) {
            Ok(done) => format!("{}: {}", done.out.display(), done.told(folder)),
            Err(e) => self.failed(e),
        }
    }

    fn failed(&mut self, e: JobError) -> String {
        let text = format!("failed: {}", chain(&e));
        self.failure = Some(e.into());
        text
    }
}
