//! Referring expressions with their truth, to measure a language of questions.
//!
//! A scene of triangles is measured (`mesh`, `shape`, `contact`, `color`, `facts`), and sentences are written about
//! what is clear (`relations`, `sentences`). Neither Gaussians nor the code that answers questions take part. A
//! sentence whose truth would depend on a borderline fact is left out and counted.
//!
//! Rules of meaning: left, right, in front and behind are the viewer's, along level axes. "Thing", "object", "item" and
//! "everything" mean objects, and none that carries at least half of the others (a table, a floor). Plurals mean all
//! that fit. A singular that fits several things equally has the truth [`ReferringTruth::OneOf`].

mod clarity;
mod collect;
mod color;
mod contact;
pub(crate) mod controls;
mod facts;
mod kinds;
mod mesh;
mod names;
mod relations;
mod scope;
mod sentences;
mod shape;
#[cfg(test)]
mod tests;

use serde::Serialize;

use crate::io::gltf_mesh::MeshScene;
use crate::pipeline::synth::levels::identities;
use crate::pipeline::synth::{Levels, SynthError, TrueIdentity};

/// Expression with its truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Referring {
    pub(crate) text: String,
    pub(crate) kind: ReferringKind,
    pub(crate) truth: ReferringTruth,
}

/// Construction of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub(crate) enum ReferringKind {
    Name,
    Part,
    Plural,
    All,
    Number,
    And,
    Or,
    Except,
    Largest,
    Smallest,
    Tallest,
    Longest,
    Leftmost,
    Rightmost,
    Closest,
    Farthest,
    Ordinal,
    LeftOf,
    RightOf,
    InFrontOf,
    Behind,
    On,
    Under,
    In,
    Above,
    NextTo,
    Between,
    Around,
    Touching,
    Nearest,
    Compare,
    Length,
    Color,
    NotColor,
    Question,
    Chained,
    /// Kinds of things: fruit, vehicles.
    Kind,
    Absent,
}

/// Identities that an expression means, by [`TrueIdentity`]'s ids.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) enum ReferringTruth {
    /// These, together.
    All(Vec<u16>),
    /// One of these, which fit equally: an honest program asks back.
    OneOf(Vec<u16>),
    /// Nothing in the scene fits.
    Nothing,
}

/// Expressions about a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ReferringSet {
    pub(crate) identities: Vec<TrueIdentity>,
    pub(crate) expressions: Vec<Referring>,
    /// Number of sentences that were left out because their truth is borderline.
    pub(crate) skipped_borderline: usize,
}

/// Writes up to `count` expressions about a scene, seen from `eye` along `forward` (axes of the glTF, y up), at least a
/// fifth of which name nothing. The same seed gives the same expressions; the truth does not depend on it.
pub(crate) fn referring(
    scene: &MeshScene,
    levels: Levels,
    file: &str,
    eye: [f64; 3],
    forward: [f64; 3],
    count: usize,
    seed: u64,
) -> Result<ReferringSet, SynthError> {
    let vertical = "left and right need a view with a horizon: look less steeply, from a finite place";
    let view = facts::TrueView::new(eye, forward).ok_or_else(|| SynthError::Options(vertical.into()))?;
    let found = identities(scene, levels, file)?;
    let facts = facts::MeshFacts::of(&found.list, mesh::solids(scene, &found)?, view)?;
    let scope = scope::TrueScope::new(&found.list, facts);
    let mut set = collect::SentenceSet::new(seed);
    sentences::write(&scope, &mut set);
    let (expressions, skipped_borderline) = set.choose(count);
    Ok(ReferringSet { identities: found.list, expressions, skipped_borderline })
}
