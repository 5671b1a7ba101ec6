//! The table of docs/formats.md of data that is passed over, and the words for it: the program has these words.
//!
//! Every phrase in double quotes in the table's last column is looked for among the texts of the program. `…` stands
//! for whatever the program fills in.

use std::fs;
use std::path::Path;

const HEADING: &str = "## What is passed over, and with which words";
/// Shortest phrase, letters: less is found anywhere.
const SHORTEST: usize = 12;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Texts of the program: its string literals outside of tests, escapes undone.
fn texts(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.file_stem().is_some_and(|name| name.to_string_lossy().starts_with("test")) {
            continue;
        }
        if path.is_dir() {
            texts(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            literals(&fs::read_to_string(&path).unwrap(), found);
        }
    }
}

/// The string literals of Rust code up to its tests.
fn literals(code: &str, found: &mut Vec<String>) {
    let code = code.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let mut rest = code;
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let (before, here) = rest.split_at(at);
        rest = if here.starts_with("//") {
            here.split_once('\n').map_or("", |(_, next)| next)
        } else if here.starts_with("'\"'") || here.starts_with("'\\") {
            // A character, which may be a quotation mark.
            &here[here[2..].find('\'').map_or(2, |end| end + 3)..]
        } else if let Some(inside) = here.strip_prefix('"') {
            let hashes = before.chars().rev().take_while(|c| *c == '#').count();
            let is_raw = before.trim_end_matches('#').ends_with('r');
            let (text, next) = if is_raw { raw(inside, hashes) } else { cooked(inside) };
            found.push(text);
            next
        } else {
            &here[1..]
        };
    }
}

/// A raw string's text and what follows.
fn raw(code: &str, hashes: usize) -> (String, &str) {
    let (text, rest) = code.split_once(&format!("\"{}", "#".repeat(hashes))).unwrap_or((code, ""));
    (text.to_owned(), rest)
}

/// A string's text and what follows.
fn cooked(code: &str) -> (String, &str) {
    let mut text = String::new();
    let mut letters = code.char_indices();
    while let Some((at, letter)) = letters.next() {
        match letter {
            '"' => return (text, &code[at + 1..]),
            '\\' => match letters.next().map(|l| l.1) {
                // The line goes on below.
                Some('\n') => letters = code_after(code, letters.offset()),
                Some('n') => text.push('\n'),
                Some('u') => {
                    let digits: String = letters.by_ref().map(|l| l.1).take_while(|c| *c != '}').skip(1).collect();
                    text.extend(u32::from_str_radix(&digits, 16).ok().and_then(char::from_u32));
                }
                Some(other) => text.push(other),
                None => {}
            },
            other => text.push(other),
        }
    }
    (text, "")
}

/// The letters from a place on, without the spaces that begin there.
fn code_after(code: &str, from: usize) -> std::str::CharIndices<'_> {
    let spaces = code[from..].len() - code[from..].trim_start().len();
    let mut letters = code.char_indices();
    while letters.offset() < from + spaces {
        letters.next();
    }
    letters
}

/// Says if a text has the parts of a phrase, one after the other.
fn says(text: &str, phrase: &str) -> bool {
    let mut rest = text;
    phrase.split('…').all(|part| match rest.find(part.trim()) {
        Some(at) => {
            rest = &rest[at + part.trim().len()..];
            true
        }
        None => false,
    })
}

/// Phrases of the table's last column, each with the row that it is in.
fn phrases(document: &str) -> Vec<(String, String)> {
    let table = document.split_once(HEADING).map_or("", |(_, rest)| rest);
    let rows = table.lines().skip_while(|l| !l.starts_with('|')).take_while(|l| l.starts_with('|')).skip(2);
    let cell = |row: &str| row.trim().trim_matches('|').rsplit('|').next().unwrap_or_default().to_owned();
    let quoted = |row: &str| cell(row).split('"').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    rows.flat_map(|row| quoted(row).into_iter().map(|phrase| (phrase, row.to_owned()))).collect()
}

/// Faults of the table: rows without words, phrases that are too short or that nothing says.
fn complaints(document: &str, texts: &[String]) -> Vec<String> {
    let found = phrases(document);
    let table = document.split_once(HEADING).map_or("", |(_, rest)| rest);
    let rows = table.lines().skip_while(|l| !l.starts_with('|')).take_while(|l| l.starts_with('|')).skip(2);
    let silent = rows.filter(|row| !found.iter().any(|f| f.1 == *row)).map(|row| format!("no words in: {row}"));
    let wrong = found.iter().filter_map(|(phrase, row)| {
        let letters = phrase.chars().filter(|c| *c != '…').count();
        match letters >= SHORTEST && texts.iter().any(|text| says(text, phrase)) {
            true => None,
            false => Some(format!("\"{phrase}\" is said nowhere (or is too short), in: {row}")),
        }
    });
    silent.chain(wrong).collect()
}

#[test]
fn what_is_passed_over_is_told_in_the_words_of_the_table() {
    let mut all = Vec::new();
    texts(&root().join("src"), &mut all);
    assert!(all.len() > 5_000, "{} texts of the program", all.len());
    let document = fs::read_to_string(root().join("docs/formats.md")).unwrap();
    assert!(phrases(&document).len() >= 20, "the table is there");
    let wrong = complaints(&document, &all);
    assert!(wrong.is_empty(), "docs/formats.md:\n{}", wrong.join("\n"));
}

#[test]
fn words_that_nobody_says_are_noticed() {
    let code = r###"
        // "only in a comment here"
        let quote = '"'; let life: &'static str = "{n} photos are \
            left out \u{201c}for ever\u{201d}"; let raw = r#"a "raw" text of it"#;
        #[cfg(test)]
mod tests { const T: &str = "only in the tests there"; }"###;
    let mut all = Vec::new();
    literals(code, &mut all);
    assert_eq!(all, ["{n} photos are left out \u{201c}for ever\u{201d}", "a \"raw\" text of it"]);
    let table =
        |words: &str| format!("x\n\n{HEADING}\n\nText.\n\n| a | b | words |\n|---|---|---|\n| x | y | {words} |\n");
    let wrong = |words: &str| complaints(&table(words), &all).len();
    assert_eq!(wrong("\"… photos are left out\", and \"a … text of it\""), 0);
    assert_eq!(wrong("\"… photos are left out\", and \"what nobody says\""), 1);
    assert_eq!(wrong("\"left out … photos are\""), 1, "in this order only");
    assert_eq!(wrong("\"photos … text of it\""), 1, "in one text only");
    for absent in ["\"only in a comment\"", "\"only in the tests\"", "\"photos\"", "nothing is quoted"] {
        assert_eq!(wrong(absent), 1, "{absent}");
    }
}
