//! Things of a scene by their names: nouns that fit some of them, kinds, colors, and names of one thing only.

use std::collections::BTreeMap;

use super::clarity::Clarity;
use super::color::{TERMS, is_color};
use super::facts::MeshFacts;
use super::kinds::TrueKind;
use super::names::{is_side, keys, plural, singular, words};
use crate::pipeline::synth::TrueIdentity;

/// Generic words for one object and for several.
const GENERIC: [[&str; 2]; 3] = [["thing", "things"], ["object", "objects"], ["item", "items"]];

/// Words for some things of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TruePhrase {
    /// Singular without an article; none if its things are named in the plural.
    pub(super) one: Option<String>,
    pub(super) many: Option<String>,
    /// Things that it fits, by index.
    pub(super) fits: Vec<usize>,
    /// True for "thing" and its like.
    pub(super) generic: bool,
}

impl TruePhrase {
    /// Returns the words, in the singular if there is one.
    pub(super) fn name(&self) -> &str {
        self.one.as_deref().or(self.many.as_deref()).unwrap_or_default()
    }
}

/// Scene that sentences are about.
pub(super) struct TrueScope {
    pub(super) facts: MeshFacts,
    /// Words of each name.
    pub(super) words: Vec<Vec<String>>,
    keys: Vec<Vec<(String, bool)>>,
    /// True for objects that carry most others.
    carriers: Vec<bool>,
    /// Nouns that fit objects, or parts of any object.
    pub(super) nouns: Vec<TruePhrase>,
}

impl TrueScope {
    pub(super) fn new(list: &[TrueIdentity], facts: MeshFacts) -> Self {
        let words: Vec<Vec<String>> = list.iter().map(|i| words(&i.name)).collect();
        let keys = words.iter().enumerate().map(|(i, w)| keys(w, i >= facts.objects).into_iter().collect()).collect();
        let carriers = facts.carriers();
        let mut scope = Self { facts, words, keys, carriers, nouns: Vec::new() };
        let all: Vec<usize> = (0..list.len()).collect();
        // Alone, "the left" and "the orange" would be sides and colors.
        scope.nouns = scope.nouns_of(&all).into_iter().filter(|n| !is_side(n.name()) && !is_color(n.name())).collect();
        scope
    }

    pub(super) fn is_object(&self, thing: usize) -> bool {
        thing < self.facts.objects
    }

    /// Objects that carry most others, which generic words do not mean.
    pub(super) fn carriers(&self) -> Vec<usize> {
        (0..self.facts.objects).filter(|&i| self.carriers[i]).collect()
    }

    /// Generic words for the objects that carry no others; none if that is a single one.
    pub(super) fn things(&self) -> Vec<TruePhrase> {
        let fits: Vec<usize> = (0..self.facts.objects).filter(|&i| !self.carriers[i]).collect();
        let phrase = |[one, many]: [&str; 2]| {
            let [one, many] = [one, many].map(|w| Some(w.to_owned()));
            TruePhrase { one, many, fits: fits.clone(), generic: true }
        };
        if fits.len() < 2 { Vec::new() } else { GENERIC.map(phrase).to_vec() }
    }

    /// Nouns of objects; of those that carry others too if asked for.
    pub(super) fn object_nouns(&self, with_carriers: bool) -> Vec<TruePhrase> {
        let fits = |n: &&TruePhrase| n.fits.iter().all(|&i| self.is_object(i) && (with_carriers || !self.carriers[i]));
        self.nouns.iter().filter(fits).cloned().collect()
    }

    /// Objects with each noun that fits only them: "kettle", "yellow kettle".
    pub(super) fn anchors(&self, with_carriers: bool) -> Vec<(usize, String)> {
        let nouns = self.object_nouns(with_carriers);
        let single = |n: &TruePhrase| (n.fits.len() == 1).then(|| (n.fits[0], n.name().to_owned()));
        nouns.iter().filter_map(single).collect()
    }

    /// Parts of an object.
    pub(super) fn parts(&self, whole: usize) -> Vec<usize> {
        (0..self.words.len()).filter(|&i| self.facts.wholes[i] == Some(whole)).collect()
    }

    /// Nouns that fit some of these things.
    pub(super) fn nouns_of(&self, things: &[usize]) -> Vec<TruePhrase> {
        let mut found: BTreeMap<&str, [Vec<usize>; 2]> = BTreeMap::new();
        for &i in things {
            for (key, grouped) in &self.keys[i] {
                found.entry(key.as_str()).or_default()[usize::from(*grouped)].push(i);
            }
        }
        let mut nouns = Vec::new();
        for (key, [single, groups]) in found {
            let is_plural = single.is_empty();
            // "window" of one thing and "windows" of another: nobody knows what "the window" means.
            if !is_plural && !groups.is_empty() {
                continue;
            }
            let fits = if is_plural { groups } else { single };
            // "jar" of a cookie jar, which is a jar itself.
            let mixed = fits.iter().any(|&i| self.is_object(i)) && fits.iter().any(|&i| !self.is_object(i));
            if !mixed {
                let one = (!is_plural).then(|| key.to_owned());
                nouns.push(TruePhrase { one, many: plural(key), fits, generic: false });
            }
        }
        nouns
    }

    /// Things for which `holds`; `None` if that is unclear for one of them.
    pub(super) fn among(&self, things: &[usize], holds: impl Fn(usize) -> Clarity) -> Option<Vec<usize>> {
        let answers: Vec<Clarity> = things.iter().map(|&i| holds(i)).collect();
        let clear = !answers.contains(&Clarity::Unclear);
        let fits = things.iter().zip(answers).filter(|(_, a)| *a == Clarity::Yes).map(|(i, _)| *i);
        clear.then(|| fits.collect())
    }

    /// Things of a phrase for which `holds`, where it does not matter if a generic word means tables and floors.
    pub(super) fn either_way(&self, head: &TruePhrase, holds: impl Fn(usize) -> Clarity) -> Option<Vec<usize>> {
        let matters = head.generic && self.carriers().iter().any(|&i| holds(i) != Clarity::No);
        if matters { None } else { self.among(&head.fits, holds) }
    }

    /// Answers whether a thing has a color, by its index: as its name says, else on most of its surface.
    pub(super) fn colored(&self, thing: usize, term: usize) -> Clarity {
        let [sure, perhaps] = self.facts.share(thing, term);
        let named = |is: &dyn Fn(&str) -> bool| self.words[thing].iter().any(|w| is(w.as_str()));
        if named(&|w| TERMS[term].is(w)) {
            Clarity::of(sure >= 0.3, false)
        } else if named(&is_color) {
            Clarity::of(false, perhaps < 0.1)
        } else {
            Clarity::of(sure >= 0.6, perhaps < 0.1)
        }
    }

    /// Things of a kind: objects, and parts of objects of another kind. `None` if that is unclear for one.
    pub(super) fn of_kind(&self, kind: &TrueKind) -> Option<Vec<usize>> {
        let answer = |i: usize| {
            let is = |nouns: &[&str]| self.keys[i].iter().any(|(key, _)| nouns.contains(&key.as_str()));
            if is(kind.holds) { Clarity::Yes } else { Clarity::of(false, !is(kind.perhaps)) }
        };
        let counts = |i: &usize| self.facts.wholes[*i].is_none_or(|whole| answer(whole) != Clarity::Yes);
        let things: Vec<usize> = (0..self.words.len()).filter(counts).collect();
        self.among(&things, answer)
    }

    /// Returns whether the last word of a noun is the noun of some name.
    pub(super) fn has_noun(&self, noun: &str) -> bool {
        let head = singular(noun.rsplit(' ').next().unwrap_or_default());
        self.keys.iter().flatten().any(|(key, _)| *key == head)
    }

    /// Returns whether the last word of a noun is in some name.
    pub(super) fn knows(&self, noun: &str) -> bool {
        let head = singular(noun.rsplit(' ').next().unwrap_or_default());
        self.words.iter().flatten().any(|word| singular(word) == head)
    }
}
