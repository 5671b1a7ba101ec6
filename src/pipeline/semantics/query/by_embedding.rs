//! Identities found by their looks: relevancy of their language features for a phrase.

use std::collections::HashMap;

use rayon::prelude::*;

use super::colors;
use super::localize::{Hit, Scorer};
use super::parse::ParsedQuery;
use super::recipe::{PartEmbedding, QueryConfig, Rejection, Strategy};
use crate::math::finite::{all_finite, insist};
use crate::models::{self, TextSource};
use crate::pipeline::semantics::relevancy::{advantage, score};
use crate::scene::{Identities, IdentityId, LanguageFeatures, ViewFeatures};

/// Embeddings of phrases, kept from query to query; `None` for those that the encoder could not read.
#[derive(Clone, Debug, Default)]
pub struct TextEmbeddings(HashMap<String, Option<Vec<f32>>>);

impl TextEmbeddings {
    /// Most phrases that are kept.
    const MOST: usize = 4_096;

    /// Adds the embeddings of the phrases that this recipe needs for a question, encoded by `source`, unless they are
    /// there already. Only the question's own phrases have to be understood.
    pub fn learn<S: TextSource + ?Sized>(
        &mut self,
        phrase: &ParsedQuery,
        recipe: &QueryConfig,
        source: &mut S,
    ) -> Result<(), S::Error> {
        if self.0.len() > Self::MOST {
            self.0.clear();
        }
        let own: Vec<&str> = std::iter::once(&phrase.text).chain(&phrase.whole).map(String::as_str).collect();
        let helpful = helpful(phrase, recipe);
        self.add(&own, helpful.iter().map(String::as_str), source)
    }

    /// Adds the embeddings of the canonical phrases of a recipe.
    pub(crate) fn learn_canonical<S: TextSource + ?Sized>(&mut self, recipe: &QueryConfig, source: &mut S) {
        // None of these phrases has to be understood, so no error can occur.
        let _ = self.add(&[], recipe.canonical.iter(), source);
    }

    /// Adds the missing embeddings of these phrases, encoded together: `own` ones must be understood, `helpful` ones
    /// need not be.
    fn add<'p, S: TextSource + ?Sized>(
        &mut self,
        own: &[&'p str],
        helpful: impl Iterator<Item = &'p str>,
        source: &mut S,
    ) -> Result<(), S::Error> {
        let mut needed: Vec<&str> = own.iter().copied().filter(|p| self.get(p).is_none()).collect();
        let own = needed.len();
        for phrase in helpful {
            if !self.0.contains_key(phrase) && !needed.contains(&phrase) {
                needed.push(phrase);
            }
        }
        if needed.is_empty() {
            return Ok(());
        }
        let mut embeddings = source.texts(&needed).into_iter();
        let understood: Vec<Vec<f32>> = embeddings.by_ref().take(own).collect::<Result<_, _>>()?;
        let all = understood.into_iter().map(Some).chain(embeddings.map(Result::ok));
        self.0.extend(needed.into_iter().map(str::to_owned).zip(all));
        Ok(())
    }

    /// Returns whether the encoder could not read a phrase.
    pub(crate) fn is_unreadable(&self, phrase: &str) -> bool {
        matches!(self.0.get(phrase), Some(None))
    }

    pub(crate) fn get(&self, phrase: &str) -> Option<&[f32]> {
        self.0.get(phrase)?.as_deref()
    }
}

/// Additional phrases for answering a question.
fn helpful(phrase: &ParsedQuery, recipe: &QueryConfig) -> Vec<String> {
    let mut all: Vec<String> = recipe.canonical.iter().map(str::to_owned).collect();
    if matches!(recipe.strategy, Strategy::TwoSteps | Strategy::Joint) {
        all.extend(phrase.implied_whole().map(str::to_owned));
    }
    if recipe.strategy == Strategy::WholeFirst {
        all.push(phrase.target.clone());
    }
    if recipe.rejection == Rejection::Strict {
        for said in colored(phrase) {
            all.push(said.to_owned());
            all.extend(colors::alternatives(said));
        }
    }
    all
}

/// Phrases of a question that name a color: its own, and the whole's.
fn colored(phrase: &ParsedQuery) -> impl Iterator<Item = &str> {
    let own = if phrase.whole.is_some() { &phrase.target } else { &phrase.text };
    std::iter::once(own).chain(&phrase.whole).map(String::as_str).filter(|said| !colors::named(said).is_empty())
}

/// Score above which an identity is nearer to the query than to any canonical phrase.
pub(crate) const THRESHOLD: f32 = 0.5;

/// Difference of scores under which two identities fit equally well: that of an advantage of 0.005.
pub(crate) fn resolution(temperature: f32) -> f32 {
    score(0.0025, temperature) - score(-0.0025, temperature)
}

/// Least number of identities per thread: fewer are not worth the handover.
const IDENTITIES_PER_TASK: usize = 32;

/// Scores by language features.
pub struct EmbeddingScorer<'a> {
    pub(crate) identities: &'a Identities,
    pub(crate) features: &'a LanguageFeatures,
    /// Embeddings of the phrases that will be asked for; other phrases score nothing.
    pub(crate) phrases: &'a TextEmbeddings,
    pub(crate) recipe: &'a QueryConfig,
    known: Vec<(String, Option<String>, Vec<f32>)>,
}

impl<'a> EmbeddingScorer<'a> {
    /// Creates a scorer from these features and encoded phrases.
    pub fn new(
        identities: &'a Identities,
        features: &'a LanguageFeatures,
        phrases: &'a TextEmbeddings,
        recipe: &'a QueryConfig,
    ) -> Self {
        Self { identities, features, phrases, recipe, known: Vec::new() }
    }

    /// Returns the advantage of every identity, by number less one: that of its best view. Negative infinity without
    /// features.
    pub fn advantages(&self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        let query = self.phrases.get(phrase);
        let canonical = self.embeddings(self.recipe.canonical.iter().chain(against));
        let best = |f: &ViewFeatures| query.map_or(f32::NEG_INFINITY, |q| self.best_view(f, q, &canonical));
        self.features.by_identity.par_iter().with_min_len(IDENTITIES_PER_TASK).map(best).collect()
    }

    fn embeddings<'p>(&self, phrases: impl Iterator<Item = &'p str>) -> Vec<Vec<f32>> {
        phrases.filter_map(|p| self.phrases.get(p)).map(<[f32]>::to_vec).collect()
    }

    fn best_view(&self, f: &ViewFeatures, query: &[f32], canonical: &[Vec<f32>]) -> f32 {
        let views = if self.recipe.parts == PartEmbedding::Raw { &f.raw } else { &f.deviated };
        views.iter().map(|v| advantage(v, query, canonical)).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns whether an identity is more like the phrase with another color than like the phrase.
    fn has_another_color(&self, phrase: &str, id: IdentityId) -> bool {
        let others = colors::alternatives(phrase);
        let others = self.embeddings(others.iter().map(String::as_str));
        let (Some(query), Some(f)) = (self.phrases.get(phrase), self.features.by_identity.get(id as usize - 1)) else {
            return false;
        };
        !others.is_empty() && self.best_view(f, query, &others) < 0.0
    }
}

impl Scorer for EmbeddingScorer<'_> {
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        if let Some(known) = self.known.iter().find(|k| k.0 == phrase && k.1.as_deref() == against) {
            return known.2.clone();
        }
        let advantages = self.advantages(phrase, against).into_iter();
        let scores: Vec<f32> = advantages.map(|d| score(d, self.recipe.temperature)).collect();
        insist(|| all_finite("relevancy", "score", &scores));
        self.known.push((phrase.to_owned(), against.map(str::to_owned), scores.clone()));
        scores
    }

    fn threshold(&self) -> f32 {
        self.recipe.rejection.threshold(THRESHOLD)
    }

    fn resolution(&self) -> f32 {
        resolution(self.recipe.temperature)
    }

    fn rejects(&mut self, phrase: &ParsedQuery, hit: &Hit) -> bool {
        if self.recipe.rejection != Rejection::Strict {
            return false;
        }
        let whole = || self.identities.object_of(hit.identity);
        let other = |said: &str| {
            let of_whole = phrase.whole.as_deref() == Some(said);
            self.has_another_color(said, if of_whole { whole() } else { hit.identity })
        };
        hit.score < score(least_advantage(&self.features.encoder), self.recipe.temperature)
            || colored(phrase).any(other)
    }
}

/// Least advantage over the canonical phrases of an identity that answers: to the encoders of photos, nearly
/// everything is a little more like some phrase (docs/notes/queries.md).
pub(crate) fn least_advantage(encoder: &str) -> f32 {
    if encoder == models::DEMO { 0.0 } else { 0.03 }
}

#[cfg(test)]
mod tests {
    use super::super::recipe::PAPERS_PHRASES;
    use super::*;

    fn features() -> LanguageFeatures {
        let f = |raw: [f32; 2], deviated: [f32; 2]| ViewFeatures {
            raw: vec![raw.to_vec()],
            deviated: vec![deviated.to_vec()],
        };
        LanguageFeatures {
            encoder: "test".into(),
            dimension: 2,
            by_identity: vec![f([1.0, 0.0], [1.0, 0.0]), f([0.0, 1.0], [0.6, 0.8]), ViewFeatures::default()],
        }
    }

    fn book() -> TextEmbeddings {
        let mut book = TextEmbeddings::default();
        let mut encode = |p: &str| {
            Ok::<_, ()>(match p {
                "lid" => vec![0.0, 1.0],
                "pot" => vec![1.0, 0.0],
                _ => vec![0.5, 0.5],
            })
        };
        for phrase in ["lid", "pot"] {
            book.learn(&parsed(phrase), &QueryConfig::default(), &mut encode).expect("encodes");
        }
        book
    }

    fn parsed(phrase: &str) -> ParsedQuery {
        ParsedQuery::parse(phrase).expect("words")
    }

    fn all() -> Identities {
        Identities::objects(3)
    }

    #[test]
    fn the_best_view_counts_and_features_can_be_chosen() {
        let (features, phrases) = (features(), book());
        let (all, recipe) = (all(), QueryConfig::default());
        let mut by = EmbeddingScorer::new(&all, &features, &phrases, &recipe);
        let d = by.advantages("lid", None);
        assert!((d[0] + 0.5).abs() < 1e-6 && (d[1] - 0.1).abs() < 1e-6 && d[2] == f32::NEG_INFINITY, "{d:?}");
        let s = by.scores("lid", None);
        assert!(s[0] < 0.5 && s[1] > 0.5 && s[2] == 0.0);
        // The whole's phrase is one more thing to be better than.
        assert!((by.advantages("lid", Some("pot"))[1] - 0.1).abs() < 1e-6);
        let raw = QueryConfig { parts: PartEmbedding::Raw, ..QueryConfig::default() };
        by.recipe = &raw;
        assert!((by.advantages("lid", None)[1] - 0.5).abs() < 1e-6);
        assert!(by.advantages("never learned", None).iter().all(|d| *d == f32::NEG_INFINITY));
    }

    #[test]
    fn phrases_are_encoded_once() {
        let mut book = TextEmbeddings::default();
        let mut calls = 0;
        for _ in 0..3 {
            let mut encode = |_: &str| {
                calls += 1;
                Ok::<_, ()>(vec![1.0])
            };
            book.learn(&parsed("lid"), &QueryConfig::default(), &mut encode).expect("encodes");
        }
        assert_eq!(calls, 1 + PAPERS_PHRASES.len());
        assert_eq!(book.learn(&parsed("pot"), &QueryConfig::default(), &mut |_: &str| Err("no")), Err("no"));
        assert!(book.get("pot").is_none());
    }

    #[test]
    fn scores_are_kept_by_phrase_and_whole() {
        let (features, phrases, all, recipe) = (features(), book(), all(), QueryConfig::default());
        let fresh = |phrase: &str, whole: Option<&str>| {
            EmbeddingScorer::new(&all, &features, &phrases, &recipe).scores(phrase, whole)
        };
        let asked = [("lid", None), ("pot", None), ("lid", Some("pot")), ("pot", Some("lid")), ("lid", None)];
        let mut by = EmbeddingScorer::new(&all, &features, &phrases, &recipe);
        for (phrase, whole) in asked {
            assert_eq!(by.scores(phrase, whole), fresh(phrase, whole), "{phrase} {whole:?}");
        }
        assert_ne!(fresh("lid", None), fresh("pot", None));
        assert_ne!(fresh("pot", None), fresh("pot", Some("pot")));
        // The slope of the logistic curve at its middle is a quarter.
        let temperature = recipe.temperature;
        assert!((resolution(temperature) - 0.005 * temperature / 4.0).abs() < 1e-5);
        assert_eq!(by.threshold(), THRESHOLD);
        assert!((by.resolution() - resolution(temperature)).abs() < 1e-9);
    }

    #[test]
    fn a_full_book_begins_anew() {
        let mut book = TextEmbeddings::default();
        let recipe = QueryConfig::default();
        let learn = |phrase: &str, book: &mut TextEmbeddings| {
            book.learn(&parsed(phrase), &recipe, &mut |_: &str| Ok::<_, ()>(vec![1.0])).expect("encodes")
        };
        let half = TextEmbeddings::MOST / 2;
        (0..half).for_each(|i| learn(&i.to_string(), &mut book));
        assert!(book.get("0").is_some());
        (half..2 * half).for_each(|i| learn(&i.to_string(), &mut book));
        assert!(book.get("0").is_none() && book.get("4095").is_some() && book.get("texture").is_some());
        assert!(book.0.len() < half);
    }

    #[test]
    fn the_recipe_says_which_phrases_are_needed() {
        let learned = |phrase: &str, recipe: QueryConfig| {
            let mut asked = Vec::new();
            let mut encode = |p: &str| {
                asked.push(p.to_owned());
                if p == "bear" { Err("no") } else { Ok(vec![1.0]) }
            };
            let mut book = TextEmbeddings::default();
            book.learn(&parsed(phrase), &recipe, &mut encode).expect("only what was asked has to be understood");
            asked
        };
        let of = |strategy, rejection| QueryConfig { strategy, rejection, ..QueryConfig::default() };
        let canonical = PAPERS_PHRASES.map(str::to_owned);
        let plain = of(Strategy::OneStep, Rejection::Canonical);
        let with = |first: &[&str]| [first.iter().map(|p| (*p).to_owned()).collect(), canonical.to_vec()].concat();
        assert_eq!(learned("bear nose", plain.clone()), with(&["bear nose"]));
        let lerf = QueryConfig { canonical: "lerf".parse().expect("four"), ..plain.clone() };
        assert_eq!(learned("mug", lerf), ["mug", "object", "things", "stuff", "texture"]);
        let steps = learned("bear nose", of(Strategy::TwoSteps, Rejection::Canonical));
        assert_eq!(steps, [with(&["bear nose"]), vec!["bear".into()]].concat());
        assert_eq!(learned("nose of the bear mask", plain), with(&["nose of the bear mask", "bear mask"]));
        let colored = learned("lid of the red pot", of(Strategy::OneStep, Rejection::Strict));
        assert!(colored.contains(&"blue pot".into()) && !colored.iter().any(|p| p.starts_with("lid of the b")));
    }
}
