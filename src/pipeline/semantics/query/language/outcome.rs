//! Sets of identities as an evaluation finds them, its steps, and reasons for which nothing is found.

use std::ops::Range;

use super::relations::HOLDS;
use crate::scene::IdentityId;

/// Identity in a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Member {
    pub(crate) id: IdentityId,
    /// Sureness from 0 to 1 that it belongs there.
    pub(crate) sure: f64,
    /// Fit of the words: 0 for its whole name, 1 for words of it, 2 for words of its wholes too, 3 for a kind of thing.
    pub(crate) rank: u8,
}

/// Set of identities that an expression stands for.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Matches {
    pub(crate) members: Vec<Member>,
    /// True if one thing is asked for in a place where several fit, with different results.
    pub(crate) unclear: bool,
}

impl Matches {
    pub(crate) fn new(members: Vec<Member>) -> Self {
        Self { members, unclear: false }
    }

    /// Members that the words fit best.
    pub(crate) fn settled(&self) -> Vec<Member> {
        let best = self.members.iter().map(|m| m.rank).min();
        self.members.iter().filter(|m| Some(m.rank) == best).copied().collect()
    }

    pub(crate) fn ids(&self) -> Vec<IdentityId> {
        self.members.iter().map(|m| m.id).collect()
    }

    /// Keeps the members for which `sure` gives a sureness; `None` removes one.
    pub(crate) fn kept(self, mut sure: impl FnMut(&Member) -> Option<f64>) -> Self {
        let keep = |m: Member| sure(&m).map(|s| Member { sure: m.sure.min(s), ..m });
        Self { members: self.members.into_iter().filter_map(keep).collect(), ..self }
    }
}

impl Matches {
    /// Members for which a relation holds by its share: sure ones alone if there are any, else those for which it may
    /// hold. With `not`, those for which it does not.
    pub(super) fn judged(self, not: bool, share: impl Fn(&Member) -> f64) -> Self {
        /// Share under which a relation does not hold.
        const FAILS: f64 = 0.35;
        if not {
            return self.kept(|m| Some(share(m)).filter(|s| *s < FAILS).map(|_| 1.0));
        }
        let found = self.kept(|m| Some(share(m)).filter(|s| *s >= HOLDS[1]));
        if found.members.iter().any(|m| m.sure >= HOLDS[0]) {
            return found.kept(|m| Some(m.sure).filter(|s| *s >= HOLDS[0]));
        }
        found
    }
}

/// Reason for which an expression has no members.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unmet {
    pub(crate) why: Why,
    /// Reason in a sentence.
    pub(crate) text: String,
    /// Words that are the reason; may be empty.
    pub(crate) words: Vec<String>,
    pub(crate) near: Vec<IdentityId>,
    /// Bytes of the text that are the reason.
    pub(crate) at: Range<usize>,
}

/// Kind of a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Why {
    /// All words are understood, and nothing in the scene is so.
    Nothing,
    /// A word names nothing in the scene.
    Unknown,
    /// A word has no meaning here.
    NotUnderstood,
    /// The encoder failed.
    Failed,
}

/// Step of an evaluation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct QueryStep {
    /// Bytes of the text that ask for it.
    pub(crate) at: Range<usize>,
    /// Effect in words: "left of the lamp, seen from here".
    pub(crate) text: String,
    /// Number of identities that are left.
    pub(crate) left: usize,
    /// True if it holds only in part.
    pub(crate) guess: bool,
    /// Number of expressions around it.
    pub(crate) depth: usize,
    /// True for a noun: without it, the rest of the sentence has nothing to be said of.
    pub(crate) is_noun: bool,
}
