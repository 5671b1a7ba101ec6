//! Inputs of a track: the frames of a sequence, and the outputs of an interrupted track.

use super::{EncodedFrame, Sam2};
use crate::models::ModelError;
use crate::models::tensor::Tensor;
use crate::scene::PhotoPixels;

/// Object number of the caller.
pub type ObjectId = u32;

/// Object in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Low-resolution logits, `[1, 1, S/4, S/4]`; the object is where they are positive.
    pub logits: Tensor,
    /// Object pointer, `[1, C]`.
    pub pointer: Tensor,
    /// Logit of its presence.
    pub score: f32,
    /// Memory features.
    pub memory: Option<Tensor>,
}

/// Encoded frames of a sequence: all in memory, or from a cache on disk.
pub trait FrameSource {
    /// Number of frames.
    fn len(&self) -> usize;

    /// True if there are no frames.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns one frame.
    fn get(&mut self, model: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError>;
}

/// Frames in memory.
#[derive(Clone, Debug, Default)]
pub struct InMemory(pub Vec<EncodedFrame>);

impl InMemory {
    /// Encodes all pictures.
    pub fn of(model: &mut Sam2, pictures: &[PhotoPixels]) -> Result<Self, ModelError> {
        pictures.iter().map(|p| model.encode(p)).collect::<Result<_, _>>().map(Self)
    }
}

impl FrameSource for InMemory {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn get(&mut self, _: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError> {
        self.0.get(index).cloned().ok_or(ModelError::NoPicture)
    }
}

/// Step of a track: one object in one frame of one pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackStep {
    pub(crate) object: ObjectId,
    pub(crate) frame: usize,
    /// True if the pass goes back from the first prompted frame.
    pub(crate) backward: bool,
}

/// Record of the outputs of a track, to resume it after an interruption.
pub trait TrackHistory {
    /// Returns the earlier output of a step, if there is one. Called in the order of tracking.
    fn earlier(&mut self, step: TrackStep) -> Option<Output>;

    /// Records the output of a step.
    fn keep(&mut self, step: TrackStep, out: &Output);
}

/// Empty history: the track starts anew and is not recorded.
pub(super) struct Afresh;

impl TrackHistory for Afresh {
    fn earlier(&mut self, _: TrackStep) -> Option<Output> {
        None
    }

    fn keep(&mut self, _: TrackStep, _: &Output) {}
}
