//! Identities found by their names: exactly, or by shared words. Needs no network and is independent of the language;
//! slips are mended before ([`super::reading`]).

use std::collections::HashSet;

use super::localize::{Hit, Scorer};
use super::parse::ParsedQuery;
use super::recipe::Rejection;
pub(crate) use super::words::singular;
use super::words::{not_in, words};
use super::{colors, grounds};
use crate::scene::identity::whole_names::key;
use crate::scene::{Identities, IdentityId};

/// Score under which a name is no answer.
pub(crate) const THRESHOLD: f32 = 0.45;
/// Difference of scores under which two names fit equally well.
pub(crate) const RESOLUTION: f32 = 0.02;

/// Scores by names alone.
pub(crate) struct ByName<'a> {
    pub(crate) identities: &'a Identities,
    pub(crate) rejection: Rejection,
}

impl Scorer for ByName<'_> {
    fn scores(&mut self, phrase: &str, _against: Option<&str>) -> Vec<f32> {
        scores(self.identities, phrase)
    }

    fn threshold(&self) -> f32 {
        self.rejection.threshold(THRESHOLD)
    }

    fn admits(&mut self, phrase: &ParsedQuery, hit: &Hit) -> bool {
        self.rejection != Rejection::Strict || grounds::unexplained(self.identities, hit.identity, phrase).is_empty()
    }

    fn rejects(&mut self, phrase: &ParsedQuery, hit: &Hit) -> bool {
        let all = self.identities;
        let wholes = || all.ancestors(hit.identity).skip(1);
        self.rejection == Rejection::Strict
            && (is_another(all, &phrase.target, std::iter::once(hit.identity))
                || phrase.whole.as_ref().is_some_and(|whole| is_another(all, whole, wholes())))
    }

    fn resolution(&self) -> f32 {
        RESOLUTION
    }
}

/// Returns whether names exclude all of `ids`: another color or number, or nothing in common but a color.
fn is_another(identities: &Identities, phrase: &str, ids: impl Iterator<Item = IdentityId>) -> bool {
    let (asked, kind) = (colors::named(phrase), colors::without(phrase));
    let numbers = |text: &str| words(text).into_iter().filter(|w| w.bytes().all(|b| b.is_ascii_digit())).collect();
    let asked_number: Vec<String> = numbers(phrase);
    let fits = |name: &String| {
        let has_number: Vec<String> = numbers(name);
        if !asked_number.is_empty() && !has_number.is_empty() && !asked_number.iter().any(|n| has_number.contains(n)) {
            return false;
        }
        let has = colors::named(name);
        let same = asked.is_empty() || has.is_empty() || asked.iter().any(|c| has.contains(c));
        same && (asked.is_empty() || words(name).iter().any(|w| kind.contains(w)))
    };
    let mut named = ids.filter_map(|id| identities.get(id)).filter(|i| !i.names.is_empty()).peekable();
    named.peek().is_some() && !named.any(|i| i.names.iter().any(fits))
}

/// Returns the score of every identity for a phrase, by number less one: 1 for the same name, 0 for nothing in common
/// or no name.
pub(crate) fn scores(identities: &Identities, phrase: &str) -> Vec<f32> {
    let wanted = words(phrase);
    let score = |names: &[String]| names.iter().map(|n| similarity(&wanted, &words(n))).fold(0.0, f64::max);
    // An identity without a name is called by its exact number, not by similar text.
    let number = |id: IdentityId| f64::from(u8::from(identities.name(id) == phrase.trim()));
    let either = |id: IdentityId, names: &[String]| if names.is_empty() { number(id) } else { score(names) };
    identities.iter().map(|(id, i)| either(id, &i.names) as f32).collect()
}

/// Returns the words of a phrase that neither names nor an encoder know: `to_encoder` are the words unknown to the
/// encoder, if there is one.
pub(crate) fn unknown_to_all(identities: &Identities, phrase: &str, to_encoder: Option<&[String]>) -> Vec<String> {
    let mut unknown = unknown_words(identities, phrase);
    unknown.retain(|w| to_encoder.is_none_or(|words| words.contains(w)));
    unknown
}

/// Returns the words of a phrase that no name in the scene has; articles and the like are left out.
pub(crate) fn unknown_words(identities: &Identities, phrase: &str) -> Vec<String> {
    let known: HashSet<String> = identities.iter().flat_map(|(_, i)| &i.names).flat_map(|n| words(n)).collect();
    let numbers = identities.iter().filter(|(_, i)| i.names.is_empty()).map(|(id, _)| id.to_string());
    not_in(phrase, &known.into_iter().chain(numbers).collect())
}

/// Returns whether a phrase means a removed thing: it has a removed name, and no words but those of such names.
pub(crate) fn was_removed(identities: &Identities, phrase: &str) -> bool {
    let (said, names) = (words(phrase), identities.removed.iter().map(|name| words(name)));
    let known: HashSet<String> = names.clone().flatten().collect();
    let is_said = |name: Vec<String>| !name.is_empty() && name.iter().all(|word| said.contains(word));
    not_in(phrase, &known).is_empty() && names.into_iter().any(is_said)
}

/// Returns full names that complete a typed phrase, by any name, best first.
pub(crate) fn completions(identities: &Identities, typed: &str, most: usize) -> Vec<String> {
    let typed = key(typed);
    let mut all = Vec::new();
    for (id, identity) in identities.iter().filter(|(_, i)| !i.names.is_empty()) {
        let full = identities.full_name(id);
        let keys = std::iter::once(&full).chain(&identity.names).map(|name| key(name));
        let begins = keys.filter_map(|name| name.find(&typed)).map(|at| at > 0).min();
        all.extend(begins.map(|begins| (begins, full.chars().count(), full)));
    }
    all.sort();
    all.into_iter().map(|(.., full)| full).take(most).collect()
}

/// Harmonic mean of the phrase's share in the name and the name's share in the phrase.
fn similarity(phrase: &[String], name: &[String]) -> f64 {
    let covered =
        |of: &[String], by: &[String]| of.iter().filter(|w| by.contains(w)).count() as f64 / of.len().max(1) as f64;
    let (asked, named) = (covered(phrase, name), covered(name, phrase));
    if asked + named > 0.0 { 2.0 * asked * named / (asked + named) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    fn scene() -> Identities {
        let mut all = Identities::default();
        let red = all.add(Level::Object, NO_IDENTITY, vec!["red controller".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["Blue_Controller".into(), "手柄".into()]);
        all.add(Level::Part, red, vec!["button a".into()]);
        all.add(Level::Object, NO_IDENTITY, vec![]);
        all
    }

    #[test]
    fn another_number_is_another_thing() {
        let mut all = Identities::default();
        let ids: Vec<IdentityId> =
            ["box 0", "box 2", "lamp"].map(|n| all.add(Level::Object, NO_IDENTITY, vec![n.into()])).into();
        let another =
            |phrase: &str| ids.iter().map(|id| is_another(&all, phrase, [*id].into_iter())).collect::<Vec<_>>();
        assert_eq!(another("box 1"), [true, true, false]);
        assert_eq!(another("box 2"), [true, false, false]);
        assert_eq!(another("box"), [false; 3]);
    }

    #[test]
    fn the_right_name_scores_highest() {
        let all = scene();
        let best = |phrase: &str| {
            let s = scores(&all, phrase);
            let best = (0..s.len()).max_by(|&a, &b| s[a].total_cmp(&s[b])).expect("scores");
            (best + 1, s[best])
        };
        assert_eq!(best("red controller"), (1, 1.0));
        assert_eq!(best("Blue controllers"), (2, 1.0));
        assert_eq!(best("手柄"), (2, 1.0));
        assert!(best("blue contoller").1 < 0.6, "slips are mended elsewhere");
        assert_eq!(best("button").0, 3);
        assert_eq!(best("#4"), (4, 1.0));
        assert!(scores(&all, "#3").iter().all(|s| *s < 0.5) && scores(&all, "#44").iter().all(|s| *s == 0.0));
        assert!(best("button").1 > 0.6 && best("button").1 < 1.0);
        assert!(scores(&all, "red controller")[1] < 0.6);
        assert!(scores(&all, "giraffe").iter().all(|s| *s == 0.0));
        assert!(scores(&all, "").iter().all(|s| *s == 0.0));
    }

    #[test]
    fn unknown_words_and_completions() {
        let all = scene();
        assert_eq!(unknown_words(&all, "the green button of a zebra"), ["green", "zebra"]);
        assert!(unknown_words(&all, "red buttons").is_empty());
        assert_eq!(completions(&all, "con", 5), ["red controller", "Blue_Controller", "button a · red controller"]);
        assert_eq!(completions(&all, "Button", 5), ["button a · red controller"]);
        assert_eq!(completions(&all, "手", 5), ["Blue_Controller"], "by another name of it");
        assert!(completions(&all, "zebra", 5).is_empty());
    }

    #[test]
    fn words_are_compared_whole_and_in_the_singular() {
        let plural = ["lamps", "glass", "virus", "taxis", "bus", "gas", "s", "keys", "knives", "dishes", "berries"];
        let single = ["lamp", "glass", "virus", "taxis", "bus", "gas", "s", "key", "knife", "dish", "berry"];
        assert_eq!(plural.map(singular), single);
        // One of two words of the phrase, all of the name: 2 x 1/2 x 1 / (1/2 + 1).
        let words = |text: &str| words(text);
        assert!((similarity(&words("red lamp"), &words("lamp")) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((similarity(&words("lamb"), &words("lamp")), similarity(&words("red"), &words("lamp"))), (0.0, 0.0));
        assert_eq!((similarity(&[], &[]), similarity(&words("lamp"), &[])), (0.0, 0.0));
    }

    #[test]
    fn unknown_is_what_neither_names_nor_encoder_know() {
        let all = scene();
        let of = |to_encoder: Option<&[&str]>| {
            let list = to_encoder.map(|l| l.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
            unknown_to_all(&all, "the green button of a zebra", list.as_deref())
        };
        assert_eq!(of(None), ["green", "zebra"]);
        assert_eq!(of(Some(&["zebra", "button"])), ["zebra"]);
        assert!(of(Some(&[])).is_empty());
        let by = ByName { identities: &all, rejection: Rejection::Canonical };
        assert_eq!((by.threshold(), by.resolution()), (THRESHOLD, RESOLUTION));
        assert_eq!(unknown_words(&all, "#4 #5"), ["5"], "a number is known, where nothing has a name");
    }
}
