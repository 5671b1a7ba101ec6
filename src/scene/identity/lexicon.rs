//! Words beyond the names of a scene: which words mean the same thing, and what is a kind of what, by WordNet.
//! `tools/lexicon/build.py` made `assets/lexicon.z` and describes its sections. Needs no network.
//!
//! Words are in lower case and in the singular, as [`singular`](super::name_words::singular) makes them, with a space
//! between them.

pub(crate) mod kinds;

use std::cmp::Ordering;
use std::io::Read;
use std::sync::OnceLock;

use flate2::read::ZlibDecoder;

/// Relation of a name to an asked word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kinship {
    /// The same thing in other words: a sofa for a couch.
    Same,
    /// One of its kinds: a kettle for a pot.
    KindOf,
}

/// Returns how a thing of this name is what was asked for, if it is.
#[must_use]
pub(crate) fn is_a(name: &str, asked: &str) -> Option<Kinship> {
    let (lexicon, wanted) = (Lexicon::get(), concepts_of(asked));
    clues(name).into_iter().find_map(|clue| match clue {
        Clue::Text(text) => (text == asked).then_some(Kinship::Same),
        Clue::Concepts(own) => lexicon.kinship(&own, &wanted),
        Clue::Describing(own) => lexicon.kinship(&own, &wanted).map(|_| Kinship::KindOf),
    })
}

/// Clue of a name about its thing.
enum Clue {
    /// Words that it may be called.
    Text(String),
    /// Concepts of these words.
    Concepts(Vec<usize>),
    /// Concepts of something that it is a kind of by a word before.
    Describing(Vec<usize>),
}

/// Returns what a name says of its thing, the surest first. Its last word is its head: a red controller is a
/// controller. What follows "of" or "in" does not count, nor does a last letter or number.
fn clues(name: &str) -> Vec<Clue> {
    let (lexicon, words) = (Lexicon::get(), head(name));
    let mut all = vec![Clue::Text(name.to_owned())];
    let mut unknown = words.len();
    for at in 0..words.len() {
        let said = words[at..].join(" ");
        let listed = find(lexicon.words, &said);
        all.push(Clue::Text(said));
        let Some(listed) = listed else { continue };
        unknown = unknown.min(at);
        let own = numbers(listed);
        // A hot dog is no dog; a teddy bear is a bear to those who look for one.
        let is_last = !lexicon.shows_something(&own);
        all.push(Clue::Concepts(own));
        if is_last {
            break;
        }
    }
    let first = words[..unknown].iter().filter_map(|word| find(lexicon.first, word));
    all.extend(first.map(|listed| Clue::Describing(numbers(listed))));
    all
}

/// Returns the concepts of a word.
fn concepts_of(word: &str) -> Vec<usize> {
    numbers(find(Lexicon::get().words, word).unwrap_or_default())
}

/// Returns whether the lexicon has a word as a noun; another one may be a slip.
#[must_use]
pub(crate) fn is_noun(word: &str) -> bool {
    find(Lexicon::get().words, word).is_some()
}

/// Returns the singular of a plural that the rules in `name_words` do not understand: "mouse" for "mice".
#[must_use]
pub(crate) fn singular_of(plural: &str) -> Option<&'static str> {
    find(Lexicon::get().plurals, plural)
}

/// Returns the American spelling of a British word: "gray" for "grey".
#[must_use]
pub(crate) fn american(word: &str) -> Option<&'static str> {
    find(Lexicon::get().spellings, word)
}

/// Words that part a name from what the thing is made of, holds or stands on.
const PARTING: [&str; 5] = ["of", "in", "on", "with", "for"];
/// Amounts, which are not the thing: a pair of scissors.
const AMOUNTS: [&str; 10] = ["pair", "piece", "set", "slice", "bunch", "pile", "stack", "group", "couple", "row"];

/// Returns the words of a name that say what the thing is.
fn head(name: &str) -> Vec<&str> {
    let mut words: Vec<&str> = name.split_whitespace().collect();
    if let Some(at) = (1..words.len()).find(|&at| PARTING.contains(&words[at])) {
        let rest = words.split_off(at);
        if words.last().is_some_and(|last| AMOUNTS.contains(last)) {
            words = rest[1..].to_vec();
        }
    }
    let is_mark = |word: &str| word.chars().count() == 1 || word.bytes().all(|b| b.is_ascii_digit());
    while words.len() > 1 && words.last().is_some_and(|last| is_mark(last)) {
        words.pop();
    }
    words
}

/// The sections of the file; sorted lines, but for the concepts.
struct Lexicon {
    words: &'static str,
    concepts: Vec<&'static str>,
    first: &'static str,
    plurals: &'static str,
    spellings: &'static str,
}

impl Lexicon {
    fn get() -> &'static Self {
        static TEXT: OnceLock<String> = OnceLock::new();
        static LEXICON: OnceLock<Lexicon> = OnceLock::new();
        LEXICON.get_or_init(|| {
            let mut sections = TEXT.get_or_init(unpacked).split('@');
            let mut next = || sections.next().unwrap_or_default();
            Self {
                words: next(),
                concepts: next().lines().collect(),
                first: next(),
                plurals: next(),
                spellings: next(),
            }
        })
    }

    /// Returns the relation of something with these concepts to something with the asked ones.
    fn kinship(&self, own: &[usize], asked: &[usize]) -> Option<Kinship> {
        if own.iter().any(|concept| asked.contains(concept)) {
            return Some(Kinship::Same);
        }
        self.above(own).iter().any(|concept| asked.contains(concept)).then_some(Kinship::KindOf)
    }

    /// Returns whether the last word of such a name says what the thing shows.
    fn shows_something(&self, own: &[usize]) -> bool {
        self.above(own).iter().any(|&concept| self.concepts.get(concept).is_some_and(|line| line.starts_with('!')))
    }

    /// Returns concepts with all that they are kinds of.
    fn above(&self, own: &[usize]) -> Vec<usize> {
        let (mut all, mut at) = (own.to_vec(), 0);
        while let Some(line) = all.get(at).map(|&concept| self.concepts.get(concept).copied().unwrap_or_default()) {
            for kind in numbers(line) {
                if !all.contains(&kind) {
                    all.push(kind);
                }
            }
            at += 1;
        }
        all
    }
}

fn unpacked() -> String {
    let mut text = String::new();
    let packed: &[u8] = include_bytes!("../../../assets/lexicon.z");
    let read = ZlibDecoder::new(packed).read_to_string(&mut text);
    debug_assert!(read.is_ok(), "a part of the program is broken: {read:?}");
    text
}

/// Returns what a section tells of a word. Its lines are not taken apart before, which would take most of the time.
fn find(section: &'static str, word: &str) -> Option<&'static str> {
    let (mut from, mut to) = (0, section.len());
    while from < to {
        let middle = from + (to - from) / 2;
        let start = section.as_bytes()[..middle].iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1);
        let line = section[start..].split('\n').next().unwrap_or_default();
        let (listed, told) = line.split_once('\t').unwrap_or((line, ""));
        match listed.cmp(word) {
            Ordering::Less => from = start + line.len() + 1,
            Ordering::Greater => to = start,
            Ordering::Equal => return Some(told),
        }
    }
    None
}

fn numbers(line: &str) -> Vec<usize> {
    line.trim_start_matches('!').split(' ').filter_map(|number| number.parse().ok()).collect()
}

#[cfg(test)]
mod tests;
