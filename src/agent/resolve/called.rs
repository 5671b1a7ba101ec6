//! Lookup of identities by a complete name, whatever words it consists of.

use super::{Resolver, Set, name_words};
use crate::pipeline::semantics::recipe::Understanding;
use crate::scene::IdentityId;

impl Resolver<'_> {
    /// Candidates by a complete name. The matches of [`Self::named`] for its words are candidates, too.
    pub(super) fn called(&mut self, name: &str) -> Option<Set> {
        if self.world.understanding() == Understanding::Embedding {
            return None;
        }
        let all = self.world.identities();
        let mut exact = all.called(name, self.level);
        exact.retain(|id| self.world.facts(*id).is_some());
        let words = name_words(name);
        let is_own = |id: &IdentityId| all.get(*id).is_some_and(|i| i.names.iter().any(|n| name_words(n) == words));
        let is_any_own = exact.first().map(|_| exact.iter().any(is_own))?;
        let mut ids =
            if is_any_own { self.named(&words).map_or_else(|_| Vec::new(), |set| set.ids) } else { Vec::new() };
        ids.extend(exact.iter().copied().filter(|id| !ids.contains(id)).collect::<Vec<_>>());
        Some(Set { ids, exact })
    }
}
