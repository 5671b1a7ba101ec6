//! Grounds of an answer. Each telling word of a question must be in the names of the answer or of its wholes, or be
//! its color; else something else is meant.

use std::collections::HashSet;

use super::colors;
use super::parse::ParsedQuery;
use super::words::{not_in, words};
use crate::scene::colors::row;
use crate::scene::{Identities, IdentityId};

/// Courtesy and the like in front of a question.
const COURTESY: [&str; 15] =
    ["please", "show", "find", "locate", "where", "is", "are", "me", "my", "our", "your", "his", "her", "their", "its"];
/// Words that only bind a piece to its whole.
pub(crate) const BINDING: [&str; 3] = ["in", "inside", "at"];

/// Words for places, comparisons, numbers and conditions, longer ones first: they mean nothing in a question that
/// names things, unless a name has them.
const GRAMMAR: &str = "on the left side of, on the right side of, to the left of, to the right of, on top of, in front of, left of, \
    right of, next to, close to, behind, under, underneath, below, beneath, above, over, beside, near, between, around, \
    nearest, closest, farthest, largest, biggest, smallest, tallest, shortest, longest, highest, lowest, leftmost, \
    rightmost, larger, bigger, smaller, two, three, four, five, six, seven, eight, nine, ten, both, all, every, each, other";
/// Words that join and deny.
const JOINING: [&str; 7] = ["and", "or", "but", "not", "without", "except", "with"];

/// Returns whether a text asks for places, comparisons or numbers.
pub(crate) fn asks_for_more(identities: &Identities, text: &str) -> bool {
    grammar(identities, text).iter().any(|word| !JOINING.contains(&word.as_str()))
}

/// Returns the places, comparisons and the like in a text that no name of the scene has.
pub(crate) fn grammar(identities: &Identities, text: &str) -> Vec<String> {
    let said = words(text);
    let known: HashSet<String> = identities.iter().flat_map(|(_, i)| &i.names).flat_map(|name| words(name)).collect();
    let mut taken = vec![false; said.len()];
    let mut found = Vec::new();
    for phrase in GRAMMAR.split(',').map(str::trim).chain(JOINING) {
        let own: Vec<&str> = phrase.split(' ').collect();
        let is_plain = own.len() > 1 || !known.contains(phrase);
        for at in (0..said.len()).filter(|_| is_plain) {
            let is_there = said[at..].iter().map(String::as_str).take(own.len()).eq(own.iter().copied());
            if is_there && !taken[at..at + own.len()].contains(&true) {
                taken[at..at + own.len()].fill(true);
                found.push((at, phrase.to_owned()));
            }
        }
    }
    found.sort();
    found.into_iter().map(|(_, phrase)| phrase).collect()
}

/// Returns the telling words among these: those that are neither courtesy nor binding words.
pub(crate) fn telling(words: &[String]) -> Vec<String> {
    let says_nothing = |word: &str| COURTESY.contains(&word) || BINDING.contains(&word);
    words.iter().filter(|word| !says_nothing(word)).cloned().collect()
}

/// Returns a question without courtesy in front and behind: "where is my mug, please" asks for "mug".
pub(crate) fn without_courtesy(query: &str) -> &str {
    let is_courtesy = |word: &str| COURTESY.contains(&word.trim_matches(',').to_lowercase().as_str());
    let mut rest = query.trim();
    while let Some((_, others)) = rest.split_once(char::is_whitespace).filter(|(first, _)| is_courtesy(first)) {
        rest = others.trim_start();
    }
    let rest = rest.trim_end_matches(|c: char| c.is_whitespace() || "?!.,".contains(c));
    let polite = rest.rsplit_once(char::is_whitespace).filter(|(_, last)| last.eq_ignore_ascii_case("please"));
    polite.map_or(rest, |(asked, _)| asked.trim_end_matches([',', ' ']))
}

/// Returns the words of a phrase that neither the names of `id` nor those of its wholes have.
fn words_beside(identities: &Identities, id: IdentityId, phrase: &str) -> Vec<String> {
    let names = |i: IdentityId| match identities.get(i).map(|i| i.names.as_slice()) {
        Some([]) | None => vec![identities.name(i)],
        Some(names) => names.to_vec(),
    };
    not_in(phrase, &identities.ancestors(id).flat_map(names).flat_map(|n| words(&n)).collect())
}

/// Returns the telling words of a phrase that do not describe `id`.
pub(crate) fn unexplained(identities: &Identities, id: IdentityId, phrase: &ParsedQuery) -> Vec<String> {
    let mut left = telling(&words_beside(identities, id, &phrase.text));
    left.retain(|word| row(word).is_none_or(|color| has_color(identities, id, phrase, color) != Some(true)));
    left
}

/// Returns whether a phrase names a color that `id` does not have, judged by names or Gaussians.
pub(crate) fn is_of_another_color(identities: &Identities, id: IdentityId, phrase: &ParsedQuery) -> bool {
    let said = [Some(&phrase.target), phrase.whole.as_ref()].into_iter().flatten().flat_map(|p| colors::named(p));
    said.into_iter().any(|color| has_color(identities, id, phrase, color) == Some(false))
}

/// Returns whether an identity has a color: by an own name with a color, else by its Gaussians. `None` if unknown.
pub(crate) fn color_of(identities: &Identities, id: IdentityId, color: usize) -> Option<bool> {
    let names = identities.get(id).map(|i| i.names.as_slice()).unwrap_or_default();
    let named: Vec<usize> = names.iter().flat_map(|name| colors::named(name)).collect();
    if named.is_empty() { identities.colors.has(id, color) } else { Some(named.contains(&color)) }
}

/// Returns whether the thing that a phrase gives the color to has it, if `id` is the answer. `None` if unknown, or if
/// the phrase gives the color to nothing.
fn has_color(identities: &Identities, id: IdentityId, phrase: &ParsedQuery, color: usize) -> Option<bool> {
    let says = |text: &String| colors::named(text).contains(&color);
    let has = |id: IdentityId| color_of(identities, id, color);
    let answers: Vec<Option<bool>> = match &phrase.whole {
        Some(whole) if says(whole) && !says(&phrase.target) => identities.ancestors(id).skip(1).map(has).collect(),
        _ if says(&phrase.target) || says(&phrase.text) => vec![has(id)],
        _ => Vec::new(),
    };
    // Of several wholes, one has to have it.
    if answers.contains(&Some(true)) { Some(true) } else { answers.contains(&Some(false)).then_some(false) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sh::SH_C0;
    use crate::scene::{GaussianCloud, Level, NO_IDENTITY, SemanticMap};

    /// A white mug with a red handle, and a kettle that is called blue and is red.
    fn scene() -> Identities {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let handle = all.add(Level::Part, mug, vec!["handle".into()]);
        let kettle = all.add(Level::Object, NO_IDENTITY, vec!["blue kettle".into()]);
        let of = vec![mug, mug, mug, handle, kettle];
        let (white, red) = ([0.9; 3], [0.8, 0.1, 0.1]);
        let cloud = GaussianCloud {
            positions: vec![[0.0; 3]; 5],
            log_scales: vec![[-3.0; 3]; 5],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; 5],
            opacity_logits: vec![4.0; 5],
            sh: [white, white, white, red, red].map(|rgb| rgb.map(|c: f64| ((c - 0.5) / SH_C0) as f32)).to_vec(),
            ..GaussianCloud::default()
        };
        let mut map = SemanticMap::from_identities(all, of, vec![1.0; 5], vec![]);
        map.see_colors(&cloud);
        map.identities
    }

    #[test]
    fn words_beside_an_identity_are_those_that_neither_it_nor_its_wholes_have() {
        let mut all = scene();
        let nameless = all.add(Level::Object, NO_IDENTITY, vec![]);
        assert_eq!(words_beside(&all, 2, "the green handles of the mug"), ["green"]);
        assert_eq!(words_beside(&all, 1, "red mugs"), ["red"], "a color is a word like any other here");
        assert_eq!(words_beside(&all, 1, "handle of the mug"), ["handle"], "what a piece is called says nothing of it");
        assert!(words_beside(&all, nameless, "#4").is_empty());
    }

    #[test]
    fn a_word_is_explained_by_names_or_by_a_color_that_is_so() {
        let all = scene();
        let left = |id, text: &str| unexplained(&all, id, &ParsedQuery::parse(text).expect("words")).join(" ");
        for (id, text, words) in [
            (1, "the mug", ""),
            (1, "where is my mug, please", ""),
            (1, "white mug", ""),
            (1, "blue mug", "blue"),
            (1, "mug and lamp", "and lamp"),
            (1, "the largest mug", "largest"),
            (1, "two mugs", "two"),
            (2, "red handle", ""),
            (2, "white handle", "white"),
            (2, "handle of the white mug", ""),
            (2, "red handle of the white mug", ""),
            (2, "handle of the red mug", "red"),
            (2, "handle in the mug", ""),
            (3, "blue kettle", ""),
            // Names come before what is seen.
            (3, "red kettle", "red"),
            (3, "kettle behind the mug", "behind mug"),
        ] {
            assert_eq!(left(id, text), words, "{text}");
        }
        for (query, asked) in [
            ("where is my mug, please?", "mug"),
            ("Please show me the lamp", "the lamp"),
            ("my camera", "camera"),
            ("please", "please"),
            ("red mug", "red mug"),
            ("", ""),
        ] {
            assert_eq!(without_courtesy(query), asked, "{query}");
        }
        for (text, found) in [
            ("mug left of the kettle", "left of"),
            ("the two largest mugs and a lamp without a shade", "two largest and without"),
            ("thing in front of the mug", "in front of"),
            ("blue kettle", ""),
            ("mug on top", ""),
        ] {
            assert_eq!(grammar(&all, text).join(" "), found, "{text}");
        }
        // Words of a name are no grammar.
        let mut twins = Identities::default();
        twins.add(Level::Object, NO_IDENTITY, vec!["the two sisters".into()]);
        assert!(grammar(&twins, "two sisters").is_empty());
        let another = |id, text: &str| is_of_another_color(&all, id, &ParsedQuery::parse(text).expect("words"));
        assert!(another(1, "blue cup") && another(3, "red pot") && another(2, "lid of the blue cup"));
        assert!(!another(1, "white cup") && !another(1, "cup") && !another(3, "blue pot"));
        // Without observed colors nothing is known: no word is explained, and nothing speaks against it.
        let mut unseen = Identities::default();
        unseen.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let phrase = ParsedQuery::parse("white mug").expect("words");
        assert_eq!(
            (unexplained(&unseen, 1, &phrase), is_of_another_color(&unseen, 1, &phrase)),
            (vec!["white".into()], false)
        );
    }
}
