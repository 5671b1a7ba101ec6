//! Lookup of identities by embedding, for phrases that no name matches.

use super::{Resolver, Unresolved};
use crate::agent::describe::names;
use crate::agent::refusal::RefusalKind;
use crate::pipeline::semantics::query::answer::{Basis, QueryAnswer};
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::recipe::MatchBy;
use crate::scene::{IdentityId, LevelFilter};

/// Number of things that are offered.
const OFFERED: usize = 3;

/// Candidates by embedding; `None` if there are none or the encoder may not be used.
pub(super) fn candidates(
    resolver: &mut Resolver<'_>,
    text: &str,
    kind: LevelFilter,
) -> Result<Option<Vec<IdentityId>>, Unresolved> {
    if !resolver.may_look {
        return Ok(None);
    }
    let found = located(resolver, text, kind)?;
    let ids = match (&found.basis, &found.answer) {
        (Basis::Embedding, Answer::Found(_)) => found.chosen(1),
        (Basis::Embedding, Answer::Ambiguous(_)) => found.chosen(2),
        _ => Vec::new(),
    };
    let ids: Vec<IdentityId> = ids.into_iter().filter(|id| resolver.world.facts(*id).is_some()).take(12).collect();
    resolver.looked |= !ids.is_empty();
    Ok(Some(ids).filter(|ids| !ids.is_empty()))
}

/// Adds the best matches by embedding to a refusal.
pub(super) fn with_offers(resolver: &mut Resolver<'_>, mut unresolved: Unresolved, phrase: &str) -> Unresolved {
    if !unresolved.is_open || resolver.world.match_by() == MatchBy::Names {
        return unresolved;
    }
    let level = resolver.level;
    let Ok(found) = located(resolver, phrase, level) else { return unresolved };
    let [_, offered] = found.offers(OFFERED);
    let answered = if found.basis == Basis::Embedding { found.chosen(1) } else { Vec::new() };
    let alike: Vec<IdentityId> =
        offered.into_iter().chain(answered).filter(|id| resolver.world.facts(*id).is_some()).collect();
    if !alike.is_empty() {
        unresolved.refusal.text += &format!(" Looks most like: {}.", names(resolver.world, &alike, OFFERED));
        unresolved.near.extend(alike.into_iter().filter(|id| !unresolved.near.contains(id)).collect::<Vec<_>>());
    }
    unresolved
}

fn located(resolver: &mut Resolver<'_>, text: &str, kind: LevelFilter) -> Result<QueryAnswer, Unresolved> {
    resolver.world.locate(text, kind).map_err(|e| Unresolved::new(RefusalKind::Failed, e.0, Vec::new()))
}
