//! From words to the thing that is meant: names, pieces of wholes, places at other things, superlatives,
//! pronouns. What several things fit equally is said to be so, what nothing fits is not there; nothing is
//! guessed. What no name says is asked of the scene's encoder, if it has one.

mod called;
mod embedded;
mod noun;

pub(crate) use noun::{NameWords, is_thing, name_words, words_of};

use self::noun::{ANYTHING, Noun, PARTS, Pick, readings};
use super::describe::{join, the};
use super::dialog::DialogState;
use super::language::Key;
use super::refusal::{Refusal, RefusalKind};
use super::relation::{Relation, fit, gap};
use super::words::{alike, singular};
use super::world::World;
use crate::pipeline::semantics::reading::{mend, mended_text};
use crate::pipeline::semantics::recipe::Understanding;
use crate::scene::identity::whole_names::BETWEEN;
use crate::scene::{Bounds, IdentityId, Level, LevelFilter};

/// What words come to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Resolved {
    /// This one is meant. The note says how it was found, if not by its name.
    One {
        id: IdentityId,
        note: String,
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
    let mut resolver = Resolver { world, dialog, level, note: String::new() };
    match resolver.phrase(&phrase) {
        Ok(set) => match set.settled() {
            [id] => {
                let notes = [mended_text(&mended).unwrap_or_default(), resolver.note];
                Resolved::One { id: *id, note: notes.join(" ").trim().into() }
            }
            several => Resolved::Several(several.to_vec()),
        },
        Err(Lost { refusal, near }) => Resolved::Missing { refusal, near },
    }
}

/// All identities that a phrase such as "buttons" or "bottles on the table" means; none if nothing fits.
pub(crate) fn resolve_all(
    world: &mut dyn World,
    phrase: &str,
    level: LevelFilter,
    dialog: &DialogState,
) -> Result<Vec<IdentityId>, Refusal> {
    let mut resolver = Resolver { world, dialog, level, note: String::new() };
    match resolver.phrase(phrase) {
        Ok(set) => Ok(set.ids),
        Err(Lost { refusal, .. }) if refusal.kind == RefusalKind::Conflict => Ok(Vec::new()),
        Err(Lost { refusal, .. }) => Err(refusal),
    }
}

/// Why no set of candidates was found.
struct Lost {
    refusal: Refusal,
    near: Vec<IdentityId>,
}

impl Lost {
    fn new(kind: RefusalKind, text: impl Into<String>, near: Vec<IdentityId>) -> Self {
        Self { refusal: Refusal::new(kind, text), near }
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
    note: String,
}

impl Resolver<'_> {
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
        // What is called "left stick" is not the left one of the sticks.
        nouns.sort_by_key(|n| matches!(n, Noun::Picked(..)));
        let mut found: Option<Set> = None;
        let mut lost = Lost::new(RefusalKind::Unclear, "I am not sure which thing you mean.", Vec::new());
        for noun in &nouns {
            if found.is_some() && matches!(noun, Noun::Picked(..)) {
                break;
            }
            match (self.set(noun), &mut found) {
                (Ok(set), None) => found = Some(set),
                (Ok(set), Some(all)) if set.settled() != all.settled() => {
                    let new: Vec<IdentityId> = set.ids.into_iter().filter(|id| !all.ids.contains(id)).collect();
                    *all = Set::new(all.settled().iter().copied().chain(new).collect());
                }
                (Ok(_), _) => {}
                // Of reasons why nothing is found, one about the scene says more than an unknown word.
                (Err(new), _) if lost.refusal.kind != RefusalKind::Conflict => lost = new,
                (Err(_), _) => {}
            }
        }
        found.ok_or(lost)
    }

    fn set(&mut self, noun: &Noun) -> Result<Set, Lost> {
        match noun {
            Noun::Last => self.last().map(|id| Set::new(vec![id])),
            Noun::Number(id) if self.world.facts(*id).is_some() => Ok(Set::new(vec![*id])),
            Noun::Number(id) => Err(Lost::new(
                RefusalKind::NotFound,
                format!("There is nothing with the number {id} here."),
                Vec::new(),
            )),
            Noun::Called(name) => self.called(name).map_or_else(|| self.named(&name_words(name)), Ok),
            Noun::Named(words) => self.named(words),
            Noun::Picked(pick, of) => self.picked(*pick, of),
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

    /// Candidates by the words of their names: all words are in the names of a thing and its wholes, the
    /// last one in its own. Slips are not taken for names.
    fn named(&mut self, words: &[String]) -> Result<Set, Lost> {
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
        let fits = |id: &IdentityId, has_head: &dyn Fn(&[String]) -> bool| {
            own(*id).iter().any(|n| has_head(&name_words(n))) && rest.iter().all(|w| line_has(*id, w))
        };
        let exact: Vec<IdentityId> =
            everyone.iter().copied().filter(|id| own(*id).iter().any(|n| name_words(n) == words)).collect();
        // A table lamp is no table; a vase with water is a vase.
        let heads =
            |name: &[String]| name.split(|w| w == "with" || w == "of").next().and_then(<[_]>::last) == Some(head);
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

    /// Nothing is called so: the nearest names, by words they share or slips of them.
    fn not_found(&self, text: &str, words: &[String]) -> Lost {
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
            let is_named = |(id, i): &(IdentityId, &crate::scene::Identity)| {
                i.level == Level::Object && !i.names.is_empty() && here(id)
            };
            let some: Vec<IdentityId> = all.iter().filter(is_named).map(|(id, _)| id).take(8).collect();
            if some.is_empty() { String::new() } else { format!(" Some names here: {}.", listed(&some)) }
        } else {
            format!(" The nearest names: {}.", listed(&near))
        };
        Lost::new(RefusalKind::NotFound, format!("There is no '{text}' in this scene.{said}"), near)
    }

    /// Pieces of a whole that words name.
    fn pieces(&mut self, piece: &Noun, whole: &Noun) -> Result<Set, Lost> {
        let wholes = self.set(whole)?.settled().to_vec();
        let all = self.world.identities();
        let mut inside = vec![false; all.len() + 1];
        for whole in &wholes {
            all.descendants(*whole).iter().enumerate().for_each(|(i, is_in)| inside[i] |= *is_in);
        }
        wholes.iter().for_each(|id| inside[*id as usize] = false);
        let is_in = |id: &IdentityId| inside.get(*id as usize) == Some(&true);
        let known: Vec<IdentityId> =
            all.iter().map(|(id, _)| id).filter(is_in).filter(|id| self.world.facts(*id).is_some()).collect();
        let name = wholes.first().map(|id| all.full_name(*id)).unwrap_or_default();
        let said = match piece {
            Noun::Named(words) => words.join(" "),
            Noun::Called(name) => name.clone(),
            _ => "such piece".into(),
        };
        let level = std::mem::replace(&mut self.level, LevelFilter::Auto);
        let set = self.set(piece);
        self.level = level;
        if let Ok(set) = set {
            let keep = |ids: Vec<IdentityId>| ids.into_iter().filter(is_in).collect::<Vec<_>>();
            let set = Set { ids: keep(set.ids), exact: keep(set.exact) };
            if !set.ids.is_empty() {
                return Ok(set);
            }
        }
        let of = match whole {
            Noun::Named(words) if self.world.understanding() == Understanding::Embedding => words.join(" "),
            Noun::Called(name) => name.clone(),
            _ => name.clone(),
        };
        let meant = self.by_embedding(&[said.as_str(), &of].join(BETWEEN), LevelFilter::Part)?.unwrap_or_default();
        let meant: Vec<IdentityId> = meant.into_iter().filter(is_in).collect();
        if !meant.is_empty() {
            return Ok(Set::new(meant));
        }
        self.note.clear();
        let names: Vec<String> = known.iter().take(12).map(|id| self.world.identities().label(*id)).collect();
        let parts =
            if names.is_empty() { "no parts are known of it".into() } else { format!("its parts: {}", join(&names)) };
        Err(Lost::new(RefusalKind::Conflict, format!("The {name} has no '{said}' here; {parts}."), known))
    }

    /// Things for which `score` holds at the anchor, best first. What is a piece of the anchor, or has it as
    /// one, has no place at it.
    fn at(
        &mut self,
        thing: &Noun,
        anchor: &Noun,
        what: &str,
        score: &dyn Fn(&Bounds, &Bounds) -> Option<f64>,
    ) -> Result<Set, Lost> {
        let anchor = self.anchor(anchor)?;
        let set = self.set(thing)?;
        let all = self.world.identities();
        let place = self.bounds(anchor);
        let apart =
            |id: &IdentityId| !all.ancestors(*id).any(|l| l == anchor) && !all.ancestors(anchor).any(|l| l == *id);
        let holds = |id: &IdentityId| score(&self.bounds(*id)?, place.as_ref()?).map(|s| (s, *id));
        let mut found: Vec<(f64, IdentityId)> = set.ids.iter().filter(|id| apart(id)).filter_map(holds).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        if found.is_empty() {
            let text = format!("I find nothing like that {what}: I looked at {}.", the(self.world, anchor));
            return Err(Lost::new(RefusalKind::Conflict, text, Vec::new()));
        }
        let ids: Vec<IdentityId> = found.into_iter().map(|(_, id)| id).collect();
        let exact = set.exact.into_iter().filter(|id| ids.contains(id)).collect();
        Ok(Set { ids, exact })
    }

    /// The first of things sorted by their gap to the anchor, with those as near as it.
    fn alike_first(&mut self, ids: &[IdentityId], anchor: &Noun) -> Result<Vec<IdentityId>, Lost> {
        let place = self.anchor(anchor).map(|id| self.bounds(id))?;
        let far = |id: &IdentityId| self.bounds(*id).zip(place).map_or(f64::INFINITY, |(b, p)| gap(&b, &p));
        let least = ids.first().map_or(0.0, far);
        Ok(ids.iter().copied().filter(|id| far(id) <= least + 1e-9).collect())
    }

    /// The one of the candidates that `pick` says; those that fit equally, if that decides nothing.
    fn picked(&mut self, pick: Pick, of: &Noun) -> Result<Set, Lost> {
        let ids = self.set(of)?.ids;
        let (key, most) = match pick {
            Pick::Other => {
                let others: Vec<IdentityId> = ids.iter().copied().filter(|id| Some(*id) != self.dialog.last).collect();
                let told = others.len() < ids.len() && !others.is_empty();
                let unclear =
                    || Lost::new(RefusalKind::Unclear, "I do not know which other one you mean.", ids.clone());
                return if told { Ok(Set::new(others)) } else { Err(unclear()) };
            }
            // Of three, the left one is any but the rightmost.
            Pick::More(..) if ids.len() > 2 => return Ok(Set::new(ids)),
            Pick::Most(key, most) | Pick::More(key, most) => (key, most),
        };
        let values: Vec<(f64, IdentityId)> = ids.iter().filter_map(|id| Some((self.value(*id, key)?, *id))).collect();
        let sign = if most { -1.0 } else { 1.0 };
        let Some(best) = values.iter().map(|(v, _)| sign * v).min_by(f64::total_cmp) else {
            return Err(Lost::new(RefusalKind::Conflict, "Nothing here has a size or place to compare.", ids));
        };
        let slack = 1e-6 * best.abs().max(1e-6);
        Ok(Set::new(values.iter().filter(|(v, _)| sign * v <= best + slack).map(|(_, id)| *id).collect()))
    }

    fn value(&self, id: IdentityId, key: Key) -> Option<f64> {
        let (view, bounds) = (self.world.view(), self.bounds(id)?);
        let frame = view.frame();
        let extent = || self.world.extent(id);
        match key {
            Key::Size => extent().map(|e| [e.length, e.width, e.height].map(|x| x.max(1e-9)).iter().product()),
            Key::Height => extent().map(|e| e.height),
            Key::Length => extent().map(|e| e.length),
            Key::Right => Some(bounds.center().dot(frame.right)),
            Key::Up => Some(bounds.center().dot(frame.up)),
            Key::Distance => Some(bounds.center().distance(view.eye)),
        }
    }

    /// What "one" may stand for: the candidates of the last question, else what shares the last word of the
    /// last thing's name.
    fn kin(&self) -> Vec<IdentityId> {
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
