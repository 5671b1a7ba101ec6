//! Foreign text (names, paths, headers of files, words of servers and models) as it may be shown: nothing in
//! it moves a cursor, recolors a terminal, reverses a line or makes a line of its own.
//!
//! Names of identities and scenes are only shown, so they are cut at 256 letters. Names of photos find files, so those
//! over 1,024 letters are refused.

use std::borrow::Cow;

use serde::{Deserialize, Deserializer};

/// Longest name of an identity or a scene, in characters; longer ones are cut, with an ellipsis: one absurd label is no
/// reason to refuse a file.
pub(crate) const LONGEST_NAME: usize = 256;

/// Longest name of a photo, in characters; longer ones are refused. It is a path that files and labels are matched by,
/// so it cannot be cut.
pub(crate) const LONGEST_PHOTO_NAME: usize = 1024;

/// Replacement of a character of foreign text; `None` if it stays.
fn instead(c: char, one_line: bool) -> Option<&'static str> {
    match c {
        '\n' | '\t' if !one_line => None,
        '\r' if !one_line => Some(""),
        '\u{2028}' | '\u{2029}' | '\u{85}' if !one_line => Some("\n"),
        '\n' | '\r' | '\t' | '\u{b}' | '\u{c}' | '\u{85}' | '\u{2028}' | '\u{2029}' => Some(" "),
        // Escape sequences lose their power with their first character; what is left of them is seen.
        c if c.is_control() => Some("\u{fffd}"),
        // Marks, embeddings, overrides and isolates of direction.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{206f}' => Some(""),
        _ => None,
    }
}

fn clean(text: &str, one_line: bool) -> Cow<'_, str> {
    if !text.chars().any(|c| instead(c, one_line).is_some()) {
        return Cow::Borrowed(text);
    }
    let mut clean = String::with_capacity(text.len());
    for c in text.chars() {
        match instead(c, one_line) {
            Some(other) => clean.push_str(other),
            None => clean.push(c),
        }
    }
    Cow::Owned(clean)
}

/// Text of any number of lines, without other control characters and marks of direction.
pub(crate) fn lines(text: &str) -> Cow<'_, str> {
    clean(text, false)
}

/// Text of one line, without control characters and marks of direction.
pub(crate) fn line(text: &str) -> Cow<'_, str> {
    clean(text, true)
}

/// [`lines()`], with every line after the first set in, so that none can pass for a message of its own.
pub(crate) fn message(text: &str) -> String {
    lines(text).trim_end().replace('\n', "\n  ").replace("\n  \n", "\n\n")
}

/// At most `most` letters of a text, the last an ellipsis if some are left out.
pub(crate) fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    if text.char_indices().nth(most).is_none() {
        return Cow::Borrowed(text);
    }
    let end = text.char_indices().nth(most.saturating_sub(1)).map_or(0, |(at, _)| at);
    Cow::Owned(format!("{}\u{2026}", &text[..end]))
}

/// [`shortened`], of which the last word is whole, if any word is.
pub(crate) fn shortened_at_word(text: &str, most: usize) -> Cow<'_, str> {
    let Cow::Owned(cut) = shortened(text, most) else { return Cow::Borrowed(text) };
    let kept = cut.trim_end_matches('\u{2026}');
    // A word that ends just there is whole.
    let is_whole = text[kept.len()..].starts_with(char::is_whitespace);
    let end = if is_whole { kept.len() } else { kept.rfind(char::is_whitespace).unwrap_or(0) };
    let kept = kept[..end].trim_end_matches(|c: char| c.is_whitespace() || ",;\u{b7}".contains(c));
    Cow::Owned(if kept.is_empty() { cut } else { format!("{kept}\u{2026}") })
}

/// A text on one line, cut in the middle so that it has at most `most` letters.
pub(crate) fn elided(text: &str, most: usize) -> String {
    let text = &*line(text);
    let n = text.chars().count();
    if n <= most {
        return text.to_owned();
    }
    let keep = most.saturating_sub(1);
    let (head, tail) = (keep / 2, keep - keep / 2);
    text.chars().take(head).chain(['\u{2026}']).chain(text.chars().skip(n - tail)).collect()
}

/// A file's name, cut so that it has at most `most` letters: without its ending if that suffices, else in the middle.
/// Most of what stays is at the end, where names of photos differ.
pub(crate) fn elided_file(name: &str, most: usize) -> String {
    let name = &*line(name);
    let n = |text: &str| text.chars().count();
    if n(name) <= most {
        return name.to_owned();
    }
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    if stem.is_empty() || n(stem) <= most {
        return if stem.is_empty() { elided(name, most) } else { stem.to_owned() };
    }
    let keep = most.saturating_sub(1);
    let head = keep / 4;
    stem.chars().take(head).chain(['\u{2026}']).chain(stem.chars().skip(n(stem) - (keep - head))).collect()
}

/// A word as a shell takes it: quoted where it would mean more than itself.
pub(crate) fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

pub(crate) fn path(path: &std::path::Path) -> String {
    line(&path.to_string_lossy()).into_owned()
}

/// The name of an identity or a scene as it is kept: one line of at most [`LONGEST_NAME`] letters.
pub(crate) fn name(text: &str) -> String {
    // The rest of an endless name is not read.
    let start = shortened(text, 2 * LONGEST_NAME);
    shortened(line(&start).trim(), LONGEST_NAME).into_owned()
}

/// JSON text in which no character acts on a terminal: those that JSON leaves as they are become escapes,
/// so that readers of the JSON get them unchanged.
pub(crate) fn json(text: &str) -> Cow<'_, str> {
    // Line breaks between values are JSON's own; those within texts are escaped already.
    let acts = |c: char| c != '\n' && instead(c, true).is_some();
    if !text.chars().any(acts) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            c if acts(c) => escaped.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => escaped.push(c),
        }
    }
    Cow::Owned(escaped)
}

/// Reads a name: see [`name`].
pub(crate) fn read_name<'de, D: Deserializer<'de>>(from: D) -> Result<String, D::Error> {
    String::deserialize(from).map(|text| name(&text))
}

/// Reads a name, if there is one.
pub(crate) fn read_optional_name<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<String>::deserialize(from)?.map(|text| name(&text)))
}

/// Reads names: see [`name`].
pub(crate) fn read_names<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    Ok(Vec::<String>::deserialize(from)?.iter().map(|text| name(text)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every character that acts on a terminal or on the order of letters.
    fn acting() -> impl Iterator<Item = char> {
        let bidi = ['\u{61c}', '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}'];
        let ranges = ('\0'..='\u{1f}').chain('\u{7f}'..='\u{9f}').chain('\u{202a}'..='\u{202e}');
        ranges.chain('\u{2066}'..='\u{2069}').chain(bidi)
    }

    #[test]
    fn nothing_that_acts_is_left() {
        for c in acting() {
            let text = format!("a{c}b");
            assert!(!line(&text).contains(c), "{c:?}");
            assert!(!name(&text).contains(c), "{c:?}");
            assert!(c == '\n' || c == '\t' || !lines(&text).contains(c), "{c:?}");
            let written = serde_json::to_string_pretty(&[&text]).expect("JSON");
            let shown = json(&written);
            assert!(!shown.chars().any(|s| s == c && s != '\n'), "{c:?}: {shown}");
            assert_eq!(serde_json::from_str::<Vec<String>>(&shown).expect("JSON"), [text], "readers get it unchanged");
        }
        // The control: JSON alone leaves most of them as they are.
        assert!(acting().filter(|c| serde_json::to_string(c).is_ok_and(|t| t.contains(*c))).count() > 40);
        assert_eq!(line("\u{1b}[31mred\u{1b}]0;title\u{7}"), "\u{fffd}[31mred\u{fffd}]0;title\u{fffd}");
        assert_eq!(line("photo\u{202e}gpj.exe\r\nb"), "photogpj.exe  b");
        assert_eq!(lines("a\r\n\tb\u{2028}c"), "a\n\tb\nc");
        assert_eq!(message("bad name\n\nerror: all is lost\n"), "bad name\n\n  error: all is lost");
    }

    #[test]
    fn other_scripts_stay_as_they_are() {
        for text in ["手柄", "Größe 1½", "👩‍🚀", "می‌خواهم", "a  b", ""] {
            assert!(matches!(line(text), Cow::Borrowed(same) if same == text), "{text}");
            assert!(matches!(json(text), Cow::Borrowed(_)));
            assert_eq!(name(text), text);
        }
    }

    #[test]
    fn names_are_bounded() {
        let long = "é".repeat(65_536);
        assert_eq!(name(&long).chars().count(), LONGEST_NAME);
        assert!(name(&long).ends_with('\u{2026}'));
        assert_eq!(name(&long[..2 * LONGEST_NAME]), &long[..2 * LONGEST_NAME]);
        assert_eq!(
            (shortened("abc", 3), shortened("abcd", 3), shortened("abc", 0)),
            ("abc".into(), "ab\u{2026}".into(), "\u{2026}".into())
        );
        assert_eq!(name("  kettle \n"), "kettle");
        let said = "button a, button b and start button";
        assert_eq!(shortened(said, 32), "button a, button b and start bu\u{2026}", "the control");
        assert_eq!(shortened_at_word(said, 32), "button a, button b and start\u{2026}");
        assert_eq!(shortened_at_word(said, 11), "button a\u{2026}", "no comma before the ellipsis");
        assert_eq!(shortened_at_word(said, 19), "button a, button b\u{2026}", "a word that just fits");
        assert_eq!((shortened_at_word(said, 35), shortened_at_word("abcdef", 4)), (said.into(), "abc\u{2026}".into()));
        assert_eq!(elided("short", 10), "short");
        assert_eq!(["/a/b-1.ply", "", "/my scene/it's"].map(shell_word), ["/a/b-1.ply", "''", r"'/my scene/it'\''s'"]);
        assert_eq!(elided("a/very/long/path/to/a/file.ply", 12), "a/ver\u{2026}le.ply");
    }

    #[test]
    fn names_of_photos_are_told_apart_when_they_are_cut() {
        let photos = ["20240215_143919.png", "20240215_143920.png"];
        assert_eq!(elided(photos[0], 9), elided(photos[1], 9), "the control");
        assert_eq!(photos.map(|photo| elided_file(photo, 9)), ["20\u{2026}143919", "20\u{2026}143920"]);
        assert_eq!(elided_file(photos[0], 15), "20240215_143919", "the ending goes first");
        assert_eq!((elided_file("0001.png", 9), elided_file("a.b", 1)), ("0001.png".into(), "a".into()));
        assert_eq!(elided_file(".hidden_photo", 6).chars().count(), 6);
    }
}
