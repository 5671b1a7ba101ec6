//! Phrases with a structure: "the handle of the kettle", "the mug left of the laptop", "the thing
//! nearest the lamp", "the mug with a blue handle".

use super::{ANYTHING, Lost, Resolver, Set};
use crate::agent::refusal::RefusalKind;
use crate::agent::relation::{Relation, fit, gap};
use crate::scene::{IdentityId, Level};

/// Phrases that place one thing at another, longest first.
const PLACES: [(&str, Relation); 37] = [
    ("on the left hand side of", Relation::LeftOf),
    ("on the right hand side of", Relation::RightOf),
    ("on the left side of", Relation::LeftOf),
    ("on the right side of", Relation::RightOf),
    ("to the left of", Relation::LeftOf),
    ("to the right of", Relation::RightOf),
    ("on the left of", Relation::LeftOf),
    ("on the right of", Relation::RightOf),
    ("left from", Relation::LeftOf),
    ("right from", Relation::RightOf),
    ("left of", Relation::LeftOf),
    ("right of", Relation::RightOf),
    ("on top of", Relation::On),
    ("atop", Relation::On),
    ("in front of", Relation::InFrontOf),
    ("before", Relation::InFrontOf),
    ("in back of", Relation::Behind),
    ("behind", Relation::Behind),
    ("right next to", Relation::Near),
    ("next to", Relation::Near),
    ("close to", Relation::Near),
    ("near to", Relation::Near),
    ("nearby", Relation::Near),
    ("near", Relation::Near),
    ("beside", Relation::Near),
    ("besides", Relation::Near),
    ("around", Relation::Near),
    ("adjacent to", Relation::Near),
    ("by", Relation::Near),
    ("upon", Relation::On),
    ("above", Relation::Above),
    ("over", Relation::Above),
    ("underneath", Relation::Under),
    ("beneath", Relation::Under),
    ("under", Relation::Under),
    ("below", Relation::Under),
    ("inside of", Relation::In),
];
/// The same, where the words may also say whose part it is.
const EITHER: [(&str, Relation); 4] =
    [("inside", Relation::In), ("within", Relation::In), ("in", Relation::In), ("on", Relation::On)];

/// Words between a thing and its place.
const STANDING: [&str; 15] = [
    "that", "which", "is", "are", "stands", "standing", "lies", "lying", "sits", "sitting", "located", "placed",
    "stood", "directly", "who",
];

/// The relation that these words begin with, and how many words say it.
pub(crate) fn relation_at(words: &[&str]) -> Option<(Relation, usize)> {
    let starts = |(phrase, relation): &(&str, Relation)| {
        let wanted: Vec<&str> = phrase.split(' ').collect();
        words.starts_with(&wanted).then_some((*relation, wanted.len()))
    };
    PLACES.iter().chain(EITHER.iter()).find_map(starts)
}

/// Without "that is standing" and the like at the end.
fn trim_standing<'a, 'b>(mut words: &'b [&'a str]) -> &'b [&'a str] {
    while let [rest @ .., last] = words
        && STANDING.contains(last)
    {
        words = rest;
    }
    words
}

impl Resolver<'_> {
    /// Candidates of a phrase with a structure; `None` if it has none.
    pub(super) fn placed(&mut self, words: &[&str], depth: usize) -> Result<Option<Set>, Lost> {
        for i in 0..words.len() {
            let after = |n: usize| super::trim(words.get(i + n..).unwrap_or_default());
            // "The controller on the left" chooses; there is no thing called "left".
            let chooses = ["on", "at", "to", "in", "from"].contains(&words[i]) && i > 0;
            if let [
                side @ ("left" | "right" | "back" | "front" | "top" | "bottom" | "middle" | "far left" | "far right"),
            ] = after(1)
                && chooses
            {
                if super::pick::pick_of(words[0]).is_some() {
                    return self.picked(words, depth + 1).map(Some);
                }
                let thing = trim_standing(&words[..i]);
                let set = self.set(thing, depth + 1)?;
                let pick = super::pick::pick_of(if *side == "back" { "rear" } else { side });
                return pick.map(|pick| self.apply(pick, thing, &set.ids)).transpose();
            }
            if let Some((relation, n)) = relation_at(&words[i..])
                && !after(n).is_empty()
            {
                return self.at_place(relation, &words[..i], after(n), depth).map(Some);
            }
            if words[i] == "between"
                && let Some(and) = words[i..].iter().position(|w| *w == "and").map(|at| at + i)
                && and > i + 1
                && and + 1 < words.len()
            {
                return self.between(&words[..i], [&words[i + 1..and], &words[and + 1..]], depth).map(Some);
            }
            let nearest = ["nearest", "closest"].contains(&words[i]);
            if nearest && i > 0 {
                let anchor = if words.get(i + 1) == Some(&"to") { after(2) } else { after(1) };
                if !anchor.is_empty() {
                    return self.nearest(&words[..i], anchor, depth).map(Some);
                }
            }
            if nearest && i == 0 {
                if words.get(1) == Some(&"to") {
                    return self.nearest(&["thing"], after(2), depth).map(Some);
                }
                let to = words.iter().position(|w| *w == "to").filter(|t| *t > 1 && *t + 1 < words.len());
                if let Some(to) = to {
                    return self.nearest(&words[1..to], super::trim(&words[to + 1..]), depth).map(Some);
                }
            }
            if ["of", "from", "belonging"].contains(&words[i]) && i > 0 && !after(1).is_empty() {
                return self.piece_of(&words[..i], after(1), depth).map(Some);
            }
            if words[i] == "with" && i > 0 && !after(1).is_empty() {
                return self.having(&words[..i], after(1), words, depth).map(Some);
            }
            let owner =
                words[i].strip_suffix("'s").or_else(|| words[i].strip_suffix('\'').filter(|o| o.ends_with('s')));
            if let Some(owner) = owner.filter(|o| !o.is_empty() && i + 1 < words.len()) {
                // "The doll's face's eye": the last owner has the piece.
                let is_last = !words[i + 1..].iter().any(|w| w.ends_with("'s"));
                if is_last {
                    let whole: Vec<&str> = words[..i].iter().copied().chain([owner]).collect();
                    // What stands elsewhere is said of the piece: "the mug's handle left of ...".
                    return self.piece_of(&words[i + 1..], &whole, depth).map(Some);
                }
            }
        }
        Ok(None)
    }

    /// "X of the Y": a piece, or one of several.
    fn piece_of(&mut self, piece: &[&str], whole: &[&str], depth: usize) -> Result<Set, Lost> {
        // "Second mug from the left" counts, and is about no whole.
        if matches!(whole, ["left" | "right"]) {
            let words: Vec<&str> = piece.iter().copied().chain(["from", "the"]).chain(whole.iter().copied()).collect();
            return self.picked(&words, depth + 1);
        }
        let piece = super::trim(piece);
        let wholes = self.set(whole, depth + 1)?;
        if let [only] = piece {
            if ["one", "any", "either", "both", "all"].contains(only) {
                return Ok(Set { chosen: true, ..wholes });
            }
            let group = wholes.ids.len() > 1;
            if let Some(pick) = super::pick::pick_of(only).filter(|_| group) {
                return self.apply(pick, whole, &wholes.ids);
            }
        }
        self.pieces(&wholes, piece, depth + 1)
    }

    /// "X with a Y": those that have such a piece, or stand at one.
    fn having(&mut self, thing: &[&str], piece: &[&str], all: &[&str], depth: usize) -> Result<Set, Lost> {
        if let Ok(set) = self.lookup(all) {
            return Ok(set);
        }
        let things = self.set(thing, depth + 1)?;
        let owners: Vec<IdentityId> = things
            .ids
            .iter()
            .copied()
            .filter(|id| self.pieces(&Set::of(vec![*id]), piece, depth + 1).is_ok())
            .collect();
        if owners.is_empty() {
            let text = format!("I find no {} with {}.", thing.join(" "), piece.join(" "));
            return Err(Lost::new(RefusalKind::Conflict, text, things.ids));
        }
        Ok(Set { ids: owners, chosen: true, ..Set::default() })
    }

    fn at_place(&mut self, relation: Relation, thing: &[&str], anchor: &[&str], depth: usize) -> Result<Set, Lost> {
        let thing = trim_standing(thing);
        let either = matches!(relation, Relation::On | Relation::In);
        if either && !super::trim(thing).is_empty() {
            let wholes = self.set(anchor, depth + 1)?;
            if let Ok(set) = self.pieces(&wholes, thing, depth + 1) {
                return Ok(set);
            }
        }
        let anchors = self.anchors(anchor, depth)?;
        let (things, is_any) = self.things(thing, depth)?;
        let frame = self.world.view().frame();
        let ranked = self.ranked(&things, &anchors, |t, a| fit(relation, t, a, &frame));
        if ranked.is_empty() {
            let what = if is_any { "Nothing here".to_owned() } else { format!("No {} here", thing.join(" ")) };
            let text =
                format!("{what} is {} the {}, as far as I can tell from this view.", relation.text(), anchor.join(" "));
            let near = if is_any { Vec::new() } else { things };
            return Err(Lost::new(RefusalKind::Conflict, text, near));
        }
        Ok(Set { ids: ranked, chosen: true, first: is_any, ..Set::default() })
    }

    fn nearest(&mut self, thing: &[&str], anchor: &[&str], depth: usize) -> Result<Set, Lost> {
        let thing = trim_standing(thing);
        let anchors = self.anchors(anchor, depth)?;
        let (things, _) = self.things(thing, depth)?;
        let mut ranked =
            self.ranked(&things, &anchors, |t, a| Some(gap(t, a) + 1e-3 * t.center().distance(a.center())));
        ranked.truncate(1);
        if ranked.is_empty() {
            return Err(Lost::new(RefusalKind::NotFound, "I find nothing like that near it.", things));
        }
        Ok(Set { ids: ranked, chosen: true, ..Set::default() })
    }

    /// Things whose middle is near the line from one thing to another, between the two.
    fn between(&mut self, thing: &[&str], ends: [&[&str]; 2], depth: usize) -> Result<Set, Lost> {
        let mut middles = Vec::new();
        let mut own = Vec::new();
        for end in ends {
            let ids = self.anchors(super::trim(end), depth)?;
            middles.extend(ids.first().and_then(|id| self.bounds(*id)).map(|b| b.center()));
            own.extend(ids);
        }
        let (things, is_any) = self.things(trim_standing(thing), depth)?;
        let [from, to] = middles[..] else {
            return Err(Lost::new(RefusalKind::Conflict, "I cannot tell where that is.", own));
        };
        let (way, all) = (to - from, self.world.identities());
        let mut found: Vec<(f64, IdentityId)> = Vec::new();
        for id in things.into_iter().filter(|id| !own.iter().any(|o| all.line(*id).any(|l| l == *o))) {
            let Some(bounds) = self.bounds(id).filter(|_| !own.contains(&id)) else { continue };
            let along = (bounds.center() - from).dot(way) / way.length_squared().max(1e-12);
            let off = (bounds.center() - from - way * along).length();
            if (0.1..0.9).contains(&along) && off < 0.4 * way.length() && bounds.radius() < way.length() {
                found.push((off, id));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        if found.is_empty() {
            let text = format!(
                "I find nothing like that between the {} and the {}.",
                ends[0].join(" "),
                super::trim(ends[1]).join(" ")
            );
            return Err(Lost::new(RefusalKind::Conflict, text, own));
        }
        let ids = found.into_iter().map(|(_, id)| id).collect();
        Ok(Set { ids, chosen: true, first: is_any, ..Set::default() })
    }

    fn anchors(&mut self, words: &[&str], depth: usize) -> Result<Vec<IdentityId>, Lost> {
        let set = self.set(words, depth + 1)?;
        Ok(self.settle(&set))
    }

    /// The things that are placed, and whether any thing will do.
    fn things(&mut self, words: &[&str], depth: usize) -> Result<(Vec<IdentityId>, bool), Lost> {
        let words = super::trim(words);
        let is_any = words.is_empty() || words == ["one"] || (words.len() == 1 && ANYTHING.contains(&words[0]));
        if is_any {
            let all = self.world.identities();
            let objects = all.iter().filter(|(_, i)| i.level == Level::Object).map(|(id, _)| id);
            return Ok((objects.filter(|id| self.world.facts(*id).is_some()).collect(), true));
        }
        Ok((self.set(words, depth + 1)?.ids, false))
    }

    /// Those of `things` for which `score` finds an anchor, best first. What is a piece of an
    /// anchor, or has it as a piece, has no place at it.
    fn ranked(
        &self,
        things: &[IdentityId],
        anchors: &[IdentityId],
        score: impl Fn(&crate::scene::Bounds, &crate::scene::Bounds) -> Option<f64>,
    ) -> Vec<IdentityId> {
        let all = self.world.identities();
        let mut found: Vec<(f64, IdentityId)> = Vec::new();
        for thing in things {
            let Some(own) = self.bounds(*thing) else { continue };
            let apart = |a: &&IdentityId| !all.line(*thing).any(|l| l == **a) && !all.line(**a).any(|l| l == *thing);
            let best =
                anchors.iter().filter(apart).filter_map(|a| score(&own, &self.bounds(*a)?)).min_by(f64::total_cmp);
            found.extend(best.map(|s| (s, *thing)));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, id)| id).collect()
    }
}
