//! Grammar: all readings of a sentence. A reading accounts for every word.
//!
//! [`sentence`] reads forms of questions, this file sets of things, [`after`] and [`before`] what stands after and
//! before a noun. A whole name in the scene comes before any other reading of its words.

mod after;
mod before;
mod lengths;
mod noun;
mod sentence;

use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

pub(crate) use self::sentence::sentences;
use super::expression::{Expression, SetOf};
use super::tokens::{Token, is_mark};
use super::words::{LanguageWords, WordClass};
use crate::scene::identity::name_words::{self, SceneWords, singular};
use crate::scene::{Identities, LevelFilter};

/// Most words of a sentence that are read.
pub(crate) const MOST_WORDS: usize = 48;
/// Most readings of the same words.
const MOST_READINGS: usize = 6;
/// Most words of a noun.
const LONGEST_NOUN: usize = 6;

/// Reader of one list of tokens.
pub(crate) struct Grammar<'a> {
    text: &'a str,
    tokens: Vec<&'a Token>,
    words: Vec<&'a str>,
    identities: &'a Identities,
    known: &'a SceneWords,
    vocabulary: &'static LanguageWords,
    /// Readings by the first word and the one after the last.
    read: HashMap<(usize, usize, bool), Rc<Vec<Expression>>>,
}

impl<'a> Grammar<'a> {
    pub(crate) fn new(text: &'a str, tokens: Vec<&'a Token>, identities: &'a Identities) -> Self {
        let comma = |low: &'a str| if is_mark(low) && low != "?" { "," } else { low };
        let words = tokens.iter().map(|t| comma(t.low.as_str())).collect();
        let (known, vocabulary) = (identities.words(), LanguageWords::get());
        Self { text, tokens, words, identities, known, vocabulary, read: HashMap::new() }
    }

    /// Reader of other tokens of the same text.
    fn of(&self, tokens: Vec<&'a Token>) -> Self {
        Self::new(self.text, tokens, self.identities)
    }

    /// Bytes of the text that words stand for.
    fn at(&self, from: usize, to: usize) -> Range<usize> {
        let of = &self.tokens[from.min(self.tokens.len())..to.min(self.tokens.len())];
        let start = of.iter().map(|t| t.at.start).min().unwrap_or(0);
        start..of.iter().map(|t| t.at.end).max().unwrap_or(start)
    }

    fn is(&self, class: WordClass, at: usize) -> bool {
        self.words.get(at).is_some_and(|word| self.vocabulary.is(class, word))
    }

    fn has_determiner(&self, at: &[usize]) -> bool {
        at.iter().any(|at| self.is(WordClass::Determiner, *at))
    }

    fn make(&self, set: SetOf, from: usize, to: usize) -> Expression {
        Expression::new(set, self.at(from, to))
    }

    /// Returns all readings of all words as a set of things.
    pub(crate) fn all(&mut self) -> Vec<Expression> {
        let n = self.words.len();
        if n == 0 || n > MOST_WORDS { Vec::new() } else { self.set(0, n, true).to_vec() }
    }

    /// Returns the readings of the words from `i` to `j`; `joined` if they may be several sets joined by "and".
    fn set(&mut self, i: usize, j: usize, joined: bool) -> Rc<Vec<Expression>> {
        if i >= j {
            return Rc::default();
        }
        if let Some(known) = self.read.get(&(i, j, joined)) {
            return Rc::clone(known);
        }
        // Ends recursion over the same words.
        self.read.insert((i, j, joined), Rc::default());
        let mut found = self.readings(i, j, joined);
        found.dedup();
        found.truncate(MOST_READINGS);
        let found = Rc::new(found);
        self.read.insert((i, j, joined), Rc::clone(&found));
        found
    }

    fn readings(&mut self, i: usize, j: usize, joined: bool) -> Vec<Expression> {
        if let Some(name) = self.whole_name(i, j) {
            return vec![self.make(SetOf::Called(name), i, j)];
        }
        let one = before::one_of(self, i, j);
        if !one.is_empty() {
            return one;
        }
        if joined {
            let several = self.several(i, j);
            if !several.is_empty() {
                return several;
            }
        }
        before::read(self, i, j)
    }

    /// Returns the text of these words if it is a whole name in the scene.
    fn whole_name(&self, i: usize, j: usize) -> Option<String> {
        if j - i > 1 && matches!(self.words[j - 1], "," | "?") {
            return None;
        }
        let from = if matches!(self.words[i], "the" | "a" | "an") && i + 1 < j { i + 1 } else { i };
        let is_number = self.words[from].starts_with('#');
        let may_be =
            self.known.has(self.words[from].trim_start_matches('"').split(' ').next()?) || !self.words[from].is_ascii();
        // One word is read as any other, so that it can be meant in the plural.
        if !may_be && !is_number && j - from < 2 || j - from > self.known.longest.max(2) + 2 {
            return None;
        }
        let is_quoted = self.words[from].starts_with('"');
        if j - from < 2 && !is_quoted && !is_number && self.words[from].chars().all(char::is_alphanumeric) && may_be {
            let word = self.words[from];
            let is_plain = !self.vocabulary.is(WordClass::NoName, word) && self.vocabulary.order(word).is_none();
            if is_plain {
                return None;
            }
        }
        let text = if is_quoted { &self.tokens[from].raw } else { self.text.get(self.at(from, j))? };
        if !self.identities.called(text, LevelFilter::Auto).is_empty() {
            return Some(text.to_owned());
        }
        let said = if (2..=LONGEST_NOUN).contains(&(j - from)) { name_words::words(text) } else { Vec::new() };
        let (id, k) = self.known.reordered(&said).filter(|_| said.len() > 1)?;
        self.identities.get(id)?.names.get(k).cloned()
    }

    /// Returns readings as several sets: "A and B", "A, B or C", "A except B".
    fn several(&mut self, i: usize, j: usize) -> Vec<Expression> {
        for p in i..j {
            let Some(n) = self.vocabulary.except(&self.words[p..j]).filter(|n| p + n < j) else { continue };
            if p > i && matches!(self.words[p - 1], "color" | "colour") {
                continue;
            }
            // "Everything but the lamp" leaves out all that follows.
            let (all, but) = (self.set(i, p, true), self.set(p + n, j, true));
            let of_rest = if p == i { Vec::new() } else { pairs(&all, &but) };
            let made: Vec<Expression> = of_rest
                .into_iter()
                .map(|(of, but)| self.make(SetOf::Except(Box::new(of), Box::new(but)), i, j))
                .collect();
            if !made.is_empty() {
                return made;
            }
        }
        let just = self.just_its(i, j);
        if !just.is_empty() {
            return just;
        }
        let mut found = self.shared(i, j);
        for p in i + 1..j.saturating_sub(1) {
            let Some(n) = self.joint(p, j) else { continue };
            // "Red or blue controller" is read above.
            if !found.is_empty() && p == i + 1 && self.is_modifier(i) {
                continue;
            }
            let either = self.words[p..p + n].contains(&"or");
            let (left, right) = (self.set(i, p, false), self.set(p + n, j, true));
            for (a, b) in pairs(&left, &right) {
                let (mut of, mut either) = (vec![a], either);
                match b.set {
                    SetOf::Union { of: more, either: too } => {
                        of.extend(more);
                        either |= too;
                    }
                    _ => of.push(b),
                }
                // "Apples or pears": both, where there are both. "The apples or the pears" is a choice.
                let is_any = either && of.iter().all(Expression::is_plural) && !self.has_determiner(&[i, p + n]);
                let union = self.make(SetOf::Union { of, either }, i, j);
                found.push(if is_any {
                    self.make(SetOf::Every { of: Box::new(union), both: false }, i, j)
                } else {
                    union
                });
            }
            found.extend(self.distributed(i, p, p + n, j, either));
            found.extend(self.of_one_whole(i, p, p + n, j, either));
        }
        // "X left of A and B" may be X left of both.
        if !found.is_empty() {
            found.extend(before::read(self, i, j));
        }
        found
    }

    /// Reads "the controller, just its buttons".
    fn just_its(&mut self, i: usize, j: usize) -> Vec<Expression> {
        let is_there =
            |p: &usize| matches!(self.words[*p..j], [",", "just" | "only" | "specifically", "its" | "the", _, ..]);
        let Some(p) = (i + 1..j.saturating_sub(3)).find(is_there) else { return Vec::new() };
        let (whole, piece) = (self.set(i, p, false), self.set(p + 3, j, true));
        let made =
            pairs(&piece, &whole).into_iter().map(|(a, b)| self.make(SetOf::PartOf(Box::new(a), Box::new(b)), i, j));
        made.collect()
    }

    /// Number of words that join two sets at `p`.
    fn joint(&self, p: usize, j: usize) -> Option<usize> {
        match self.words[p..j] {
            [",", "and" | "or", "also" | "then", ..] => Some(3),
            ["and" | "or" | "plus", "also" | "then", ..] => Some(2),
            [",", "and" | "or", ..] | ["as", "well", "as", ..] => Some(if self.words[p] == "as" { 3 } else { 2 }),
            ["together" | "along", "with", ..] => Some(2),
            ["," | "and" | "or" | "plus" | "&" | "+" | "nor", ..] => Some(1),
            _ => None,
        }
    }

    /// Reads "red and blue controllers", "largest and smallest book", "left and right stick of X".
    fn shared(&mut self, i: usize, j: usize) -> Vec<Expression> {
        let from = (i..j).find(|k| !self.is(WordClass::Determiner, *k) && !self.is(WordClass::All, *k)).unwrap_or(i);
        let mut firsts = Vec::new();
        let mut p = from;
        while p + 1 < j && self.is_modifier(p) {
            let joint = self.joint(p + 1, j);
            firsts.push(p);
            match joint {
                Some(n) => {
                    p += 1 + n;
                    while p < j && self.is(WordClass::Determiner, p) {
                        p += 1;
                    }
                }
                None => break,
            }
        }
        if firsts.len() < 2 || firsts.last() != Some(&p) || p + 1 >= j || self.joint(p + 1, j).is_some() {
            return Vec::new();
        }
        let mut sets: Vec<Vec<Expression>> = Vec::new();
        for first in firsts {
            let tokens = [first].into_iter().chain(p + 1..j).map(|k| self.tokens[k]).collect();
            let mut one = self.of(tokens);
            let n = one.words.len();
            sets.push(one.set(0, n, false).to_vec());
        }
        let either = self.words[from..p].contains(&"or");
        let all: Option<Vec<Expression>> = sets.into_iter().map(|readings| readings.into_iter().next()).collect();
        all.map(|of| self.make(SetOf::Union { of, either }, i, j)).into_iter().collect()
    }

    /// Returns whether a word may stand before a noun and be joined with others like it.
    fn is_modifier(&self, at: usize) -> bool {
        let word = self.words[at];
        let is_name = || {
            singular(word) == word
                && !self.known.with(word).is_empty()
                && !self.known.ends(word)
                && self.identities.called(word, LevelFilter::Auto).is_empty()
                // "The teddy or the lamp": another word for a teddy bear.
                && self.known.kinds().of(word).is_empty()
        };
        self.vocabulary.order(word).is_some() || crate::scene::colors::row(word).is_some() || is_name()
    }

    /// Reads "the lid and the handle of the kettle" as both of the kettle.
    fn distributed(&mut self, i: usize, p: usize, from: usize, j: usize, either: bool) -> Vec<Expression> {
        let is_of = |k: &usize| self.words[*k] == "of" || self.vocabulary.relation(&self.words[*k..j]).is_some();
        let Some(q) = (from + 1..j).find(is_of) else { return Vec::new() };
        if (i..p).any(|k| self.vocabulary.is(WordClass::NoName, self.words[k]) && !self.is(WordClass::Determiner, k)) {
            return Vec::new();
        }
        let tokens = (i..p).chain(q..j).map(|k| self.tokens[k]).collect();
        let mut left = self.of(tokens);
        let n = left.words.len();
        let (left, right) = (left.set(0, n, false), self.set(from, j, false));
        self.both(&left, &right, i, j, either)
    }

    fn both(&self, left: &[Expression], right: &[Expression], i: usize, j: usize, either: bool) -> Vec<Expression> {
        let union = |(a, b)| self.make(SetOf::Union { of: vec![a, b], either }, i, j);
        pairs(left, right).into_iter().map(union).collect()
    }

    /// Reads "the kettle lid and knob" as both of the kettle.
    fn of_one_whole(&mut self, i: usize, p: usize, from: usize, j: usize, either: bool) -> Vec<Expression> {
        let is_plain = |k: usize| !self.vocabulary.is(WordClass::NoName, self.words[k]);
        let start = (i..p).find(|k| is_plain(*k)).unwrap_or(p);
        if p < start + 2 || !(start..p).chain(from..j).all(is_plain) {
            return Vec::new();
        }
        let tokens = (start..p - 1).chain(from..j).map(|k| self.tokens[k]).collect();
        let mut right = self.of(tokens);
        let n = right.words.len();
        let (left, right) = (self.set(i, p, false), right.set(0, n, false));
        self.both(&left, &right, i, j, either)
    }
}

/// Returns all pairs of readings, the best first.
fn pairs(left: &[Expression], right: &[Expression]) -> Vec<(Expression, Expression)> {
    let both = left.iter().flat_map(|a| right.iter().map(move |b| (a.clone(), b.clone())));
    both.take(MOST_READINGS).collect()
}
