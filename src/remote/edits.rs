//! Changes of objects and parts that a client asks for, where the server was told to allow them.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use crate::io::snapshot;
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::{JobError, open};
use crate::pipeline::semantics::edit::Edit;

/// Changes the objects of one trained scene, one change after the other.
#[derive(Debug)]
pub(super) struct Editor {
    folder: PathBuf,
    /// The save that is known: what somebody else has stored since is not written over.
    state: Mutex<Option<String>>,
}

impl Editor {
    pub(super) fn new(folder: PathBuf, state: Option<String>) -> Self {
        Self { folder, state: Mutex::new(state) }
    }

    /// Makes and stores a change, and shows the snapshot of the scene then, before another change is made.
    pub(super) fn apply(&self, edit: Edit, show: impl FnOnce(Vec<u8>)) -> Result<(), JobError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let scene = open::scene(&self.folder)?;
        let map = scene.semantics()?;
        let new = edit::apply(&scene.cloud, &map, &EditRequest::Apply(edit))?;
        if let Some(stored) = edit::store(&self.folder, state.as_deref(), &new, &scene.cloud)? {
            *state = Some(stored);
        }
        show(snapshot::of_folder(&self.folder)?);
        Ok(())
    }
}
