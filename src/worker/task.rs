//! A job and the handle of whoever asked for it.
//!
//! [`Tasks::spawn`](super::Tasks::spawn) takes a [`JobInfo`] and a closure, and returns a [`Task`] that will hold the
//! closure's result. The status bar and the log follow the job by its [`Event`](super::Event)s.

use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded};

use super::failure::{Failure, Stop};
use crate::jobs::phases::WholeProgress;

/// Identifier of a job: local to one worker, or of a job on another computer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JobId {
    /// A job of the worker.
    Local(u64),
    /// A job on another computer.
    Remote(u64),
}

/// Thread that runs a job, and its priority.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JobLane {
    /// Jobs of minutes, one after another. They yield to the window.
    #[default]
    Long,
    /// A long job that the user waits for: normal priority.
    Urgent,
    /// Short jobs, run beside a long one.
    Short,
}

/// Part of the open scene that a job makes anew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Makes {
    /// The job leaves the scene as it is.
    #[default]
    Nothing,
    /// Another scene.
    Scene,
    /// Gaussians: a training.
    Gaussians,
    /// Objects and parts.
    Objects,
    /// A scene beside the open one, by a training that the same request goes on with.
    SceneBeside,
}

impl Makes {
    /// Returns whether the scene on screen is another one afterwards.
    pub(crate) fn changes_scene(self) -> bool {
        !matches!(self, Self::Nothing | Self::SceneBeside)
    }

    /// Returns whether it is a training, of the open scene or of one beside it.
    pub(crate) fn is_training(self) -> bool {
        matches!(self, Self::Gaussians | Self::SceneBeside)
    }
}

/// Description of a job for the worker, the status bar and the log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JobInfo {
    /// Title, such as "Opening fox".
    pub title: String,
    pub(crate) lane: JobLane,
    pub(crate) makes: Makes,
    pub(crate) can_pause: bool,
    /// True if nobody asked for it: a failure is a passing message.
    pub(crate) is_aside: bool,
    /// Sentence for a user who waits for it.
    pub(crate) hint: &'static str,
    /// Progress over its phases, before it has begun.
    pub(crate) whole: WholeProgress,
}

impl JobInfo {
    /// A job of minutes.
    pub fn long(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// A long job that the user waits for.
    pub(crate) fn urgent(title: impl Into<String>) -> Self {
        Self { lane: JobLane::Urgent, ..Self::long(title) }
    }

    /// A short job.
    pub fn short(title: impl Into<String>) -> Self {
        Self { lane: JobLane::Short, ..Self::long(title) }
    }

    pub(crate) fn makes(self, makes: Makes) -> Self {
        Self { makes, ..self }
    }

    pub(crate) fn pausable(self) -> Self {
        Self { can_pause: true, ..self }
    }

    pub(crate) fn aside(self) -> Self {
        Self { is_aside: true, ..self }
    }

    pub(crate) fn hint(self, hint: &'static str) -> Self {
        Self { hint, ..self }
    }

    /// The job with one progress over its phases, which are a list of [`crate::jobs::phases`].
    pub(crate) fn phases(self, phases: &'static [(&'static str, f64)]) -> Self {
        Self { whole: WholeProgress::of(phases), ..self }
    }
}

/// End of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobEnd {
    /// The job has finished.
    Finished,
    /// The job was canceled.
    Cancelled,
    /// The job has failed.
    Failed(Failure),
}

/// Handle of a job, for its result. Dropping it does not cancel the job.
#[derive(Debug)]
pub struct Task<T> {
    job: JobId,
    result: Receiver<Result<T, Stop>>,
}

/// The other end of a [`Task`], which gives it the result.
#[derive(Debug)]
pub(crate) struct TaskResult<T>(Sender<Result<T, Stop>>);

impl<T> Task<T> {
    /// A task and its other end.
    pub(crate) fn pair(job: JobId) -> (Self, TaskResult<T>) {
        let (sender, result) = bounded(1);
        (Self { job, result }, TaskResult(sender))
    }

    /// The job.
    pub fn job(&self) -> JobId {
        self.job
    }

    /// The result, once the job has ended. It is given once; a job that was canceled before it began gives
    /// [`Stop::Cancelled`].
    pub fn poll(&self) -> Option<Result<T, Stop>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(Stop::Cancelled)),
        }
    }

    /// The result of the task in `slot`, which is then empty; `None` if there is no task or it is not done.
    pub(crate) fn take(slot: &mut Option<Self>) -> Option<Result<T, Stop>> {
        let result = slot.as_ref()?.poll()?;
        *slot = None;
        Some(result)
    }
}

impl<T> TaskResult<T> {
    /// Gives the result; returns the end of the job.
    pub(crate) fn give(self, result: Result<T, Stop>) -> JobEnd {
        let end = match &result {
            Ok(_) => JobEnd::Finished,
            Err(Stop::Cancelled) => JobEnd::Cancelled,
            Err(Stop::Failed(failure)) => JobEnd::Failed(failure.clone()),
        };
        // Whoever asked may no longer want it.
        let _ = self.0.send(result);
        end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_given_once_and_a_dropped_job_counts_as_canceled() {
        let (task, result) = Task::pair(JobId::Local(1));
        let mut slot = Some(task);
        assert!(Task::take(&mut slot).is_none() && slot.is_some());
        assert!(matches!(result.give(Ok(7)), JobEnd::Finished));
        assert_eq!(Task::take(&mut slot), Some(Ok(7)));
        assert!(slot.is_none() && Task::take(&mut slot).is_none());
        let (task, result) = Task::<()>::pair(JobId::Local(2));
        drop(result);
        assert_eq!(task.poll(), Some(Err(Stop::Cancelled)));
    }
}
