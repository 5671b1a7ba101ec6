//! Work on scenes: training, evaluation, synthetic data, semantics, edits. All of it reports only through an
//! [`observer::Observer`].

pub(crate) mod cleaning;
pub(crate) mod depth;
pub(crate) mod evaluate;
pub(crate) mod evaluate_fitted;
pub(crate) mod frames;
pub(crate) mod locate;
pub(crate) mod metrics;
pub mod observer;
pub(crate) mod removal;
pub mod semantics;
pub(crate) mod splat_edit;
pub mod synth;
pub mod train;
pub(crate) mod video;
