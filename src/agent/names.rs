//! Names in a request: whole names of the scene, and words that can be read as a thing.

use std::cell::RefCell;
use std::collections::HashMap;

use super::words::request_tokens;
use crate::pipeline::semantics::query::language;
use crate::pipeline::semantics::query::language::tokens::tokens;
use crate::scene::Identities;
use crate::scene::identity::whole_names::key;

/// Names of a scene, for the matching of commands.
pub(crate) struct NameWords<'a> {
    identities: &'a Identities,
    /// Complete names, by their words in a request; such words have no other reading.
    whole: HashMap<String, String>,
    /// Phrases that were read before.
    things: RefCell<HashMap<String, [bool; 2]>>,
}

impl<'a> NameWords<'a> {
    /// Collects the whole names.
    pub(crate) fn new(identities: &'a Identities) -> Self {
        let mut whole = HashMap::new();
        for (id, identity) in identities.iter() {
            for name in [identities.full_name(id), identities.label(id)].iter().chain(&identity.names) {
                whole.entry(spoken(name)).or_insert_with(|| name.clone());
                whole.entry(spoken(&key(name))).or_insert_with(|| name.clone());
            }
        }
        whole.remove("");
        Self { identities, whole, things: RefCell::default() }
    }

    /// Returns whether a name has this word.
    pub(crate) fn has(&self, word: &str) -> bool {
        self.identities.words().has(word)
    }

    pub(crate) fn words(&self) -> impl Iterator<Item = &str> {
        self.identities.words().words()
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

    /// Returns whether a text asks which of several named things is so.
    pub(crate) fn asks_which(&self, text: &str) -> bool {
        language::asks_which(text, self.identities)
    }

    /// Returns whether words can be read as a thing. With `strict`, all of them must be known here.
    pub(crate) fn is_thing(&self, words: &[&str], strict: bool) -> bool {
        if self.whole(words).is_some() {
            return true;
        }
        // What ends a sentence is no part of a thing.
        let ends = ["?", ",", "here", "there", "now", "please", "too", "again", "and", "or"];
        if words.last().is_none_or(|last| ends.contains(last)) {
            return false;
        }
        let text = words.join(" ").replace(" 's", "'s").replace(" ,", ",");
        let mut known = self.things.borrow_mut();
        let [any, known] = *known.entry(text).or_insert_with_key(|text| language::is_thing(text, self.identities));
        if strict { known } else { any }
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
