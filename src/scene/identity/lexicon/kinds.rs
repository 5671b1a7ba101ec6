//! Index of a scene's names by what their things are, so that a question does not go through all names.

use std::collections::HashMap;

use super::super::IdentityId;
use super::{Clue, Kinship, Lexicon, clues, concepts_of};

/// Names by the words and concepts of their things.
#[derive(Debug, Default)]
pub(crate) struct NameKinds {
    /// Each name once, with its owners and the place of the name among theirs.
    names: Vec<(String, Vec<(IdentityId, usize)>)>,
    by_text: HashMap<String, Vec<Entry>>,
    by_concept: HashMap<usize, Vec<Entry>>,
}

/// Name that is a thing of some kind, by its clue of this number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    name: usize,
    clue: usize,
    kinship: Kinship,
}

impl NameKinds {
    /// Indexes names in the singular, each with its owner and its place among the owner's names.
    pub(crate) fn new(names: impl Iterator<Item = (String, IdentityId, usize)>) -> Self {
        let mut kinds = Self::default();
        let mut known: HashMap<String, usize> = HashMap::new();
        for (name, id, place) in names {
            let at = *known.entry(name).or_insert_with_key(|name| kinds.add(name));
            kinds.names[at].1.push((id, place));
        }
        kinds
    }

    fn add(&mut self, name: &str) -> usize {
        let (at, lexicon) = (self.names.len(), Lexicon::get());
        self.names.push((name.to_owned(), Vec::new()));
        for (clue, what) in clues(name).into_iter().enumerate() {
            let entry = |kinship| Entry { name: at, clue, kinship };
            let (own, same) = match what {
                Clue::Text(text) => {
                    self.by_text.entry(text).or_default().push(entry(Kinship::Same));
                    continue;
                }
                Clue::Concepts(own) => (own, Kinship::Same),
                Clue::Describing(own) => (own, Kinship::KindOf),
            };
            for concept in lexicon.above(&own) {
                let kinship = if own.contains(&concept) { same } else { Kinship::KindOf };
                self.by_concept.entry(concept).or_default().push(entry(kinship));
            }
        }
        at
    }

    /// Returns what is of this kind by one of its names, with the first such name, as [`is_a`](super::is_a) tells.
    pub(crate) fn of(&self, asked: &str) -> Vec<(IdentityId, &str, Kinship)> {
        let concepts = concepts_of(asked);
        let by_concept = concepts.iter().filter_map(|concept| self.by_concept.get(concept)).flatten();
        let mut entries: Vec<Entry> =
            self.by_text.get(asked).into_iter().flatten().chain(by_concept).copied().collect();
        entries.sort_unstable();
        entries.dedup_by_key(|entry| entry.name);
        let owners = |e: Entry| self.names[e.name].1.iter().map(move |(id, place)| (*id, *place, e));
        let mut found: Vec<(IdentityId, usize, Entry)> = entries.into_iter().flat_map(owners).collect();
        found.sort_unstable();
        found.dedup_by_key(|(id, ..)| *id);
        found.into_iter().map(|(id, _, e)| (id, self.names[e.name].0.as_str(), e.kinship)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::is_a;
    use super::*;

    #[test]
    fn the_index_tells_what_the_names_tell() {
        let mut names = include_str!("pairs.txt").lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>();
        names.sort_unstable();
        let pairs: Vec<[&str; 2]> = names
            .iter()
            .filter_map(|l| l.split_once(" | "))
            .map(|(a, b)| [a, b.split(" | ").next().unwrap_or_default()])
            .collect();
        let listed = pairs.iter().enumerate().map(|(i, [name, _])| ((*name).to_owned(), i as IdentityId + 1, 0));
        let kinds = NameKinds::new(listed);
        let mut told = 0;
        for [_, asked] in &pairs {
            let found = kinds.of(asked);
            for (i, [name, _]) in pairs.iter().enumerate() {
                let here = found.iter().find(|(id, ..)| *id == i as IdentityId + 1).map(|(_, _, kinship)| *kinship);
                assert_eq!(here, is_a(name, asked), "{name} as {asked}");
                told += usize::from(here.is_some());
            }
        }
        assert!(told > pairs.len() / 4);
        // Of two names, the first one that fits is told.
        let two =
            NameKinds::new([("mug".to_owned(), 1, 0), ("cup".to_owned(), 1, 1), ("lamp".to_owned(), 2, 0)].into_iter());
        assert_eq!(two.of("cup"), [(1, "mug", Kinship::KindOf)]);
        assert!(two.of("zebra").is_empty() && two.of("").is_empty());
    }
}
