//! Preparation for selecting by clicks and strokes: once per state of a scene, for all selections in it.

use std::sync::Arc;

use crate::jobs::select::Selected;
use crate::scene::GaussianCloud;
use crate::worker::{Task, Tasks};

/// The preparation, done or running.
#[derive(Default)]
pub(crate) struct SelectionPreparation {
    /// An empty selection, with all that the next selection needs.
    last: Option<Arc<Selected>>,
    running: Option<Task<Selected>>,
    /// True if the job has failed since the last update.
    has_failed: bool,
    /// Number of preparations in this scene.
    times: usize,
}

impl SelectionPreparation {
    /// Forgets the preparation of another scene.
    pub(crate) fn forget(&mut self, tasks: &Tasks) {
        self.running.iter().for_each(|task| tasks.cancel(task.job()));
        *self = Self::default();
    }

    /// Takes over the result of the job, once per frame.
    pub(crate) fn update(&mut self) {
        let done = Task::take(&mut self.running);
        self.has_failed = matches!(done, Some(Err(_)));
        if let Some(Ok(prepared)) = done {
            self.keep(&prepared);
        }
    }

    /// Begins the job.
    pub(super) fn begin(&mut self, task: Task<Selected>) {
        self.running = Some(task);
    }

    /// Keeps the preparation of a selection's step.
    pub(super) fn keep(&mut self, found: &Selected) {
        self.times += usize::from(self.last.as_ref().is_none_or(|last| !last.shares(found)));
        self.last = Some(Arc::new(found.begun_anew()));
    }

    /// The preparation for these Gaussians.
    pub(super) fn of(&self, cloud: &Arc<GaussianCloud>) -> Option<Arc<Selected>> {
        self.last.as_ref().filter(|last| last.is_of(cloud)).map(Arc::clone)
    }

    pub(super) fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// True if the job has failed since the last update.
    pub(super) fn has_failed(&self) -> bool {
        self.has_failed
    }

    /// Number of preparations of the scene.
    pub(crate) fn times(&self) -> usize {
        self.times
    }
}
