//! One query, answered: by names where the scene's names know the words, else by meaning.

use std::time::Instant;

use rayon::prelude::*;

use super::by_embedding::{EmbeddingOptions, EmbeddingScorer, TextEmbeddings};
use super::localize::{Answer, Scorer, Strategy, localize};
use super::names::{self, ByName};
use super::parse::ParsedQuery;
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
}

/// Features and encoded phrases for answers by meaning.
#[derive(Clone, Copy)]
pub(crate) struct Language<'a> {
    pub(crate) features: &'a LanguageFeatures,
    /// With the query's phrases learned; see [`phrases_of`].
    pub(crate) phrases: &'a TextEmbeddings,
    pub(crate) options: EmbeddingOptions,
}

/// The phrases of a query that answers by meaning need: all of it, and the whole's.
pub(crate) fn phrases_of(phrase: &ParsedQuery) -> Vec<&str> {
    std::iter::once(phrase.text.as_str()).chain(phrase.whole.as_deref()).collect()
}

/// Answers by names where all words are known, else by meaning where that finds something.
pub(crate) fn answer(
    identities: &Identities,
    phrase: &ParsedQuery,
    level: LevelFilter,
    language: Option<Language<'_>>,
) -> QueryAnswer {
    let named = by_name(identities, phrase, level);
    let Some(language) = language else { return named };
    let known = names::unknown_words(identities, &phrase.text).is_empty();
    if known && !matches!(named.answer, Answer::NotFound(_)) {
        return named;
    }
    let meant = by_embedding(identities, phrase, level, language);
    // Both were looked at, whichever is taken.
    let stages = named.stages.and(meant.stages);
    let nothing = |a: &Answer| matches!(a, Answer::NotFound(_));
    let taken = if nothing(&meant.answer) && !nothing(&named.answer) { named } else { meant };
    QueryAnswer { stages, ..taken }
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

    fn strategy(&self) -> Strategy {
        self.scorer.strategy()
    }

    fn threshold(&self) -> f32 {
        self.scorer.threshold()
    }

    fn resolution(&self) -> f32 {
        self.scorer.resolution()
    }
}

/// Localizes by `scorer`, then makes the relevancy of every identity by `relevancy`.
fn judged<S: Scorer>(
    (identities, phrase, level): (&Identities, &ParsedQuery, LevelFilter),
    basis: Basis,
    scorer: &mut S,
    relevancy: impl FnOnce(&Answer, &mut S) -> Vec<f32>,
) -> QueryAnswer {
    let start = Instant::now();
    let mut timed = Timed { scorer, ms: 0.0 };
    let answer = localize(identities, phrase, level, &mut timed);
    let (scored_ms, localized_ms) = (timed.ms, ms_since(start));
    let relevancy = relevancy(&answer, scorer);
    let stages = StagesMs {
        relevancy: scored_ms + ms_since(start) - localized_ms,
        localize: localized_ms - scored_ms,
        ..StagesMs::default()
    };
    QueryAnswer { answer, basis, relevancy, stages }
}

pub(crate) fn by_name(identities: &Identities, phrase: &ParsedQuery, level: LevelFilter) -> QueryAnswer {
    judged((identities, phrase, level), Basis::Names, &mut ByName(identities), |answer, _| {
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
    language: Language<'_>,
) -> QueryAnswer {
    let Language { features, phrases, options } = language;
    let mut scorer = EmbeddingScorer::new(features, phrases, options);
    judged((identities, phrase, level), Basis::Embedding, &mut scorer, |_, scorer| {
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
        phrase: &ParsedQuery,
        unknown: &[String],
    ) -> Vec<String> {
        match (&self.answer, self.basis) {
            (Answer::NotFound(_), _) => Vec::new(),
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
            (Answer::Found(_), Some(first), Basis::Embedding)
                if ignored.is_empty() && first.score >= LIKELY.0 && first.margin >= LIKELY.1 =>
            {
                Certainty::Likely
            }
            _ => Certainty::Guess,
        }
    }

    /// Score from which an identity is what was asked for.
    pub(crate) fn threshold(&self) -> f32 {
        match self.basis {
            Basis::Names => names::THRESHOLD,
            Basis::Embedding => super::by_embedding::THRESHOLD,
        }
    }

    fn resolution(&self) -> f32 {
        match self.basis {
            Basis::Names => names::RESOLUTION,
            Basis::Embedding => super::by_embedding::resolution(super::relevancy::TEMPERATURE),
        }
    }

    /// The pixels of what is meant, in a view.
    pub(crate) fn mask(&self, map: &ViewMap, identities: &Identities, top: usize) -> Mask {
        let mut mask = Mask::empty(map.width_px, map.height_px);
        self.chosen(top).into_iter().for_each(|id| mask.add(&map.mask(identities, id)));
        mask
    }

    /// Relevancy of every pixel of a view, row-major, 0 to 1.
    pub(crate) fn heat(&self, map: &ViewMap) -> Vec<f32> {
        // One more entry for numbers that nobody has.
        let mut table = self.relevancy.clone();
        table.push(0.0);
        let last = table.len() - 1;
        map.identity.par_iter().with_min_len(1 << 16).map(|id| table[(*id as usize).min(last)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::localize::Hit;
    use super::*;
    use crate::scene::{Level, NOBODY, ViewFeatures};

    fn scene() -> (Identities, LanguageFeatures) {
        let mut all = Identities::default();
        let lamp = all.add(Level::Object, NOBODY, vec!["lamp".into()]);
        all.add(Level::Part, lamp, vec!["shade".into()]);
        all.add(Level::Object, NOBODY, vec!["mug".into()]);
        let f = |v: [f32; 3]| ViewFeatures { raw: vec![v.to_vec()], deviated: vec![v.to_vec()] };
        let of = vec![f([0.0, 1.0, 0.0]), f([0.0, 0.8, 0.6]), f([1.0, 0.0, 0.0])];
        (all, LanguageFeatures { encoder: "test".into(), dimension: 3, by_identity: of })
    }

    fn ask(text: &str, with_meaning: bool) -> QueryAnswer {
        let (all, features) = scene();
        let phrase = ParsedQuery::parse(text).expect("a phrase");
        let mut phrases = TextEmbeddings::default();
        let encode = |p: &str| {
            Ok::<_, ()>(match p {
                "cup" => vec![1.0, 0.0, 0.0],
                "giraffe" => vec![0.0, 0.0, -1.0],
                _ => vec![0.5, 0.5, 0.5],
            })
        };
        phrases.learn(&phrases_of(&phrase), encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, options: EmbeddingOptions::default() };
        answer(&all, &phrase, LevelFilter::Auto, with_meaning.then_some(language))
    }

    #[test]
    fn names_come_first_and_meaning_where_they_fail() {
        let a = ask("the lamp's shade", true);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![2]));
        assert!(a.relevancy[2] > a.relevancy[1] && a.relevancy[3] == 0.0);
        let a = ask("a shade on the lamp", true);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![2]), "words between names are nothing unknown");
        let a = ask("cup", true);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Embedding, vec![3]));
        assert!(a.relevancy[3] > 0.9 && a.relevancy[1] < 0.5);
        assert!(ask("cup", false).chosen(1).is_empty());
        assert!(ask("giraffe", true).chosen(3).is_empty());
        let stages = a.stages;
        assert!(stages.relevancy >= 0.0 && stages.localize >= 0.0, "{stages:?}");
        assert_eq!(stages.whole(), stages.relevancy + stages.localize, "nothing else happens here");
        let a = ask("lamp", true);
        assert_eq!(a.chosen(2), [1], "only what fits");
        let map = ViewMap::certain(3, vec![1, 2, 3]);
        let (all, _) = scene();
        assert_eq!(a.mask(&map, &all, 1).area(), 2, "a piece belongs to its whole");
        assert_eq!(a.heat(&map)[2], 0.0);
    }

    #[test]
    fn meaning_comes_first_where_a_word_is_unknown_and_names_where_it_finds_nothing() {
        let (all, features) = scene();
        let ask = |text: &str, to: [f32; 3]| {
            let phrase = ParsedQuery::parse(text).expect("a phrase");
            let mut phrases = TextEmbeddings::default();
            let encode = |p: &str| Ok::<_, ()>(if p == text { to.to_vec() } else { vec![0.5, 0.5, 0.5] });
            phrases.learn(&phrases_of(&phrase), encode).expect("encodes");
            let language = Language { features: &features, phrases: &phrases, options: EmbeddingOptions::default() };
            answer(&all, &phrase, LevelFilter::Auto, Some(language))
        };
        let a = ask("beige lamp", [1.0, 0.0, 0.0]);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Embedding, vec![3]), "by name it would be the lamp");
        let a = ask("beige lamp", [0.0, 0.0, -1.0]);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![1]));
        let a = ask("mug", [0.0, 1.0, 0.0]);
        assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![3]), "a known name is not asked of the encoder");
        assert_eq!((a.threshold(), ask("cup", [1.0, 0.0, 0.0]).threshold()), (names::THRESHOLD, 0.5));
    }

    #[test]
    fn an_answer_is_as_sure_as_it_rests_on_names() {
        let sure = |text: &str| {
            let (all, _) = scene();
            let phrase = ParsedQuery::parse(text).expect("a phrase");
            let answered = ask(text, true);
            let ignored = answered.ignored_words(&all, &phrase, &["beige".to_owned()]);
            (answered.certainty(&ignored), ignored)
        };
        assert_eq!(sure("the lamp's shade"), (Certainty::Certain, vec![]));
        assert_eq!(sure("lamp mug shade").0, Certainty::Guess, "not all of it is explained");
        assert_eq!(sure("cup"), (Certainty::Guess, vec!["beige".into()]), "by looks, with a word left out");
        let mut looks = ask("cup", true);
        assert_eq!(looks.certainty(&[]), Certainty::Likely);
        looks.answer = Answer::Found(vec![Hit { identity: 3, score: 0.9, margin: 0.01 }]);
        assert_eq!(looks.certainty(&[]), Certainty::Guess, "another fits nearly as well");
        assert_eq!(ask("giraffe", true).certainty(&[]), Certainty::Guess);
    }

    #[test]
    fn those_that_fit_alike_are_all_chosen_and_top_is_a_limit() {
        let answered = |answer: fn(Vec<Hit>) -> Answer, scores: &[f32]| QueryAnswer {
            answer: answer(
                scores
                    .iter()
                    .enumerate()
                    .map(|(i, s)| Hit { identity: i as IdentityId + 1, score: *s, margin: 0.0 })
                    .collect(),
            ),
            basis: Basis::Names,
            relevancy: vec![0.0, 0.25, 0.5],
            stages: StagesMs::default(),
        };
        let hits = [0.9, 0.89, 0.6, 0.3];
        assert_eq!(answered(Answer::Ambiguous, &hits).chosen(1), [1, 2], "0.01 apart, under 0.02");
        assert_eq!(answered(Answer::Ambiguous, &hits).chosen(3), [1, 2, 3]);
        assert_eq!(answered(Answer::Found, &hits).chosen(0), [1]);
        assert_eq!(answered(Answer::Found, &hits).chosen(9), [1, 2, 3], "0.3 is under the threshold");
        assert_eq!(answered(Answer::Found, &[0.45]).chosen(1), [1], "on it is enough");
        assert!(answered(Answer::NotFound, &hits).chosen(9).is_empty());
        let view = ViewMap { width_px: 4, height_px: 1, identity: vec![0, 2, 1, 77], share: vec![], alpha: vec![] };
        assert_eq!(answered(Answer::Found, &hits).heat(&view), [0.0, 0.5, 0.25, 0.0]);
    }
}
