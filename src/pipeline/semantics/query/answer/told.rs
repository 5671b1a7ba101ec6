//! Report of an answer: its certainty, the words that it leaves out, and offers if nothing was found.

use super::{Basis, QueryAnswer};
use crate::pipeline::semantics::query::grounds;
use crate::pipeline::semantics::query::localize::{Answer, Hit};
use crate::pipeline::semantics::query::names;
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::scene::{Identities, IdentityId};

/// Certainty of an answer, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Certainty {
    /// Every word is in its name or in those of its wholes, and the query has every word of its name.
    Certain,
    /// The query has a part of its name, or an encoder of photos finds it far more similar than anything else.
    Likely,
    Guess,
}

/// Least score, and least margin, of a likely answer by embedding.
const LIKELY: (f32, f32) = (0.6, 0.05);

impl QueryAnswer {
    /// Returns the telling words of a query on which the answer does not rest; `unknown` are the words that nothing
    /// here knows. Words on which any of the shown answers rests are left out.
    pub(crate) fn ignored_words(
        &self,
        identities: &Identities,
        QueryReading { phrase, called, .. }: &QueryReading,
        unknown: &[String],
    ) -> Vec<String> {
        match (&self.answer, self.basis) {
            (Answer::NotFound(_), _) => Vec::new(),
            (_, Basis::Names) if !called.is_empty() => Vec::new(),
            (_, Basis::Names) => {
                let beside = |id: &IdentityId| grounds::unexplained(identities, *id, phrase);
                let each: Vec<Vec<String>> = self.chosen(1).iter().map(beside).collect();
                let Some((first, others)) = each.split_first() else { return Vec::new() };
                first.iter().filter(|word| others.iter().all(|words| words.contains(word))).cloned().collect()
            }
            (_, Basis::Embedding) => unknown.to_vec(),
        }
    }

    /// Returns the telling words of a query that nothing here explains, if they are the reason for "not found";
    /// `unknown` are the words that nothing here knows.
    pub(crate) fn unexplained(
        &self,
        identities: &Identities,
        QueryReading { phrase, .. }: &QueryReading,
        unknown: &[String],
    ) -> Vec<String> {
        match (&self.answer, self.basis) {
            (Answer::NotFound(hits), Basis::Names) => {
                let mut words = grounds::grammar(identities, &phrase.text);
                let unknown = grounds::telling(&names::unknown_words(identities, &phrase.text));
                let said = words.join(" ");
                words.extend(unknown.into_iter().filter(|word| !said.split(' ').any(|w| w == word)));
                if words.is_empty() {
                    let left = hits.iter().map(|hit| grounds::unexplained(identities, hit.identity, phrase));
                    words = left.min_by_key(Vec::len).unwrap_or_default();
                }
                words
            }
            (Answer::NotFound(_), Basis::Embedding) => grounds::telling(unknown),
            _ => Vec::new(),
        }
    }

    /// Returns offers if nothing was found: identities that share words with the query, then those that look most
    /// like it; at most `most` of each.
    pub(crate) fn offers(&self, most: usize) -> [Vec<IdentityId>; 2] {
        let Answer::NotFound(hits) = &self.answer else { return [Vec::new(), Vec::new()] };
        let by_name = if self.basis == Basis::Names { hits.as_slice() } else { &[] };
        let by_looks = if self.basis == Basis::Names { self.alike.as_slice() } else { hits.as_slice() };
        let first = |hits: &[Hit]| -> Vec<IdentityId> {
            hits.iter().filter(|h| h.score > 0.0).take(most).map(|h| h.identity).collect()
        };
        let by_name = first(by_name);
        let by_looks = first(by_looks).into_iter().filter(|id| !by_name.contains(id)).collect();
        [by_name, by_looks]
    }

    /// Returns the certainty of the first hit, with these words `ignored`.
    pub(crate) fn certainty(&self, ignored: &[String]) -> Certainty {
        let hits = self.answer.hits();
        match (&self.answer, hits.first(), self.basis) {
            (Answer::Found(_), Some(first), Basis::Names) if first.score > 0.999 && ignored.is_empty() => {
                Certainty::Certain
            }
            (Answer::Found(_), Some(_), Basis::Names) if ignored.is_empty() => Certainty::Likely,
            (Answer::Found(_), Some(first), Basis::Embedding) if ignored.is_empty() && self.is_likely(first) => {
                Certainty::Likely
            }
            _ => Certainty::Guess,
        }
    }

    fn is_likely(&self, hit: &Hit) -> bool {
        let score = self.usual(hit.score);
        !self.is_rough && score >= LIKELY.0 && score - self.usual((hit.score - hit.margin).max(0.0)) >= LIKELY.1
    }
}
