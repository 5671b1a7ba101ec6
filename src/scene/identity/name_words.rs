//! Words of the names of a scene, for questions: computed once, looked up by word.

use std::collections::HashMap;
use std::sync::OnceLock;

use super::lexicon::kinds::NameKinds;
use super::{Identities, IdentityId};

/// Most characters of a name that are compared.
const MOST_CHARS: usize = 300;

/// Words that tell the pieces of a thing apart by their place.
pub(crate) const SIDES: [&str; 9] = ["front", "back", "rear", "left", "right", "top", "bottom", "upper", "lower"];

/// Returns the lower-case words of a name; a plural counts like its singular.
pub(crate) fn words(text: &str) -> Vec<String> {
    written(text).map(|w| singular(&w)).collect()
}

/// Returns the lower-case words of a name as they are written.
pub(crate) fn written(text: &str) -> impl Iterator<Item = String> + use<> {
    // No name is longer, and comparing every letter of a long text would be slow.
    let lower = text.chars().take(MOST_CHARS).collect::<String>().to_lowercase();
    let apart = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty() && *w != "s");
    apart.map(str::to_owned).collect::<Vec<_>>().into_iter()
}

/// Returns a word without an English plural's ending.
pub(crate) fn singular(word: &str) -> String {
    for (end, instead) in [("knives", "knife"), ("shelves", "shelf"), ("ies", "y")] {
        if let Some(stem) = word.strip_suffix(end).filter(|s| s.len() > 1 || end.len() > 3) {
            return format!("{stem}{instead}");
        }
    }
    for end in ["sses", "xes", "ches", "shes"] {
        if word.ends_with(end) {
            return word[..word.len() - 2].into();
        }
    }
    match word.strip_suffix('s') {
        Some(stem) if stem.chars().count() > 2 && !stem.ends_with(['s', 'u', 'i']) => stem.into(),
        _ => word.into(),
    }
}

/// Names of one identity, taken apart.
#[derive(Clone, Debug, Default)]
pub(crate) struct NamedWords {
    /// Words of each name, in the singular.
    pub(crate) names: Vec<Vec<String>>,
}

/// Words of all names of a scene.
#[derive(Debug, Default)]
pub(crate) struct SceneWords {
    /// By number less one.
    of: Vec<NamedWords>,
    /// Identities that have a word in a name of their own, by number.
    by_word: HashMap<String, Vec<IdentityId>>,
    /// Words as they are written, by their singular.
    written: HashMap<String, String>,
    /// Names by what their things are, once it was asked for.
    kinds: OnceLock<NameKinds>,
    /// Most words of a name or full name.
    pub(crate) longest: usize,
}

impl SceneWords {
    pub(super) fn new(all: &Identities) -> Self {
        let mut scene = Self::default();
        for (id, identity) in all.iter() {
            let names: Vec<Vec<String>> = identity.names.iter().map(|n| words(n)).collect();
            for word in names.iter().flatten() {
                let ids = scene.by_word.entry(word.clone()).or_default();
                if ids.last() != Some(&id) {
                    ids.push(id);
                }
            }
            identity.names.iter().flat_map(|n| written(n)).for_each(|w| {
                scene.written.insert(singular(&w), w);
            });
            let full =
                all.ancestors(id).filter_map(|i| all.get(i)?.names.first()).map(|n| written(n).count() + 2).sum();
            scene.longest = names.iter().map(Vec::len).max().unwrap_or(0).max(full).max(scene.longest);
            scene.of.push(NamedWords { names });
        }
        scene
    }

    /// Words of the names of an identity.
    pub(crate) fn names(&self, id: IdentityId) -> &[Vec<String>] {
        (id as usize).checked_sub(1).and_then(|i| self.of.get(i)).map(|of| of.names.as_slice()).unwrap_or_default()
    }

    /// Names by what their things are.
    pub(crate) fn kinds(&self) -> &NameKinds {
        self.kinds.get_or_init(|| {
            let ids = self.of.iter().zip(1..);
            let names =
                ids.flat_map(|(of, id)| of.names.iter().enumerate().map(move |(k, name)| (name.join(" "), id, k)));
            NameKinds::new(names)
        })
    }

    /// Identities that have a word, in the singular, in a name of their own.
    pub(crate) fn with(&self, word: &str) -> &[IdentityId] {
        self.by_word.get(word).map(Vec::as_slice).unwrap_or_default()
    }

    /// Returns whether a name has this word, in the singular or not.
    pub(crate) fn has(&self, word: &str) -> bool {
        self.by_word.contains_key(word) || self.by_word.contains_key(&singular(word))
    }

    /// Returns whether a name ends in this word, in the singular.
    pub(crate) fn ends(&self, word: &str) -> bool {
        self.with(word).iter().any(|id| self.names(*id).iter().any(|name| name.last().is_some_and(|w| w == word)))
    }

    /// Returns whether a name is this one word, in the singular.
    pub(crate) fn is_name(&self, word: &str) -> bool {
        self.with(word).iter().any(|id| self.names(*id).iter().any(|name| name.len() == 1 && name[0] == word))
    }

    /// Returns whether a name has these two words one after the other.
    pub(crate) fn follow(&self, first: &str, second: &str) -> bool {
        let second = singular(second);
        let has = |name: &Vec<String>| name.windows(2).any(|pair| pair[0] == first && pair[1] == second);
        self.with(first).iter().any(|id| self.names(*id).iter().any(has))
    }

    /// Returns the identity and the number of a name that has these words, in the singular, with the sides at its end:
    /// the "back wheel" may be called "wheel back".
    pub(crate) fn reordered(&self, said: &[String]) -> Option<(IdentityId, usize)> {
        let sorted = |words: &[String]| {
            let mut words = words.to_vec();
            words.sort_unstable();
            words
        };
        let wanted = sorted(said);
        let is_so = |name: &Vec<String>| name.len() == said.len() && sorted(name) == wanted;
        self.with(said.first().filter(|word| SIDES.contains(&word.as_str()))?)
            .iter()
            .find_map(|id| Some((*id, self.names(*id).iter().position(is_so)?)))
    }

    /// Words of all names in the singular, each as it is written.
    pub(crate) fn written(&self) -> impl Iterator<Item = (&str, &str)> {
        self.written.iter().map(|(single, written)| (single.as_str(), written.as_str()))
    }

    /// Words of all names, in the singular.
    pub(crate) fn words(&self) -> impl Iterator<Item = &str> {
        self.by_word.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Level, NO_IDENTITY};
    use super::*;

    #[test]
    fn words_are_compared_whole_and_in_the_singular() {
        let plural = ["lamps", "glass", "virus", "taxis", "bus", "gas", "s", "keys", "knives", "dishes", "berries"];
        let single = ["lamp", "glass", "virus", "taxis", "bus", "gas", "s", "key", "knife", "dish", "berry"];
        assert_eq!(plural.map(singular), single);
        assert_eq!(words("The kettle's Lids"), ["the", "kettle", "lid"]);
    }

    #[test]
    fn identities_are_found_by_the_words_of_their_own_names() {
        let mut all = Identities::default();
        let red = all.add(Level::Object, NO_IDENTITY, vec!["Red_Controllers".into(), "手柄".into()]);
        let button = all.add(Level::Part, red, vec!["button a".into()]);
        let words = all.words();
        assert_eq!(
            (words.with("controller"), words.with("手柄"), words.with("button")),
            (&[red][..], &[red][..], &[button][..])
        );
        assert!(words.has("controllers") && words.has("a") && !words.has("lamp") && words.with("lamp").is_empty());
        assert_eq!(words.names(button), [vec!["button".to_owned(), "a".into()]]);
        assert_eq!(words.reordered(&["a".into(), "button".into()]).or(words.reordered(&[])), None);
        assert!(words.written().any(|w| w == ("controller", "controllers")) && words.longest >= 4);
        let wheel = all.add(Level::Part, red, vec!["wheel-back".into()]);
        assert_eq!(all.words().reordered(&["back".into(), "wheel".into()]), Some((wheel, 0)));
        assert_eq!(all.words().reordered(&["front".into(), "wheel".into()]), None);
        all.rename(button, "lamp");
        assert!(all.words().has("lamp"), "names that change are looked up anew");
    }
}
