//! Names of a scene beside the grammar: shared words, completions, and names of what was removed.

use std::collections::HashSet;

use super::parse::is_glue;
use crate::scene::identity::name_words::words;
use crate::scene::identity::whole_names::key;
use crate::scene::{Identities, IdentityId};

/// Score under which a name is no answer.
pub(crate) const THRESHOLD: f32 = 0.45;
/// Difference of scores under which two names fit equally well.
pub(crate) const RESOLUTION: f32 = 0.02;

/// Returns the score of every identity for a phrase, by number less one: 1 for the same name, 0 for nothing in common
/// or no name.
pub(crate) fn scores(identities: &Identities, phrase: &str) -> Vec<f32> {
    let (wanted, known) = (words(phrase), identities.words());
    let score = |id: IdentityId| known.names(id).iter().map(|n| similarity(&wanted, n)).fold(0.0, f64::max);
    identities.iter().map(|(id, _)| score(id) as f32).collect()
}

/// Returns the words of a phrase that neither names nor an encoder know: `to_encoder` are the words unknown to the
/// encoder, if there is one.
pub(crate) fn unknown_to_all(identities: &Identities, phrase: &str, to_encoder: Option<&[String]>) -> Vec<String> {
    let known = identities.words();
    let numbers: HashSet<String> =
        identities.iter().filter(|(_, i)| i.names.is_empty()).map(|(id, _)| id.to_string()).collect();
    let mut unknown = words(phrase);
    unknown.retain(|w| !is_glue(w) && !known.has(w) && !numbers.contains(w));
    unknown.retain(|w| to_encoder.is_none_or(|words| words.contains(w)));
    unknown
}

/// Returns whether a phrase means a removed thing: it has a removed name, and no words but those of such names.
pub(crate) fn was_removed(identities: &Identities, phrase: &str) -> bool {
    let (said, names) = (words(phrase), identities.removed.iter().map(|name| words(name)));
    let known: HashSet<String> = names.clone().flatten().collect();
    let is_said = |name: Vec<String>| !name.is_empty() && name.iter().all(|word| said.contains(word));
    said.iter().all(|w| is_glue(w) || known.contains(w)) && names.into_iter().any(is_said)
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
        assert!(best("button").0 == 3 && (0.6..1.0).contains(&best("button").1));
        assert!(scores(&all, "giraffe").iter().all(|s| *s == 0.0) && scores(&all, "").iter().all(|s| *s == 0.0));
        // One of two words of the phrase, all of the name: 2 x 1/2 x 1 / (1/2 + 1).
        assert!((similarity(&words("red lamp"), &words("lamp")) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((similarity(&[], &[]), similarity(&words("lamp"), &[])), (0.0, 0.0));
    }

    #[test]
    fn unknown_is_what_neither_names_nor_encoder_know() {
        let all = scene();
        let of = |phrase: &str, to_encoder: Option<&[&str]>| {
            let list = to_encoder.map(|l| l.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
            unknown_to_all(&all, phrase, list.as_deref())
        };
        let phrase = "the green button of a zebra";
        assert_eq!(of(phrase, None), ["green", "zebra"]);
        assert_eq!(of(phrase, Some(&["zebra", "button"])), ["zebra"]);
        assert!(of(phrase, Some(&[])).is_empty() && of("red buttons", None).is_empty());
        assert_eq!(of("#4 #5", None), ["5"], "a number is known, where nothing has a name");
        assert_eq!(completions(&all, "con", 5), ["red controller", "Blue_Controller", "button a · red controller"]);
        assert_eq!(completions(&all, "手", 5), ["Blue_Controller"], "by another name of it");
        assert!(completions(&all, "zebra", 5).is_empty());
    }
}
