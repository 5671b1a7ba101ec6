//! Sets that a noun stands for: by name, by words of names, by kind, by the encoder.

use std::collections::BTreeSet;
use std::ops::Range;

use super::adjectives::{self, Adjective};
use super::evaluator::{Evaluator, Outcome};
use super::outcome::{Matches, Member, Unmet, Why};
use crate::models;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::scene::colors::row;
use crate::scene::identity::lexicon::{self, Kinship};
use crate::scene::identity::name_words;
use crate::scene::{IdentityId, Level};

/// Sureness of what has the name only in part: a kind of it, or by embedding.
const KIND: f64 = 0.95;

/// Kinds of things that lie in others, or are worn by them: as parts they are things of their own.
const CONTENTS: [&str; 3] = ["food", "clothing", "flower"];

fn member(id: IdentityId) -> Member {
    Member { id, sure: 1.0, rank: 1 }
}

/// Identities of a whole name. Others whose names have the words are candidates, too.
pub(super) fn called(all: &mut Evaluator<'_>, name: &str, at: &Range<usize>) -> Outcome {
    let identities = all.scene.identities;
    let exact = identities.called(name, crate::scene::LevelFilter::Auto).into_iter().filter(|id| all.accepts(*id));
    let mut exact: Vec<IdentityId> = exact.collect();
    // A piece and its whole with the same name are not two things.
    let all_exact = exact.clone();
    exact.retain(|id| !identities.ancestors(*id).skip(1).any(|i| all_exact.contains(&i)));
    if exact.is_empty() {
        return words(all, &name_words::words(name), false, at);
    }
    let said = name_words::words(name);
    let is_own = |id: &IdentityId| identities.words().names(*id).contains(&said);
    let mut members: Vec<Member> = exact.iter().map(|id| Member { rank: 0, ..member(*id) }).collect();
    if exact.iter().any(is_own) {
        let others = by_heads(all, &said).members.into_iter().filter(|m| !exact.contains(&m.id));
        members.extend(others.map(|m| Member { rank: m.rank.max(1), ..m }));
    }
    let found = Matches::new(members);
    all.noun_step(at, format!("called \u{201c}{}\u{201d}", all.said(at)), &found);
    Ok(found)
}

/// Any object that does not carry all others, or any part.
pub(super) fn any(all: &mut Evaluator<'_>, parts: bool) -> Matches {
    let identities = all.scene.identities;
    let stages = all.space.filter(|s| s.shapes.are_known() && !all.with_stages);
    let stages = stages.map(|s| s.stages().to_vec()).unwrap_or_default();
    let level = if parts { Level::Part } else { Level::Object };
    let wanted =
        identities.iter().filter(|(id, i)| i.level == level && !stages.contains(id) && all.scene.is_there(*id));
    let found: Vec<Member> = wanted.map(|(id, _)| member(id)).collect();
    // Worth a remark where they are asked for, not where others are compared with them.
    if !stages.is_empty() && !parts && all.depth == 0 && found.len() < identities.count(level) {
        let names: Vec<String> = stages.iter().map(|id| identities.label(*id)).collect();
        let note = format!("Not counting what the others stand on: {}.", names.join(", "));
        if !all.notes.contains(&note) {
            all.notes.push(note);
        }
    }
    Matches::new(found)
}

/// Parts that are things of their own, such as the apple of a fruit bowl.
pub(super) fn contents(all: &Evaluator<'_>) -> Vec<Member> {
    let identities = all.scene.identities;
    let kinds = identities.words().kinds();
    let of_kind = CONTENTS.iter().flat_map(|kind| kinds.of(kind)).map(|(id, ..)| id);
    let is_part = |id: &IdentityId| identities.get(*id).is_some_and(|i| i.level == Level::Part);
    let ids: BTreeSet<IdentityId> = of_kind.filter(|id| is_part(id) && all.accepts(*id)).collect();
    ids.into_iter().map(member).collect()
}

/// Identities that "one" may stand for: the candidates of the last question, else all whose name ends in the same
/// word as the name of the last thing.
pub(super) fn kin(all: &mut Evaluator<'_>, at: &Range<usize>) -> Outcome {
    let talk = all.scene.place.talk.clone();
    if !talk.group.is_empty() {
        let there = talk.group.iter().copied().filter(|id| all.scene.is_there(*id));
        return Ok(Matches::new(there.map(member).collect()));
    }
    let known = all.scene.identities.words();
    let heads = talk.last.iter().filter_map(|id| known.names(*id).first()?.last());
    let heads: Vec<&String> = heads.collect();
    let like = |id: &IdentityId| known.names(*id).iter().any(|name| name.last().is_some_and(|w| heads.contains(&w)));
    let found: Vec<Member> =
        all.scene.identities.iter().map(|(id, _)| id).filter(|id| like(id) && all.accepts(*id)).map(member).collect();
    if found.is_empty() && talk.last.is_empty() {
        return Ok(any(all, false));
    }
    if found.is_empty() {
        let unmet = all.unmet(Why::NotUnderstood, "I do not know what \u{201c}one\u{201d} refers to.", at);
        return Err(Unmet { words: vec![all.said(at).into()], ..unmet });
    }
    Ok(Matches::new(found))
}

/// Identities that were spoken of last.
pub(super) fn last(all: &mut Evaluator<'_>, plural: bool, at: &Range<usize>) -> Outcome {
    let talk = &all.scene.place.talk;
    let of = if plural && !talk.group.is_empty() { &talk.group } else { &talk.last };
    let found: Vec<Member> = of.iter().copied().filter(|id| all.scene.is_there(*id)).map(member).collect();
    if found.is_empty() {
        let text = "I do not know what you refer to: nothing was spoken of yet.";
        return Err(Unmet { words: vec![all.said(at).into()], ..all.unmet(Why::NotUnderstood, text, at) });
    }
    Ok(Matches::new(found))
}

/// Identity of a number.
pub(super) fn numbered(all: &mut Evaluator<'_>, id: IdentityId, at: &Range<usize>) -> Outcome {
    if all.scene.identities.get(id).is_some() && all.scene.is_there(id) {
        return Ok(Matches::new(vec![Member { rank: 0, ..member(id) }]));
    }
    Err(all.unmet(Why::Unknown, format!("There is nothing with the number {id} here."), at))
}

/// Identities by words: the last one is the thing itself, the others are names of its wholes, kinds or colors.
pub(super) fn words(all: &mut Evaluator<'_>, words: &[String], plural: bool, at: &Range<usize>) -> Outcome {
    let found = if all.scene.by_names { by_words(all, words)? } else { Matches::default() };
    if !found.members.is_empty() {
        // All of several are meant, also those with more in their names.
        let found = if plural {
            Matches::new(found.members.into_iter().map(|m| Member { rank: m.rank.max(1), ..m }).collect())
        } else {
            found
        };
        all.noun_step(at, format!("\u{201c}{}\u{201d}", all.said(at)), &found);
        return Ok(found);
    }
    if let Some(found) = looked_for(all, words, plural, at)? {
        all.noun_step(at, format!("\u{201c}{}\u{201d}, by embedding", all.said(at)), &found);
        return Ok(found);
    }
    Err(not_there(all, words, at))
}

fn by_words(all: &mut Evaluator<'_>, words: &[String]) -> Outcome {
    let found = by_heads(all, words);
    if !found.members.is_empty() {
        return Ok(found);
    }
    // A thing of this name that is not so is another answer than a kind of it.
    if words.last().is_none_or(|head| !has_head(all, head)) {
        let kinds = by_kind(all, words);
        if !kinds.members.is_empty() {
            return Ok(kinds);
        }
    }
    // "The controller red": the color stands behind.
    match words {
        [rest @ .., head, color] if row(color).is_some() => {
            let turned: Vec<String> = [color].into_iter().chain(rest).chain([head]).cloned().collect();
            Ok(by_heads(all, &turned))
        }
        _ => Ok(Matches::default()),
    }
}

/// Identities whose own name has the last word as its head, and which the others describe.
fn by_heads(all: &Evaluator<'_>, words: &[String]) -> Matches {
    let Some((head, rest)) = words.split_last() else { return Matches::default() };
    let known = all.scene.identities.words();
    let mut found = Vec::new();
    for id in known.with(head).iter().copied().filter(|id| all.accepts(*id)) {
        let names = known.names(id);
        let exact = names.iter().any(|name| name == words);
        if exact {
            found.push(Member { rank: 0, ..member(id) });
        } else if names.iter().any(|name| is_head(name, head))
            && let Some(sure) = adjectives::described_by(all, id, rest)
        {
            // The "fruit bowl" is that rather than the bowl of it.
            let own = rest.iter().all(|w| row(w).is_some() || names.iter().flatten().any(|n| n == w));
            found.push(Member { sure, rank: if own { 1 } else { 2 }, ..member(id) });
        }
    }
    Matches::new(found)
}

/// Returns whether a word is the head of a name: its last word before "with" or "of", a single letter or number aside.
/// A table lamp is not a table, a vase with water is a vase, "button a" is a button.
fn is_head(name: &[String], head: &str) -> bool {
    let thing = name.split(|w| w == "with" || w == "of").next().unwrap_or_default();
    let tells_apart = |w: &String| w.chars().count() == 1 || w.bytes().all(|b| b.is_ascii_digit());
    let at_a_side = |w: &String| name_words::SIDES.contains(&w.as_str());
    thing.last().is_some_and(|w| w == head)
        || thing.iter().rev().find(|w| !tells_apart(w) && !at_a_side(w)).is_some_and(|w| w == head)
}

/// Returns whether a thing of a name with this head is there.
fn has_head(all: &Evaluator<'_>, head: &str) -> bool {
    let known = all.scene.identities.words();
    known.with(head).iter().any(|id| all.accepts(*id) && known.names(*id).iter().any(|name| is_head(name, head)))
}

/// Identities that are of the kind that the words name; of a whole and its pieces, the whole.
fn by_kind(all: &mut Evaluator<'_>, words: &[String]) -> Matches {
    let identities = all.scene.identities;
    let known = identities.words();
    let mut found: Vec<Member> = Vec::new();
    let mut told: Vec<String> = Vec::new();
    for start in 0..words.len() {
        let (rest, kind) = words.split_at(start);
        let asked = kind.join(" ");
        for (id, name, kinship) in known.kinds().of(&asked).into_iter().filter(|(id, ..)| all.accepts(*id)) {
            if let Some(sure) = adjectives::described_by(all, id, rest) {
                found.push(Member { sure: sure.min(KIND), rank: 3, ..member(id) });
                told.push(match kinship {
                    Kinship::Same => format!("\u{201c}{asked}\u{201d} is another word for {name}."),
                    Kinship::KindOf => format!("A kind of {asked}: {name}."),
                });
            }
        }
        if !found.is_empty() {
            break;
        }
    }
    // Of objects and parts of this kind, the objects.
    let is_object = |m: &Member| identities.get(m.id).is_some_and(|i| i.level == Level::Object);
    if found.iter().any(is_object) {
        found.retain(is_object);
    }
    let ids: Vec<IdentityId> = found.iter().map(|m| m.id).collect();
    found.retain(|m| !identities.ancestors(m.id).skip(1).any(|i| ids.contains(&i)));
    told.dedup();
    if !found.is_empty() {
        all.notes.extend(told.into_iter().take(4));
    }
    Matches::new(found)
}

/// Identities that the encoder finds, if it may be used; `None` if not, or if there are none.
fn looked_for(
    all: &mut Evaluator<'_>,
    words: &[String],
    plural: bool,
    at: &Range<usize>,
) -> Result<Option<Matches>, Unmet> {
    let phrase = ParsedQuery::undivided(words.join(" "));
    let Some(looks) = all.looks.as_deref_mut() else { return Ok(None) };
    let seen = match looks.find(&phrase, plural) {
        Ok(seen) => seen,
        Err(problem) => return Err(all.unmet(Why::Failed, problem, at)),
    };
    let found: Vec<Member> =
        seen.into_iter().filter(|(id, _)| all.accepts(*id)).map(|(id, sure)| Member { sure, ..member(id) }).collect();
    all.looked |= !found.is_empty();
    Ok((!found.is_empty()).then(|| Matches::new(found)))
}

/// Reason that no name has these words, with the nearest names.
fn not_there(all: &Evaluator<'_>, words: &[String], at: &Range<usize>) -> Unmet {
    let identities = all.scene.identities;
    let known = identities.words();
    let said: String = words.join(" ").chars().take(80).collect();
    let Some((head, rest)) = words.split_last() else {
        return all.unmet(Why::NotUnderstood, "Nothing is asked for.", at);
    };
    let heads = known
        .with(head)
        .iter()
        .copied()
        .filter(|id| all.accepts(*id) && known.names(*id).iter().any(|n| is_head(n, head)));
    let heads: Vec<IdentityId> = heads.take(6).collect();
    // "Red controller wheel": the whole is there, and lacks such a piece.
    let wholes: Vec<IdentityId> = if rest.is_empty() { Vec::new() } else { by_heads(all, rest).ids() };
    if let Some(whole) = wholes.first() {
        let text = format!("The {} has no \u{201c}{head}\u{201d} here.", identities.full_name(*whole));
        return Unmet { why: Why::Unknown, text, words: vec![head.clone()], near: wholes, at: at.clone() };
    }
    if !heads.is_empty() {
        // The thing is there, but not so.
        let beside = |id: &IdentityId| adjectives::undescribed(all, *id, rest);
        let left = heads.iter().map(beside).min_by_key(Vec::len).unwrap_or_default();
        let strange = left.iter().any(|w| adjectives::class(all, w) == Adjective::Unknown);
        let why = if strange { Why::NotUnderstood } else { Why::Unknown };
        let near: Vec<String> = heads.iter().take(3).map(|id| identities.full_name(*id)).collect();
        let text =
            format!("No {head} here is \u{201c}{}\u{201d}. The nearest names: {}.", left.join(" "), near.join(", "));
        return Unmet { why, text, words: left, near: heads, at: at.clone() };
    }
    let unknown: Vec<String> = words.iter().filter(|w| !known.has(w) && row(w).is_none()).cloned().collect();
    let is_like = |word: &str| words.iter().any(|w| super::alike(word, w));
    let near: BTreeSet<IdentityId> =
        known.words().filter(|w| is_like(w)).flat_map(|w| known.with(w)).copied().collect();
    let near: Vec<IdentityId> = near.into_iter().filter(|id| all.scene.is_there(*id)).take(6).collect();
    let list = |ids: &[IdentityId]| ids.iter().map(|id| identities.full_name(*id)).collect::<Vec<_>>().join(", ");
    let some: Vec<IdentityId> = identities
        .iter()
        .filter(|(id, i)| i.level == Level::Object && !i.names.is_empty() && all.scene.is_there(*id))
        .map(|(id, _)| id)
        .take(8)
        .collect();
    let more = match (near.is_empty(), some.is_empty()) {
        (false, _) => format!(" The nearest names: {}.", list(&near)),
        (true, false) => format!(" Some names here: {}.", list(&some)),
        (true, true) => String::new(),
    };
    let words = if unknown.is_empty() { vec![head.clone()] } else { unknown };
    let is_word = lexicon::is_noun(head) || models::is_word(head);
    let why = if is_word { Why::Unknown } else { Why::NotUnderstood };
    Unmet { why, text: format!("There is no \u{201c}{said}\u{201d} in this scene.{more}"), words, near, at: at.clone() }
}
