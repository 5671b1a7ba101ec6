//! Typing errors: words are mended by the words of the scene's names and of the language.

use std::collections::BTreeMap;

use super::tokens::MAX_CHARS;
use super::words::{LanguageWords, WordClass};
use crate::models;
use crate::scene::identity::lexicon;
use crate::scene::identity::name_words::{SceneWords, singular};
use crate::scene::{Identities, colors};

/// Pairs of a typed word and another one.
pub(crate) type Pairs = Vec<(String, String)>;

/// Least length of a mended word and of its correction, in letters: short words differ by one letter and mean
/// something else.
const SHORTEST: usize = 4;
/// Length of a word from which two slips are mended, in letters.
const LONG: usize = 8;

/// Text with its slips mended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Mended {
    pub(crate) text: String,
    /// Words taken for slips, each with its correction.
    pub(crate) slips: Pairs,
    /// Unknown words near a word of the scene: suggestions if nothing is found.
    pub(crate) near: Pairs,
}

/// Mends a text word by word.
pub(crate) fn mend(identities: &Identities, text: &str) -> Mended {
    let known = identities.words();
    let mut mended = Mended::default();
    let text: String = text.chars().take(MAX_CHARS).collect();
    for run in text.split_inclusive(|c: char| !c.is_alphanumeric()) {
        let word = run.trim_end_matches(|c: char| !c.is_alphanumeric());
        match slip(&word.to_lowercase(), known) {
            Slip::Of(right) => {
                mended.text.push_str(&right);
                mended.slips.push((word.to_lowercase(), right));
            }
            Slip::Near(other) => {
                mended.text.push_str(word);
                mended.near.push((word.to_lowercase(), other));
            }
            Slip::None => mended.text.push_str(word),
        }
        mended.text.push_str(&run[word.len()..]);
    }
    mended
}

/// Describes the mended words in a sentence; `None` if there are none.
pub(crate) fn mended_text(slips: &[(String, String)]) -> Option<String> {
    let each: Vec<String> = slips.iter().map(|(typed, read)| format!("\"{typed}\" as \"{read}\"")).collect();
    (!each.is_empty()).then(|| format!("Read {}.", each.join(", ")))
}

/// Relation of a word to the words of the scene.
enum Slip {
    /// Slip of this word.
    Of(String),
    /// Unknown word that is near this one.
    Near(String),
    None,
}

fn slip(word: &str, known: &SceneWords) -> Slip {
    let language = LanguageWords::get();
    let letters = word.chars().count();
    if letters < SHORTEST || !word.chars().all(char::is_alphabetic) || known.has(word) {
        return Slip::None;
    }
    if language.is(WordClass::NoName, word) || language.order(word).is_some() || language.same(word).is_some() {
        return Slip::None;
    }
    if colors::row(word).is_some() || colors::tone(word).is_some() {
        return Slip::None;
    }
    // "toycar": two words of a name, or of the language.
    let cuts = word.char_indices().skip(2).map(|(at, _)| word.split_at(at)).filter(|(_, b)| b.len() > 1);
    let is_word = |w: &str| known.has(w) && w.len() > 2;
    if let Some((a, b)) = cuts
        .clone()
        .find(|(a, b)| known.follow(a, b))
        .or_else(|| cuts.clone().find(|(a, b)| is_word(a) && is_word(b) && !models::is_word(word)))
    {
        return Slip::Of(format!("{a} {b}"));
    }
    let most = if letters >= LONG { 2 } else { 1 };
    let letters_of = |w: &str| {
        w.chars().fold(BTreeMap::new(), |mut n, c| {
            *n.entry(c).or_insert(0) += 1;
            n
        })
    };
    let mut near = Vec::new();
    let of_names = known.written().map(|(single, written)| (single, written, true));
    let of_language = language.words().map(|w| (w, w, false));
    for (single, written, is_name) in of_names.chain(of_language).filter(|(_, w, _)| w.chars().count() >= SHORTEST) {
        // A slip at the first letter swaps it with the second, or drops it.
        if !written.chars().take(2).any(|c| word.starts_with(c)) || written.len().abs_diff(word.len()) > 8 {
            continue;
        }
        let far = |other: &str| strsim::damerau_levenshtein(word, other);
        let far = far(written).min(far(single)).min(strsim::damerau_levenshtein(&singular(word), single));
        if far <= most && far > 0 {
            // Letters that only changed places are the likelier slip.
            near.push(((far, letters_of(written) != letters_of(word)), written, is_name));
        }
    }
    near.sort();
    near.dedup_by(|a, b| a.1 == b.1);
    let is_own = || models::is_word(word) || lexicon::is_noun(&singular(word));
    match near.as_slice() {
        // Two words at the same distance are a guess.
        [a, b, ..] if a.0 == b.0 => Slip::None,
        [(_, other, is_name), ..] if is_own() => {
            if *is_name {
                Slip::Near((*other).to_owned())
            } else {
                Slip::None
            }
        }
        [(_, other, _), ..] => Slip::Of((*other).to_owned()),
        [] => Slip::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn slips_are_mended_by_the_words_of_the_scene_and_of_the_language() {
        let mut all = Identities::default();
        for name in ["red controller", "toy car", "lamp", "kettel"] {
            all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        }
        let text = |typed: &str| mend(&all, typed).text;
        assert_eq!(text("teh red contoller"), "teh red controller");
        assert_eq!(text("the toycar behnid the lmap"), "the toy car behind the lamp");
        assert_eq!(text("kettel"), "kettel", "names are never mended");
        assert_eq!(mend(&all, "the lamb").near, [("lamb".to_owned(), "lamp".to_owned())]);
        assert_eq!(mended_text(&mend(&all, "lmap").slips).as_deref(), Some("Read \"lmap\" as \"lamp\"."));
        assert_eq!(mended_text(&[]), None);
    }
}
