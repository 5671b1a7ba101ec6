//! Words of the language that are no names, read from `assets/language.toml`: relations, orders, determiners.

use std::collections::HashMap;
use std::sync::OnceLock;

use serde::Deserialize;

use super::expression::{OrderBy, Relation};

/// Contents of the file, which documents each list.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct WordLists {
    determiners: Vec<String>,
    any: Vec<String>,
    all: Vec<String>,
    things: Vec<String>,
    parts: Vec<String>,
    of: Vec<String>,
    amounts: Vec<String>,
    standing: Vec<String>,
    except: Vec<String>,
    here: Vec<String>,
    openers: Vec<String>,
    relations: Vec<(String, Relation)>,
    superlatives: Vec<(String, OrderBy, bool)>,
    comparatives: Vec<(String, OrderBy, bool)>,
    places: Vec<(String, OrderBy, bool)>,
    quantities: Vec<(String, OrderBy)>,
    units: Vec<(String, f64)>,
    no_name: String,
    same: Vec<(String, String)>,
}

/// Kind of a word that has a meaning of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum WordClass {
    Determiner,
    Any,
    All,
    Thing,
    Part,
    Of,
    Amount,
    Standing,
    NoName,
}

/// Choice of the one with the most or the least of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OrderWord {
    pub(crate) order: OrderBy,
    /// True for the most of it.
    pub(crate) most: bool,
    /// True if it chooses among any number of things, false if among two.
    pub(crate) superlative: bool,
}

/// Words of the language, by their first word.
#[derive(Debug, Default)]
pub(crate) struct LanguageWords {
    classes: HashMap<String, Vec<WordClass>>,
    except: Phrases<()>,
    here: Phrases<()>,
    openers: Phrases<()>,
    relations: Phrases<Relation>,
    places: Phrases<(OrderBy, bool)>,
    orders: HashMap<String, OrderWord>,
    quantities: HashMap<String, OrderBy>,
    units: HashMap<String, f64>,
    same: HashMap<String, String>,
}

/// Phrases with their values, by their first word.
type Phrases<T> = HashMap<String, Vec<(Vec<String>, T)>>;

fn phrases<T>(list: impl IntoIterator<Item = (String, T)>) -> Phrases<T> {
    let mut all: Phrases<T> = HashMap::new();
    for (phrase, value) in list {
        let words: Vec<String> = phrase.split(' ').map(str::to_owned).collect();
        all.entry(words[0].clone()).or_default().push((words, value));
    }
    all
}

/// Longest phrase that `words` begin with, with its number of words.
fn begins<'l, T>(all: &'l Phrases<T>, words: &[&str]) -> Option<(&'l T, usize)> {
    let begun = all.get(*words.first()?)?.iter();
    let found =
        begun.filter(|(phrase, _)| phrase.len() <= words.len() && phrase.iter().zip(words).all(|(a, b)| a == b));
    found.map(|(phrase, value)| (value, phrase.len())).max_by_key(|(_, n)| *n)
}

impl LanguageWords {
    /// Returns the built-in words. A test reads them, so the fallback to none is never used.
    pub(crate) fn get() -> &'static Self {
        static READ: OnceLock<LanguageWords> = OnceLock::new();
        READ.get_or_init(|| Self::read().unwrap_or_default())
    }

    fn read() -> Result<Self, toml::de::Error> {
        let lists: WordLists = toml::from_str(include_str!("../../../../../assets/language.toml"))?;
        let plain = |list: Vec<String>| phrases(list.into_iter().map(|w| (w, ())));
        let no_name = lists.no_name.split_whitespace().map(str::to_owned).collect();
        let classes = [
            (WordClass::Determiner, lists.determiners),
            (WordClass::Any, lists.any),
            (WordClass::All, lists.all),
            (WordClass::Thing, lists.things),
            (WordClass::Part, lists.parts),
            (WordClass::Of, lists.of),
            (WordClass::Amount, lists.amounts),
            (WordClass::Standing, lists.standing),
            (WordClass::NoName, no_name),
        ];
        let word = |(order, most, superlative)| OrderWord { order, most, superlative };
        let orders = lists.superlatives.into_iter().map(|(w, order, most)| (w, word((order, most, true))));
        let of_two = lists.comparatives.into_iter().map(|(w, order, most)| (w, word((order, most, false))));
        let mut of_word: HashMap<String, Vec<WordClass>> = HashMap::new();
        for (class, list) in classes {
            list.into_iter().for_each(|w| of_word.entry(w).or_default().push(class));
        }
        Ok(Self {
            classes: of_word,
            except: plain(lists.except),
            here: plain(lists.here),
            openers: plain(lists.openers),
            relations: phrases(lists.relations),
            places: phrases(lists.places.into_iter().map(|(w, order, most)| (w, (order, most)))),
            orders: of_two.chain(orders).collect(),
            quantities: lists.quantities.into_iter().collect(),
            units: lists.units.into_iter().collect(),
            same: lists.same.into_iter().collect(),
        })
    }

    /// Returns whether a word is of a class.
    pub(crate) fn is(&self, class: WordClass, word: &str) -> bool {
        self.classes.get(word).is_some_and(|of| of.contains(&class))
    }

    /// Number of the words at the start that leave things out: "except for".
    pub(crate) fn except(&self, words: &[&str]) -> Option<usize> {
        begins(&self.except, words).map(|(_, n)| n)
    }

    /// Number of the words at the start that exclude nothing: "in the scene".
    pub(crate) fn here(&self, words: &[&str]) -> Option<usize> {
        begins(&self.here, words).map(|(_, n)| n)
    }

    /// Number of the words at the start that are polite or command: "show me".
    pub(crate) fn opener(&self, words: &[&str]) -> Option<usize> {
        begins(&self.openers, words).map(|(_, n)| n)
    }

    /// Relation at the start, and its number of words.
    pub(crate) fn relation(&self, words: &[&str]) -> Option<(Relation, usize)> {
        begins(&self.relations, words).map(|(relation, n)| (*relation, n))
    }

    /// Place at the start that is said without another thing, and its number of words.
    pub(crate) fn place(&self, words: &[&str]) -> Option<((OrderBy, bool), usize)> {
        begins(&self.places, words).map(|(place, n)| (*place, n))
    }

    /// Words of all relations.
    pub(crate) fn relations(&self) -> impl Iterator<Item = (String, Relation)> {
        self.relations.values().flatten().map(|(words, relation)| (words.join(" "), *relation))
    }

    /// Choice that a word stands for.
    pub(crate) fn order(&self, word: &str) -> Option<OrderWord> {
        self.orders.get(word).copied()
    }

    /// Words that choose among any number of things.
    pub(crate) fn superlatives(&self) -> impl Iterator<Item = &str> {
        self.orders.iter().filter(|(_, o)| o.superlative).map(|(word, _)| word.as_str())
    }

    /// Quantity that an adjective or noun names.
    pub(crate) fn quantity(&self, word: &str) -> Option<OrderBy> {
        self.quantities.get(word).copied()
    }

    /// Words that another spelling stands for.
    pub(crate) fn same(&self, word: &str) -> Option<&str> {
        self.same.get(word).map(String::as_str)
    }

    /// All words of the language, for slips of them.
    pub(crate) fn words(&self) -> impl Iterator<Item = &str> {
        let of_phrases = self.relations.values().flatten().flat_map(|(words, _)| words);
        of_phrases.map(String::as_str).chain(self.orders.keys().map(String::as_str)).filter(|w| w.len() > 4)
    }

    /// Length of a unit in meters.
    pub(crate) fn unit(&self, word: &str) -> Option<f64> {
        self.units.get(word).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_phrase_counts() {
        let words = LanguageWords::read().expect("the words");
        assert_eq!(words.relation(&["on", "top", "of", "it"]), Some((Relation::On, 3)));
        assert_eq!(words.relation(&["on", "the", "left", "of", "it"]), Some((Relation::LeftOf, 4)));
        assert_eq!(words.place(&["on", "the", "left"]), Some(((OrderBy::Right, false), 3)));
        let [tallest, taller] = ["tallest", "taller"].map(|w| words.order(w).expect("an order"));
        assert!(tallest.superlative && !taller.superlative && tallest.order == taller.order && taller.most);
        assert!(words.is(WordClass::NoName, "and") && !words.is(WordClass::NoName, "lamp"));
        assert!(words.relation(&["lamp"]).is_none() && words.except(&["but", "not", "it"]) == Some(2));
        assert_eq!(
            (words.unit("cm"), words.quantity("tall"), words.opener(&["show", "me", "it"])),
            (Some(0.01), Some(OrderBy::Height), Some(2))
        );
    }
}
