//! A query with its answer.

use super::OverlaySettings;
use crate::pipeline::semantics::answer::QueryAnswer;
use crate::pipeline::semantics::reading::QueryReading;
use crate::scene::IdentityId;

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
    /// The identities that are shown.
    pub(crate) fn shown(&self, settings: &OverlaySettings) -> Vec<IdentityId> {
        self.chosen.map_or_else(|| self.answered.chosen(settings.top), |id| vec![id])
    }
}
