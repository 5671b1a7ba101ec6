//! Resolution of a phrase to an identity: names, parts of wholes, places relative to other things, superlatives,
//! pronouns. Ambiguous and unmatched phrases are reported; nothing is guessed. All readings are tried by names; only if
//! none of them matches, the scene's encoder is used, if it has one, and the reply says so.

mod embedded;
mod named;
mod noun;
mod places;

pub(crate) use noun::{NameWords, counted, is_thing, name_words, words_of};

use self::noun::{Noun, Pick, readings};
use super::describe::{join, the};
use super::dialog::DialogState;
use super::refusal::{Refusal, RefusalKind};
use super::relation::{Relation, fit, gap};
use super::world::World;
use crate::pipeline::semantics::query::reading::{mend, mended_text};
use crate::pipeline::semantics::query::recipe::MatchBy;
use crate::scene::{Bounds, IdentityId, LevelFilter};

/// Result of a resolution.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Resolved {
    /// A single identity. The note says how it was found, if not by its name.
    One {
        id: IdentityId,
        note: String,
        /// True if it was found by embedding, not by name: a change then needs a confirmation.
        by_looks: bool,
    },
    Several(Vec<IdentityId>),
    Missing {
        refusal: Refusal,
        near: Vec<IdentityId>,
    },
}

/// Resolves `phrase` to one identity.
pub(crate) fn resolve(world: &mut dyn World, phrase: &str, level: LevelFilter, dialog: &DialogState) -> Resolved {
    // Correcting typing errors is safe here: the reply names the thing, so a wrong correction is noticed.
    let (phrase, mended) = match world.identities().called(phrase, level).as_slice() {
        [] => mend(world.identities(), phrase),
        _ => (phrase.to_owned(), Vec::new()),
    };
    let mut resolver = Resolver::new(world, dialog, level);
    match resolver.meant(&phrase) {
        Ok(set) => match set.settled() {
            [id] => {
                let by_looks = resolver.looked;
                let looked = if by_looks { "(Found by embedding, not by name.)" } else { "" };
                let notes = [mended_text(&mended).unwrap_or_default(), looked.into()];
                Resolved::One { id: *id, note: notes.join(" ").trim().into(), by_looks }
            }
            several => Resolved::Several(several.to_vec()),
        },
        Err(Unresolved { refusal, near, .. }) => Resolved::Missing { refusal, near },
    }
}

/// Resolves a phrase such as "buttons" or "bottles on the table" to all its identities, by names. Matches by embedding
/// count only if the scene is set to ignore names.
pub(crate) fn resolve_all(
    world: &mut dyn World,
    phrase: &str,
    level: LevelFilter,
    dialog: &DialogState,
) -> Result<Vec<IdentityId>, Refusal> {
    let mut resolver = Resolver::new(world, dialog, level);
    let by_names = resolver.phrase(phrase);
    let meant = by_names.map_err(|unresolved| embedded::with_offers(&mut resolver, unresolved, phrase));
    meant.map(|set| set.ids).map_err(|unresolved| unresolved.refusal)
}

/// Reason for which no candidates were found.
struct Unresolved {
    refusal: Refusal,
    near: Vec<IdentityId>,
    /// True if no name matches, so that the encoder may be tried; false if the facts of the scene rule the phrase out.
    is_open: bool,
}

impl Unresolved {
    fn new(kind: RefusalKind, text: impl Into<String>, near: Vec<IdentityId>) -> Self {
        Self { refusal: Refusal::new(kind, text), near, is_open: kind == RefusalKind::NotFound }
    }
}

/// Candidates: all matches, and the exact ones among them. Never empty.
#[derive(Clone, Debug)]
struct Candidates {
    ids: Vec<IdentityId>,
    exact: Vec<IdentityId>,
}

impl Candidates {
    fn new(ids: Vec<IdentityId>) -> Self {
        Self { ids, exact: Vec::new() }
    }

    /// Exact matches if there are any, else all.
    fn settled(&self) -> &[IdentityId] {
        if self.exact.is_empty() { &self.ids } else { &self.exact }
    }
}

struct Resolver<'a> {
    world: &'a mut dyn World,
    dialog: &'a DialogState,
    level: LevelFilter,
    /// True if the encoder may be used; `looked` is true once a match came from it.
    may_look: bool,
    looked: bool,
}

impl<'a> Resolver<'a> {
    fn new(world: &'a mut dyn World, dialog: &'a DialogState, level: LevelFilter) -> Self {
        let may_look = world.match_by() == MatchBy::Embedding;
        Self { world, dialog, level, may_look, looked: false }
    }
}

impl Resolver<'_> {
    /// Resolves a phrase by names in all its readings; if none matches, again with the encoder for the unknown words.
    fn meant(&mut self, phrase: &str) -> Result<Candidates, Unresolved> {
        let unresolved = match self.phrase(phrase) {
            Err(unresolved) if unresolved.is_open && !self.may_look => unresolved,
            done => return done,
        };
        if self.world.match_by() != MatchBy::Names {
            self.may_look = true;
            let found = self.phrase(phrase);
            self.may_look = false;
            match found {
                Err(Unresolved { refusal, .. }) if refusal.kind != RefusalKind::Failed => {}
                done => return done,
            }
        }
        Err(embedded::with_offers(self, unresolved, phrase))
    }

    /// Resolves a phrase by a complete name, else by its readings. If readings match different things, all of these are
    /// candidates.
    fn phrase(&mut self, phrase: &str) -> Result<Candidates, Unresolved> {
        if let Some(set) = named::called(self, phrase) {
            return Ok(set);
        }
        let words = words_of(phrase);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let known = NameWords::new(self.world.identities());
        let mut nouns = readings(&words, &known, false);
        // A name such as "left stick" goes before the left one of the sticks. With the encoder, superlatives and counts
        // go first, as any words match something by embedding.
        let may_look = self.may_look;
        let place = |noun: &Noun| match noun {
            Noun::Picked(Pick::Most(..), _) | Noun::Counted(..) if may_look => 0,
            Noun::Picked(..) => 2,
            _ => 1,
        };
        nouns.sort_by_key(place);
        let mut last = 2;
        let mut found: Option<Candidates> = None;
        let mut unresolved = Unresolved::new(RefusalKind::Unclear, "I am not sure which thing you mean.", Vec::new());
        for noun in &nouns {
            if place(noun) > last {
                break;
            }
            match (self.set(noun), &mut found) {
                (Ok(set), None) => (found, last) = (Some(set), place(noun)),
                (Ok(set), Some(all)) if set.settled() != all.settled() => {
                    let new: Vec<IdentityId> = set.ids.into_iter().filter(|id| !all.ids.contains(id)).collect();
                    *all = Candidates::new(all.settled().iter().copied().chain(new).collect());
                }
                (Ok(_), _) => {}
                // A conflict with the scene explains more than an unknown word.
                (Err(new), _) if unresolved.refusal.kind != RefusalKind::Conflict => unresolved = new,
                (Err(new), _) if new.refusal.kind == RefusalKind::Conflict && unresolved.is_open => unresolved = new,
                (Err(_), _) => {}
            }
        }
        found.ok_or(unresolved)
    }

    fn set(&mut self, noun: &Noun) -> Result<Candidates, Unresolved> {
        match noun {
            Noun::Last => self.last().map(|id| Candidates::new(vec![id])),
            Noun::Number(id) if self.world.facts(*id).is_some() => Ok(Candidates::new(vec![*id])),
            Noun::Number(id) => {
                let text = format!("There is nothing with the number {id} here.");
                Err(Unresolved { is_open: false, ..Unresolved::new(RefusalKind::NotFound, text, Vec::new()) })
            }
            Noun::Called(name) => {
                named::called(self, name).map_or_else(|| named::by_words(self, &name_words(name)), Ok)
            }
            Noun::Named(words) => named::by_words(self, words),
            Noun::Picked(pick, of) => places::picked(self, *pick, of),
            Noun::Counted(count, of) => places::counted(self, *count, of),
            Noun::PieceOf(piece, whole) => places::pieces(self, piece, whole),
            Noun::Placed(thing, relation, anchor) => {
                let frame = self.world.view().frame();
                let what = format!("is {} it", relation.text());
                places::at(self, thing, anchor, &what, &|t, a| fit(*relation, t, a, &frame))
            }
            Noun::Nearest(thing, anchor) => {
                // The support of a thing and things on it touch it and are not meant.
                let frame = self.world.view().frame();
                let rests = |t: &Bounds, a: &Bounds| fit(Relation::On, t, a, &frame).is_some();
                let apart = |t: &Bounds, a: &Bounds| (!rests(t, a) && !rests(a, t)).then(|| gap(t, a));
                let set = places::at(self, thing, anchor, "is near it", &apart)?;
                let nearest = places::alike_first(self, &set.ids, anchor)?;
                Ok(Candidates::new(nearest))
            }
        }
    }

    /// Identity that was mentioned last.
    fn last(&self) -> Result<IdentityId, Unresolved> {
        let there = self.dialog.last.filter(|id| self.world.facts(*id).is_some());
        let unclear = "I do not know what you refer to: nothing was spoken of yet.";
        there.ok_or_else(|| Unresolved::new(RefusalKind::Unclear, unclear, Vec::new()))
    }

    fn bounds(&self, id: IdentityId) -> Option<Bounds> {
        self.world.facts(id).and_then(|f| f.bounds)
    }

    /// Resolves the anchor of a place, which must be unambiguous.
    fn anchor(&mut self, noun: &Noun) -> Result<IdentityId, Unresolved> {
        let set = self.set(noun)?;
        match set.settled() {
            [only] => Ok(*only),
            several => {
                let names: Vec<String> = several.iter().take(6).map(|id| the(self.world, *id)).collect();
                let text = format!("Several things match equally: {}. Please say which one in full.", join(&names));
                Err(Unresolved::new(RefusalKind::Unclear, text, several.to_vec()))
            }
        }
    }
}
