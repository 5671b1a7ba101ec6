//! A query with its answer.

use super::OverlaySettings;
use super::embeddings::Embeddings;
use crate::jobs::query::answer_encoded;
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::names;
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::scene::{IdentityId, SemanticMap};

/// A query with its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// The text as typed.
    pub(crate) text: String,
    /// Answer to the query.
    pub answered: QueryAnswer,
    /// True if the text encoder has yet to read it: only names have been searched so far.
    pub pending: bool,
    /// Hit chosen by the user; otherwise the best are shown.
    pub(super) chosen: Option<IdentityId>,
    /// Interpretation of the text.
    pub(super) reading: QueryReading,
    /// Unknown words that prevented an answer.
    pub(super) unexplained: Vec<String>,
    /// Words that the answer ignores.
    pub(super) ignored: Vec<String>,
}

impl Asked {
    /// Answers a text with the embeddings known so far; `None` without a query in it.
    pub(super) fn new(
        text: &str,
        semantics: &SemanticMap,
        settings: &OverlaySettings,
        embeddings: &Embeddings,
    ) -> Option<Self> {
        let text = text.trim();
        let OverlaySettings { kind, recipe, .. } = settings;
        let reading = QueryReading::new(&semantics.identities, text, *kind, recipe)?;
        let phrase = &reading.phrase;
        let encoded = embeddings.of(phrase);
        let unread = encoded.map(|t| t.unknown.as_slice()).unwrap_or_default();
        let phrases = embeddings.phrases(phrase).map(|phrases| (phrases, unread));
        let mut answered = answer_encoded(semantics, &reading, *kind, recipe, phrases);
        answered.stages.encode = encoded.map_or(0.0, |t| t.encode_ms);
        let to_encoder = encoded.map(|t| t.unknown.as_slice());
        let unknown = names::unknown_to_all(&semantics.identities, &phrase.text, to_encoder);
        let ignored = answered.ignored_words(&semantics.identities, &reading, &unknown);
        let unexplained = answered.unexplained(&semantics.identities, &reading, &unknown);
        let pending = semantics.language.is_some() && embeddings.is_pending(phrase);
        Some(Self { text: text.to_owned(), answered, pending, chosen: None, reading, unexplained, ignored })
    }

    /// The identities that are shown.
    pub(crate) fn shown(&self, settings: &OverlaySettings) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(settings.top), |id| vec![id])
    }
}
