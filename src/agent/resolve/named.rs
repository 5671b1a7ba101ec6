//! Lookup of identities by a complete name or by words of their names, and the refusal if none matches.

use super::noun::{ANYTHING, PARTS};
use super::{Candidates, Resolver, Unresolved, embedded, name_words};
use crate::agent::describe::join;
use crate::agent::refusal::RefusalKind;
use crate::agent::words::{alike, singular};
use crate::jobs::query::color_of;
use crate::pipeline::semantics::query::recipe::MatchBy;
use crate::scene::colors::row;
use crate::scene::{Identity, IdentityId, Level};

/// Candidates by a complete name, whatever words it consists of. The matches of [`by_words`] are candidates, too.
pub(super) fn called(resolver: &mut Resolver<'_>, name: &str) -> Option<Candidates> {
    if resolver.world.match_by() == MatchBy::Embedding {
        return None;
    }
    let all = resolver.world.identities();
    let mut exact = all.called(name, resolver.level);
    exact.retain(|id| resolver.world.facts(*id).is_some());
    let words = name_words(name);
    let is_own = |id: &IdentityId| all.get(*id).is_some_and(|i| i.names.iter().any(|n| name_words(n) == words));
    let is_any_own = exact.first().map(|_| exact.iter().any(is_own))?;
    let mut ids =
        if is_any_own { by_words(resolver, &words).map_or_else(|_| Vec::new(), |set| set.ids) } else { Vec::new() };
    ids.extend(exact.iter().copied().filter(|id| !ids.contains(id)).collect::<Vec<_>>());
    Some(Candidates { ids, exact })
}

/// Candidates by the words of their names: all words are in the names of a thing and its ancestors, the last one in
/// its own. Typing errors are not corrected here.
pub(super) fn by_words(resolver: &mut Resolver<'_>, words: &[String]) -> Result<Candidates, Unresolved> {
    let all = resolver.world.identities();
    let wished = all.iter().filter(|(_, i)| resolver.level.accepts(i.level)).map(|(id, _)| id);
    let everyone: Vec<IdentityId> = wished.filter(|id| resolver.world.facts(*id).is_some()).collect();
    let Some((head, rest)) = words.split_last() else { return Err(not_found(resolver, "that", &[])) };
    if resolver.world.match_by() == MatchBy::Embedding {
        return by_embedding(resolver, words);
    }
    let own = |id: IdentityId| all.get(id).map(|i| i.names.as_slice()).unwrap_or_default();
    let line_has = |id: IdentityId, word: &String| {
        all.ancestors(id).any(|i| own(i).iter().any(|name| name_words(name).contains(word)))
    };
    let is_object = |id: &IdentityId| all.object_of(*id) == *id;
    let generic = match head.as_str() {
        "one" => Some(kin(resolver)),
        word if ANYTHING.contains(&word) => Some(everyone.iter().copied().filter(is_object).collect()),
        word if PARTS.contains(&word) => Some(everyone.iter().copied().filter(|id| !is_object(id)).collect()),
        _ => None,
    };
    if let Some(ids) = generic {
        let fit: Vec<IdentityId> = ids.into_iter().filter(|id| rest.iter().all(|w| line_has(*id, w))).collect();
        return if fit.is_empty() {
            Err(not_found(resolver, &words.join(" "), words))
        } else {
            Ok(Candidates::new(fit))
        };
    }
    // A color that no name has is looked up in the Gaussians.
    let is_seen = |id: IdentityId, word: &String| row(word).and_then(|color| color_of(all, id, color)) == Some(true);
    let fits = |id: &IdentityId, has_head: &dyn Fn(&[String]) -> bool| {
        own(*id).iter().any(|n| has_head(&name_words(n))) && rest.iter().all(|w| line_has(*id, w) || is_seen(*id, w))
    };
    let exact: Vec<IdentityId> =
        everyone.iter().copied().filter(|id| own(*id).iter().any(|n| name_words(n) == words)).collect();
    // The head of a name is its last word before "with" or "of", a single letter or number aside: a table lamp is
    // not a table, a vase with water is a vase, "button a" is a button.
    let heads = |name: &[String]| {
        let thing = name.split(|w| w == "with" || w == "of").next().unwrap_or_default();
        let tells_apart = |w: &String| w.chars().count() == 1 || w.bytes().all(|b| b.is_ascii_digit());
        thing.last() == Some(head) || thing.iter().rev().find(|w| !tells_apart(w)) == Some(head)
    };
    let mut ids: Vec<IdentityId> = everyone.iter().copied().filter(|id| fits(id, &heads)).collect();
    ids.extend(exact.iter().copied().filter(|id| !ids.contains(id)).collect::<Vec<_>>());
    if ids.is_empty() {
        ids = everyone.iter().copied().filter(|id| fits(id, &|name| name.contains(head))).collect();
    }
    if !ids.is_empty() {
        return Ok(Candidates { ids, exact });
    }
    by_embedding(resolver, words)
}

/// Candidates by embedding, if it may be used; else, and without any, a refusal.
fn by_embedding(resolver: &mut Resolver<'_>, words: &[String]) -> Result<Candidates, Unresolved> {
    let (text, level) = (words.join(" "), resolver.level);
    let found = embedded::candidates(resolver, &text, level)?;
    found.map(Candidates::new).ok_or_else(|| not_found(resolver, &text, words))
}

/// Refusal of an unknown name with the nearest names, by shared or similar words.
fn not_found(resolver: &Resolver<'_>, text: &str, words: &[String]) -> Unresolved {
    let all = resolver.world.identities();
    let here = |id: &IdentityId| resolver.world.facts(*id).is_some();
    let shares = |id: &IdentityId| {
        let names = all.get(*id).map(|i| i.names.as_slice()).unwrap_or_default();
        names.iter().flat_map(|n| name_words(n)).any(|n| words.iter().any(|w| alike(&n, w)))
    };
    let near: Vec<IdentityId> = all.iter().map(|(id, _)| id).filter(here).filter(shares).take(6).collect();
    let text: String = text.chars().take(80).collect();
    let listed = |ids: &[IdentityId]| join(&ids.iter().map(|id| all.full_name(*id)).collect::<Vec<_>>());
    let said = if near.is_empty() {
        let is_named = |(id, i): &(IdentityId, &Identity)| i.level == Level::Object && !i.names.is_empty() && here(id);
        let some: Vec<IdentityId> = all.iter().filter(is_named).map(|(id, _)| id).take(8).collect();
        if some.is_empty() { String::new() } else { format!(" Some names here: {}.", listed(&some)) }
    } else {
        format!(" The nearest names: {}.", listed(&near))
    };
    Unresolved::new(RefusalKind::NotFound, format!("There is no '{text}' in this scene.{said}"), near)
}

/// Identities that "one" may stand for: the candidates of the last question, else all whose name ends in the same
/// word as the name of the last thing.
fn kin(resolver: &Resolver<'_>) -> Vec<IdentityId> {
    if !resolver.dialog.group.is_empty() {
        return resolver.dialog.group.clone();
    }
    let all = resolver.world.identities();
    let words = |id: IdentityId| all.get(id).and_then(|i| i.names.first()).map(|n| name_words(n)).unwrap_or_default();
    let Some(last) = resolver.dialog.last else { return Vec::new() };
    let head = words(last).pop().map(|w| singular(&w));
    let like = |id: &IdentityId| head.as_ref().is_some_and(|h| words(*id).last() == Some(h));
    all.iter().map(|(id, _)| id).filter(like).filter(|id| resolver.world.facts(*id).is_some()).collect()
}
