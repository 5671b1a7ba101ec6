//! Readings of a phrase as a thing, by words alone. A reading accounts for every word.

use std::collections::{HashMap, HashSet};

use crate::agent::language::{CommandLanguage, Key, find};
use crate::agent::relation::Relation;
use crate::agent::words::{number, request_tokens, singular, tokens};
use crate::scene::Identities;
use crate::scene::identity::whole_names::key;

/// Thing as described by a phrase.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Noun {
    Last,
    Number(u32),
    /// By a complete name.
    Called(String),
    /// By words of its name, or by a generic word.
    Named(Vec<String>),
    /// By comparison with others: "the largest ...".
    Picked(Pick, Box<Noun>),
    /// All of an exact number: "the two ...".
    Counted(usize, Box<Noun>),
    PieceOf(Box<Noun>, Box<Noun>),
    /// A thing in a relation to another.
    Placed(Box<Noun>, Relation, Box<Noun>),
    /// The nearest one to another thing.
    Nearest(Box<Noun>, Box<Noun>),
}

/// Choice among several things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    Other,
    /// The one with the most (`true`) or the least (`false`) of a quantity.
    Most(Key, bool),
    More(Key, bool),
}

/// Returns the choice that a word stands for.
pub(super) fn pick(word: &str) -> Option<Pick> {
    let all = CommandLanguage::get();
    let most = || find(&all.most, word).map(|key| Pick::Most(key, true));
    let least = || find(&all.least, word).map(|key| Pick::Most(key, false));
    let more = || find(&all.more, word).map(|key| Pick::More(key, true));
    let less = || find(&all.less, word).map(|key| Pick::More(key, false));
    if word == "other" { Some(Pick::Other) } else { most().or_else(least).or_else(more).or_else(less) }
}

/// Splits words into a leading number, two or more, and the rest.
pub(crate) fn counted<'a, 'b>(words: &'b [&'a str]) -> Option<(usize, &'b [&'a str])> {
    let (first, rest) = words.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let count = number(first).filter(|n| (2.0..=99.0).contains(n) && n.fract() == 0.0)?;
    Some((count as usize, rest))
}

/// Maximum number of words of a thing.
const MOST_WORDS: usize = 24;
/// Generic words for an object.
pub(super) const ANYTHING: [&str; 4] = ["thing", "object", "item", "something"];
/// Generic words for a part.
pub(super) const PARTS: [&str; 2] = ["part", "piece"];

/// Splits a name into words, in lower case and in the singular.
pub(crate) fn name_words(name: &str) -> Vec<String> {
    let apart = name.split(|c: char| !(c.is_alphanumeric() || c == '#')).filter(|w| !w.is_empty() && *w != "s");
    apart.map(|w| singular(&w.to_lowercase())).collect()
}

/// Words and complete names of a scene.
pub(crate) struct NameWords {
    words: HashSet<String>,
    /// Complete names, by their words in a request; such words have no other reading.
    whole: HashMap<String, String>,
    /// Complete names of more than one word, in the singular.
    singular: HashSet<Vec<String>>,
}

impl NameWords {
    /// Collects the words of all names.
    pub(crate) fn new(identities: &Identities) -> Self {
        let names: Vec<Vec<String>> = identities.iter().flat_map(|(_, i)| &i.names).map(|n| name_words(n)).collect();
        let words = names.iter().flatten().cloned().collect();
        let singular = names.into_iter().filter(|n| n.len() > 1).collect();
        let mut whole = HashMap::new();
        for (id, identity) in identities.iter() {
            for name in [identities.full_name(id), identities.label(id)].iter().chain(&identity.names) {
                whole.entry(spoken(name)).or_insert_with(|| name.clone());
                whole.entry(spoken(&key(name))).or_insert_with(|| name.clone());
            }
        }
        whole.remove("");
        Self { words, whole, singular }
    }

    /// Returns whether a name has this word.
    pub(crate) fn has(&self, word: &str) -> bool {
        self.words.contains(&singular(word))
    }

    pub(crate) fn words(&self) -> impl Iterator<Item = &str> {
        self.words.iter().map(String::as_str)
    }

    /// Returns the complete name that these words of a request match.
    pub(crate) fn whole(&self, words: &[&str]) -> Option<&str> {
        let words = match words {
            ["the" | "a" | "an", rest @ ..] if !rest.is_empty() => rest,
            all => all,
        };
        let said = words.join(" ");
        let said = if said.contains('"') { spoken(&said.replace('"', " ")) } else { said };
        self.whole.get(&said).map(String::as_str)
    }

    fn is_name(&self, words: &[&str]) -> bool {
        let said = || words.iter().flat_map(|w| name_words(w)).collect();
        self.whole(words).is_some() || self.singular.contains::<Vec<String>>(&said())
    }
}

/// Joins the words of a name as a request would have them.
fn spoken(name: &str) -> String {
    let words = request_tokens(name).into_iter().map(|t| t.low).collect::<Vec<_>>();
    words.join(" ")
}

/// Splits a phrase into words, without quotes and without punctuation except commas.
pub(crate) fn words_of(phrase: &str) -> Vec<String> {
    let all = tokens(phrase).into_iter().filter(|t| !matches!(t.low.as_str(), "?" | "!" | "." | ";" | ":"));
    all.flat_map(|t| t.low.trim_start_matches('"').split(' ').map(str::to_owned).collect::<Vec<_>>()).collect()
}

/// Returns all readings of words as a thing. With `strict`, every word must be one of a name in the scene.
pub(super) fn readings(words: &[&str], known: &NameWords, strict: bool) -> Vec<Noun> {
    let (language, mut found) = (CommandLanguage::get(), Vec::new());
    let is_determiner = |word: &str| language.determiners.iter().any(|d| d == word);
    let words = match words {
        [first, rest @ ..] if is_determiner(first) && !rest.is_empty() && !known.is_name(words) => rest,
        other => other,
    };
    // "in the scene" excludes nothing.
    let words = match words {
        [thing @ .., "in", "the" | "this", last @ ("scene" | "room")] if !known.has(last) => thing,
        other => other,
    };
    match words {
        _ if words.len() > MOST_WORDS => return found,
        [] => return found,
        [_, _, ..] if let Some(name) = known.whole(words) => return vec![Noun::Called(name.to_owned())],
        ["it" | "this" | "that"] => return vec![Noun::Last],
        [number] if number.starts_with('#') => return number[1..].parse().map(Noun::Number).into_iter().collect(),
        ["its", piece @ ..] => {
            let pieces = readings(piece, known, strict);
            return pieces.into_iter().map(|p| Noun::PieceOf(Box::new(p), Box::new(Noun::Last))).collect();
        }
        _ if let Some(name) = known.whole(words) => return vec![Noun::Called(name.to_owned())],
        _ if known.is_name(words) => return vec![named(words)],
        _ => {}
    }
    for i in 1..words.len() {
        let (left, right) = (&words[..i], &words[i + 1..]);
        let mut both = |left: &[&str], right: &[&str], make: &dyn Fn(Box<Noun>, Box<Noun>) -> Noun| {
            let is_one = |l: &Noun| !matches!(l, Noun::Picked(..) | Noun::Counted(..));
            let things = readings(left, known, strict).into_iter().filter(is_one);
            for thing in things {
                found.extend(
                    readings(right, known, strict).into_iter().map(|r| make(Box::new(thing.clone()), Box::new(r))),
                );
            }
        };
        match words[i] {
            "of" => both(left, right, &Noun::PieceOf),
            "'s" => both(right, left, &Noun::PieceOf),
            "nearest" | "closest" if right.first() == Some(&"to") => both(stood(left), &right[1..], &Noun::Nearest),
            "nearest" | "closest" => both(stood(left), right, &Noun::Nearest),
            "to" if i > 1 && matches!(words[0], "nearest" | "closest") => both(&words[1..i], right, &Noun::Nearest),
            _ => {}
        }
        if let Some((relation, n)) = language.relation_at(&words[i..]) {
            both(stood(left), &words[i + n..], &|l, r| Noun::Placed(l, relation, r));
            if matches!(relation, Relation::On | Relation::In) {
                both(left, &words[i + n..], &Noun::PieceOf);
            }
        }
    }
    if let Some((choice, rest)) = pick(words[0]).zip(words.get(1..).filter(|r| !r.is_empty())) {
        let rest = readings(rest, known, strict);
        found.extend(rest.into_iter().map(|r| Noun::Picked(choice, Box::new(r))));
    }
    if let Some((count, rest)) = counted(words) {
        let rest = readings(rest, known, strict);
        found.extend(rest.into_iter().map(|r| Noun::Counted(count, Box::new(r))));
    }
    let any = |w: &str| w == "one" || w == "ones" || [&ANYTHING[..], &PARTS].concat().contains(&singular(w).as_str());
    let inner = |w: &&str| language.is_no_name(w) || language.relation_at(&[w]).is_some();
    let is_known = |w: &&str| known.has(w) || any(w);
    let plain = !words.iter().any(inner) && words.len() <= 5 && !words.iter().all(|w| pick(w).is_some());
    if plain && (!strict || words.iter().all(is_known)) && words.iter().any(|w| w.chars().any(char::is_alphanumeric)) {
        found.push(named(words));
    }
    found
}

fn named(words: &[&str]) -> Noun {
    Noun::Named(words.iter().flat_map(|w| name_words(w)).collect())
}

/// Removes "that is standing" at the end.
fn stood<'a, 'b>(mut words: &'b [&'a str]) -> &'b [&'a str] {
    while let [rest @ .., last] = words
        && CommandLanguage::get().standing.iter().any(|w| w == last)
    {
        words = rest;
    }
    words
}

/// Returns whether words can be read as a thing.
pub(crate) fn is_thing(words: &[&str], known: &NameWords, strict: bool) -> bool {
    !readings(words, known, strict).is_empty()
}
