//! Report of an answer: its certainty, the words that it leaves out, and offers if nothing was found.

use super::{Basis, QueryAnswer};
use crate::pipeline::semantics::query::grounds;
use crate::pipeline::semantics::query::language::Understood;
use crate::pipeline::semantics::query::language::relations::HOLDS;
use crate::pipeline::semantics::query::localize::{Answer, Hit};
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::scene::identity::name_words::words;
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

/// Score of what is near a query that finds nothing.
const NEAR: f32 = 0.3;

/// Hits of what the language understood.
pub(super) fn answer(identities: &Identities, reading: &QueryReading, understood: Option<&Understood>) -> Answer {
    let near = |ids: &[IdentityId]| ids.iter().map(|id| Hit { identity: *id, score: NEAR, margin: 0.0 }).collect();
    let Some(understood) = understood else { return Answer::NotFound(Vec::new()) };
    if let Some(unmet) = &understood.unmet {
        return Answer::NotFound(near(&unmet.near));
    }
    let said = words(&reading.text);
    let known = identities.words();
    // A name of which every word is said is as sure as a whole name.
    let is_said = |id: IdentityId| known.names(id).iter().any(|name| name.iter().all(|w| said.contains(w)));
    let score =
        |id: IdentityId, sure: f64| (if is_said(id) || known.names(id).is_empty() { sure } else { 0.9 * sure }) as f32;
    let settled = understood.found.settled();
    if understood.is_ambiguous() {
        return Answer::Ambiguous(settled.iter().map(|m| Hit { identity: m.id, score: 1.0, margin: 0.0 }).collect());
    }
    let mut hits: Vec<Hit> =
        settled.iter().map(|m| Hit { identity: m.id, score: score(m.id, m.sure), margin: 0.0 }).collect();
    hits.iter_mut().for_each(|hit| hit.margin = hit.score);
    Answer::Found(hits)
}

/// Least score, and least margin, of a likely answer by embedding.
const LIKELY: (f32, f32) = (0.6, 0.05);

impl QueryAnswer {
    /// Returns the words of a query on which an answer by embedding does not rest; `unknown` are those that nothing here
    /// knows.
    pub(crate) fn ignored_words(&self, unknown: &[String]) -> Vec<String> {
        match (&self.answer, self.basis) {
            (Answer::NotFound(_), _) | (_, Basis::Names) => Vec::new(),
            (_, Basis::Embedding) => unknown.to_vec(),
        }
    }

    /// Returns the telling words of a query that nothing here explains, if they are the reason for "not found";
    /// `unknown` are the words that nothing here knows.
    pub(crate) fn unexplained(&self, reading: &QueryReading, unknown: &[String]) -> Vec<String> {
        match (&self.answer, &self.understood) {
            (Answer::NotFound(_), Some(understood)) => {
                understood.unmet.as_ref().map(|u| u.words.clone()).unwrap_or_default()
            }
            (Answer::NotFound(_), None) if self.basis == Basis::Names => vec![reading.text.clone()],
            (Answer::NotFound(_), None) => grounds::telling(unknown),
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
            (Answer::Found(_), Some(_), Basis::Names) if self.is_guess() => Certainty::Guess,
            (Answer::Found(_), Some(_), Basis::Names) if hits.iter().all(|h| h.score > 0.999) => Certainty::Certain,
            (Answer::Found(_), Some(_), Basis::Names) => Certainty::Likely,
            (Answer::Found(_), Some(first), Basis::Embedding) if ignored.is_empty() && self.is_likely(first) => {
                Certainty::Likely
            }
            _ => Certainty::Guess,
        }
    }

    /// Returns whether something holds only in part for what is shown.
    fn is_guess(&self) -> bool {
        let members = self.understood.as_ref().map(|u| u.found.settled()).unwrap_or_default();
        members.iter().any(|m| m.sure < HOLDS[0])
    }

    fn is_likely(&self, hit: &Hit) -> bool {
        let score = self.usual(hit.score);
        !self.is_rough && score >= LIKELY.0 && score - self.usual((hit.score - hit.margin).max(0.0)) >= LIKELY.1
    }
}
