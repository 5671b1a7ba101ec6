//! Parser of typed queries: for a thing, or for a piece of a thing.

use crate::scene::identity::whole_names::BETWEEN;

/// Longest query, in characters; the rest is ignored.
pub(crate) const MAX_CHARS: usize = 300;

/// Parsed query.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ParsedQuery {
    /// The whole query in lower case, without words that carry nothing.
    pub text: String,
    /// Phrase of the queried thing or piece.
    pub target: String,
    /// Phrase of the whole, if the query is for a piece.
    pub whole: Option<String>,
}

/// Words between a piece and its whole: "the lid OF the kettle".
const PIECE_OF: [&str; 8] = ["of", "on", "from", "de", "del", "du", "von", "vom"];
/// Words that carry nothing at the beginning of a phrase.
const ARTICLES: [&str; 14] =
    ["a", "an", "the", "some", "any", "this", "that", "el", "la", "le", "les", "der", "die", "das"];
/// Characters between a whole and its piece where words are not spaced.
const WHOLE_S: [char; 2] = ['的', 'の'];

/// Returns whether a word carries nothing by itself: an article, or a word between a piece and its whole.
pub(crate) fn is_glue(word: &str) -> bool {
    ARTICLES.contains(&word) || PIECE_OF.contains(&word)
}

impl ParsedQuery {
    /// Parses a query; `None` if there is nothing in it.
    ///
    /// The grammar has "X of the Y" (and "on", "from", and the like in some other languages), "Y's
    /// X", and `Y的X`, `YのX`. The last such word parts the query, so that "the eye of the face of
    /// the doll" is about the doll's. "X · Y" is the form of full names.
    pub fn parse(query: &str) -> Option<Self> {
        Self::partings(query).into_iter().next()
    }

    /// Returns all ways to divide a query, the best first; as one phrase if there is none.
    pub(crate) fn partings(query: &str) -> Vec<Self> {
        let text: String = query.chars().take(MAX_CHARS).collect::<String>().to_lowercase();
        let text = text.replace(['\u{2019}', '\u{2018}', '`'], "'");
        if let Some((piece, whole)) = text.split_once(BETWEEN) {
            let whole = whole.replace(BETWEEN, " of the ");
            if let Some((target, whole)) = phrase(&split(piece)).zip(phrase(&split(&whole))) {
                return vec![Self { text: format!("{target} of the {whole}"), target, whole: Some(whole) }];
            }
        }
        let words = split(&text);
        let parted = words.iter().enumerate().rev().filter_map(|(i, word)| {
            if PIECE_OF.contains(word) {
                return both(&words, &words[..i], &words[i + 1..]);
            }
            let owner = word.strip_suffix("'s").or_else(|| word.strip_suffix("s'"))?;
            let whole: Vec<&str> = words[..i].iter().copied().chain([owner]).collect();
            both(&words, &words[i + 1..], &whole)
        });
        let parted: Vec<Self> = parted.collect();
        if !parted.is_empty() {
            return parted;
        }
        let Some(text) = phrase(&words) else { return Vec::new() };
        let unspaced = text.rsplit_once(WHOLE_S).filter(|(whole, piece)| !whole.is_empty() && !piece.is_empty());
        let (target, whole) = match unspaced {
            Some((whole, piece)) => (piece.to_owned(), Some(whole.to_owned())),
            None => (text.clone(), None),
        };
        vec![Self { text, target, whole }]
    }

    /// Returns a text as one phrase.
    pub(crate) fn undivided(text: String) -> Self {
        Self { target: text.clone(), text, whole: None }
    }

    /// Returns the whole of "X Y" without grammar: all words of the query but the last.
    pub(crate) fn implied_whole(&self) -> Option<&str> {
        let (whole, _) = self.text.rsplit_once(' ')?;
        self.whole.is_none().then_some(whole)
    }
}

/// Returns the words of a text, without punctuation.
fn split(text: &str) -> Vec<&str> {
    let apart = text.split(|c: char| c.is_whitespace() || c.is_control() || "\"?!,;:()[]{}".contains(c));
    apart.map(|w| w.trim_end_matches('.')).filter(|w| !w.is_empty()).collect()
}

fn both(all: &[&str], piece: &[&str], whole: &[&str]) -> Option<ParsedQuery> {
    Some(ParsedQuery { text: phrase(all)?, target: phrase(piece)?, whole: Some(phrase(whole)?) })
}

/// Joins the words without articles at the beginning; `None` if no letter or digit is left.
fn phrase(words: &[&str]) -> Option<String> {
    let start = words.iter().position(|w| !ARTICLES.contains(w)).unwrap_or(words.len());
    let text = words[start..].join(" ");
    text.chars().any(char::is_alphanumeric).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(query: &str) -> Option<(String, Option<String>)> {
        ParsedQuery::parse(query).map(|p| (p.target, p.whole))
    }

    fn both(target: &str, whole: &str) -> Option<(String, Option<String>)> {
        Some((target.into(), Some(whole.into())))
    }

    #[test]
    fn pieces_and_wholes_are_told_apart() {
        assert_eq!(parsed("a button of the red controller"), both("button", "red controller"));
        assert_eq!(parsed("The red controller's button?"), both("button", "red controller"));
        assert_eq!(parsed("the red controller\u{2019}s left stick"), both("left stick", "red controller"));
        assert_eq!(parsed("handle on the kettle"), both("handle", "kettle"));
        assert_eq!(parsed("eye of the face of the doll"), both("eye of the face", "doll"));
        assert_eq!(parsed("赤いコントローラーのボタン"), both("ボタン", "赤いコントローラー"));
        assert_eq!(parsed("红色手柄的按钮"), both("按钮", "红色手柄"));
        assert_eq!(parsed("el botón del mando"), both("botón", "mando"));
        assert_eq!(parsed("Bow on the hood · the doll's house"), both("bow on the hood", "doll's house"));
        let face = ParsedQuery::parse("eye · face · doll").expect("words");
        assert_eq!(
            (face.text.as_str(), face.whole.as_deref()),
            ("eye of the face of the doll", Some("face of the doll"))
        );
        assert_eq!(parsed("lamp ·"), Some(("lamp ·".into(), None)));
    }

    #[test]
    fn what_is_not_parted_is_one_phrase() {
        assert_eq!(parsed("The Lamp"), Some(("lamp".into(), None)));
        assert_eq!(parsed("of the"), Some(("of the".into(), None)));
        assert_eq!(parsed("cup of"), Some(("cup of".into(), None)));
        assert_eq!(parsed("glass"), Some(("glass".into(), None)), "an s that owns nothing");
    }

    #[test]
    fn emptiness_and_excess_are_survived() {
        for empty in ["", "   ", "?!", "\u{0}\n\t", "the", "的", "..."] {
            let p = parsed(empty);
            assert!(p.is_none() || empty == "的", "{empty:?}: {p:?}");
        }
        let long = "lamp ".repeat(2_000);
        assert!(parsed(&long).is_some_and(|p| p.0.chars().count() <= MAX_CHARS));
        let particles = parsed(&"的".repeat(10_000));
        assert!(particles.is_some_and(|(target, whole)| target.chars().count() <= MAX_CHARS && whole.is_none()));
    }
}
