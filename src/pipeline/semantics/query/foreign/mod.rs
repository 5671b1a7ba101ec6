//! Foreign results: answers from the Gaussians of other methods, with their values in place of a `SemanticMap`.
//!
//! 1. [`cosines`] compares codes with phrases through their decoder.
//! 2. [`blend`] renders the codes of a view, [`packed`] keeps LangSplatV2's; [`pieces`] turns cosines into relevancy.
//!    [`classes`] and [`click`] read classes and clicks.
//! 3. [`asked`] holds a result with what is computed once, and gives relevancy of Gaussians and pixels.
//! 4. [`own_rules`] makes masks as each method does, and one as this program does.
//! 5. [`identities`] and [`affinity`] make a `SemanticMap` of what a method has: classes, clusters, alike features.
//!
//! Embeddings of phrases come from the caller: [`Method::encoder`](crate::io::results::Method::encoder) names the
//! encoder.

pub mod affinity;
pub mod asked;
pub mod blend;
pub mod classes;
pub mod click;
pub(crate) mod cosines;
pub mod identities;
pub mod own_rules;
pub(crate) mod packed;
pub(crate) mod pieces;

#[cfg(test)]
mod tests;

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
    #[error("the result of {0} has no classes or clusters")]
    NoIdentities(&'static str),
    #[error("{0} has no rule of its own for masks of phrases")]
    NoRule(&'static str),
    #[error("the phrase's embedding has {have} numbers, but {method} compares {want}; encode it with {encoder}")]
    Dimension { have: usize, want: usize, method: &'static str, encoder: &'static str },
    #[error("there is no level {0}")]
    Level(usize),
}

impl From<RenderError> for ForeignError {
    fn from(e: RenderError) -> Self {
        Self::Draw(DrawError::Cpu(e))
    }
}
