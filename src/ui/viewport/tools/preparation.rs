//! Preparation for selecting by clicks and strokes: once per state of a scene, for all selections in it.

use std::sync::Arc;

use crate::jobs::select::{self, PrepareRequest, PreparedScene};
use crate::scene::GaussianCloud;
use crate::ui::state::{AppState, Tone};
use crate::worker::{JobInfo, Task, Tasks};

/// Title of the job.
const TITLE: &str = "Preparing the selection";

/// The preparation, done or running.
#[derive(Default)]
pub(crate) struct SelectionPreparation {
    last: Option<Arc<PreparedScene>>,
    running: Option<Task<PreparedScene>>,
    /// True if the job has failed since the last update.
    has_failed: bool,
    /// Number of preparations in this scene, those that were kept from before left out.
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
            self.times += usize::from(!prepared.is_kept);
            self.last = Some(Arc::new(prepared));
        }
    }

    /// Begins the job. Returns false, with a message, if that is refused.
    pub(super) fn begin(&mut self, cloud: &Arc<GaussianCloud>, state: &mut AppState, tasks: &Tasks) -> bool {
        let Some(scene) = &state.scene else { return false };
        let request = PrepareRequest {
            cloud: Arc::clone(cloud),
            settings: state.render_settings(),
            cameras: scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default(),
            home: scene.home.clone(),
            file: Some(scene.selection_file()),
        };
        let spawned = tasks.spawn(JobInfo::short(TITLE), move |observer| select::prepare(&request, observer));
        self.running = spawned.map_err(|e| state.toast(Tone::Warning, format!("{TITLE}: {e}"))).ok();
        self.is_running()
    }

    /// The preparation for these Gaussians.
    pub(super) fn of(&self, cloud: &Arc<GaussianCloud>) -> Option<Arc<PreparedScene>> {
        self.last.as_ref().filter(|last| last.is_of(cloud)).map(Arc::clone)
    }

    /// Share of the job that is done, 0 to 1, if it runs.
    pub(super) fn share(&self, state: &AppState) -> Option<f32> {
        let progress = state.running(self.running.as_ref()?.job())?.progress.as_ref()?;
        (progress.total > 0).then(|| progress.done as f32 / progress.total as f32)
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
