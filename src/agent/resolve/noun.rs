//! How a phrase names a thing: its readings, by words alone. Every word must have a place in one.

use std::collections::{HashMap, HashSet};

use crate::agent::language::{CommandLanguage, Key, find};
use crate::agent::relation::Relation;
use crate::agent::words::{number, request_tokens, singular, tokens};
use crate::scene::Identities;
use crate::scene::identity::whole_names::key;

/// A thing as a phrase has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Noun {
    Last,
    Number(u32),
    /// By a name as a whole.
    Called(String),
    /// By these words of its name, or a word for anything.
    Named(Vec<String>),
    /// One among others: "the largest ...".
    Picked(Pick, Box<Noun>),
    /// All of them, if there are so many: "the two ...".
    Counted(usize, Box<Noun>),
    PieceOf(Box<Noun>, Box<Noun>),
    /// Something that stands so to something else.
    Placed(Box<Noun>, Relation, Box<Noun>),
    /// The one of these that is nearest to something.
    Nearest(Box<Noun>, Box<Noun>),
}

/// How a word chooses among things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    Other,
    /// The one with the most of this, or the least.
    Most(Key, bool),
    More(Key, bool),
}

/// How a word chooses, if it does.
pub(super) fn pick(word: &str) -> Option<Pick> {
    let all = CommandLanguage::get();
    let most = || find(&all.most, word).map(|key| Pick::Most(key, true));
    let least = || find(&all.least, word).map(|key| Pick::Most(key, false));
    let more = || find(&all.more, word).map(|key| Pick::More(key, true));
    let less = || find(&all.less, word).map(|key| Pick::More(key, false));
    if word == "other" { Some(Pick::Other) } else { most().or_else(least).or_else(more).or_else(less) }
}

/// The number that words begin with, two or more, and what there are so many of.
pub(crate) fn counted<'a, 'b>(words: &'b [&'a str]) -> Option<(usize, &'b [&'a str])> {
    let (first, rest) = words.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let count = number(first).filter(|n| (2.0..=99.0).contains(n) && n.fract() == 0.0)?;
    Some((count as usize, rest))
}

/// Words of a thing at most.
const MOST_WORDS: usize = 24;
/// Words for any object.
pub(super) const ANYTHING: [&str; 4] = ["thing", "object", "item", "something"];
/// Words for any part.
pub(super) const PARTS: [&str; 2] = ["part", "piece"];

/// The words that names in a scene are made of.
pub(crate) fn name_words(name: &str) -> Vec<String> {
    let apart = name.split(|c: char| !(c.is_alphanumeric() || c == '#')).filter(|w| !w.is_empty() && *w != "s");
    apart.map(|w| singular(&w.to_lowercase())).collect()
}

/// Words as the names in the scene have them.
pub(crate) struct NameWords {
    words: HashSet<String>,
    /// Names as a whole, by their words in a request: what these are made of means nothing else.
    whole: HashMap<String, String>,
    /// The same of more than one word, in the singular.
    singular: HashSet<Vec<String>>,
}

impl NameWords {
    /// The words of all names.
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

    /// Whether a name has this word.
    pub(crate) fn has(&self, word: &str) -> bool {
        self.words.contains(&singular(word))
    }

    pub(crate) fn words(&self) -> impl Iterator<Item = &str> {
        self.words.iter().map(String::as_str)
    }

    /// The name that these words of a request are as a whole.
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

/// The words of a name as a request has them, joined.
fn spoken(name: &str) -> String {
    let words = request_tokens(name).into_iter().map(|t| t.low).collect::<Vec<_>>();
    words.join(" ")
}

/// The words of a phrase: quotes and marks around them are no part of it.
pub(crate) fn words_of(phrase: &str) -> Vec<String> {
    let all = tokens(phrase).into_iter().filter(|t| !matches!(t.low.as_str(), "?" | "!" | "." | ";" | ":"));
    all.flat_map(|t| t.low.trim_start_matches('"').split(' ').map(str::to_owned).collect::<Vec<_>>()).collect()
}

/// All ways to read words as a thing. With `strict`, every word must be one that the scene's names have.
pub(super) fn readings(words: &[&str], known: &NameWords, strict: bool) -> Vec<Noun> {
    let (language, mut found) = (CommandLanguage::get(), Vec::new());
    let is_determiner = |word: &str| language.determiners.iter().any(|d| d == word);
    let words = match words {
        [first, rest @ ..] if is_determiner(first) && !rest.is_empty() && !known.is_name(words) => rest,
        other => other,
    };
    // Everything is in the scene.
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

/// Without "that is standing" at the end.
fn stood<'a, 'b>(mut words: &'b [&'a str]) -> &'b [&'a str] {
    while let [rest @ .., last] = words
        && CommandLanguage::get().standing.iter().any(|w| w == last)
    {
        words = rest;
    }
    words
}

/// Whether words can be read as a thing.
pub(crate) fn is_thing(words: &[&str], known: &NameWords, strict: bool) -> bool {
    !readings(words, known, strict).is_empty()
}
