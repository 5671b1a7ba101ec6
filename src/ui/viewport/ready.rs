//! What selecting by clicks and strokes is made ready with: once for a scene as it is, for all selections in it.

use std::sync::Arc;

use super::Viewport;
use crate::jobs::select::{SelectStep, Selected};
use crate::scene::GaussianCloud;
use crate::worker::{JobId, Worker};

/// What is made ready, and what is being made ready.
#[derive(Default)]
pub(super) struct ReadySelection {
    /// Nothing selected, with all that the next selection needs.
    last: Option<Arc<Selected>>,
    preparing: Option<JobId>,
    /// How often it was made ready in this scene.
    times: usize,
}

impl ReadySelection {
    /// Forgets it: another scene.
    pub(super) fn forget(&mut self, worker: &Worker) {
        self.preparing.iter().for_each(|job| worker.cancel(*job));
        *self = Self::default();
    }

    /// Keeps what a step of any selection was made ready with.
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
    /// How often the scene was made ready for selections by clicks and strokes.
    pub fn times_prepared(&self) -> usize {
        self.ready.times
    }

    /// The step of a selection that is to be done next, with what was before it. Preparing comes first, as soon as the
    /// tool is there; Gaussians in training would have changed by then.
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
                // Why it failed was said; the next stroke tries again.
                tool.give_up();
            }
            let begins = self.ready.preparing.is_none() && (!tool.gave_up || tool.waits());
            return begins.then_some((SelectStep::Prepare, None));
        }
        let before = tool.selected.clone().or(before);
        tool.next().map(|step| (step, before))
    }

    /// The step is done by this job.
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
