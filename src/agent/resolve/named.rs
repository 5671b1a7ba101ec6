//! Lookup of identities by the words of their names, and the refusal if none matches.

use super::noun::{ANYTHING, PARTS};
use super::{Lost, Resolver, Set, name_words};
use crate::agent::describe::join;
use crate::agent::refusal::RefusalKind;
use crate::agent::words::{alike, singular};
use crate::jobs::query::color_of;
use crate::pipeline::semantics::recipe::Understanding;
use crate::scene::colors::row;
use crate::scene::{Identity, IdentityId, Level};

impl Resolver<'_> {
    /// Candidates by the words of their names: all words are in the names of a thing and its ancestors, the last one in
    /// its own. Typing errors are not corrected here.
    pub(super) fn named(&mut self, words: &[String]) -> Result<Set, Lost> {
        let all = self.world.identities();
        let wished = all.iter().filter(|(_, i)| self.level.accepts(i.level)).map(|(id, _)| id);
        let everyone: Vec<IdentityId> = wished.filter(|id| self.world.facts(*id).is_some()).collect();
        let Some((head, rest)) = words.split_last() else { return Err(self.not_found("that", &[])) };
        if self.world.understanding() == Understanding::Embedding {
            return self.embedded(words);
        }
        let own = |id: IdentityId| all.get(id).map(|i| i.names.as_slice()).unwrap_or_default();
        let line_has = |id: IdentityId, word: &String| {
            all.ancestors(id).any(|i| own(i).iter().any(|name| name_words(name).contains(word)))
        };
        let is_object = |id: &IdentityId| all.object_of(*id) == *id;
        let generic = match head.as_str() {
            "one" => Some(self.kin()),
            word if ANYTHING.contains(&word) => Some(everyone.iter().copied().filter(is_object).collect()),
            word if PARTS.contains(&word) => Some(everyone.iter().copied().filter(|id| !is_object(id)).collect()),
            _ => None,
        };
        if let Some(ids) = generic {
            let fit: Vec<IdentityId> = ids.into_iter().filter(|id| rest.iter().all(|w| line_has(*id, w))).collect();
            return if fit.is_empty() { Err(self.not_found(&words.join(" "), words)) } else { Ok(Set::new(fit)) };
        }
        // A color that no name has is looked up in the Gaussians.
        let is_seen =
            |id: IdentityId, word: &String| row(word).and_then(|color| color_of(all, id, color)) == Some(true);
        let fits = |id: &IdentityId, has_head: &dyn Fn(&[String]) -> bool| {
            own(*id).iter().any(|n| has_head(&name_words(n)))
                && rest.iter().all(|w| line_has(*id, w) || is_seen(*id, w))
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
            return Ok(Set { ids, exact });
        }
        self.embedded(words)
    }

    /// Refusal of an unknown name with the nearest names, by shared or similar words.
    pub(super) fn not_found(&self, text: &str, words: &[String]) -> Lost {
        let all = self.world.identities();
        let here = |id: &IdentityId| self.world.facts(*id).is_some();
        let shares = |id: &IdentityId| {
            let names = all.get(*id).map(|i| i.names.as_slice()).unwrap_or_default();
            names.iter().flat_map(|n| name_words(n)).any(|n| words.iter().any(|w| alike(&n, w)))
        };
        let near: Vec<IdentityId> = all.iter().map(|(id, _)| id).filter(here).filter(shares).take(6).collect();
        let text: String = text.chars().take(80).collect();
        let listed = |ids: &[IdentityId]| join(&ids.iter().map(|id| all.full_name(*id)).collect::<Vec<_>>());
        let said = if near.is_empty() {
            let is_named =
                |(id, i): &(IdentityId, &Identity)| i.level == Level::Object && !i.names.is_empty() && here(id);
            let some: Vec<IdentityId> = all.iter().filter(is_named).map(|(id, _)| id).take(8).collect();
            if some.is_empty() { String::new() } else { format!(" Some names here: {}.", listed(&some)) }
        } else {
            format!(" The nearest names: {}.", listed(&near))
        };
        Lost::new(RefusalKind::NotFound, format!("There is no '{text}' in this scene.{said}"), near)
    }

    /// Identities that "one" may stand for: the candidates of the last question, else all whose name ends in the same
    /// word as the name of the last thing.
    pub(super) fn kin(&self) -> Vec<IdentityId> {
        if !self.dialog.group.is_empty() {
            return self.dialog.group.clone();
        }
        let all = self.world.identities();
        let words =
            |id: IdentityId| all.get(id).and_then(|i| i.names.first()).map(|n| name_words(n)).unwrap_or_default();
        let Some(last) = self.dialog.last else { return Vec::new() };
        let head = words(last).pop().map(|w| singular(&w));
        let like = |id: &IdentityId| head.as_ref().is_some_and(|h| words(*id).last() == Some(h));
        all.iter().map(|(id, _)| id).filter(like).filter(|id| self.world.facts(*id).is_some()).collect()
    }
}
