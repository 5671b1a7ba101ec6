//! Queries to a scene: from a typed text to an answer, with the encoder of the scene's identities, if there is one,
//! and the phrases that it has encoded.

use std::time::Instant;

use super::answer::{Language, QueryAnswer, answer, by_embedding};
use super::by_embedding::TextEmbeddings;
use super::language::QueryPlace;
use super::names;
use super::parse::ParsedQuery;
use super::reading::QueryReading;
use super::recipe::{MatchBy, QueryConfig};
use super::timing::{StagesMs, ms_since};
use crate::models::{self, Encoder, ModelError, TextSource};
use crate::scene::{Identities, LanguageFeatures, LevelFilter, SemanticMap};

/// Answers questions about a scene; without an encoder, by names alone.
#[derive(Default)]
pub(crate) struct QueryEngine {
    encoder: Option<Box<dyn Encoder>>,
    phrases: TextEmbeddings,
    recipe: QueryConfig,
    /// Place from which the scene is asked.
    pub(crate) place: QueryPlace,
}

impl QueryEngine {
    /// Opens the encoder of the scene's identities, if there is one.
    pub(crate) fn new(language: Option<&LanguageFeatures>, recipe: QueryConfig) -> Result<Self, ModelError> {
        let language = language.filter(|_| recipe.match_by != MatchBy::Names);
        let encoder = language.map(|language| models::encoder(&language.encoder)).transpose()?;
        Ok(Self { encoder, recipe, ..Self::default() })
    }

    /// Answers a question; `None` if there is nothing in it.
    pub(crate) fn ask(
        &mut self,
        map: &SemanticMap,
        text: &str,
        level: LevelFilter,
    ) -> Result<Option<QueryAnswer>, ModelError> {
        let reading = self.read(&map.identities, text);
        reading.map(|reading| self.answer(map, &reading, level)).transpose()
    }

    /// Answers by this recipe from now on, with the same encoder.
    pub(crate) fn answer_by(&mut self, recipe: QueryConfig) {
        self.recipe = recipe;
    }

    /// Returns the canonical phrases of the recipe that the encoder could not read.
    pub(crate) fn unread(&self) -> Vec<String> {
        let missing = |p: &&str| self.phrases.is_unreadable(p);
        self.recipe.canonical.iter().filter(missing).map(str::to_owned).collect()
    }

    /// Reads a question; `None` if there is nothing in it.
    pub(crate) fn read(&self, identities: &Identities, text: &str) -> Option<QueryReading> {
        QueryReading::new(identities, text, &self.recipe)
    }

    /// Answers a question that was read before.
    ///
    /// # Errors
    /// If the encoder fails.
    pub(crate) fn answer(
        &mut self,
        map: &SemanticMap,
        reading: &QueryReading,
        level: LevelFilter,
    ) -> Result<QueryAnswer, ModelError> {
        let start = Instant::now();
        let wanted = self.recipe.match_by != MatchBy::Names;
        let mut known = false;
        for phrase in reading.phrases() {
            let Some(encoder) = self.encoder.as_mut().filter(|_| wanted) else { break };
            match self.phrases.learn(&phrase, &self.recipe, &mut **encoder) {
                Ok(()) => known = true,
                // Words that the encoder does not know are no failure: names may know them.
                Err(ModelError::NoKnownWord { .. }) => {}
                Err(other) => return Err(other),
            }
        }
        let encode = ms_since(start);
        let unknown = self.encoder.as_ref().map(|e| e.unknown_words(&reading.phrase.text)).unwrap_or_default();
        let encoded = known.then_some((&self.phrases, unknown.as_slice()));
        let answered = answer_encoded(map, reading, (level, &self.place), &self.recipe, encoded);
        Ok(QueryAnswer { stages: StagesMs { encode, ..answered.stages }, ..answered })
    }

    /// Returns the words of a question that nothing here knows.
    pub(crate) fn unknown_words(&self, identities: &Identities, phrase: &ParsedQuery) -> Vec<String> {
        let to_encoder = self.encoder.as_ref().map(|e| e.unknown_words(&phrase.text));
        names::unknown_to_all(identities, &phrase.text, to_encoder.as_deref())
    }

    /// Returns the words that an answer ignored, and those that prevented an answer.
    pub(crate) fn left_out(
        &self,
        identities: &Identities,
        reading: &QueryReading,
        answered: &QueryAnswer,
    ) -> (Vec<String>, Vec<String>) {
        let unknown = self.unknown_words(identities, &reading.phrase);
        (answered.ignored_words(&unknown), answered.unexplained(reading, &unknown))
    }
}

/// Answers a question by its `encoded` phrases and the words of it that the encoder does not know, or by names alone
/// without them.
pub(crate) fn answer_encoded(
    map: &SemanticMap,
    reading: &QueryReading,
    from: (LevelFilter, &QueryPlace),
    recipe: &QueryConfig,
    encoded: Option<(&TextEmbeddings, &[String])>,
) -> QueryAnswer {
    let with = |(features, (phrases, unknown))| Language { features, phrases, unknown };
    let language = map.language.as_ref().zip(encoded).map(with);
    answer(&map.identities, reading, from, recipe, language)
}

/// Answers a question by names and these `features`, as the recipe says; `None` if there is nothing in it. `source`
/// encodes phrases; if it cannot encode the question's, names alone answer.
pub(crate) fn ask_with<S: TextSource + ?Sized>(
    identities: &Identities,
    (features, recipe): (&LanguageFeatures, &QueryConfig),
    text: &str,
    from: (LevelFilter, &QueryPlace),
    source: &mut S,
) -> Option<QueryAnswer> {
    let reading = QueryReading::new(identities, text, recipe)?;
    let mut phrases = TextEmbeddings::default();
    let learned: Vec<bool> = reading.phrases().iter().map(|p| phrases.learn(p, recipe, source).is_ok()).collect();
    let language = learned.contains(&true).then_some(Language { features, phrases: &phrases, unknown: &[] });
    Some(answer(identities, &reading, from, recipe, language))
}

/// Answers a question by names alone; `None` if there is nothing in it.
pub(crate) fn ask_by_name(
    identities: &Identities,
    text: &str,
    from: (LevelFilter, &QueryPlace),
    recipe: &QueryConfig,
) -> Option<QueryAnswer> {
    let reading = QueryReading::new(identities, text, recipe)?;
    Some(answer_by_name(identities, &reading, from, recipe))
}

/// Answers a question that was read before, by names alone.
pub(crate) fn answer_by_name(
    identities: &Identities,
    reading: &QueryReading,
    from: (LevelFilter, &QueryPlace),
    recipe: &QueryConfig,
) -> QueryAnswer {
    answer(identities, reading, from, recipe, None)
}

/// Answers a question by these `features` alone, without regard to names; `None` if there is nothing in it. `source`
/// encodes phrases, and `phrases` keeps their embeddings.
pub(crate) fn ask_by_embedding<S: TextSource + ?Sized>(
    identities: &Identities,
    (features, recipe): (&LanguageFeatures, &QueryConfig),
    text: &str,
    phrases: &mut TextEmbeddings,
    source: &mut S,
) -> Result<Option<QueryAnswer>, S::Error> {
    let start = Instant::now();
    let Some(phrase) = ParsedQuery::parse(text) else { return Ok(None) };
    phrases.learn(&phrase, recipe, source)?;
    let encode = ms_since(start);
    let language = Language { features, phrases, unknown: &[] };
    let mut answered = by_embedding(identities, &phrase, LevelFilter::Auto, recipe, language);
    answered.stages.encode = encode;
    Ok(Some(answered))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::IdentityCrop;
    use crate::pipeline::semantics::query::answer::Basis;
    use crate::scene::{Level, NO_IDENTITY, ViewFeatures};

    /// Knows "red" and the canonical phrases; fails as a damaged network does on "broken".
    struct Small;

    impl Encoder for Small {
        fn name(&self) -> &str {
            "small"
        }

        fn dimension(&self) -> usize {
            2
        }

        fn tile_side_px(&self) -> Option<usize> {
            None
        }

        fn images(&mut self, _: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError> {
            Ok(Vec::new())
        }

        fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
            let one = |phrase: &&str| match *phrase {
                "red" => Ok(vec![1.0, 0.0]),
                "giraffe" => Err(ModelError::NoKnownWord { unknown: vec!["giraffe".into()] }),
                "broken" => Err(ModelError::Run { model: "text.onnx".into(), problem: "out of memory".into() }),
                _ => Ok(vec![0.0, 1.0]),
            };
            phrases.iter().map(one).collect()
        }

        fn unknown_words(&self, phrase: &str) -> Vec<String> {
            phrase.split(' ').filter(|w| *w == "giraffe").map(str::to_owned).collect()
        }
    }

    #[test]
    fn words_that_nobody_knows_are_no_failure_and_a_broken_encoder_is() {
        let mut map = SemanticMap::default();
        map.identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        let red = ViewFeatures { raw: vec![vec![1.0, 0.0]], deviated: vec![vec![1.0, 0.0]] };
        map.language = Some(LanguageFeatures { encoder: "small".into(), dimension: 2, by_identity: vec![red] });
        let mut engine = QueryEngine { encoder: Some(Box::new(Small)), ..QueryEngine::default() };
        let mut ask = |text: &str| engine.ask(&map, text, LevelFilter::Auto);
        let answered = ask("red").expect("encodes").expect("words");
        assert_eq!((answered.basis, answered.chosen(1)), (Basis::Embedding, vec![1]));
        assert!(ask("giraffe").expect("no failure").expect("words").chosen(1).is_empty());
        assert!(matches!(ask("broken"), Err(ModelError::Run { .. })));
        assert!(ask("  ").expect("no failure").is_none());
        let phrase = ParsedQuery::parse("lamp giraffe").expect("words");
        assert_eq!(engine.unknown_words(&map.identities, &phrase), ["giraffe"]);
        // Without an encoder, by names alone.
        let mut names = QueryEngine::default();
        assert!(names.ask(&map, "red", LevelFilter::Auto).expect("no encoder").expect("words").chosen(1).is_empty());
        assert_eq!(names.ask(&map, "lamp", LevelFilter::Auto).expect("names").expect("words").chosen(1), [1]);
    }
}
