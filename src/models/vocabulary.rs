//! Tokens of a phrase for the demo text encoder; the same rules as `tools/encoder/texts.py`.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use super::ModelError;

/// Most unknown words that are reported.
const UNKNOWN_MOST: usize = 16;
/// Most characters of an unknown word that are reported.
const UNKNOWN_CHARS: usize = 40;

/// Word list and dimensions of a text encoder.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Vocabulary {
    pub(crate) version: u32,
    pub(crate) dimension: usize,
    pub(crate) tile_side_px: usize,
    /// Number of words of a phrase that are encoded.
    pub(crate) tokens: usize,
    /// Words without content of their own ("the", "of").
    pub(crate) glue: BTreeSet<String>,
    /// Token of each word, from 1.
    pub(crate) words: BTreeMap<String, i64>,
}

impl Vocabulary {
    /// Reads the JSON text of a word list; `file` names it in errors.
    pub(crate) fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        let damaged = |problem: String| ModelError::Vocabulary { file: file.into(), problem };
        let list: Self = serde_json::from_str(text).map_err(|e| damaged(e.to_string()))?;
        if list.version != 1 {
            return Err(damaged(format!("version {} is not known", list.version)));
        }
        if ![list.dimension, list.tile_side_px, list.tokens].iter().all(|n| (1..=4096).contains(n)) {
            return Err(damaged("a size is out of bounds".into()));
        }
        let last = list.words.len() as i64;
        if let Some((word, number)) = list.words.iter().find(|(_, n)| !(1..=last).contains(*n)) {
            return Err(damaged(format!("'{word}' has the number {number}, not one of 1 to {last}")));
        }
        Ok(list)
    }

    /// Returns the tokens of a phrase's known words, padded with zeros.
    pub(crate) fn encode(&self, phrase: &str) -> Result<Vec<i64>, ModelError> {
        let mut numbers = Vec::with_capacity(self.tokens);
        let mut content = false;
        for word in split(phrase) {
            if let Some((known, number)) = self.find(&word) {
                content |= !self.glue.contains(known);
                numbers.push(number);
                if numbers.len() == self.tokens {
                    break;
                }
            }
        }
        if !content {
            return Err(ModelError::NoKnownWord { unknown: self.unknown(phrase) });
        }
        numbers.resize(self.tokens, 0);
        Ok(numbers)
    }

    /// Returns the unknown words of a phrase, each once.
    pub(crate) fn unknown(&self, phrase: &str) -> Vec<String> {
        let mut found: Vec<String> = Vec::new();
        for word in split(phrase) {
            let told: String = word.chars().take(UNKNOWN_CHARS).collect();
            if self.find(&word).is_none() && !found.contains(&told) {
                found.push(told);
                if found.len() == UNKNOWN_MOST {
                    break;
                }
            }
        }
        found
    }

    /// Finds a word, or its singular or plural, in the list.
    fn find(&self, word: &str) -> Option<(&str, i64)> {
        let get = |w: &str| self.words.get_key_value(w).map(|(w, n)| (w.as_str(), *n));
        get(word)
            .or_else(|| get(word.strip_suffix('s')?))
            .or_else(|| get(word.strip_suffix("es")?))
            .or_else(|| get(&format!("{word}s")))
    }
}

/// Splits a phrase into lower-case runs of letters and digits.
fn split(phrase: &str) -> impl Iterator<Item = String> + '_ {
    phrase.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_lowercase)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list() -> Vocabulary {
        let text = r#"{ "version": 1, "dimension": 4, "tile_side_px": 8, "tokens": 6, "glue": ["the", "of", "s"],
            "words": { "the": 1, "of": 2, "s": 3, "red": 4, "button": 5, "mug": 6, "headphones": 7, "box": 8 } }"#;
        Vocabulary::parse(text, "words.json").expect("a sound list")
    }

    #[test]
    fn words_become_numbers_in_their_order() {
        let words = list();
        let numbers = |phrase: &str| words.encode(phrase).expect("known words");
        assert_eq!(numbers("The BUTTON of the red mug!"), [1, 5, 2, 1, 4, 6]);
        assert_eq!(numbers("red mug\u{2019}s button"), [4, 6, 3, 5, 0, 0]);
        assert_eq!(numbers("buttons, boxes; headphone"), [5, 8, 7, 0, 0, 0]);
        assert_eq!(numbers("a giraffe-shaped mug"), [6, 0, 0, 0, 0, 0], "unknown words are left out");
        assert_eq!(numbers(&"red ".repeat(2_500)), [4; 6], "10,000 characters");
    }

    #[test]
    fn phrases_without_a_known_word_are_told() {
        let words = list();
        let unknown = |phrase: &str| match words.encode(phrase) {
            Err(ModelError::NoKnownWord { unknown }) => unknown,
            other => panic!("{other:?}"),
        };
        assert_eq!(unknown("Giraffe of the giraffe"), ["giraffe"]);
        assert_eq!(unknown("赤い コントローラー"), ["赤い", "コントローラー"]);
        assert_eq!(unknown("красный džbán İ"), ["красный", "džbán", "i\u{307}"]);
        assert!(unknown("").is_empty() && unknown(" \u{0}\n?!, ").is_empty() && unknown("of the").is_empty());
        let long = unknown(&"x".repeat(10_000));
        assert_eq!((long.len(), long[0].chars().count()), (1, UNKNOWN_CHARS));
        let many: String = (0..5_000).map(|i| format!("w{i} ")).collect();
        assert_eq!(unknown(&many).len(), UNKNOWN_MOST);
        assert_eq!(words.unknown("red giraffes"), ["giraffes"]);
    }

    #[test]
    fn damaged_lists_are_refused() {
        let sound =
            r#"{ "version": 1, "dimension": 4, "tile_side_px": 8, "tokens": 6, "glue": [], "words": { "red": 1 } }"#;
        assert!(Vocabulary::parse(sound, "w").is_ok());
        for (from, to) in
            [("\"version\": 1", "\"version\": 2"), ("\"red\": 1", "\"red\": 7"), ("6", "0"), ("4", "1e9"), ("}", "")]
        {
            let damaged = sound.replacen(from, to, 1);
            assert!(matches!(Vocabulary::parse(&damaged, "w"), Err(ModelError::Vocabulary { .. })), "{damaged}");
        }
    }
}
