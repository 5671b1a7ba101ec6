//! Results of other methods that give Gaussians a language or identities.
//!
//! [`face`] is what they have in common, [`open`](mod@open) finds the reader. One file for each method or family reads
//! its files; what a phrase, a click or a number means is in `pipeline/semantics/query/foreign`. A result that cannot be
//! read exactly is refused with the reason.

pub(in crate::io) mod autoencoder;
mod class_names;
mod decoder;
mod face;
mod faiss;
mod feature_3dgs;
mod folder;
mod gags;
mod grouping;
mod laga;
mod langsplat;
mod legaussians;
mod level_runs;
mod lifted;
pub(crate) mod numpy;
mod open;
mod open_gaussian;
mod product;
mod rows;
mod saga;
mod semantic_gaussians;
mod sniff;
mod sparse;
mod tensors;
mod thgs;

#[cfg(test)]
mod broken_tests;
#[cfg(test)]
pub(crate) mod tests;

pub use decoder::{Decoder, DecoderStep, LinearLayer};
pub use face::{
    CLIP_B32, Classifier, ClusterLevel, Descriptors, EmbeddedLevel, Leaves, LevelCodes, LevelValues, Method,
    MethodKind, MethodResult, OPEN_CLIP, ResultLevel, ScaleGate,
};
pub use folder::ResultOptions;
pub use open::open_result;
pub use product::ProductCodes;
pub use rows::FeatureRows;
pub use saga::saved_selections;
pub use sniff::{SniffedResult, is_feature, sniff};
pub use sparse::SparseRows;
