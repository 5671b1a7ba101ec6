//! Evaluation of an expression on a scene: sets of identities, step by step.

use std::ops::Range;

use super::evaluator::{Evaluator, Outcome};
use super::expression::{Condition, Expression, Relation, SetOf};
use super::outcome::{Matches, Member, Unmet, Why};
use super::relations::{HOLDS, Space};
use super::{conditions, nouns, order};
use crate::scene::IdentityId;

impl Evaluator<'_> {
    /// Evaluates an expression; an empty set is an error.
    pub(super) fn set(&mut self, e: &Expression) -> Outcome {
        let found = match &e.set {
            SetOf::Words { words, plural } => nouns::words(self, words, *plural, &e.at)?,
            SetOf::Called(name) => nouns::called(self, name, &e.at)?,
            SetOf::Any { parts, .. } => nouns::any(self, *parts),
            SetOf::Kin { plural } => match self.antecedent.clone() {
                Some(word) => nouns::words(self, &[word], *plural, &e.at)?,
                None => nouns::kin(self, &e.at)?,
            },
            SetOf::Last { plural } => nouns::last(self, *plural, &e.at)?,
            SetOf::Numbered(id) => nouns::numbered(self, *id, &e.at)?,
            SetOf::PartOf(piece, whole) => self.part_of(piece, whole, e)?,
            SetOf::Where { of, is, not } => match conditions::filtered(self, of, is, *not, &e.at) {
                // "What is under the mug": the table.
                Err(unmet)
                    if unmet.why == Why::Nothing
                        && !self.with_stages
                        && of.is_any()
                        && matches!(is, Condition::Placed(..)) =>
                {
                    self.with_stages = true;
                    let again = conditions::filtered(self, of, is, *not, &e.at);
                    self.with_stages = false;
                    again.map_err(|_| unmet)?
                }
                found => found?,
            },
            SetOf::Ranked { of, order, most, first, count, superlative } => {
                let found = self.set(of)?;
                order::ranked(self, found, (*order, *most, *superlative), [*first, *count], &e.at)?
            }
            SetOf::Nearest { of, to, far, first, count } => {
                let anchors = self.anchor(to)?;
                let found = self.set(of)?;
                order::nearest(self, found, &anchors, *far, [*first, *count], &e.at)?
            }
            SetOf::Counted { of, count } => self.counted(of, *count, e)?,
            SetOf::Every { of, both } => {
                let found = self.set(of)?;
                let n = found.settled().len();
                if *both && n != 2 {
                    return Err(self.of_number(&found, "two", e));
                }
                found
            }
            SetOf::One(of) => self.set(of)?,
            SetOf::Nth { of, nth } => {
                let found = self.set(of)?;
                if found.settled().len() < *nth {
                    return Err(self.of_number(&found, &nth.to_string(), e));
                }
                self.notes.push("Say from where to count, such as \u{201c}from the left\u{201d}.".into());
                Matches { unclear: true, ..found }
            }
            SetOf::Other(of) => self.other(of, &e.at)?,
            SetOf::Union { of, either } => self.union(of, *either, e)?,
            SetOf::Except(of, but) => {
                let found = self.set(of)?;
                let before = std::mem::replace(&mut self.antecedent, of.head());
                let out = self.inner(|all| all.set(but));
                self.antecedent = before;
                let out = out?.ids();
                let before = found.members.len();
                let left = found.kept(|m| (!out.contains(&m.id)).then_some(1.0));
                self.idle += usize::from(left.members.len() == before);
                self.step(&e.at, format!("without \u{201c}{}\u{201d}", self.said(&but.at)), &left);
                left
            }
        };
        if found.members.is_empty() {
            let text = format!("Nothing here is \u{201c}{}\u{201d}.", self.said(&e.at));
            return Err(self.unmet(Why::Nothing, text, &e.at));
        }
        Ok(found)
    }

    /// Evaluates the thing that others are compared with.
    pub(super) fn anchor(&mut self, e: &Expression) -> Outcome {
        let found = self.anchor_or_all(e)?;
        Ok(Matches { members: found.settled(), unclear: found.unclear })
    }

    /// Evaluates the thing that others are compared with; what the words fit less is there, too.
    pub(super) fn anchor_or_all(&mut self, e: &Expression) -> Outcome {
        self.of_any_level(|s| s.inner(|s| s.set(e)))
    }

    fn part_of(&mut self, piece: &Expression, whole: &Expression, e: &Expression) -> Outcome {
        let wholes = self.anchor_or_all(whole)?;
        let all = self.scene.identities;
        let pieces = self.of_any_level(|s| s.set(piece));
        let pieces = match pieces {
            Ok(found) => found,
            Err(unmet) if unmet.why == Why::Failed => return Err(unmet),
            Err(unmet) => return Err(self.no_piece(piece, &wholes.settled(), unmet.words, e)),
        };
        // The exact "bowl" may lack the part: another match, the fruit bowl, has the apple.
        for wholes_of in [wholes.settled(), wholes.members.clone()] {
            let within = |m: &Member| wholes_of.iter().any(|w| all.is_piece(m.id, w.id)).then_some(1.0);
            let found = pieces.clone().kept(within);
            if !found.members.is_empty() {
                let owns = |whole: IdentityId| found.members.iter().any(|m| all.is_piece(m.id, whole));
                // "The lids of the kettle and the mug": each that is listed has one.
                let is_list = matches!(whole.set, SetOf::Union { either: false, .. });
                if let Some(bare) = wholes_of.iter().find(|w| is_list && !owns(w.id)) {
                    return Err(self.no_piece(piece, &[*bare], Vec::new(), e));
                }
                let owners = wholes_of.iter().filter(|w| owns(w.id)).count();
                let unclear = found.unclear || wholes.unclear || (owners > 1 && !whole.is_plural());
                let found = Matches { unclear, ..found };
                self.step(&e.at, format!("of \u{201c}{}\u{201d}", self.said(&whole.at)), &found);
                return Ok(found);
            }
        }
        // Things in or on a thing need not be parts of it: the candle on the cake.
        let lies = |s: &Space<'_>, m: &Member| {
            let share =
                |relation| wholes.members.iter().filter_map(|w| s.share(relation, m.id, w.id)).fold(0.0, f64::max);
            Some(share(Relation::In)).filter(|share| *share >= HOLDS[0])
        };
        let is_named = matches!(piece.set, SetOf::Words { .. } | SetOf::Called(_));
        let space = self.space(&e.at).ok().filter(|_| is_named);
        let inside = space.map(|space| pieces.clone().kept(|m| lies(space, m)));
        match inside.filter(|found| !found.members.is_empty()) {
            Some(found) => Ok(found),
            None => Err(self.no_piece(piece, &wholes.settled(), Vec::new(), e)),
        }
    }

    fn no_piece(&self, piece: &Expression, wholes: &[Member], words: Vec<String>, e: &Expression) -> Unmet {
        let all = self.scene.identities;
        let known: Vec<IdentityId> =
            wholes.iter().flat_map(|w| all.children(w.id)).filter(|id| self.scene.is_there(*id)).collect();
        let parts: Vec<String> = known.iter().take(12).map(|id| all.label(*id)).collect();
        let parts = if parts.is_empty() {
            "no parts are known of it".into()
        } else {
            format!("its parts: {}", parts.join(", "))
        };
        let name = wholes.first().map(|w| all.full_name(w.id)).unwrap_or_default();
        let text = format!("The {name} has no \u{201c}{}\u{201d} here; {parts}.", self.said(&piece.at));
        Unmet { why: Why::Nothing, text, words, near: known, at: e.at.clone() }
    }

    fn counted(&mut self, of: &Expression, count: usize, e: &Expression) -> Outcome {
        let found = self.set(of)?;
        let n = found.settled().len();
        if n < count || self.looked {
            return Err(self.of_number(&found, &count.to_string(), e));
        }
        if n > count {
            self.notes.push(format!("There are {n} of them."));
        }
        self.step(&e.at, format!("{count} of them"), &found);
        Ok(Matches { unclear: found.unclear || n > count, ..found })
    }

    fn of_number(&self, found: &Matches, asked: &str, e: &Expression) -> Unmet {
        let ids: Vec<IdentityId> = found.settled().iter().map(|m| m.id).collect();
        let listed: Vec<String> = ids.iter().take(6).map(|id| self.scene.identities.label(*id)).collect();
        let listed = listed.join(", ");
        let text = match ids.len() {
            _ if self.looked => format!("By embedding, which is no count: {listed}. Say each by its name."),
            1 => format!("There is 1 of them here, not {asked}: {listed}."),
            n => format!("There are {n} of them here, not {asked}: {listed}."),
        };
        Unmet { near: ids, ..self.unmet(Why::Nothing, text, &e.at) }
    }

    fn other(&mut self, of: &Expression, at: &Range<usize>) -> Outcome {
        let found = self.set(of)?;
        let last = &self.scene.place.talk.last;
        let others = found.clone().kept(|m| (!last.contains(&m.id)).then_some(1.0));
        if others.members.len() == found.members.len() {
            let unmet = self.unmet(Why::NotUnderstood, "I do not know which other one you mean.", at);
            return Err(Unmet { near: found.ids(), words: vec!["other".into()], ..unmet });
        }
        Ok(others)
    }

    fn union(&mut self, of: &[Expression], either: bool, e: &Expression) -> Outcome {
        let (mut all, mut missing): (Matches, Option<Unmet>) = (Matches::default(), None);
        let before = self.antecedent.clone();
        for one in of {
            let found = self.inner(|s| s.set(one));
            if let Some(head) = one.head() {
                self.antecedent = Some(head);
            }
            match found {
                Ok(found) => {
                    let several = !one.is_plural() && found.settled().len() > 1;
                    all.unclear |= found.unclear || several;
                    let new = found.settled().into_iter().filter(|m| !all.members.iter().any(|o| o.id == m.id));
                    let new: Vec<Member> = new.map(|m| Member { rank: 0, ..m }).collect();
                    all.members.extend(new);
                }
                Err(unmet) => missing = missing.or(Some(unmet)),
            }
        }
        self.antecedent = before;
        match missing {
            Some(unmet) if !either || all.members.is_empty() || unmet.why == Why::NotUnderstood => Err(unmet),
            _ => {
                self.step(&e.at, if either { "any of these" } else { "all of these" }, &all);
                Ok(all)
            }
        }
    }
}
