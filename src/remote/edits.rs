//! Edits of objects and parts by a client, if the server permits them.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use crate::io::snapshot;
use crate::jobs::edit::{self, EditRequest};
use crate::jobs::{JobError, open};
use crate::pipeline::semantics::lifting::edit::Edit;

/// Editor of the objects of one trained scene; applies one edit at a time.
#[derive(Debug)]
pub(super) struct Editor {
    folder: PathBuf,
    /// Known state of the saved scene, so that a newer save by another program is not overwritten.
    state: Mutex<Option<String>>,
}

impl Editor {
    pub(super) fn new(folder: PathBuf, state: Option<String>) -> Self {
        Self { folder, state: Mutex::new(state) }
    }

    /// Applies and stores an edit, then passes the new snapshot of the scene to `show`, before the next edit may begin.
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
