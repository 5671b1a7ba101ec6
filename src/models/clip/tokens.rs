//! CLIP's tokenizer, with the text cleaning of OpenCLIP.

use instant_clip_tokenizer::Tokenizer;

use super::repair::repaired;

/// Turns phrases into rows of tokens.
pub struct Tokens {
    tokenizer: Tokenizer,
    context: usize,
}

impl Tokens {
    /// Tokenizer with CLIP's own vocabulary; `context` tokens a row.
    pub fn new(context: usize) -> Self {
        Self { tokenizer: Tokenizer::new(), context: context.max(3) }
    }

    /// Returns the row of a phrase: start, its tokens, end, zeros. A long phrase is cut before the end token.
    pub fn row(&self, text: &str) -> Vec<i64> {
        let mut tokens = vec![self.tokenizer.start_of_text()];
        self.tokenizer.encode(&single_spaced(&clean(text)), &mut tokens);
        tokens.truncate(self.context - 1);
        tokens.push(self.tokenizer.end_of_text());
        let mut row: Vec<i64> = tokens.into_iter().map(|t| i64::from(t.to_u16())).collect();
        row.resize(self.context, 0);
        row
    }
}

/// Repairs the encoding of a text and resolves its HTML entities.
pub fn clean(text: &str) -> String {
    // As in ftfy, entities are resolved first only in a text without tags.
    let text = if text.contains('<') { text.into() } else { htmlize::unescape(text) };
    let once = htmlize::unescape(repaired(&without_escapes(&text))).into_owned();
    htmlize::unescape(once.as_str()).trim_matches(is_space).to_owned()
}

/// Removes the escape sequences of terminals (`ESC [ 31 m`).
fn without_escapes(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("\u{1b}[") {
        kept.push_str(&rest[..at]);
        let body = &rest[at + 2..];
        let end = body.find(|c: char| !c.is_ascii_digit() && c != ';');
        match end.and_then(|end| body[end..].chars().next().filter(char::is_ascii_alphabetic).map(|_| end + 1)) {
            Some(end) => rest = &body[end..],
            None => {
                kept.push_str("\u{1b}[");
                rest = body;
            }
        }
    }
    kept.push_str(rest);
    kept
}

/// Replaces each run of white space with one space.
fn single_spaced(text: &str) -> String {
    text.split(is_space).filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Returns whether Python counts a character as white space: separators of files and records too.
fn is_space(c: char) -> bool {
    c.is_whitespace() || ('\u{1c}'..='\u{1f}').contains(&c)
}
