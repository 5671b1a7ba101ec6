//! A query with its answer.

use super::OverlaySettings;
use super::embeddings::Embeddings;
use crate::jobs::query::answer_encoded;
use crate::pipeline::semantics::query::answer::QueryAnswer;
use crate::pipeline::semantics::query::language::QueryPlace;
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
        place: &QueryPlace,
        settings: &OverlaySettings,
        embeddings: &Embeddings,
    ) -> Option<Self> {
        let text = text.trim();
        let OverlaySettings { kind, recipe, .. } = settings;
        let reading = QueryReading::new(&semantics.identities, text, recipe)?;
        let phrases = reading.phrases();
        let encoded: Vec<_> = phrases.iter().filter_map(|p| embeddings.of(p)).collect();
        let unread = encoded.first().map(|t| t.unknown.as_slice()).unwrap_or_default();
        let known = phrases.iter().find_map(|p| embeddings.phrases(p)).map(|phrases| (phrases, unread));
        let mut answered = answer_encoded(semantics, &reading, (*kind, place), recipe, known);
        answered.stages.encode = encoded.iter().map(|t| t.encode_ms).sum();
        let to_encoder = encoded.first().map(|t| t.unknown.as_slice());
        let unknown = names::unknown_to_all(&semantics.identities, &reading.phrase.text, to_encoder);
        let (ignored, unexplained) = (answered.ignored_words(&unknown), answered.unexplained(&reading, &unknown));
        let pending = semantics.language.is_some() && phrases.iter().any(|p| embeddings.is_pending(p));
        Some(Self { text: text.to_owned(), answered, pending, chosen: None, reading, unexplained, ignored })
    }

    /// Returns whether the answer depends on the view.
    pub(super) fn is_of_view(&self) -> bool {
        self.answered.understood.as_ref().is_some_and(|u| u.of_view)
    }

    /// The identities that are shown.
    pub(crate) fn shown(&self, settings: &OverlaySettings) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(settings.top), |id| vec![id])
    }
}
