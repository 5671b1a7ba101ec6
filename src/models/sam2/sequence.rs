//! What a track goes through: the frames of a sequence, and what was followed of it before it was stopped.

use super::{EncodedFrame, Sam2};
use crate::models::ModelError;
use crate::models::tensor::Tensor;
use crate::scene::PhotoPixels;

/// The caller's number of an object.
pub type ObjectId = u32;

/// An object in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Low-resolution logits, `[1, 1, S/4, S/4]`; the object is where they are positive.
    pub logits: Tensor,
    /// What points to it, `[1, C]`.
    pub pointer: Tensor,
    /// Logit of it being there at all.
    pub score: f32,
    /// What is remembered of it.
    pub memory: Option<Tensor>,
}

/// The frames of a sequence, as the encoder sees them: all in memory, or from a cache on disk.
pub trait FrameSource {
    /// How many there are.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of them.
    fn get(&mut self, model: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError>;
}

/// Frames that are kept in memory.
#[derive(Clone, Debug, Default)]
pub struct InMemory(pub Vec<EncodedFrame>);

impl InMemory {
    /// Looks at all pictures.
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

/// One object in one frame of one pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrackStep {
    pub(crate) object: ObjectId,
    pub(crate) frame: usize,
    /// Whether the pass goes back from the first frame that was marked.
    pub(crate) backward: bool,
}

/// What was followed before a track was stopped; keeps what is followed now.
pub trait TrackHistory {
    /// What was found there, if the track got that far. Asked in the order in which objects are followed.
    fn earlier(&mut self, step: TrackStep) -> Option<Output>;

    /// Keeps what was found.
    fn keep(&mut self, step: TrackStep, out: &Output);
}

/// A track that begins anew and is not kept.
pub(super) struct Afresh;

impl TrackHistory for Afresh {
    fn earlier(&mut self, _: TrackStep) -> Option<Output> {
        None
    }

    fn keep(&mut self, _: TrackStep, _: &Output) {}
}
