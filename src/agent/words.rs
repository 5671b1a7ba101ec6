//! Tokens and numbers of a request.

pub(crate) use crate::pipeline::semantics::query::names::singular;

/// Longest request, in characters.
pub(crate) const MAX_CHARS: usize = 600;

/// Word or punctuation mark.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Token {
    pub(crate) raw: String,
    /// Text in lower case; a quoted text starts with `"`.
    pub(crate) low: String,
}

/// Splits a text into words and punctuation marks; quoted texts stay whole.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let text: String = text.chars().take(MAX_CHARS).collect();
    let text = text.replace(['\u{2019}', '\u{2018}', '`'], "'").replace(['\u{201c}', '\u{201d}'], "\"");
    let mut found = Vec::new();
    for (i, piece) in text.split('"').enumerate() {
        // An odd piece is inside quotes, unless the last quote was never closed.
        if i % 2 == 1 && text.matches('"').count() > i {
            found.push(Token { raw: piece.trim().into(), low: format!("\"{}", piece.trim().to_lowercase()) });
            continue;
        }
        piece.split(|c: char| c.is_whitespace() || c.is_control() || "()[]{}".contains(c)).for_each(|word| {
            split_word(word, &mut found);
        });
    }
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

/// Splits a word: the mark at its end and the unit of a number become tokens of their own; 'quotes' are removed.
fn split_word(word: &str, found: &mut Vec<Token>) {
    let body = word.trim_end_matches(|c: char| ",;.?!:…".contains(c));
    let marks = &word[body.len()..];
    let body = body.trim_start_matches([',', ';', '!', '?', ':']);
    let mut push = |raw: &str| {
        if !raw.is_empty() {
            found.push(Token { raw: raw.into(), low: raw.to_lowercase() });
        }
    };
    if let Some(owner) = body.strip_suffix("'s").filter(|o| !o.starts_with('\'')) {
        let short = ["what", "where", "there", "that", "it", "how", "who", "here"];
        push(owner);
        push(if short.contains(&owner.to_lowercase().as_str()) { "is" } else { "'s" });
    } else if let Some(who) = body.strip_suffix("'d") {
        push(who);
        push("would");
    } else if let Some(quoted) = body.strip_prefix('\'').and_then(|b| b.strip_suffix('\'')).filter(|b| !b.is_empty()) {
        push(quoted);
    } else {
        let digits = body.find(|c: char| !(c.is_ascii_digit() || ".,/".contains(c))).unwrap_or(body.len());
        let starts_number = body.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let unit = &body[digits..];
        if starts_number && !unit.is_empty() && !["st", "nd", "rd", "th"].contains(&unit) {
            push(&body[..digits]);
            push(unit.trim_start_matches('-'));
        } else {
            push(body);
        }
    }
    if let Some(mark) = marks.chars().next() {
        push(&mark.to_string());
    }
}

/// Returns whether a token is a punctuation mark.
pub(crate) fn is_mark(word: &str) -> bool {
    matches!(word, "," | ";" | "." | "?" | "!" | ":" | "…")
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
    const WORDS: [&str; 6] = ["last", "first", "second", "third", "fourth", "fifth"];
    WORDS.iter().position(|w| *w == word)
}

/// Returns whether two words are equal but for a plural or a typing error.
pub(crate) fn alike(a: &str, b: &str) -> bool {
    let (a, b) = (singular(a), singular(b));
    if a == b {
        return true;
    }
    let short = a.chars().count().min(b.chars().count());
    let most = if short >= 8 { 2 } else { 1 };
    short >= 4 && strsim::damerau_levenshtein(&a, &b) <= most
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
        assert!(cut(" \t\u{0} ").is_empty());
        assert!(cut(&"word ".repeat(9_999)).len() <= MAX_CHARS);
    }

    #[test]
    fn numbers_and_plurals() {
        assert_eq!((number("half"), number("twenty-five"), number("1/2")), (None, Some(25.0), Some(0.5)));
        assert_eq!((number("0,5"), number("1e999"), number("nan"), number("1/0")), (Some(0.5), None, None, None));
        assert!(alike("controllers", "controller") && alike("contoller", "controller") && !alike("mug", "mag"));
    }
}
