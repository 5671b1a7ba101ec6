//! Errors of the search for objects and parts.

use crate::io::IoError;
use crate::models::ModelError;
use crate::pipeline::observer::Interrupted;
use crate::render::{DrawError, RenderError};

/// Errors of finding objects, embedding them or giving them codes.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum FindError {
    #[error("the '{0}' masks say nothing about any photo; give masks of at least one")]
    NoSeed(String),
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("photo {0}: {1}")]
    Render(String, DrawError),
    #[error("training codes: {0}")]
    Lift(#[from] RenderError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}
