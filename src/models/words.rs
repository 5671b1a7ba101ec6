//! Whether a word is one of the language, for telling slips of the keys from words that are meant.

use std::sync::OnceLock;

use instant_clip_tokenizer::Tokenizer;

use super::demo::DemoEncoder;

/// Whether an encoder knows a word by itself: the vocabulary of CLIP's tokens, which has what 400 million captions
/// say often, or that of the encoder that comes with the program.
pub(crate) fn is_word(word: &str) -> bool {
    static KNOWN: OnceLock<(Tokenizer, Option<DemoEncoder>)> = OnceLock::new();
    let (tokenizer, demo) = KNOWN.get_or_init(|| (Tokenizer::new(), DemoEncoder::new().ok()));
    let is_one = |w: &str| {
        let mut tokens = Vec::new();
        tokenizer.encode(w, &mut tokens);
        tokens.len() == 1
    };
    let is_known = |demo: &DemoEncoder| super::Encoder::unknown_words(demo, word).is_empty();
    is_one(word) || word.strip_suffix('s').is_some_and(is_one) || demo.as_ref().is_some_and(is_known)
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
}
