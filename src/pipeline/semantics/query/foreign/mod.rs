//! Foreign results: answers from the Gaussians of other methods, with their values in place of a `SemanticMap`.
//!
//! 1. [`cosines`] compares codes with phrases through their decoder.
//! 2. [`blend`] renders the codes of a view, [`packed`] keeps LangSplatV2's; [`pieces`] turns cosines into relevancy.
//!    [`classes`] and [`click`] read classes and clicks, [`pointed`] what a pixel belongs to.
//! 3. [`asked`] holds a result with what is computed once, and gives relevancy of Gaussians and pixels.
//! 4. [`own_rules`] makes masks as each method does ([`laga`] LaGa's), and one as this program does; [`descriptors`]
//!    answers from clusters with several embeddings.
//! 5. [`features`] gives codes and embeddings of Gaussians as rows, [`named_classes`] answers names of classes.
//! 6. [`identities`] and [`affinity`] make a `SemanticMap` of what a method has: classes, clusters, alike features.
//!
//! Embeddings of phrases come from the caller:
//! [`MethodResult::encoder`](crate::io::results::MethodResult::encoder) names the encoder.

pub mod affinity;
pub mod asked;
pub mod blend;
pub mod classes;
pub mod click;
pub(crate) mod cosines;
pub(crate) mod descriptors;
pub(crate) mod features;
pub mod identities;
mod laga;
pub(crate) mod named_classes;
pub mod own_rules;
pub(crate) mod packed;
pub(crate) mod pieces;
pub mod pointed;

#[cfg(test)]
mod exchanged_tests;
#[cfg(test)]
mod map_tests;
#[cfg(test)]
mod tests;

use crate::io::results::Method;
use crate::render::{DrawError, RenderError};

/// A phrase as other methods compare it.
#[derive(Clone, Copy, Debug)]
pub struct ForeignPhrase<'a> {
    /// Its embedding, of unit length.
    pub query: &'a [f32],
    /// Embeddings of the canonical phrases, of unit length.
    pub canonical: &'a [Vec<f32>],
    /// Factor of the advantage before it becomes relevancy.
    pub temperature: f32,
}

/// A question that a result cannot answer.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum ForeignError {
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error("the result of {0} knows no language; name its objects, and ask for the names")]
    NoLanguage(&'static str),
    #[error(
        "the result of {method} is compared with phrases by {encoder}, which is not in the list of models; fuse \
         features of LSeg, of 512 numbers, or name an encoder of your own with --encoder"
    )]
    NoEncoder { method: &'static str, encoder: &'static str },
    #[error("{method} knows no language, and no class in its class_names.txt is called '{name}'")]
    NoClass { method: &'static str, name: String },
    #[error("the result of {0} has no classes or clusters")]
    NoIdentities(&'static str),
    #[error("{0} has no rule of its own for masks of phrases")]
    NoRule(&'static str),
    #[error(
        "the phrase's embedding by {encoder} has {have} numbers, but {method} compares {want}; name the encoder that the \
         result was trained with (--encoder)"
    )]
    Dimension { have: usize, want: usize, method: &'static str, encoder: String },
    #[error("there is no level {0}")]
    Level(usize),
}

impl ForeignError {
    /// The reason for which a method without an encoder answers no phrase.
    pub(crate) fn of_silent(method: Method) -> Self {
        let name = method.name();
        method.missing_encoder().map_or(Self::NoLanguage(name), |encoder| Self::NoEncoder { method: name, encoder })
    }
}

impl From<RenderError> for ForeignError {
    fn from(e: RenderError) -> Self {
        Self::Draw(DrawError::Cpu(e))
    }
}
