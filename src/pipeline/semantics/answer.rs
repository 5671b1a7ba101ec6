//! One query, answered: by names where the scene's names know the words or what was removed has them, else by meaning.

use std::time::Instant;

use rayon::prelude::*;

use super::by_embedding::{EmbeddingScorer, TextEmbeddings};
use super::code_map::CodeMap;
use super::localize::{Answer, Hit, Scorer, called, localize};
use super::matching::{self, MatchMode};
use super::names::{self, ByName};
use super::parse::ParsedQuery;
use super::reading::QueryReading;
use super::recipe::{Recipe, RelevancyScale, Strategy, Understanding};
use super::relevancy::{LERFS_SHARE, on_lerfs_scale};
use super::timing::{StagesMs, ms_since};
use super::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, LanguageFeatures, LevelFilter, Mask};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Basis {
    /// Names that people or label files gave.
    Names,
    /// What identities look like to an encoder.
    Embedding,
}

/// How sure an answer is, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Certainty {
    /// Every word is in its name or in those of its wholes, and every word of its name was said.
    Certain,
    /// A part of its name was said, or it looks like it far more than anything else.
    Likely,
    Guess,
}

/// Score from which, and margin by which, what looks like the query is likely meant.
const LIKELY: (f32, f32) = (0.6, 0.05);

/// An answered query.
#[derive(Clone, Debug, PartialEq)]
pub struct QueryAnswer {
    pub(crate) answer: Answer,
    pub(crate) basis: Basis,
    /// Relevancy of every identity by number, 0 to 1; a piece is at least as relevant as its whole
    /// where names decide.
    pub(crate) relevancy: Vec<f32>,
    /// How long that took: relevancy and localization here, the other stages by those who go on.
    pub(crate) stages: StagesMs,
    /// How it was answered.
    pub(crate) recipe: Recipe,
}

/// Features and encoded phrases for answers by meaning.
#[derive(Clone, Copy)]
pub(crate) struct Language<'a> {
    pub(crate) features: &'a LanguageFeatures,
    /// With the query's phrases learned.
    pub(crate) phrases: &'a TextEmbeddings,
}

/// Answers as the recipe says: by names where all words are known, by meaning where that finds something, or by one
/// of them alone.
pub(crate) fn answer(
    identities: &Identities,
    reading: &QueryReading,
    level: LevelFilter,
    recipe: &Recipe,
    language: Option<Language<'_>>,
) -> QueryAnswer {
    let phrase = &reading.phrase;
    let nothing = |a: &Answer| matches!(a, Answer::NotFound(_));
    let language = match (recipe.understanding, language) {
        (Understanding::Names, _) | (Understanding::Both, None) => return by_name(identities, reading, level, recipe),
        (Understanding::Embedding, None) => return unanswered(identities, recipe),
        (Understanding::Embedding, Some(language)) => return by_embedding(identities, phrase, level, recipe, language),
        (Understanding::Both, Some(language)) => language,
    };
    let named = by_name(identities, reading, level, recipe);
    let known = !reading.called.is_empty() || names::unknown_words(identities, &phrase.text).is_empty();
    if known && !nothing(&named.answer) {
        return named;
    }
    // Something always looks most like it.
    if nothing(&named.answer) && names::was_removed(identities, &phrase.text) {
        return named;
    }
    let meant = by_embedding(identities, phrase, level, recipe, language);
    // Both were looked at, whichever is taken.
    let stages = named.stages.and(meant.stages);
    let taken = if nothing(&meant.answer) && !nothing(&named.answer) { named } else { meant };
    QueryAnswer { stages, ..taken }
}

/// What is answered by embedding where there are no embeddings.
fn unanswered(identities: &Identities, recipe: &Recipe) -> QueryAnswer {
    QueryAnswer {
        answer: Answer::NotFound(Vec::new()),
        basis: Basis::Embedding,
        relevancy: vec![0.0; identities.len() + 1],
        stages: StagesMs::default(),
        recipe: recipe.clone(),
    }
}

struct Timed<'a, S> {
    scorer: &'a mut S,
    ms: f64,
}

impl<S: Scorer> Scorer for Timed<'_, S> {
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        let start = Instant::now();
        let scores = self.scorer.scores(phrase, against);
        self.ms += ms_since(start);
        scores
    }

    fn threshold(&self) -> f32 {
        self.scorer.threshold()
    }

    fn resolution(&self) -> f32 {
        self.scorer.resolution()
    }

    fn rejects(&mut self, phrase: &ParsedQuery, hit: &Hit) -> bool {
        self.scorer.rejects(phrase, hit)
    }
}

/// Localizes by `scorer`, unless `whole` are called so as a whole, then makes the relevancy of every identity by
/// `relevancy`.
fn judged<S: Scorer>(
    (identities, phrase, level): (&Identities, &ParsedQuery, LevelFilter),
    whole: &[IdentityId],
    (basis, recipe): (Basis, &Recipe),
    scorer: &mut S,
    relevancy: impl FnOnce(&Answer, &mut S) -> Vec<f32>,
) -> QueryAnswer {
    let start = Instant::now();
    let mut timed = Timed { scorer, ms: 0.0 };
    // Names are words, which are compared one by one.
    let strategy = match (basis, recipe.strategy) {
        (Basis::Names, Strategy::Joint) => Strategy::WholeFirst,
        (_, strategy) => strategy,
    };
    let answer = match whole {
        [] => localize(identities, phrase, level, strategy, &mut timed),
        ids => called(identities, (ids, &phrase.text), level, &mut timed),
    };
    let (scored_ms, localized_ms) = (timed.ms, ms_since(start));
    let relevancy = relevancy(&answer, scorer);
    let stages = StagesMs {
        relevancy: scored_ms + ms_since(start) - localized_ms,
        localize: localized_ms - scored_ms,
        ..StagesMs::default()
    };
    QueryAnswer { answer, basis, relevancy, stages, recipe: recipe.clone() }
}

pub(crate) fn by_name(
    identities: &Identities,
    QueryReading { phrase, called, .. }: &QueryReading,
    level: LevelFilter,
    recipe: &Recipe,
) -> QueryAnswer {
    let mut scorer = ByName { identities, rejection: recipe.rejection };
    judged((identities, phrase, level), called, (Basis::Names, recipe), &mut scorer, |answer, _| {
        let alone = names::scores(identities, &phrase.target);
        let mut relevancy = vec![0.0; identities.len() + 1];
        for (id, identity) in identities.iter() {
            let hit = answer.hits().iter().find(|h| h.identity == id);
            // What shares the words but not the whole is related, not meant.
            let own = hit.map_or(0.5 * alone[id as usize - 1], |h| h.score);
            relevancy[id as usize] = f32::max(own, relevancy[identity.parent as usize]);
        }
        relevancy
    })
}

/// Answers by meaning alone.
pub(crate) fn by_embedding(
    identities: &Identities,
    phrase: &ParsedQuery,
    level: LevelFilter,
    recipe: &Recipe,
    language: Language<'_>,
) -> QueryAnswer {
    let Language { features, phrases } = language;
    let mut scorer = EmbeddingScorer::new(identities, features, phrases, recipe);
    judged((identities, phrase, level), &[], (Basis::Embedding, recipe), &mut scorer, |_, scorer| {
        let mut relevancy = vec![0.0];
        relevancy.extend(scorer.scores(&phrase.text, None));
        relevancy.resize(identities.len() + 1, 0.0);
        relevancy
    })
}

impl QueryAnswer {
    /// The best identities: none if nothing was found, all that fit alike if the answer is
    /// ambiguous, else up to `top` that fit.
    pub fn chosen(&self, top: usize) -> Vec<IdentityId> {
        let hits = self.answer.hits();
        let alike = |first: f32| hits.iter().take_while(|h| first - h.score < self.resolution()).count();
        let (most, threshold) = match &self.answer {
            Answer::Found(_) => (top.max(1), self.threshold()),
            Answer::Ambiguous(hits) => (top.max(alike(hits[0].score)), self.threshold()),
            Answer::NotFound(_) => (0, self.threshold()),
        };
        hits.iter().take(most).filter(|h| h.score >= threshold).map(|h| h.identity).collect()
    }

    /// The words of a query that the answer does not rest on; `unknown` are those that nothing here knows.
    pub(crate) fn ignored_words(
        &self,
        identities: &Identities,
        QueryReading { phrase, called, .. }: &QueryReading,
        unknown: &[String],
    ) -> Vec<String> {
        match (&self.answer, self.basis) {
            (Answer::NotFound(_), _) => Vec::new(),
            (_, Basis::Names) if !called.is_empty() => Vec::new(),
            (found, Basis::Names) => {
                let first = found.hits().first();
                first.map_or_else(Vec::new, |h| names::words_beside(identities, h.identity, &phrase.text))
            }
            (_, Basis::Embedding) => unknown.to_vec(),
        }
    }

    /// How sure the first hit is, some words being `ignored`.
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
        score >= LIKELY.0 && score - self.usual((hit.score - hit.margin).max(0.0)) >= LIKELY.1
    }

    /// Score from which an identity is what was asked for.
    pub(crate) fn threshold(&self) -> f32 {
        self.recipe.rejection.threshold(match self.basis {
            Basis::Names => names::THRESHOLD,
            Basis::Embedding => super::by_embedding::THRESHOLD,
        })
    }

    fn resolution(&self) -> f32 {
        match self.basis {
            Basis::Names => names::RESOLUTION,
            Basis::Embedding => super::by_embedding::resolution(self.recipe.temperature),
        }
    }

    /// A score by embedding as it would be at this program's own temperature.
    fn usual(&self, score: f32) -> f32 {
        let odds = score / (1.0 - score);
        let odds = odds.powf(Recipe::default().temperature / self.recipe.temperature);
        if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 }
    }

    /// Relevancy as the recipe shows it, by identity, in a view.
    pub(crate) fn shown_relevancy(&self, map: &ViewMap) -> Vec<f32> {
        match self.recipe.scale {
            RelevancyScale::Raw => self.relevancy.clone(),
            RelevancyScale::Lerf => self.lerfs_scale(map.identity.iter().copied()),
        }
    }

    /// Relevancy of every identity on LERF's scale: from a half to the largest of those that are `seen`.
    fn lerfs_scale(&self, seen: impl Iterator<Item = IdentityId>) -> Vec<f32> {
        let of = |id: IdentityId| self.relevancy.get(id as usize).copied().unwrap_or(0.0);
        let most = seen.map(of).fold(0.0, f32::max);
        self.relevancy.iter().map(|r| on_lerfs_scale(*r, most).clamp(0.0, 1.0)).collect()
    }

    /// Whether each identity is relevant enough on LERF's scale, among those that are `seen`.
    pub(crate) fn relevant(&self, seen: impl Iterator<Item = IdentityId>) -> Vec<bool> {
        self.lerfs_scale(seen).into_iter().map(|r| r > LERFS_SHARE).collect()
    }

    /// The pixels of what is meant, in a view.
    pub(crate) fn mask(&self, map: &ViewMap, codes: Option<&CodeMap>, identities: &Identities, top: usize) -> Mask {
        let Recipe { masks, tolerance, .. } = self.recipe;
        if masks == MatchMode::Relevancy {
            let relevant = self.relevant(map.identity.iter().copied());
            let is = |id: IdentityId| relevant.get(id as usize).copied().unwrap_or(false);
            return Mask::from_fn(map.width_px, map.height_px, |i| is(map.identity[i]));
        }
        let mut mask = Mask::empty(map.width_px, map.height_px);
        let of = |id: IdentityId| matching::pixels((map, codes), identities, id, masks, tolerance);
        self.chosen(top).into_iter().for_each(|id| mask.add(&of(id)));
        mask
    }

    /// Relevancy of every pixel of a view, row-major, 0 to 1.
    pub(crate) fn heat(&self, map: &ViewMap) -> Vec<f32> {
        // One more entry for numbers that nobody has.
        let mut table = self.shown_relevancy(map);
        table.push(0.0);
        let last = table.len() - 1;
        map.identity.par_iter().with_min_len(1 << 16).map(|id| table[(*id as usize).min(last)]).collect()
    }
}

#[cfg(test)]
mod tests;
