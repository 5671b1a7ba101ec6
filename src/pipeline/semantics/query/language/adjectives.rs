//! Adjectives: colors, and words of the names of a thing or its wholes.

use std::ops::Range;

use super::evaluator::{Evaluator, Outcome};
use super::outcome::{Matches, Member, Unmet, Why};
use super::relations::HOLDS;
use crate::scene::IdentityId;
use crate::scene::colors::{ColorVerdict, row, tone};
use crate::scene::identity::lexicon;

/// Class of an adjective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Adjective {
    Color,
    /// Word of a name in the scene, or of a kind of thing.
    Name,
    Unknown,
}

/// Words between adjectives that say nothing.
const JOINTS: [&str; 7] = ["and", "or", "nor", ",", "the", "a", "an"];

/// Class of a word.
pub(super) fn class(all: &Evaluator<'_>, word: &str) -> Adjective {
    match word {
        _ if row(word).is_some() || tone(word).is_some() => Adjective::Color,
        _ if all.scene.identities.words().has(word) => Adjective::Name,
        _ => Adjective::Unknown,
    }
}

/// Sureness that all of these adjectives describe an identity; `None` if one does not.
pub(super) fn described_by(all: &Evaluator<'_>, id: IdentityId, words: &[String]) -> Option<f64> {
    let each = words.iter().enumerate().map(|(k, _)| describes(all, id, words, k));
    each.collect::<Option<Vec<f64>>>().map(|all| all.into_iter().fold(1.0, f64::min))
}

/// Adjectives that do not describe an identity.
pub(super) fn undescribed(all: &Evaluator<'_>, id: IdentityId, words: &[String]) -> Vec<String> {
    let fails = |k: &usize| describes(all, id, words, *k).is_none();
    (0..words.len()).filter(fails).map(|k| words[k].clone()).collect()
}

fn describes(all: &Evaluator<'_>, id: IdentityId, words: &[String], k: usize) -> Option<f64> {
    let identities = all.scene.identities;
    let known = identities.words();
    let word = &words[k];
    if matches!(word.as_str(), "colored" | "coloured" | "color" | "very") && k > 0 {
        return Some(1.0);
    }
    let has = |id: IdentityId, word: &str| known.names(id).iter().flatten().any(|w| w == word);
    if let Some(color) = row(word) {
        // "Red controller button": the color is that of the controller.
        let of_whole = words.get(k + 1).and_then(|next| identities.ancestors(id).find(|i| has(*i, next)));
        let owner = of_whole.unwrap_or(id);
        let sure = color_of(all, owner, color);
        let named = || identities.ancestors(id).any(|i| has(i, word));
        return match sure {
            Some(sure) => (sure >= HOLDS[1]).then_some(sure),
            None => named().then_some(1.0),
        };
    }
    if identities.ancestors(id).any(|i| has(i, word)) {
        return Some(1.0);
    }
    if let Some(tone) = tone(word) {
        // "Dark blue": the tone is that of the color.
        let color = words.get(k + 1).and_then(|next| row(next));
        let sure = identities.colors.judge_tone(id, tone, color).map(sureness)?;
        return (sure >= HOLDS[1]).then_some(sure);
    }
    let wholes = identities.ancestors(id).skip(1);
    let is_kind = |i: IdentityId| known.names(i).iter().any(|name| lexicon::is_a(&name.join(" "), word).is_some());
    wholes.into_iter().any(is_kind).then_some(HOLDS[0])
}

fn sureness(verdict: ColorVerdict) -> f64 {
    match verdict {
        ColorVerdict::Yes => 1.0,
        ColorVerdict::Partly => 0.8,
        ColorVerdict::No => 0.0,
    }
}

/// Sureness that an identity has a color: by an own name with a color, else by its Gaussians. `None` if unknown.
pub(super) fn color_of(all: &Evaluator<'_>, id: IdentityId, color: usize) -> Option<f64> {
    let identities = all.scene.identities;
    let names = identities.words().names(id);
    let named: Vec<usize> =
        names.iter().flat_map(|name| name.iter().take(name.len().saturating_sub(1)).filter_map(|w| row(w))).collect();
    if !named.is_empty() {
        return Some(if named.contains(&color) { 1.0 } else { 0.0 });
    }
    identities.colors.judge(id, color).map(sureness)
}

/// Members that adjectives describe; "red or blue" are choices.
pub(super) fn described(
    all: &mut Evaluator<'_>,
    found: Matches,
    words: &[String],
    not: bool,
    at: &Range<usize>,
) -> Outcome {
    let either = words.iter().any(|w| w == "or" || w == "nor");
    let words: Vec<String> = words
        .iter()
        .filter(|w| !JOINTS.contains(&w.as_str()) && !matches!(w.as_str(), "colored" | "coloured"))
        .cloned()
        .collect();
    if let Some(strange) = words.iter().find(|w| class(all, w) == Adjective::Unknown) {
        let text = format!("\u{201c}{strange}\u{201d} is not understood here.");
        return Err(Unmet {
            words: vec![strange.clone()],
            near: found.ids(),
            ..all.unmet(Why::NotUnderstood, text, at)
        });
    }
    let sure = |id: IdentityId| {
        let each = words.iter().enumerate().map(|(k, _)| {
            describes(all, id, if either { &words[k..=k] } else { &words }, if either { 0 } else { k }).unwrap_or(0.0)
        });
        if either { each.fold(0.0, f64::max) } else { each.fold(1.0, f64::min) }
    };
    // What is partly of a color may be meant by "not red", and may not.
    let partly = |m: &Member| not && (HOLDS[1]..HOLDS[0]).contains(&sure(m.id));
    let unsure: Vec<Member> = found.members.iter().filter(|m| partly(m)).copied().collect();
    let mut kept = found.judged(not, |m| sure(m.id));
    if !kept.members.is_empty() {
        kept.unclear |= !unsure.is_empty();
        kept.members.extend(unsure.into_iter().map(|m| Member { sure: HOLDS[1], ..m }));
    }
    Ok(kept)
}
