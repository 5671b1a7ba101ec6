//! Asking a scene from the command line: its map, its view, and an encoder if it has features for one.

use std::path::Path;

use super::CliError;
use crate::io;
use crate::models::{self, Encoder, ModelError};
use crate::pipeline::semantics::answer::{Answered, Language, answer, phrases_of};
use crate::pipeline::semantics::grammar::{Kind, Phrase};
use crate::pipeline::semantics::meaning::{MeaningOptions, Phrasebook};
use crate::pipeline::semantics::names;
use crate::scene::{GaussianCloud, SemanticMap};

/// The objects of the scene in the folder `scene`, whose Gaussians are `cloud`.
pub fn semantics(scene: &Path, cloud: &GaussianCloud) -> Result<SemanticMap, CliError> {
    io::semantic_map::load(scene, cloud)?.ok_or_else(|| {
        let path = scene.display();
        CliError::failed(format!("{path} knows no objects yet; find them with 'fmlgs preprocess {path}'"))
    })
}

/// What answers questions about a scene.
pub struct Asker<'a> {
    map: &'a SemanticMap,
    encoder: Option<Box<dyn Encoder>>,
    phrases: Phrasebook,
    /// How answers by meaning are scored.
    pub options: MeaningOptions,
}

impl<'a> Asker<'a> {
    /// With the encoder that looked at the scene's identities, if one has.
    pub fn new(map: &'a SemanticMap) -> Result<Self, CliError> {
        let encoder = match &map.language {
            Some(language) => Some(models::encoder(&language.encoder)?),
            None => None,
        };
        Ok(Self { map, encoder, phrases: Phrasebook::default(), options: MeaningOptions::default() })
    }

    /// Answers a question; `None` if there is nothing in it.
    pub fn ask(&mut self, text: &str, kind: Kind) -> Result<Option<Answered>, CliError> {
        let Some(phrase) = Phrase::parse(text) else { return Ok(None) };
        let known = match &mut self.encoder {
            Some(encoder) => match self.phrases.learn(&phrases_of(&phrase), |p| encoder.text(p)) {
                Ok(()) => true,
                // Words that nobody knows are no failure: names may know them.
                Err(ModelError::NoKnownWord { .. }) => false,
                Err(other) => return Err(other.into()),
            },
            None => false,
        };
        let language = self.map.language.as_ref().filter(|_| known);
        let language = language.map(|features| Language { features, phrases: &self.phrases, options: self.options });
        Ok(Some(answer(&self.map.identities, &phrase, kind, language)))
    }

    /// The words of a question that nothing here knows.
    pub fn unknown_words(&self, text: &str) -> Vec<String> {
        let to_encoder = self.encoder.as_ref().map(|e| e.unknown_words(text));
        names::unknown_to_all(&self.map.identities, text, to_encoder.as_deref())
    }
}
