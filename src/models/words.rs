//! Check for known words, to tell typing errors from intended words.

use std::sync::OnceLock;

use instant_clip_tokenizer::Tokenizer;

use super::demo::DemoEncoder;

/// Returns whether an encoder knows a word as a whole: as one token of CLIP, from frequent words of 400 million
/// captions, or in the word list of the built-in encoder.
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
