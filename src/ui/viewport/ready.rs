//! Preparation for selecting by clicks and strokes: once per state of a scene, for all selections in it.

use std::sync::Arc;

use super::Viewport;
use crate::jobs::select::{SelectStep, Selected};
use crate::scene::GaussianCloud;
use crate::worker::{JobId, Worker};

/// The preparation, done or running.
#[derive(Default)]
pub(super) struct ReadySelection {
    /// An empty selection, with all that the next selection needs.
    last: Option<Arc<Selected>>,
    preparing: Option<JobId>,
    /// Number of preparations in this scene.
    times: usize,
}

impl ReadySelection {
    /// Forgets the preparation of another scene.
    pub(super) fn forget(&mut self, worker: &Worker) {
        self.preparing.iter().for_each(|job| worker.cancel(*job));
        *self = Self::default();
    }

    /// Keeps the preparation of a selection's step.
    pub(super) fn take(&mut self, job: JobId, found: &Selected) {
        self.preparing.take_if(|preparing| *preparing == job);
        self.times += usize::from(self.last.as_ref().is_none_or(|last| !last.shares(found)));
        self.last = Some(Arc::new(found.begun_anew()));
    }

    fn of(&self, cloud: &Arc<GaussianCloud>) -> Option<Arc<Selected>> {
        self.last.as_ref().filter(|last| last.is_of(cloud)).map(Arc::clone)
    }
}

impl Viewport {
    /// Number of preparations of the scene for selecting by clicks and strokes.
    pub fn times_prepared(&self) -> usize {
        self.ready.times
    }

    /// The next step of a selection, with the state before it. Preparation comes first, as soon as the tool is in use;
    /// not during training, which would change the Gaussians meanwhile.
    pub(crate) fn next_select_step(
        &mut self,
        done: JobId,
        is_training: bool,
    ) -> Option<(SelectStep, Option<Arc<Selected>>)> {
        let ended = self.ready.preparing.take_if(|job| *job <= done).is_some();
        let (tool, cloud) = (self.select.as_mut()?, self.cloud.as_ref()?);
        let before = tool.selected.clone().filter(|s| s.is_of(cloud)).or_else(|| self.ready.of(cloud));
        tool.is_prepared = before.is_some() || is_training;
        if !tool.is_prepared {
            if ended {
                // The failure was reported; the next stroke tries again.
                tool.give_up();
            }
            let begins = self.ready.preparing.is_none() && (!tool.gave_up || tool.waits());
            return begins.then_some((SelectStep::Prepare, None));
        }
        let before = tool.selected.clone().or(before);
        tool.next().map(|step| (step, before))
    }

    /// Records the job that runs the step.
    pub(crate) fn select_step_runs(&mut self, job: Option<JobId>, step: &SelectStep) {
        match (step, &mut self.select) {
            (SelectStep::Prepare, tool) => {
                self.ready.preparing = job;
                tool.iter_mut().filter(|_| job.is_none()).for_each(|tool| tool.give_up());
            }
            (step, Some(tool)) => tool.runs(job, matches!(step, SelectStep::Stroke(_))),
            _ => {}
        }
    }
}
