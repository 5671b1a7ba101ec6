//! Words and marks of a sentence, with their places in the text.

use std::ops::Range;

/// Longest sentence, in characters; the rest is ignored.
pub(crate) const MAX_CHARS: usize = 600;

/// Word or mark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    pub(crate) raw: String,
    /// Text in lower case; a quoted text starts with `"`.
    pub(crate) low: String,
    /// Bytes of the text that it stands for.
    pub(crate) at: Range<usize>,
}

/// Words that are written together with "is", "not" and the like, and what they stand for.
const SHORT: [(&str, &[&str]); 14] = [
    ("isn't", &["is", "not"]),
    ("aren't", &["are", "not"]),
    ("isnt", &["is", "not"]),
    ("arent", &["are", "not"]),
    ("doesn't", &["does", "not"]),
    ("doesnt", &["does", "not"]),
    ("don't", &["do", "not"]),
    ("whats", &["what", "is"]),
    ("wheres", &["where", "is"]),
    ("they're", &["they", "are"]),
    ("cannot", &["can", "not"]),
    ("i'd", &["i", "would"]),
    ("i'm", &["i", "am"]),
    ("nonred", &["not", "red"]),
];
/// Words after which "'s" is "is".
const IS: [&str; 12] =
    ["what", "where", "there", "that", "it", "how", "who", "here", "which", "whatever", "everything", "something"];
/// Marks between words.
const MARKS: &str = ",;.?!:\u{2026}";
/// Characters between a whole and its piece where words are not spaced.
const WHOLE_S: [char; 2] = ['的', 'の'];

/// Splits a text into words and marks; quoted texts stay whole.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let end = text.char_indices().nth(MAX_CHARS).map_or(text.len(), |(at, _)| at);
    let text = &text[..end];
    let is_quote = |c: char| matches!(c, '"' | '\u{201c}' | '\u{201d}');
    let quotes: Vec<(usize, char)> = text.char_indices().filter(|(_, c)| is_quote(*c)).collect();
    let mut found = Vec::new();
    let mut from = 0;
    for pair in quotes.chunks(2) {
        // A last quote that was never closed quotes nothing.
        let [(open, a), (close, b)] = *pair else { break };
        split(text, from..open, &mut found);
        let inside = text[open + a.len_utf8()..close].trim();
        if !inside.is_empty() {
            let low = format!("\"{}", inside.to_lowercase());
            found.push(Token { raw: inside.into(), low, at: open..close + b.len_utf8() });
        }
        from = close + b.len_utf8();
    }
    split(text, from..text.len(), &mut found);
    found
}

/// Splits a request into tokens; all marks but the question mark become commas.
pub(crate) fn request_tokens(request: &str) -> Vec<Token> {
    let mut all = tokens(request);
    for token in all.iter_mut().filter(|t| is_mark(&t.low) && t.low != "?") {
        token.low = ",".into();
    }
    all
}

/// Returns whether a token is a mark.
pub(crate) fn is_mark(word: &str) -> bool {
    word.chars().count() == 1 && word.chars().all(|c| MARKS.contains(c))
}

fn split(text: &str, part: Range<usize>, found: &mut Vec<Token>) {
    let is_gap = |c: char| c.is_whitespace() || c.is_control() || "()[]{}\"\u{201c}\u{201d}".contains(c);
    let mut from = part.start;
    for (at, c) in text[part.clone()].char_indices().map(|(i, c)| (part.start + i, c)) {
        if is_gap(c) {
            split_word(text, from..at, found);
            from = at + c.len_utf8();
        }
    }
    split_word(text, from..part.end, found);
}

/// Splits a word: marks around it and the unit of a number become tokens of their own; 'quotes' are removed.
fn split_word(text: &str, at: Range<usize>, found: &mut Vec<Token>) {
    let word = &text[at.clone()];
    let whole = word.trim_start_matches(|c: char| MARKS.contains(c) && c != '.');
    let body = whole.trim_end_matches(|c: char| MARKS.contains(c));
    if body.is_empty() {
        if let Some(mark) = word.chars().next() {
            push(found, &mark.to_string(), at);
        }
        return;
    }
    let start = at.start + (word.len() - whole.len());
    let marks = start + body.len();
    let low = body.to_lowercase().replace(['\u{2019}', '\u{2018}', '`'], "'");
    let here = start..marks;
    let owner = |end: &str| low.strip_suffix(end).filter(|o| !o.is_empty() && !o.starts_with('\''));
    if let Some(words) = super::words::LanguageWords::get().same(&low) {
        words.split(' ').for_each(|w| push(found, w, here.clone()));
    } else if let Some((_, words)) = SHORT.iter().find(|(short, _)| *short == low) {
        words.iter().for_each(|w| push(found, w, here.clone()));
    } else if let Some(owner) = owner("'s") {
        let cut = start + body.char_indices().rev().nth(1).map_or(body.len(), |(i, _)| i);
        hyphened(text, start..cut, found);
        push(found, if IS.contains(&owner) { "is" } else { "'s" }, cut..marks);
    } else if let Some(who) = owner("'d") {
        push(found, who, here.clone());
        push(found, "would", here);
    } else if owner("s'").is_some() {
        hyphened(text, start..marks - body.chars().next_back().map_or(0, char::len_utf8), found);
        push(found, "'s", here);
    } else if let Some(quoted) = low.strip_prefix('\'').and_then(|b| b.strip_suffix('\'')).filter(|b| !b.is_empty()) {
        push(found, quoted, here);
    } else if let Some((whole, piece)) = body.rsplit_once(WHOLE_S).filter(|(w, p)| !w.is_empty() && !p.is_empty()) {
        push(found, piece, here.clone());
        push(found, "of", here.clone());
        push(found, whole, here);
    } else {
        let digits = body.find(|c: char| !(c.is_ascii_digit() || ".,/".contains(c))).unwrap_or(body.len());
        let is_number = body.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let unit = &body[digits..];
        if is_number && !unit.is_empty() && !["st", "nd", "rd", "th"].contains(&unit.to_lowercase().as_str()) {
            push(found, &body[..digits], start..start + digits);
            push(found, unit.trim_start_matches('-'), start + digits..marks);
        } else {
            hyphened(text, here, found);
        }
    }
    if let Some(mark) = text[marks..at.end].chars().next() {
        push(found, &mark.to_string(), marks..at.end);
    }
}

/// Adds a word; one with hyphens as several, so that it is compared word by word.
fn hyphened(text: &str, at: Range<usize>, found: &mut Vec<Token>) {
    let word = &text[at.clone()];
    let low = word.to_lowercase();
    if low.ends_with("most") && low.contains('-') {
        return push(found, &word.replace('-', ""), at);
    }
    let parts: Vec<&str> = word.split('-').collect();
    let is_plain = |p: &&str| p.chars().count() > 1 && p.chars().all(char::is_alphabetic);
    if parts.len() < 2 || !parts.iter().all(is_plain) {
        return push(found, word, at);
    }
    let mut from = at.start;
    for part in parts {
        let instead = if part.eq_ignore_ascii_case("non") { "not" } else { part };
        push(found, instead, from..from + part.len());
        from += part.len() + 1;
    }
}

fn push(found: &mut Vec<Token>, raw: &str, at: Range<usize>) {
    if !raw.is_empty() {
        let low = raw.to_lowercase().replace(['\u{2019}', '\u{2018}', '`'], "'");
        found.push(Token { raw: raw.into(), low, at });
    }
}

/// Reads a number in digits or as a word; "a" and "an" are not numbers here.
pub(crate) fn number(word: &str) -> Option<f64> {
    const SMALL: [&str; 13] =
        ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];
    const TENS: [&str; 8] = ["twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"];
    if let Some(i) = SMALL.iter().position(|w| *w == word) {
        return Some(i as f64);
    }
    if let Some(i) = TENS.iter().position(|w| *w == word) {
        return Some(10.0 * (i + 2) as f64);
    }
    match word {
        "fifteen" => return Some(15.0),
        "hundred" => return Some(100.0),
        _ => {}
    }
    if let Some((tens, ones)) = word.split_once('-') {
        let (tens, ones) = (number(tens)?, number(ones)?);
        return (tens >= 20.0 && ones < 10.0).then_some(tens + ones);
    }
    if !word.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    if let Some((top, bottom)) = word.split_once('/') {
        let (top, bottom): (f64, f64) = (top.parse().ok()?, bottom.parse().ok()?);
        return Some(top / bottom).filter(|n| n.is_finite());
    }
    word.replace(',', ".").parse().ok().filter(|n: &f64| n.is_finite())
}

/// Reads an ordinal as a position from 1; 0 for the last.
pub(crate) fn ordinal(word: &str) -> Option<usize> {
    const WORDS: [&str; 11] =
        ["last", "first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];
    let digits = || {
        let end = ["st", "nd", "rd", "th"].iter().find_map(|end| word.strip_suffix(end))?;
        end.parse().ok().filter(|n| (1..=99).contains(n))
    };
    WORDS.iter().position(|w| *w == word).or_else(digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(text: &str) -> Vec<String> {
        tokens(text).into_iter().map(|t| t.low).collect()
    }

    #[test]
    fn texts_become_words() {
        assert_eq!(cut("Move 20cm left, please!"), ["move", "20", "cm", "left", ",", "please", "!"]);
        assert_eq!(cut("the kettle\u{2019}s lid"), ["the", "kettle", "'s", "lid"]);
        assert_eq!(cut("What's 'it' called?"), ["what", "is", "it", "called", "?"]);
        assert_eq!(cut("rename it to \"Big Cup\" now"), ["rename", "it", "to", "\"big cup", "now"]);
        assert_eq!(cut("0.5 m... 90°"), ["0.5", "m", ".", "90", "°"]);
        assert_eq!(
            cut("the left-most non-red toy-car isn't"),
            ["the", "leftmost", "not", "red", "toy", "car", "is", "not"]
        );
        assert_eq!(cut("both controllers' sticks; 2nd"), ["both", "controllers", "'s", "sticks", ";", "2nd"]);
        assert_eq!(cut("红色手柄的按钮"), ["按钮", "of", "红色手柄"]);
        assert!(cut(" \t\u{0} ").is_empty());
        assert!(cut(&"word ".repeat(9_999)).len() <= MAX_CHARS);
    }

    #[test]
    fn tokens_know_their_places() {
        for text in ["the kettle's  \"Big Cup\", 20cm!", "«Чайник» twenty-five's x-y 'q'", "a\u{201c}b\u{201d}c"]
        {
            for token in tokens(text) {
                assert!(text.get(token.at.clone()).is_some(), "{text}: {token:?}");
            }
        }
        let all = tokens("the kettle's lid");
        assert_eq!(&"the kettle's lid"[all[1].at.clone()], "kettle");
        assert_eq!(&"the kettle's lid"[all[3].at.clone()], "lid");
    }

    #[test]
    fn numbers_and_ordinals() {
        assert_eq!((number("half"), number("twenty-five"), number("1/2")), (None, Some(25.0), Some(0.5)));
        assert_eq!((number("0,5"), number("1e999"), number("nan"), number("1/0")), (Some(0.5), None, None, None));
        assert_eq!(
            (ordinal("third"), ordinal("2nd"), ordinal("last"), ordinal("two")),
            (Some(3), Some(2), Some(0), None)
        );
    }
}
