//! Answers to one query: by names if there are any, else by embedding. If names decide, identities that merely look
//! alike are offered, unless the encoder knows photos (CLIP).

use std::time::Instant;

use rayon::prelude::*;

use super::by_embedding::{EmbeddingScorer, TextEmbeddings};
use super::grounds;
use super::language::outcome::Why;
use super::language::{self, Looks, QueryPlace, QueryScene, Understood};
use super::localize::{Answer, Hit, Scorer, localize};
use super::matching::{self, MatchMode};
use super::names;
use super::parse::ParsedQuery;
use super::reading::QueryReading;
use super::recipe::{MatchBy, QueryConfig, Rejection, RelevancyScale};
use super::timing::{StagesMs, ms_since};
use crate::models;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::relevancy::{LERFS_SHARE, on_lerfs_scale};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, LanguageFeatures, LevelFilter, Mask};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Basis {
    /// Names given by people or label files.
    Names,
    /// Embeddings that an encoder made of the identities.
    Embedding,
}

/// An answered query.
#[derive(Clone, Debug, PartialEq)]
pub struct QueryAnswer {
    pub(crate) answer: Answer,
    pub(crate) basis: Basis,
    /// Identities that look most like the query when names have no answer, best first; offers, not answers.
    pub(crate) alike: Vec<Hit>,
    /// True if the encoder is the small one that comes with the program, whose answers are never certain.
    pub(crate) is_rough: bool,
    /// Relevancy of every identity by number, 0 to 1; a piece is at least as relevant as its whole
    /// where names decide.
    pub(crate) relevancy: Vec<f32>,
    /// Milliseconds of relevancy and localization; the caller adds the other stages.
    pub(crate) stages: StagesMs,
    /// Recipe of the answer.
    pub(crate) recipe: QueryConfig,
    /// Answer of the language, if it was asked.
    pub(crate) understood: Option<Understood>,
}

/// Features and encoded phrases for answers by embedding.
#[derive(Clone, Copy)]
pub(crate) struct Language<'a> {
    pub(crate) features: &'a LanguageFeatures,
    /// Embeddings of phrases, those of the query included.
    pub(crate) phrases: &'a TextEmbeddings,
    /// Words of the query that the encoder does not know and left out.
    pub(crate) unknown: &'a [String],
}

/// Answers by the recipe: by names, by embedding if names have no answer and the encoder may give one, or by one of
/// the two alone.
pub(crate) fn answer(
    identities: &Identities,
    reading: &QueryReading,
    (level, place): (LevelFilter, &QueryPlace),
    recipe: &QueryConfig,
    language: Option<Language<'_>>,
) -> QueryAnswer {
    let phrase = &reading.phrase;
    let scene = QueryScene { identities, level, place, by_names: recipe.match_by != MatchBy::Embedding };
    let nothing = |a: &Answer| matches!(a, Answer::NotFound(_));
    let language = match (recipe.match_by, language) {
        (MatchBy::Names, _) | (MatchBy::Both, None) => return by_language(scene, reading, recipe, None),
        (MatchBy::Embedding, None) => return unanswered(identities, recipe),
        (MatchBy::Embedding, Some(language)) if reading.is_plain() => {
            return by_embedding(identities, phrase, level, recipe, language);
        }
        (MatchBy::Embedding, Some(language)) => return by_language(scene, reading, recipe, Some(language)),
        (MatchBy::Both, Some(language)) => language,
    };
    let named = by_language(scene, reading, recipe, None);
    // By embedding, there is always an identity that looks most like the phrase.
    if !nothing(&named.answer) || names::was_removed(identities, &phrase.text) {
        return named;
    }
    let is_strict = recipe.rejection == Rejection::Strict;
    let may = !is_strict || may_answer(identities, language.features);
    if !reading.is_plain() {
        let why = named.understood.as_ref().and_then(|u| u.unmet.as_ref()).map(|unmet| unmet.why);
        // What is understood and not so needs no encoder.
        let meant = (may && why != Some(Why::Nothing)).then(|| by_language(scene, reading, recipe, Some(language)));
        return meant.filter(|a| !nothing(&a.answer)).unwrap_or(named);
    }
    let mut meant = by_embedding(identities, phrase, level, recipe, language);
    let first = meant.chosen(1);
    // Without a telling word, or in another color, nothing has much in common with what is asked for.
    let leaves_out = !grounds::telling(language.unknown).is_empty();
    let is_alike =
        |hit: &&Hit| first.contains(&hit.identity) && !grounds::is_of_another_color(identities, hit.identity, phrase);
    let alike = || meant.answer.hits().iter().filter(is_alike).copied().collect();
    let alike: Vec<Hit> = if is_strict && !leaves_out { alike() } else { Vec::new() };
    if is_strict {
        meant.answer = grounded(identities, phrase, language, meant.answer);
    }
    // Both were computed, whichever is taken.
    let stages = named.stages.and(meant.stages);
    let taken = match nothing(&meant.answer) {
        false if !may => QueryAnswer { alike, ..named },
        true if is_strict && identities.have_names() => QueryAnswer { alike, ..named },
        _ => meant,
    };
    QueryAnswer { stages, ..taken }
}

/// Returns whether an encoder may answer by itself: if nothing has a name, or if it knows photos. To the small
/// encoder that comes with the program, everything unknown looks like something known (docs/notes/queries.md).
pub(crate) fn may_answer(identities: &Identities, features: &LanguageFeatures) -> bool {
    !identities.have_names() || !models::is_rough(&features.encoder)
}

/// Rejects an answer by embedding if a word is left out or if the identity has another color than the query says.
fn grounded(identities: &Identities, phrase: &ParsedQuery, language: Language<'_>, answer: Answer) -> Answer {
    let leaves_out = !grounds::telling(language.unknown).is_empty();
    match answer {
        Answer::Found(hits) | Answer::Ambiguous(hits)
            if leaves_out || grounds::is_of_another_color(identities, hits[0].identity, phrase) =>
        {
            Answer::NotFound(hits)
        }
        other => other,
    }
}

/// Returns the answer by embedding of a scene without embeddings: nothing is found.
fn unanswered(identities: &Identities, recipe: &QueryConfig) -> QueryAnswer {
    QueryAnswer::nothing(Basis::Embedding, identities, recipe)
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

/// Search by embedding for the nouns of a sentence.
struct ByLooks<'a> {
    identities: &'a Identities,
    recipe: &'a QueryConfig,
    language: Language<'a>,
}

/// Sureness of what is found by embedding.
const BY_LOOKS: f64 = 0.8;

impl Looks for ByLooks<'_> {
    fn find(&mut self, phrase: &ParsedQuery, plural: bool) -> Result<Vec<(IdentityId, f64)>, String> {
        let mut found = by_embedding(self.identities, phrase, LevelFilter::Auto, self.recipe, self.language);
        if self.recipe.rejection == Rejection::Strict {
            found.answer = grounded(self.identities, phrase, self.language, found.answer);
        }
        // Of several, all that are more like the phrase than like anything.
        let most = if plural { TOP_LOOKS } else { 1 };
        Ok(found.chosen(most).into_iter().map(|id| (id, BY_LOOKS)).collect())
    }
}

/// Most identities that a plural finds by embedding.
const TOP_LOOKS: usize = 12;

/// Answers by the language: by names, and with the encoder for words that no name has, if there is one.
pub(crate) fn by_language(
    scene: QueryScene<'_>,
    reading: &QueryReading,
    recipe: &QueryConfig,
    encoder: Option<Language<'_>>,
) -> QueryAnswer {
    let start = Instant::now();
    let identities = scene.identities;
    let mut looks = encoder.map(|language| ByLooks { identities, recipe, language });
    let looks = looks.as_mut().map(|l| l as &mut dyn Looks);
    let understood = language::ask(&scene, &reading.text, &reading.sentences, looks);
    let localize = ms_since(start);
    let basis = match &understood {
        Some(u) if u.by_looks || !scene.by_names => Basis::Embedding,
        _ => Basis::Names,
    };
    let answer = told::answer(identities, reading, understood.as_ref());
    let since = Instant::now();
    // An identity that shares words but not the whole query is related, not meant.
    let alone = names::scores(identities, &reading.phrase.target).into_iter().map(|score| 0.5 * score);
    let mut relevancy: Vec<f32> = [0.0].into_iter().chain(alone).collect();
    let meant = if let Answer::NotFound(_) = answer { &[] } else { answer.hits() };
    meant.iter().rev().for_each(|hit| relevancy[hit.identity as usize] = hit.score);
    for (id, identity) in identities.iter() {
        relevancy[id as usize] = f32::max(relevancy[id as usize], relevancy[identity.parent as usize]);
    }
    let stages = StagesMs { relevancy: ms_since(since), localize, ..StagesMs::default() };
    let is_rough = encoder.is_some_and(|l| models::is_rough(&l.features.encoder));
    QueryAnswer { stages, understood, is_rough, ..QueryAnswer::new(answer, basis, relevancy, recipe) }
}

/// Answers by embedding alone.
pub(crate) fn by_embedding(
    identities: &Identities,
    phrase: &ParsedQuery,
    level: LevelFilter,
    recipe: &QueryConfig,
    language: Language<'_>,
) -> QueryAnswer {
    let Language { features, phrases, .. } = language;
    let start = Instant::now();
    let mut scorer = EmbeddingScorer::new(identities, features, phrases, recipe);
    let mut timed = Timed { scorer: &mut scorer, ms: 0.0 };
    let answer = localize(identities, phrase, level, recipe.strategy, &mut timed);
    let (scored_ms, localized_ms) = (timed.ms, ms_since(start));
    let mut relevancy = vec![0.0];
    relevancy.extend(scorer.scores(&phrase.text, None));
    relevancy.resize(identities.len() + 1, 0.0);
    let stages = StagesMs {
        relevancy: scored_ms + ms_since(start) - localized_ms,
        localize: localized_ms - scored_ms,
        ..StagesMs::default()
    };
    let is_rough = models::is_rough(&features.encoder);
    QueryAnswer { stages, is_rough, ..QueryAnswer::new(answer, Basis::Embedding, relevancy, recipe) }
}

impl QueryAnswer {
    /// Creates an answer without look-alikes, with times of zero.
    pub(crate) fn new(answer: Answer, basis: Basis, relevancy: Vec<f32>, recipe: &QueryConfig) -> Self {
        let (stages, recipe) = (StagesMs::default(), recipe.clone());
        Self { answer, basis, alike: Vec::new(), is_rough: false, relevancy, stages, recipe, understood: None }
    }

    /// Creates the answer "not found".
    pub(crate) fn nothing(basis: Basis, identities: &Identities, recipe: &QueryConfig) -> Self {
        Self::new(Answer::NotFound(Vec::new()), basis, vec![0.0; identities.len() + 1], recipe)
    }

    /// Returns the best identities: none if nothing was found, all that fit equally well if the answer is ambiguous,
    /// else up to `top` that fit.
    pub fn chosen(&self, top: usize) -> Vec<IdentityId> {
        let hits = self.answer.hits();
        let alike = |first: f32| hits.iter().take_while(|h| first - h.score < self.resolution()).count();
        let (most, threshold) = match &self.answer {
            // All of several that are meant together.
            Answer::Found(hits) if self.understood.is_some() => (top.max(hits.len()), 0.0),
            Answer::Found(_) => (top.max(1), self.threshold()),
            Answer::Ambiguous(hits) => (top.max(alike(hits[0].score)), self.threshold()),
            Answer::NotFound(_) => (0, self.threshold()),
        };
        hits.iter().take(most).filter(|h| h.score >= threshold).map(|h| h.identity).collect()
    }

    /// Least score of an identity that answers the query.
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

    /// Converts a score by embedding to this program's default temperature.
    fn usual(&self, score: f32) -> f32 {
        let odds = score / (1.0 - score);
        let odds = odds.powf(QueryConfig::default().temperature / self.recipe.temperature);
        if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 }
    }

    /// Relevancy by identity in a view, on the recipe's scale.
    pub(crate) fn shown_relevancy(&self, map: &ViewMap) -> Vec<f32> {
        match self.recipe.scale {
            RelevancyScale::Raw => self.relevancy.clone(),
            RelevancyScale::Lerf => self.lerfs_scale(map.identity.iter().copied()),
        }
    }

    /// Relevancy of every identity on LERF's scale: from one half to the largest of the `seen` identities.
    fn lerfs_scale(&self, seen: impl Iterator<Item = IdentityId>) -> Vec<f32> {
        let of = |id: IdentityId| self.relevancy.get(id as usize).copied().unwrap_or(0.0);
        let most = seen.map(of).fold(0.0, f32::max);
        self.relevancy.iter().map(|r| on_lerfs_scale(*r, most).clamp(0.0, 1.0)).collect()
    }

    /// Returns, for each identity, whether its relevancy is over the cut on LERF's scale, among those `seen`.
    pub(crate) fn relevant(&self, seen: impl Iterator<Item = IdentityId>) -> Vec<bool> {
        self.lerfs_scale(seen).into_iter().map(|r| r > LERFS_SHARE).collect()
    }

    /// Mask of the answer in a view.
    pub(crate) fn mask(&self, map: &ViewMap, codes: Option<&CodeMap>, identities: &Identities, top: usize) -> Mask {
        let QueryConfig { masks, tolerance, .. } = self.recipe;
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
        // One more entry for numbers without an identity.
        let mut table = self.shown_relevancy(map);
        table.push(0.0);
        let last = table.len() - 1;
        map.identity.par_iter().with_min_len(1 << 16).map(|id| table[(*id as usize).min(last)]).collect()
    }
}

mod told;

pub(crate) use told::Certainty;

#[cfg(test)]
mod tests;
