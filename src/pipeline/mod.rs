//! What the program does with scenes: training, evaluation, synthetic data.
//! Everything here talks to the outside through an [`observer::Observer`] and nothing else.

pub(crate) mod cleaning;
pub(crate) mod depth;
pub(crate) mod evaluate;
pub(crate) mod metrics;
pub mod observer;
pub(crate) mod removal;
pub mod semantics;
pub(crate) mod splat_edit;
pub mod synth;
pub mod train;
pub(crate) mod video;
