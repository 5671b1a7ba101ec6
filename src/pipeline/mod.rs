//! What the program does with scenes: training, evaluation, synthetic data.
//! Everything here talks to the outside through an [`observer::Observer`] and nothing else.

pub mod depth;
pub mod evaluate;
pub mod metrics;
pub mod observer;
pub mod semantics;
pub mod synth;
pub mod train;
pub mod video;
