//! Words that people write, from the page: it carries those that the program's encoders know.

use std::collections::HashSet;
use std::sync::OnceLock;

static KNOWN: OnceLock<HashSet<String>> = OnceLock::new();

/// Takes the words, with spaces between them. A second list is ignored.
pub(crate) fn know(words: &str) {
    KNOWN.get_or_init(|| words.split(' ').map(str::to_owned).collect());
}

/// Returns whether a word, or its singular, is among them.
pub(crate) fn is_word(word: &str) -> bool {
    let is_one = |word: &str| KNOWN.get().is_some_and(|known| known.contains(word));
    is_one(word) || word.strip_suffix('s').is_some_and(is_one)
}
