//! Check for known words, to tell typing errors from intended words.

use std::sync::OnceLock;

use instant_clip_tokenizer::{Token, Tokenizer};

use super::demo::DemoEncoder;

/// Returns whether an encoder knows a word as a whole: as one token of CLIP, from frequent words of 400 million
/// captions, or in the word list of the built-in encoder.
pub(crate) fn is_word(word: &str) -> bool {
    let (tokenizer, demo) = known();
    let is_one = |w: &str| {
        let mut tokens = Vec::new();
        tokenizer.encode(w, &mut tokens);
        tokens.len() == 1
    };
    let is_known = |demo: &DemoEncoder| super::Encoder::unknown_words(demo, word).is_empty();
    is_one(word) || word.strip_suffix('s').is_some_and(is_one) || demo.as_ref().is_some_and(is_known)
}

fn known() -> &'static (Tokenizer, Option<DemoEncoder>) {
    static KNOWN: OnceLock<(Tokenizer, Option<DemoEncoder>)> = OnceLock::new();
    KNOWN.get_or_init(|| (Tokenizer::new(), DemoEncoder::new().ok()))
}

/// Returns all words of lower-case Latin letters that [`is_word`] knows without a plural, in order.
pub(crate) fn all_words() -> Vec<String> {
    let (tokenizer, demo) = known();
    let tokens = (0..=u16::MAX).map_while(|n| Token::from_u16(n, tokenizer));
    let written = tokens.map(|token| tokenizer.decode([token]));
    let whole = written.filter_map(|word| word.strip_suffix(' ').map(str::to_owned));
    let mut words: Vec<String> = whole.chain(demo.iter().flat_map(DemoEncoder::words)).collect();
    words.retain(|w| w.len() > 1 && w.bytes().all(|b| b.is_ascii_lowercase()));
    words.sort();
    words.dedup();
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_known_and_slips_are_not() {
        for word in ["lamp", "lamb", "controllers", "battle", "armrests", "dpad", "Lamp"] {
            assert!(is_word(word), "{word}");
        }
        for slip in ["contoller", "buton", "kettel", "lmap", "viewfnder"] {
            assert!(!is_word(slip), "{slip}");
        }
    }

    #[test]
    fn all_words_are_those_that_are_known() {
        let all = all_words();
        assert!(all.len() > 20_000 && all.is_sorted(), "{}", all.len());
        let listed = |w: &str| all.binary_search_by(|other| other.as_str().cmp(w)).is_ok();
        for word in all.iter().step_by(97) {
            assert!(is_word(word), "{word}");
        }
        for word in ["lamp", "lamps", "battle", "armrests", "dpad", "torch", "torches", "glass", "glasses", "contoller"]
        {
            assert_eq!(listed(word) || word.strip_suffix('s').is_some_and(listed), is_word(word), "{word}");
        }
    }
}
