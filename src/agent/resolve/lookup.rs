//! Candidates by what they are called, and pieces of wholes.

use super::pick::pick_of;
use super::{ANYTHING, Lost, Resolver, Set};
use crate::agent::describe::join;
use crate::agent::refusal::RefusalKind;
use crate::agent::words::{alike, singular};
use crate::pipeline::semantics::answer::Basis;
use crate::pipeline::semantics::grammar::{Kind, is_glue};
use crate::pipeline::semantics::localise::Answer;
use crate::scene::{IdentityId, NOBODY};

/// Most candidates of one lookup.
const MOST: usize = 12;

/// Words for colours: what is called red is not blue.
const COLOURS: [&str; 19] = [
    "red",
    "green",
    "blue",
    "yellow",
    "orange",
    "purple",
    "violet",
    "pink",
    "brown",
    "black",
    "white",
    "grey",
    "gray",
    "beige",
    "golden",
    "silver",
    "turquoise",
    "cyan",
    "magenta",
];

/// The words of a name.
pub(super) fn name_words(name: &str) -> Vec<String> {
    let apart = name.split(|c: char| !(c.is_alphanumeric() || c == '#')).filter(|w| !w.is_empty() && *w != "s");
    apart.map(str::to_lowercase).collect()
}

impl Resolver<'_> {
    /// What is called exactly so, in full ("handle of the kettle") or by its own name, or has this
    /// number ("#3").
    pub(super) fn exact(&self, words: &[&str]) -> Option<Set> {
        let text: Vec<String> = words.iter().map(|w| singular(w)).collect();
        let same = |name: &str| {
            let named = name.to_lowercase();
            let named: Vec<String> = named.split_whitespace().map(singular).collect();
            named == text
        };
        let number = words.first().filter(|_| words.len() == 1).and_then(|w| w.strip_prefix('#'));
        if let Some(id) = number.and_then(|n| n.parse::<IdentityId>().ok()) {
            let there = self.world.facts(id).is_some();
            return there.then(|| Set::of(vec![id]));
        }
        let identities = self.world.identities();
        let everyone = self.everyone();
        // A name of several words stands for itself, whatever the words mean.
        if words.len() >= 2 {
            let full: Vec<IdentityId> =
                everyone.iter().copied().filter(|id| same(&identities.full_name(*id))).collect();
            if !full.is_empty() {
                return Some(Set { exact: full.clone(), ids: full, ..Set::default() });
            }
        }
        let own = |id: &IdentityId| identities.get(*id).is_some_and(|i| i.names.iter().any(|n| same(n)));
        let named: Vec<IdentityId> = everyone.into_iter().filter(own).collect();
        (words.len() >= 3 && !named.is_empty()).then(|| Set { exact: named.clone(), ids: named, ..Set::default() })
    }

    /// Whether an identity's names, with those of what it is a piece of, have all these words, and
    /// its own names have the last.
    fn covers(&self, id: IdentityId, words: &[&str], same: fn(&str, &str) -> bool) -> bool {
        let identities = self.world.identities();
        let names = |id: IdentityId| identities.get(id).map(|i| i.names.as_slice()).unwrap_or_default();
        let own: Vec<String> = names(id).iter().flat_map(|n| name_words(n)).collect();
        let line: Vec<String> = identities.line(id).flat_map(names).flat_map(|n| name_words(n)).collect();
        let has = |list: &[String], word: &str| list.iter().any(|w| same(w, word));
        words.last().is_some_and(|last| has(&own, last)) && words.iter().all(|w| has(&line, w))
    }

    /// Whether an identity's own name is these words.
    fn is_called(&self, id: IdentityId, words: &[&str]) -> bool {
        let same = |name: &String| {
            let name = name_words(name);
            name.len() == words.len() && name.iter().zip(words).all(|(a, b)| alike(a, b))
        };
        self.world.identities().get(id).is_some_and(|i| i.names.iter().any(same))
    }

    /// Candidates among `of` whose names have the words; slips count only where nothing fits without.
    fn named(&self, of: &[IdentityId], words: &[&str]) -> Set {
        let equal: fn(&str, &str) -> bool = |a, b| singular(a) == singular(b);
        let fits = |same| of.iter().copied().filter(|id| self.covers(*id, words, same)).take(64).collect();
        let mut ids: Vec<IdentityId> = fits(equal);
        if ids.is_empty() {
            ids = fits(alike);
        }
        let exact = ids.iter().copied().filter(|id| self.is_called(*id, words)).collect();
        Set { ids, exact, ..Set::default() }
    }

    /// Candidates for words without structure.
    pub(super) fn lookup(&mut self, words: &[&str]) -> Result<Set, Lost> {
        let content: Vec<&str> = words.iter().copied().filter(|w| !is_glue(w)).collect();
        let everyone = self.everyone();
        if content.len() == 1 && ANYTHING.contains(&content[0]) {
            let objects = everyone.into_iter().filter(|id| self.world.identities().object_of(*id) == *id).collect();
            return Ok(Set::of(objects));
        }
        if content.is_empty() {
            return Err(Lost::new(RefusalKind::Unclear, "I am not sure which thing you mean.", Vec::new()));
        }
        let set = self.named(&everyone, &content);
        if !set.ids.is_empty() {
            return Ok(set);
        }
        if let [number] = content.as_slice()
            && let Some(id) = number.strip_prefix('#').and_then(|n| n.parse().ok())
            && self.world.facts(id).is_some()
        {
            return Ok(Set::of(vec![id]));
        }
        let text = words.join(" ");
        let picks = content.iter().any(|w| pick_of(w).is_some());
        if picks {
            return Err(self.not_found(&text, Vec::new()));
        }
        let found = self.world.locate(&text, self.level.kind())?;
        let there = |ids: Vec<IdentityId>| -> Vec<IdentityId> {
            ids.into_iter().filter(|id| self.world.facts(*id).is_some()).take(MOST).collect()
        };
        if found.basis == Basis::Meaning {
            let ids = match &found.answer {
                Answer::Found(_) => there(found.chosen(1)),
                Answer::Ambiguous(_) => there(found.chosen(2)),
                Answer::NotFound(_) => Vec::new(),
            };
            if !ids.is_empty() {
                return Ok(Set::of(ids));
            }
        }
        let near = there(found.answer.hits().iter().filter(|h| h.score > 0.3).map(|h| h.identity).collect());
        self.fewer_words(&content, &text, near)
    }

    /// Words that no name has may describe the thing ("the shiny kettle"), unless its names say
    /// otherwise ("the green controller", where one is red and one is blue).
    fn fewer_words(&mut self, content: &[&str], text: &str, near: Vec<IdentityId>) -> Result<Set, Lost> {
        for start in 1..content.len() {
            let rest = &content[start..];
            let set = self.named(&self.everyone(), rest);
            if set.ids.is_empty() {
                continue;
            }
            let said: Vec<&str> = content[..start].to_vec();
            let colour = |w: &str| COLOURS.contains(&w);
            let all = self.world.identities();
            let other_colour = |id: &IdentityId| {
                let names = all.get(*id).map(|i| i.names.as_slice()).unwrap_or_default();
                names.iter().flat_map(|n| name_words(n)).any(|w| colour(&w))
            };
            if said.iter().any(|w| colour(w)) && set.ids.iter().all(other_colour) {
                let there: Vec<String> =
                    set.ids.iter().take(4).map(|id| format!("the {}", all.full_name(*id))).collect();
                let text = format!("There is no {text} here, only {}.", join(&there));
                return Err(Lost::new(RefusalKind::Conflict, text, set.ids));
            }
            let known = all.iter().flat_map(|(_, i)| &i.names).flat_map(|n| name_words(n));
            let known: Vec<String> = known.filter(|w| !colour(w)).collect();
            // A word that names other things makes this another thing: "kettle mug".
            if said.iter().any(|w| known.iter().any(|k| alike(k, w))) {
                continue;
            }
            self.notes.push(format!("(Whether it is {}, its name does not tell.)", said.join(" ")));
            return Ok(set);
        }
        Err(self.not_found(text, near))
    }

    fn not_found(&self, text: &str, near: Vec<IdentityId>) -> Lost {
        let all = self.world.identities();
        let text: String = text.chars().take(80).collect();
        let said = if near.is_empty() {
            let objects = all.iter().filter(|(id, i)| i.parent == NOBODY && self.world.facts(*id).is_some());
            let named: Vec<String> = objects.filter(|(_, i)| !i.names.is_empty()).map(|(id, _)| all.name(id)).collect();
            let more = if named.len() > 8 { " and more" } else { "" };
            let some: Vec<String> = named.into_iter().take(8).collect();
            if some.is_empty() { String::new() } else { format!(" I know: {}{more}.", some.join(", ")) }
        } else {
            let near: Vec<String> = near.iter().take(3).map(|id| all.full_name(*id)).collect();
            format!(" What comes near by name: {}.", join(&near))
        };
        Lost::new(RefusalKind::NotFound, format!("I find no '{text}' in this scene.{said}"), near)
    }

    /// The pieces of `wholes` that `words` name, with what chooses among them.
    pub(super) fn pieces(&mut self, wholes: &Set, words: &[&str], depth: usize) -> Result<Set, Lost> {
        let owners = if wholes.exact.is_empty() || wholes.chosen { &wholes.ids } else { &wholes.exact };
        let owners = if wholes.first { &owners[..1.min(owners.len())] } else { owners.as_slice() };
        let all = self.world.identities();
        let mut inside = vec![false; all.len() + 1];
        for owner in owners {
            all.within(*owner).iter().enumerate().filter(|(i, is_in)| **is_in && *i as IdentityId != *owner).for_each(
                |(i, _)| {
                    inside[i] = true;
                },
            );
        }
        let there = |id: &IdentityId| inside.get(*id as usize) == Some(&true) && self.world.facts(*id).is_some();
        let pieces: Vec<IdentityId> = all.iter().map(|(id, _)| id).filter(there).collect();
        let words = super::trim(words);
        let content: Vec<&str> = words.iter().copied().filter(|w| !is_glue(w)).collect();
        if matches!(content.as_slice(), ["part" | "parts" | "piece" | "pieces"]) {
            return Ok(Set { ids: pieces, chosen: true, ..Set::default() });
        }
        let set = self.named(&pieces, &content);
        if !set.ids.is_empty() {
            return Ok(set);
        }
        if let Some(set) = self.choose_among(&pieces, words, depth)? {
            return Ok(set);
        }
        let name = owners.first().map(|id| self.world.identities().full_name(*id)).unwrap_or_default();
        let query = format!("{} of the {name}", words.join(" "));
        let found = self.world.locate(&query, Kind::Part)?;
        if found.basis == Basis::Meaning {
            let meant: Vec<IdentityId> = found.chosen(1).into_iter().filter(|id| pieces.contains(id)).collect();
            if !meant.is_empty() {
                return Ok(Set::of(meant));
            }
        }
        let all = self.world.identities();
        let known: Vec<String> = pieces
            .iter()
            .filter(|id| all.get(**id).is_some_and(|i| !i.names.is_empty()))
            .map(|id| all.name(*id))
            .collect();
        let piece = words.join(" ");
        let text = if known.is_empty() {
            format!("I know no parts of the {name}, so no '{piece}' either.")
        } else {
            format!("The {name} has no {piece} that I know of; its parts are: {}.", join(&known))
        };
        Err(Lost::new(RefusalKind::Conflict, text, pieces))
    }
}
