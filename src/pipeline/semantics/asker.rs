//! Asks a scene: the encoder that looked at its identities, if one has, and the phrases that it has
//! read so far.

use std::time::Instant;

use super::answer::{Answered, Language, answer, phrases_of};
use super::grammar::{Kind, Phrase};
use super::meaning::{MeaningOptions, Phrasebook};
use super::names;
use super::stages::ms_since;
use crate::models::{self, Encoder, ModelError};
use crate::scene::{Identities, LanguageFeatures, SemanticMap};

/// What answers questions about a scene.
#[derive(Default)]
pub struct Asker {
    encoder: Option<Box<dyn Encoder>>,
    phrases: Phrasebook,
    /// How answers by meaning are scored.
    pub options: MeaningOptions,
}

impl Asker {
    /// With the encoder that looked at the scene's identities, if one has.
    ///
    /// # Errors
    /// If it cannot be loaded.
    pub fn new(language: Option<&LanguageFeatures>) -> Result<Self, ModelError> {
        let encoder = match language {
            Some(language) => Some(models::encoder(&language.encoder)?),
            None => None,
        };
        Ok(Self { encoder, ..Self::default() })
    }

    /// Answers a question; `None` if there is nothing in it.
    ///
    /// # Errors
    /// If the encoder fails.
    pub fn ask(&mut self, map: &SemanticMap, text: &str, kind: Kind) -> Result<Option<Answered>, ModelError> {
        let start = Instant::now();
        let Some(phrase) = Phrase::parse(text) else { return Ok(None) };
        let known = match &mut self.encoder {
            Some(encoder) => match self.phrases.learn(&phrases_of(&phrase), |p| encoder.text(p)) {
                Ok(()) => true,
                // Words that nobody knows are no failure: names may know them.
                Err(ModelError::NoKnownWord { .. }) => false,
                Err(other) => return Err(other),
            },
            None => false,
        };
        let encode = ms_since(start);
        let language = map.language.as_ref().filter(|_| known);
        let language = language.map(|features| Language { features, phrases: &self.phrases, options: self.options });
        let mut answered = answer(&map.identities, &phrase, kind, language);
        answered.stages.encode = encode;
        Ok(Some(answered))
    }

    /// The words of a question that nothing here knows.
    pub fn unknown_words(&self, identities: &Identities, text: &str) -> Vec<String> {
        let to_encoder = self.encoder.as_ref().map(|e| e.unknown_words(text));
        names::unknown_to_all(identities, text, to_encoder.as_deref())
    }
}
