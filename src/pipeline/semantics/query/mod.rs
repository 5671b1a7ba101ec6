//! Query: from a typed text to the identities meant, with the time of each stage.
//!
//! In the order of the data, the first four steps run by [`query_engine`]:
//!
//! 1. [`reading`] mends slips and reads the text: [`language`] by its grammar, [`parse`] as a phrase for an encoder.
//! 2. [`language`] finds the identities by name, kind, color, place and order; [`names`] are for completions.
//! 3. [`by_embedding`] scores identities by what they look like, [`localize`] picks those of the answer.
//! 4. [`answer`] puts it together, with the time of each of the [`timing`] stages.
//! 5. [`matching`] finds the pixels and the Gaussians of the answer.
//!
//! [`foreign`] answers from the results of other methods instead of a `SemanticMap`.
//!
//! The [`lexicon`](crate::scene::identity::lexicon) knows words that no name has. All choices are settings of one
//! [`recipe`].

pub mod answer;
pub mod by_embedding;
pub(crate) mod colors;
pub mod foreign;
pub(crate) mod grounds;
pub(crate) mod language;
pub mod localize;
pub mod matching;
pub(crate) mod names;
pub mod parse;
pub(crate) mod query_engine;
pub(crate) mod reading;
pub mod recipe;
pub(crate) mod timing;
