//! From words to the thing that is meant: names, parts of wholes, places beside other things,
//! superlatives, ordinals, pronouns. Names come first; what they do not know is asked of the scene.

mod lookup;
mod pick;
mod place;

pub(crate) use pick::is_pick;
pub(crate) use place::relation_at;

use super::focus::Focus;
use super::refusal::{Refusal, RefusalKind};
use super::tool::LevelWish;
use super::words::{is_mark, tokens};
use super::world::{World, WorldError};
use crate::scene::{Bounds, IdentityId};

/// What words come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Resolved {
    /// This one is meant. The note says what was not taken literally.
    One {
        /// Which.
        id: IdentityId,
        /// For the user; mostly empty.
        note: String,
    },
    /// Any of these could be meant.
    Several(Vec<IdentityId>),
    /// Nothing fits.
    Missing {
        /// Why.
        refusal: Refusal,
        /// What comes near.
        near: Vec<IdentityId>,
    },
}

/// Finds what `phrase` means.
///
/// # Errors
/// If the scene cannot be asked.
pub fn resolve(world: &mut dyn World, phrase: &str, level: LevelWish, focus: &Focus) -> Result<Resolved, WorldError> {
    let mut resolver = Resolver { world, focus, level, notes: Vec::new() };
    match resolver.phrase(phrase) {
        Ok(set) => {
            let mut ids = resolver.settle(&set);
            let note = resolver.notes.join(" ");
            Ok(match ids.len() {
                0 => missing(RefusalKind::NotFound, format!("I see no '{phrase}' here."), Vec::new()),
                1 => Resolved::One { id: ids.remove(0), note },
                _ => Resolved::Several(ids),
            })
        }
        Err(Lost::Missing { refusal, near }) => Ok(Resolved::Missing { refusal, near }),
        Err(Lost::World(e)) => Err(e),
    }
}

/// All identities that a phrase such as "buttons" or "bottles on the table" may mean.
///
/// # Errors
/// If the scene cannot be asked.
pub fn resolve_all(
    world: &mut dyn World,
    phrase: &str,
    level: LevelWish,
    focus: &Focus,
) -> Result<Vec<IdentityId>, WorldError> {
    let mut resolver = Resolver { world, focus, level, notes: Vec::new() };
    match resolver.phrase(phrase) {
        Ok(set) => Ok(set.ids),
        Err(Lost::Missing { .. }) => Ok(Vec::new()),
        Err(Lost::World(e)) => Err(e),
    }
}

fn missing(kind: RefusalKind, text: String, near: Vec<IdentityId>) -> Resolved {
    Resolved::Missing { refusal: Refusal::new(kind, text), near }
}

/// Why no set of candidates was found.
enum Lost {
    Missing { refusal: Refusal, near: Vec<IdentityId> },
    World(WorldError),
}

impl Lost {
    fn new(kind: RefusalKind, text: impl Into<String>, near: Vec<IdentityId>) -> Self {
        Self::Missing { refusal: Refusal::new(kind, text), near }
    }
}

impl From<WorldError> for Lost {
    fn from(e: WorldError) -> Self {
        Self::World(e)
    }
}

/// Candidates.
#[derive(Clone, Debug, Default)]
struct Set {
    /// All that fit, best first.
    ids: Vec<IdentityId>,
    /// Those that are called exactly so.
    exact: Vec<IdentityId>,
    /// Whether the words chose among candidates, so that a name said exactly decides nothing more.
    chosen: bool,
    /// Whether the first is meant without asking: "the thing on the table".
    first: bool,
}

impl Set {
    fn of(ids: Vec<IdentityId>) -> Self {
        Self { ids, ..Self::default() }
    }
}

/// How deep phrases may be nested.
const DEEPEST: usize = 6;

struct Resolver<'a> {
    world: &'a mut dyn World,
    focus: &'a Focus,
    level: LevelWish,
    notes: Vec<String>,
}

/// Words that say nothing about which thing is meant, before and after it.
const LEADING: [&str; 17] = [
    "the", "a", "an", "some", "any", "my", "your", "our", "me", "to", "at", "this", "that", "these", "those", "just",
    "of",
];
const TRAILING: [&str; 14] = [
    "in the scene",
    "in this scene",
    "in the room",
    "in this room",
    "in the view",
    "in the picture",
    "over there",
    "please",
    "there",
    "here",
    "again",
    "too",
    "as well",
    "instead",
];
const PRONOUNS: [&str; 18] = [
    "it",
    "she",
    "he",
    "they",
    "there",
    "that",
    "this",
    "them",
    "him",
    "her",
    "these",
    "those",
    "that one",
    "this one",
    "the same",
    "the thing",
    "that thing",
    "this thing",
];
/// Words for anything.
const ANYTHING: [&str; 12] = [
    "thing",
    "things",
    "object",
    "objects",
    "item",
    "items",
    "something",
    "anything",
    "stuff",
    "everything",
    "what",
    "whatever",
];

impl Resolver<'_> {
    fn phrase(&mut self, phrase: &str) -> Result<Set, Lost> {
        let tokens = tokens(phrase);
        let words: Vec<String> =
            tokens.iter().filter(|t| !is_mark(&t.low)).map(|t| t.low.trim_start_matches('"').to_owned()).collect();
        let words: Vec<&str> = words.iter().flat_map(|w| w.split_whitespace()).collect();
        self.set(&words, 0)
    }

    fn set(&mut self, words: &[&str], depth: usize) -> Result<Set, Lost> {
        let unclear = || Lost::new(RefusalKind::Unclear, "I am not sure which thing you mean.", Vec::new());
        if depth > DEEPEST {
            return Err(unclear());
        }
        let all = words;
        if let Some(set) = self.pronoun(words)? {
            return Ok(set);
        }
        let words = trim(words);
        if words.is_empty() {
            return Err(unclear());
        }
        let exact = [words, all].iter().find_map(|w| self.exact(w));
        if let Some(set) = exact {
            return Ok(set);
        }
        if let Some(set) = self.pronoun(words)? {
            return Ok(set);
        }
        if let [own, piece @ ..] = words
            && ["its", "their", "his", "whose"].contains(own)
            && !piece.is_empty()
        {
            let whole = self.last()?;
            return self.pieces(&Set::of(vec![whole]), piece, depth);
        }
        if let Some(set) = self.placed(words, depth)? {
            return Ok(set);
        }
        self.chosen(words, depth)
    }

    /// The one that was spoken of last.
    fn last(&self) -> Result<IdentityId, Lost> {
        let there = self.focus.last.filter(|id| self.world.facts(*id).is_some());
        let unclear = "I do not know what you refer to: nothing was spoken of yet.";
        there.ok_or_else(|| Lost::new(RefusalKind::Unclear, unclear, Vec::new()))
    }

    fn pronoun(&self, words: &[&str]) -> Result<Option<Set>, Lost> {
        if PRONOUNS.contains(&words.join(" ").as_str()) { Ok(Some(Set::of(vec![self.last()?]))) } else { Ok(None) }
    }

    /// The candidates that remain when nothing more is said.
    fn settle(&self, set: &Set) -> Vec<IdentityId> {
        if set.first {
            return set.ids.iter().take(1).copied().collect();
        }
        let ids = if set.chosen || set.exact.is_empty() { &set.ids } else { &set.exact };
        if ids.len() < 2 {
            return ids.clone();
        }
        let identities = self.world.identities();
        let is_object = |id: &IdentityId| identities.get(*id).is_some_and(|i| i.parent == crate::scene::NOBODY);
        let objects: Vec<IdentityId> = ids.iter().copied().filter(is_object).collect();
        if !objects.is_empty() && objects.len() < ids.len() && self.level != LevelWish::Part {
            return objects;
        }
        // "The lid", said of a kettle just now, is the kettle's.
        if objects.is_empty()
            && let Some(last) = self.focus.last
        {
            for whole in identities.line(last) {
                let inside = identities.within(whole);
                let own: Vec<IdentityId> =
                    ids.iter().copied().filter(|id| inside.get(*id as usize) == Some(&true)).collect();
                if !own.is_empty() {
                    return own;
                }
            }
        }
        ids.clone()
    }

    fn bounds(&self, id: IdentityId) -> Option<Bounds> {
        self.world.facts(id).and_then(|f| f.bounds)
    }

    /// All identities that are in the scene and on the wished level.
    fn everyone(&self) -> Vec<IdentityId> {
        let wished = self.world.identities().iter().filter(|(_, i)| self.level.takes(i.level));
        wished.map(|(id, _)| id).filter(|id| self.world.facts(*id).is_some()).collect()
    }
}

/// Without what says nothing about which thing is meant.
fn trim<'a, 'b>(mut words: &'b [&'a str]) -> &'b [&'a str] {
    while let [first, rest @ ..] = words
        && LEADING.contains(first)
    {
        words = rest;
    }
    while let Some(n) = TRAILING.iter().find_map(|phrase| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        words.ends_with(&wanted).then_some(wanted.len())
    }) {
        words = &words[..words.len() - n];
    }
    words
}
