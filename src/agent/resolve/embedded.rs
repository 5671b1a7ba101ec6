//! What no name says, asked of the scene's encoder.

use super::{Lost, Resolver, Set};
use crate::agent::refusal::RefusalKind;
use crate::pipeline::semantics::answer::Basis;
use crate::pipeline::semantics::localize::Answer;
use crate::scene::{IdentityId, LevelFilter};

impl Resolver<'_> {
    /// What the words mean to the scene's encoder.
    pub(super) fn embedded(&mut self, words: &[String]) -> Result<Set, Lost> {
        let text = words.join(" ");
        let found = self.by_embedding(&text, self.level)?;
        found.map(Set::new).ok_or_else(|| self.not_found(&text, words))
    }

    /// What the scene's encoder says, where it has one and that finds something.
    pub(super) fn by_embedding(&mut self, text: &str, kind: LevelFilter) -> Result<Option<Vec<IdentityId>>, Lost> {
        let found = self.world.locate(text, kind).map_err(|e| Lost::new(RefusalKind::Failed, e.0, Vec::new()))?;
        let ids = match (&found.basis, &found.answer) {
            (Basis::Embedding, Answer::Found(_)) => found.chosen(1),
            (Basis::Embedding, Answer::Ambiguous(_)) => found.chosen(2),
            _ => Vec::new(),
        };
        let ids: Vec<IdentityId> = ids.into_iter().filter(|id| self.world.facts(*id).is_some()).take(12).collect();
        if ids.is_empty() {
            return Ok(None);
        }
        self.note = "(Found by embedding, not by name.)".into();
        Ok(Some(ids))
    }
}
