//! Outcome of a training run: Gaussians, or an error.

use std::sync::Arc;

use super::checkpoint::CheckpointError;
use crate::io::IoError;
use crate::math::finite::NotFinite;
use crate::pipeline::locate::LocateError;
use crate::pipeline::observer::{Evaluation, Interrupted};
use crate::render::{GpuError, RenderError};
use crate::scene::GaussianCloud;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TrainEnd {
    Finished,
    /// The observer asked to stop; the state is saved.
    Cancelled,
}

#[derive(Clone, Debug)]
pub(crate) struct TrainOutcome {
    pub(crate) cloud: Arc<GaussianCloud>,
    /// Held-out evaluations, the last one of the final state.
    pub(crate) evaluations: Vec<Evaluation>,
    pub(crate) end: TrainEnd,
    pub(crate) steps: u64,
    pub(crate) secs: f64,
}

impl TrainOutcome {
    /// Outcome of a run that was stopped before its first step.
    pub(super) fn stopped_early() -> Self {
        Self { cloud: Arc::default(), evaluations: Vec::new(), end: TrainEnd::Cancelled, steps: 0, secs: 0.0 }
    }
}

/// Reasons for which a run failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum TrainError {
    #[error("{0} has no photo to train on: {1} photos, all held out; raise --held-out-every or add photos")]
    NoPhotos(String, usize),
    #[error(transparent)]
    Photo(IoError),
    #[error("photo {0}: {1}")]
    Render(String, RenderError),
    /// The GPU failed. The last checkpoint is intact.
    #[error("the GPU failed: {0}; --backend cpu does without")]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    #[error(transparent)]
    Save(IoError),
    #[error("the training diverged {0} times even with lowered rates; the photos' poses may be wrong")]
    Diverged(u32),
    /// A stage left a value that is not finite; checked under `debug-validation` only.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    #[error("held-out photos: {0}")]
    Fit(LocateError),
    #[error("{0}")]
    Config(String),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}
