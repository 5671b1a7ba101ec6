//! Query: from a typed text to the identities meant, with the time of each stage.
//!
//! In the order of the data, the first four steps run by [`query_engine`]:
//!
//! 1. [`parse`] takes the text apart, and [`reading`] mends its slips and reads noun compounds.
//! 2. [`names`] and [`by_embedding`] score identities by name and by embedding.
//! 3. [`localize`] picks the identities of the answer from the scores; [`grounds`] say which words the answer rests on.
//! 4. [`answer`] puts it together, with the time of each of the [`timing`] stages.
//! 5. [`matching`] finds the pixels and the Gaussians of the answer.
//!
//! The [`lexicon`] knows words that no name has. All choices are settings of one [`recipe`].

pub mod answer;
pub mod by_embedding;
pub(crate) mod colors;
pub(crate) mod grounds;
pub(crate) mod lexicon;
pub mod localize;
pub mod matching;
pub(crate) mod names;
pub mod parse;
pub(crate) mod query_engine;
pub(crate) mod reading;
pub mod recipe;
pub(crate) mod timing;
pub(crate) mod words;
