//! Identities found by what they look like: relevancy of their language features for a phrase.

use std::collections::HashMap;

use rayon::prelude::*;

use super::localize::{Scorer, Strategy};
use super::relevancy::{CANONICAL, TEMPERATURE, advantage, score};
use crate::math::finite::{all_finite, insist};
use crate::scene::{LanguageFeatures, ViewFeatures};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum PartFeatures {
    /// Moved toward their whole's: the paper's semantic deviation.
    #[default]
    Deviated,
    Raw,
}

/// How scores are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmbeddingOptions {
    pub(crate) parts: PartFeatures,
    pub(crate) strategy: Strategy,
    /// Spread of the scores; the order does not depend on it.
    pub(crate) temperature: f32,
}

impl Default for EmbeddingOptions {
    fn default() -> Self {
        Self { parts: PartFeatures::Deviated, strategy: Strategy::Joint, temperature: TEMPERATURE }
    }
}

/// Embeddings of phrases, kept from query to query.
#[derive(Clone, Debug, Default)]
pub struct TextEmbeddings(HashMap<String, Vec<f32>>);

impl TextEmbeddings {
    /// Phrases that are kept at most.
    const MOST: usize = 4_096;

    /// Adds the embedding that `encode` makes of each phrase, and of the canonical ones, unless it is
    /// there already.
    pub fn learn<E>(&mut self, phrases: &[&str], mut encode: impl FnMut(&str) -> Result<Vec<f32>, E>) -> Result<(), E> {
        if self.0.len() > Self::MOST {
            self.0.clear();
        }
        for phrase in phrases.iter().chain(&CANONICAL) {
            if !self.0.contains_key(*phrase) {
                self.0.insert((*phrase).to_owned(), encode(phrase)?);
            }
        }
        Ok(())
    }

    pub(crate) fn get(&self, phrase: &str) -> Option<&[f32]> {
        self.0.get(phrase).map(Vec::as_slice)
    }
}

/// Score above which an identity is nearer to the query than to any canonical phrase.
pub(crate) const THRESHOLD: f32 = 0.5;

/// Difference of scores under which two identities fit alike: that of an advantage of 0.005.
pub(crate) fn resolution(temperature: f32) -> f32 {
    score(0.0025, temperature) - score(-0.0025, temperature)
}

/// Identities that one thread scores at least: less is not worth handing over.
const IDENTITIES_PER_TASK: usize = 32;

/// Scores by language features.
pub struct EmbeddingScorer<'a> {
    pub(crate) features: &'a LanguageFeatures,
    /// Embeddings of the phrases that will be asked for; others score nothing.
    pub(crate) phrases: &'a TextEmbeddings,
    pub(crate) options: EmbeddingOptions,
    known: Vec<(String, Option<String>, Vec<f32>)>,
}

impl<'a> EmbeddingScorer<'a> {
    /// Scores by these features and encoded phrases.
    pub fn new(features: &'a LanguageFeatures, phrases: &'a TextEmbeddings, options: EmbeddingOptions) -> Self {
        Self { features, phrases, options, known: Vec::new() }
    }

    /// Advantage of every identity, by number less one: that of its best view. Negative infinity
    /// without features.
    pub fn advantages(&self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        let query = self.phrases.get(phrase);
        let canonical: Vec<Vec<f32>> =
            CANONICAL.into_iter().chain(against).filter_map(|p| self.phrases.get(p)).map(<[f32]>::to_vec).collect();
        let best = |f: &ViewFeatures| {
            let views = if self.options.parts == PartFeatures::Raw { &f.raw } else { &f.deviated };
            let each = query.into_iter().flat_map(|q| views.iter().map(move |v| (v, q)));
            each.map(|(v, q)| advantage(v, q, &canonical)).fold(f32::NEG_INFINITY, f32::max)
        };
        self.features.by_identity.par_iter().with_min_len(IDENTITIES_PER_TASK).map(best).collect()
    }
}

impl Scorer for EmbeddingScorer<'_> {
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        if let Some(known) = self.known.iter().find(|k| k.0 == phrase && k.1.as_deref() == against) {
            return known.2.clone();
        }
        let advantages = self.advantages(phrase, against).into_iter();
        let scores: Vec<f32> = advantages.map(|d| score(d, self.options.temperature)).collect();
        insist(|| all_finite("relevancy", "score", &scores));
        self.known.push((phrase.to_owned(), against.map(str::to_owned), scores.clone()));
        scores
    }

    fn strategy(&self) -> Strategy {
        self.options.strategy
    }

    fn threshold(&self) -> f32 {
        THRESHOLD
    }

    fn resolution(&self) -> f32 {
        resolution(self.options.temperature)
    }
}

#[cfg(test)]
mod tests {
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
        let encode = |p: &str| {
            Ok::<_, ()>(match p {
                "lid" => vec![0.0, 1.0],
                "pot" => vec![1.0, 0.0],
                _ => vec![0.5, 0.5],
            })
        };
        book.learn(&["lid", "pot"], encode).expect("encodes");
        book
    }

    #[test]
    fn the_best_view_counts_and_features_can_be_chosen() {
        let (features, phrases) = (features(), book());
        let mut by = EmbeddingScorer::new(&features, &phrases, EmbeddingOptions::default());
        let d = by.advantages("lid", None);
        assert!((d[0] + 0.5).abs() < 1e-6 && (d[1] - 0.1).abs() < 1e-6 && d[2] == f32::NEG_INFINITY, "{d:?}");
        let s = by.scores("lid", None);
        assert!(s[0] < 0.5 && s[1] > 0.5 && s[2] == 0.0);
        // The whole's phrase is one more thing to be better than.
        assert!((by.advantages("lid", Some("pot"))[1] - 0.1).abs() < 1e-6);
        by.options.parts = PartFeatures::Raw;
        assert!((by.advantages("lid", None)[1] - 0.5).abs() < 1e-6);
        assert!(by.advantages("never learned", None).iter().all(|d| *d == f32::NEG_INFINITY));
    }

    #[test]
    fn phrases_are_encoded_once() {
        let mut book = TextEmbeddings::default();
        let mut calls = 0;
        for _ in 0..3 {
            book.learn(&["lid"], |_| {
                calls += 1;
                Ok::<_, ()>(vec![1.0])
            })
            .expect("encodes");
        }
        assert_eq!(calls, 1 + CANONICAL.len());
        assert_eq!(book.learn(&["pot"], |_| Err("no")), Err("no"));
        assert!(book.get("pot").is_none());
    }

    #[test]
    fn scores_are_kept_by_phrase_and_whole() {
        let (features, phrases) = (features(), book());
        let fresh = |phrase: &str, whole: Option<&str>| {
            EmbeddingScorer::new(&features, &phrases, EmbeddingOptions::default()).scores(phrase, whole)
        };
        let asked = [("lid", None), ("pot", None), ("lid", Some("pot")), ("pot", Some("lid")), ("lid", None)];
        let mut by = EmbeddingScorer::new(&features, &phrases, EmbeddingOptions::default());
        for (phrase, whole) in asked {
            assert_eq!(by.scores(phrase, whole), fresh(phrase, whole), "{phrase} {whole:?}");
        }
        assert_ne!(fresh("lid", None), fresh("pot", None));
        assert_ne!(fresh("pot", None), fresh("pot", Some("pot")));
        // The slope of the logistic curve at its middle is a quarter.
        assert!((resolution(TEMPERATURE) - 0.005 * TEMPERATURE / 4.0).abs() < 1e-5);
        assert_eq!((by.strategy(), by.threshold()), (Strategy::Joint, THRESHOLD));
        assert!((by.resolution() - resolution(TEMPERATURE)).abs() < 1e-9);
    }

    #[test]
    fn a_full_book_begins_anew() {
        let mut book = TextEmbeddings::default();
        let many: Vec<String> = (0..=TextEmbeddings::MOST).map(|i| i.to_string()).collect();
        let encode = |_: &str| Ok::<_, ()>(vec![1.0]);
        book.learn(&many.iter().map(String::as_str).collect::<Vec<_>>(), encode).expect("encodes");
        assert!(book.get("7").is_some());
        book.learn(&["lid"], encode).expect("encodes");
        assert!(book.get("7").is_none() && book.get("lid").is_some() && book.get("texture").is_some());
    }
}
