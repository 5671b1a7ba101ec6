//! From words to the thing that is meant: names, pieces of wholes, places at other things, superlatives,
//! pronouns. What several things fit equally is said to be so, what nothing fits is not there; nothing is
//! guessed. All readings are tried by names; only if none of them comes to anything, the scene's encoder is asked, if it
//! has one, and what is found by it is said to be.

mod called;
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
use crate::pipeline::semantics::reading::{mend, mended_text};
use crate::pipeline::semantics::recipe::Understanding;
use crate::scene::{Bounds, IdentityId, LevelFilter};

/// What words come to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Resolved {
    /// This one is meant. The note says how it was found, if not by its name.
    One {
        id: IdentityId,
        note: String,
        /// Whether the encoder says so and no name: what is changed is to be asked about first.
        by_looks: bool,
    },
    Several(Vec<IdentityId>),
    Missing {
        refusal: Refusal,
        near: Vec<IdentityId>,
    },
}

/// Finds what `phrase` means.
pub(crate) fn resolve(world: &mut dyn World, phrase: &str, level: LevelFilter, dialog: &DialogState) -> Resolved {
    // What is done to one thing is said of it by name, so a slip that was mended wrongly is seen.
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
        Err(Lost { refusal, near, .. }) => Resolved::Missing { refusal, near },
    }
}

/// All identities that a phrase such as "buttons" or "bottles on the table" means, by names: what looks so is not
/// counted, unless names are not looked at.
pub(crate) fn resolve_all(
    world: &mut dyn World,
    phrase: &str,
    level: LevelFilter,
    dialog: &DialogState,
) -> Result<Vec<IdentityId>, Refusal> {
    let mut resolver = Resolver::new(world, dialog, level);
    let by_names = resolver.phrase(phrase);
    let meant = by_names.map_err(|lost| resolver.with_offers(lost, phrase));
    meant.map(|set| set.ids).map_err(|lost| lost.refusal)
}

/// Why no set of candidates was found.
struct Lost {
    refusal: Refusal,
    near: Vec<IdentityId>,
    /// Whether the encoder may know more: names know no such thing. Facts are not overruled.
    is_open: bool,
}

impl Lost {
    fn new(kind: RefusalKind, text: impl Into<String>, near: Vec<IdentityId>) -> Self {
        Self { refusal: Refusal::new(kind, text), near, is_open: kind == RefusalKind::NotFound }
    }
}

/// Candidates: all that fit, and those of them that are called exactly so. Never empty.
#[derive(Clone, Debug)]
struct Set {
    ids: Vec<IdentityId>,
    exact: Vec<IdentityId>,
}

impl Set {
    fn new(ids: Vec<IdentityId>) -> Self {
        Self { ids, exact: Vec::new() }
    }

    /// Those that are meant when nothing more is said.
    fn settled(&self) -> &[IdentityId] {
        if self.exact.is_empty() { &self.ids } else { &self.exact }
    }
}

struct Resolver<'a> {
    world: &'a mut dyn World,
    dialog: &'a DialogState,
    level: LevelFilter,
    /// Whether the encoder may be asked, and whether what was found rests on it.
    may_look: bool,
    looked: bool,
}

impl<'a> Resolver<'a> {
    fn new(world: &'a mut dyn World, dialog: &'a DialogState, level: LevelFilter) -> Self {
        let may_look = world.understanding() == Understanding::Embedding;
        Self { world, dialog, level, may_look, looked: false }
    }
}

impl Resolver<'_> {
    /// What a phrase means by names, by all of its readings; else what it means if the encoder is asked for what names
    /// do not know.
    fn meant(&mut self, phrase: &str) -> Result<Set, Lost> {
        let lost = match self.phrase(phrase) {
            Err(lost) if lost.is_open && !self.may_look => lost,
            done => return done,
        };
        if self.world.understanding() != Understanding::Names {
            self.may_look = true;
            let found = self.phrase(phrase);
            self.may_look = false;
            match found {
                Err(Lost { refusal, .. }) if refusal.kind != RefusalKind::Failed => {}
                done => return done,
            }
        }
        Err(self.with_offers(lost, phrase))
    }

    /// What is called so as a whole, else what the readings come to: those that come to something must come to the
    /// same.
    fn phrase(&mut self, phrase: &str) -> Result<Set, Lost> {
        if let Some(set) = self.called(phrase) {
            return Ok(set);
        }
        let words = words_of(phrase);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let known = NameWords::new(self.world.identities());
        let mut nouns = readings(&words, &known, false);
        // What is called "left stick" is not the left one of the sticks; but to an encoder anything looks like something.
        let may_look = self.may_look;
        let place = |noun: &Noun| match noun {
            Noun::Picked(Pick::Most(..), _) | Noun::Counted(..) if may_look => 0,
            Noun::Picked(..) => 2,
            _ => 1,
        };
        nouns.sort_by_key(place);
        let mut last = 2;
        let mut found: Option<Set> = None;
        let mut lost = Lost::new(RefusalKind::Unclear, "I am not sure which thing you mean.", Vec::new());
        for noun in &nouns {
            if place(noun) > last {
                break;
            }
            match (self.set(noun), &mut found) {
                (Ok(set), None) => (found, last) = (Some(set), place(noun)),
                (Ok(set), Some(all)) if set.settled() != all.settled() => {
                    let new: Vec<IdentityId> = set.ids.into_iter().filter(|id| !all.ids.contains(id)).collect();
                    *all = Set::new(all.settled().iter().copied().chain(new).collect());
                }
                (Ok(_), _) => {}
                // Of reasons why nothing is found, one about the scene says more than an unknown word.
                (Err(new), _) if lost.refusal.kind != RefusalKind::Conflict => lost = new,
                (Err(new), _) if new.refusal.kind == RefusalKind::Conflict && lost.is_open => lost = new,
                (Err(_), _) => {}
            }
        }
        found.ok_or(lost)
    }

    fn set(&mut self, noun: &Noun) -> Result<Set, Lost> {
        match noun {
            Noun::Last => self.last().map(|id| Set::new(vec![id])),
            Noun::Number(id) if self.world.facts(*id).is_some() => Ok(Set::new(vec![*id])),
            Noun::Number(id) => {
                let text = format!("There is nothing with the number {id} here.");
                Err(Lost { is_open: false, ..Lost::new(RefusalKind::NotFound, text, Vec::new()) })
            }
            Noun::Called(name) => self.called(name).map_or_else(|| self.named(&name_words(name)), Ok),
            Noun::Named(words) => self.named(words),
            Noun::Picked(pick, of) => self.picked(*pick, of),
            Noun::Counted(count, of) => self.counted(*count, of),
            Noun::PieceOf(piece, whole) => self.pieces(piece, whole),
            Noun::Placed(thing, relation, anchor) => {
                let frame = self.world.view().frame();
                let what = format!("is {} it", relation.text());
                self.at(thing, anchor, &what, &|t, a| fit(*relation, t, a, &frame))
            }
            Noun::Nearest(thing, anchor) => {
                // What it stands on, and what stands on it, touches it and is not meant.
                let frame = self.world.view().frame();
                let rests = |t: &Bounds, a: &Bounds| fit(Relation::On, t, a, &frame).is_some();
                let apart = |t: &Bounds, a: &Bounds| (!rests(t, a) && !rests(a, t)).then(|| gap(t, a));
                let set = self.at(thing, anchor, "is near it", &apart)?;
                let nearest = self.alike_first(&set.ids, anchor)?;
                Ok(Set::new(nearest))
            }
        }
    }

    /// The one that was spoken of last.
    fn last(&self) -> Result<IdentityId, Lost> {
        let there = self.dialog.last.filter(|id| self.world.facts(*id).is_some());
        let unclear = "I do not know what you refer to: nothing was spoken of yet.";
        there.ok_or_else(|| Lost::new(RefusalKind::Unclear, unclear, Vec::new()))
    }

    fn bounds(&self, id: IdentityId) -> Option<Bounds> {
        self.world.facts(id).and_then(|f| f.bounds)
    }

    /// The one anchor of a place; several are none.
    fn anchor(&mut self, noun: &Noun) -> Result<IdentityId, Lost> {
        let set = self.set(noun)?;
        match set.settled() {
            [only] => Ok(*only),
            several => {
                let names: Vec<String> = several.iter().take(6).map(|id| the(self.world, *id)).collect();
                let text = format!("Several things match equally: {}. Please say which one in full.", join(&names));
                Err(Lost::new(RefusalKind::Unclear, text, several.to_vec()))
            }
        }
    }
}
