//! Words that choose among candidates: "the largest", "the second", "the left", "the other".

use glam::DVec3;

use super::{Lost, Resolver, Set};
use crate::agent::refusal::RefusalKind;
use crate::agent::relation::{gap, span};
use crate::agent::words::{number, ordinal, singular};
use crate::scene::{Bounds, IdentityId};

/// How a word chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    /// The n-th from the left as seen now, from 1; -1 for the last.
    Ordinal(i32),
    /// Not the last one spoken of.
    Other,
    /// The one with the most of this, or the least.
    Most(Key, bool),
    /// Neither the first nor the last from the left.
    Middle,
}

/// What candidates are compared by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// Volume of the box.
    Size,
    /// Height of the box.
    Height,
    /// Length of the box's longest edge.
    Length,
    /// Place to the right.
    Right,
    /// Place upwards.
    Up,
    /// Distance from the eye.
    Distance,
}

/// How a word chooses, if it does.
pub(super) fn pick_of(word: &str) -> Option<Pick> {
    if let Some(n) = ordinal(word) {
        return Some(Pick::Ordinal(n));
    }
    Some(match word {
        "other" | "another" | "opposite" => Pick::Other,
        "largest" | "biggest" | "bigger" | "larger" | "hugest" => Pick::Most(Key::Size, true),
        "smallest" | "tiniest" | "littlest" | "smaller" => Pick::Most(Key::Size, false),
        "tallest" | "taller" => Pick::Most(Key::Height, true),
        "shortest" | "shorter" => Pick::Most(Key::Height, false),
        "longest" | "longer" => Pick::Most(Key::Length, true),
        "left" | "leftmost" | "left-most" | "left-hand" => Pick::Most(Key::Right, false),
        "right" | "rightmost" | "right-most" | "right-hand" => Pick::Most(Key::Right, true),
        "upper" | "top" | "topmost" | "highest" => Pick::Most(Key::Up, true),
        "lower" | "bottom" | "lowest" => Pick::Most(Key::Up, false),
        "nearest" | "closest" | "nearer" | "front" => Pick::Most(Key::Distance, false),
        "farthest" | "furthest" | "farther" | "further" | "rear" => Pick::Most(Key::Distance, true),
        "middle" | "central" | "center" | "centre" => Pick::Middle,
        _ => return None,
    })
}

/// Whether a word chooses among things.
pub(crate) fn is_pick(word: &str) -> bool {
    pick_of(word).is_some()
}

impl Resolver<'_> {
    /// Candidates for words without relations: a name, or something that chooses among names.
    pub(super) fn chosen(&mut self, words: &[&str], depth: usize) -> Result<Set, Lost> {
        if let Some(set) = self.one_of_them(words)? {
            return Ok(set);
        }
        if let [first, rest @ ..] = words
            && !rest.is_empty()
        {
            let many = ["both", "all", "every", "each"].contains(first);
            let count = number(first).filter(|n| n.fract() == 0.0 && *n >= 1.0);
            if many || count.is_some() {
                let mut set = self.set(rest, depth + 1)?;
                if count.is_some_and(|n| n > set.ids.len() as f64) {
                    return Err(self.too_few(rest, &set.ids));
                }
                set.chosen = true;
                return Ok(set);
            }
            if pick_of(first).is_some() {
                // "Left stick" may be a name.
                if let Ok(set) = self.lookup(words) {
                    return Ok(set);
                }
                return self.picked(words, depth);
            }
        }
        self.lookup(words)
    }

    /// "Largest bottle", "second mug from the left": the rest's candidates, one of them chosen.
    pub(super) fn picked(&mut self, words: &[&str], depth: usize) -> Result<Set, Lost> {
        let (Some(first), rest) = (words.first(), words.get(1..).unwrap_or_default()) else {
            return self.lookup(words);
        };
        let Some(pick) = pick_of(first) else { return self.lookup(words) };
        let (rest, from_right) = match rest {
            [rest @ .., "from", "the", "right"] => (rest, true),
            [rest @ .., "from", "the", "left"] => (rest, false),
            _ => (rest, false),
        };
        let set = self.set(rest, depth + 1)?;
        let mut ids = set.ids;
        if from_right {
            ids = self.sorted(&ids, Key::Right);
            ids.reverse();
            return self.nth(rest, &ids, pick);
        }
        self.apply(pick, rest, &ids)
    }

    fn nth(&self, words: &[&str], ids: &[IdentityId], pick: Pick) -> Result<Set, Lost> {
        let at = match pick {
            Pick::Ordinal(-1) => ids.len().checked_sub(1),
            Pick::Ordinal(n) => (n as usize).checked_sub(1),
            _ => Some(0),
        };
        match at.and_then(|i| ids.get(i)) {
            Some(id) => Ok(Set { ids: vec![*id], chosen: true, ..Set::default() }),
            None => Err(self.too_few(words, ids)),
        }
    }

    fn too_few(&self, words: &[&str], ids: &[IdentityId]) -> Lost {
        let what = words.iter().copied().filter(|w| *w != "the").collect::<Vec<_>>().join(" ");
        let what = if what == "one" || what.is_empty() { "of them".to_owned() } else { singular(&what) };
        let text = match ids.len() {
            1 => format!("There is only one {what} here."),
            n => format!("There are only {n} here that are called {what}."),
        };
        Lost::new(RefusalKind::Conflict, text, ids.to_vec())
    }

    /// One of `ids`, as `pick` says; `words` are what they are called.
    pub(super) fn apply(&self, pick: Pick, words: &[&str], ids: &[IdentityId]) -> Result<Set, Lost> {
        let picked = |ids: Vec<IdentityId>| Ok(Set { ids, chosen: true, ..Set::default() });
        match pick {
            Pick::Ordinal(_) => self.nth(words, &self.sorted(ids, Key::Right), pick),
            Pick::Middle => {
                let sorted = self.sorted(ids, Key::Right);
                picked(sorted.get(sorted.len() / 2).copied().into_iter().collect())
            }
            Pick::Other => {
                let last = self.focus.last;
                let others: Vec<IdentityId> = ids.iter().copied().filter(|id| Some(*id) != last).collect();
                if others.is_empty() {
                    let what = words.join(" ");
                    return Err(Lost::new(
                        RefusalKind::Conflict,
                        format!("There is no other {what} here."),
                        ids.to_vec(),
                    ));
                }
                picked(others)
            }
            Pick::Most(key, most) => {
                let sorted = self.sorted(ids, key);
                let id = if most { sorted.last() } else { sorted.first() };
                picked(id.copied().into_iter().collect())
            }
        }
    }

    /// Ascending by `key`; what has no box comes first for none of them, so it is left out if
    /// anything has one.
    pub(super) fn sorted(&self, ids: &[IdentityId], key: Key) -> Vec<IdentityId> {
        let view = self.world.view();
        let frame = view.frame();
        let here = Bounds { min: view.eye, max: view.eye };
        let value = |b: &Bounds| match key {
            Key::Size => b.size().max(DVec3::splat(1e-9)).element_product(),
            Key::Height => {
                let (low, high) = span(b, frame.up);
                high - low
            }
            Key::Length => b.size().max_element(),
            Key::Right => b.center().dot(frame.right),
            Key::Up => b.center().dot(frame.up),
            Key::Distance => gap(b, &here),
        };
        let mut with: Vec<(f64, IdentityId)> =
            ids.iter().filter_map(|id| Some((value(&self.bounds(*id)?), *id))).collect();
        if with.is_empty() {
            return ids.to_vec();
        }
        with.sort_by(|a, b| a.0.total_cmp(&b.0));
        with.into_iter().map(|(_, id)| id).collect()
    }

    /// "The blue one", "the other one", "the second": chosen from what was spoken of.
    fn one_of_them(&mut self, words: &[&str]) -> Result<Option<Set>, Lost> {
        let (said, is_one) = match words {
            [said @ .., "one" | "ones"] => (said, true),
            _ => {
                (words, words.iter().all(|w| pick_of(w).is_some() || ["the", "two", "of", "them", "these"].contains(w)))
            }
        };
        if !is_one {
            return Ok(None);
        }
        let mut set = Set::of(self.kin());
        if set.ids.is_empty() {
            let text = "I do not know what you choose from: nothing was spoken of yet.";
            return Err(Lost::new(RefusalKind::Unclear, text, Vec::new()));
        }
        for word in said.iter().filter(|w| !["the", "that", "this", "of", "them", "these", "two"].contains(*w)) {
            if let Some(pick) = pick_of(word) {
                set = self.apply(pick, &["one"], &set.ids)?;
                continue;
            }
            let all = self.world.identities();
            let has = |id: &IdentityId| {
                let names = all.get(*id).map(|i| i.names.as_slice()).unwrap_or_default();
                names.iter().flat_map(|n| super::lookup::name_words(n)).any(|w| crate::agent::words::alike(&w, word))
            };
            let fit: Vec<IdentityId> = set.ids.iter().copied().filter(has).collect();
            if fit.is_empty() {
                let names: Vec<String> =
                    set.ids.iter().take(4).map(|id| format!("the {}", all.full_name(*id))).collect();
                let text = format!("None is {word} by name; there are {}.", crate::agent::describe::join(&names));
                return Err(Lost::new(RefusalKind::Conflict, text, set.ids));
            }
            set = Set { ids: fit, chosen: true, ..Set::default() };
        }
        Ok(Some(set))
    }

    /// What "one" may stand for: the candidates of the last question, else what is called like the
    /// last thing (its siblings, if it is a part).
    fn kin(&self) -> Vec<IdentityId> {
        if !self.focus.group.is_empty() {
            return self.focus.group.clone();
        }
        let all = self.world.identities();
        let Some(last) = self.focus.last.and_then(|id| Some((id, all.get(id)?))) else { return Vec::new() };
        let (id, identity) = last;
        let words: Vec<String> = identity.names.first().map(|n| super::lookup::name_words(n)).unwrap_or_default();
        for word in words.iter().rev() {
            let like = |other: &IdentityId| {
                all.get(*other).is_some_and(|o| {
                    let same = |n: &String| super::lookup::name_words(n).iter().any(|w| singular(w) == singular(word));
                    o.parent == identity.parent && o.level == identity.level && o.names.iter().any(same)
                })
            };
            let kin: Vec<IdentityId> = self.everyone().into_iter().filter(like).collect();
            if kin.len() > 1 {
                return kin;
            }
        }
        vec![id]
    }

    /// Chooses among pieces by words such as "left button"; `None` if the words do not.
    pub(super) fn choose_among(
        &mut self,
        of: &[IdentityId],
        words: &[&str],
        depth: usize,
    ) -> Result<Option<Set>, Lost> {
        let [first, rest @ ..] = words else { return Ok(None) };
        let Some(pick) = pick_of(first) else { return Ok(None) };
        if depth > super::DEEPEST {
            return Ok(None);
        }
        let rest = match rest {
            ["one" | "ones" | "part" | "parts" | "piece"] | [] => return self.apply(pick, &["part"], of).map(Some),
            rest => rest,
        };
        let inner = self.lookup(rest)?.ids;
        let ids: Vec<IdentityId> = inner.into_iter().filter(|id| of.contains(id)).collect();
        if ids.is_empty() { Ok(None) } else { self.apply(pick, rest, &ids).map(Some) }
    }
}
