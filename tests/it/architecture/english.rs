//! Plain English: doc lines begin with a noun or a verb, and sentences of documents are short.

use std::path::{Path, PathBuf};

use super::rules::Complaint;
use super::source::SourceFile;

/// First words that make a doc line a riddle.
const QUESTIONS: [&str; 10] = ["What", "Whether", "How", "Where", "Why", "Which", "Those", "Who", "Whose", "When"];
/// Doc lines that may begin so.
const MOST_QUESTIONS: usize = 20;
/// Words of a sentence.
const LONGEST: usize = 40;
/// Longer sentences in all documents.
const MOST_LONG: usize = 10;

/// Doc lines that begin with a question word, if there are too many.
pub fn doc_lines(files: &[SourceFile]) -> Vec<Complaint> {
    let lines = files.iter().flat_map(|f| f.text.lines().enumerate().map(move |(i, line)| (f, i + 1, line)));
    let asks = |line: &str| {
        let doc = line.trim_start().strip_prefix("/// ").or_else(|| line.trim_start().strip_prefix("//! "));
        let first = doc.and_then(|d| d.split(|c: char| !c.is_alphabetic()).next());
        first.is_some_and(|word| QUESTIONS.contains(&word))
    };
    let found = lines.filter(|(.., line)| asks(line));
    at_most(found.map(|(f, n, line)| format!("{}:{n}: {}", f.path, line.trim())).collect(), MOST_QUESTIONS)
}

/// Documents that readers are sent to: not the record of changes.
pub fn documents(root: &Path) -> Vec<SourceFile> {
    let (top, docs) = (root.to_path_buf(), root.join("docs"));
    let folders = [top, docs.clone(), docs.join("notes")];
    let entries = folders.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten();
    let paths = entries.map(|e| e.expect("readable folder").path());
    let wanted = |p: &PathBuf| p.extension().is_some_and(|e| e == "md") && !p.ends_with("CHANGELOG.md");
    let read = |p: PathBuf| SourceFile {
        path: p.strip_prefix(root).expect("under the root").to_string_lossy().replace('\\', "/"),
        text: std::fs::read_to_string(&p).unwrap_or_else(|e| panic!("{}: {e}", p.display())),
    };
    paths.filter(wanted).map(read).collect()
}

/// Sentences of documents that are too long, if there are too many.
pub fn sentences(documents: &[SourceFile]) -> Vec<Complaint> {
    let long = documents.iter().flat_map(|d| {
        let long = prose(&d.text).into_iter().flat_map(|block| split(&block)).filter(|s| words(s) > LONGEST);
        long.map(|s| format!("{}: {} words: {s}", d.path, words(&s))).collect::<Vec<_>>()
    });
    at_most(long.collect(), MOST_LONG)
}

fn at_most(found: Vec<Complaint>, most: usize) -> Vec<Complaint> {
    if found.len() > most { found } else { Vec::new() }
}

fn words(sentence: &str) -> usize {
    sentence.split_whitespace().filter(|w| w.chars().any(char::is_alphanumeric)).count()
}

/// Paragraphs and list items of Markdown, without code blocks, tables and headings.
fn prose(markdown: &str) -> Vec<String> {
    let (mut blocks, mut in_code) = (vec![String::new()], false);
    for line in markdown.lines().map(str::trim) {
        let fence = line.starts_with("```");
        in_code ^= fence;
        let apart = fence || in_code || line.is_empty() || line.starts_with(['|', '#']);
        if apart || line.starts_with("- ") || line.starts_with("* ") {
            blocks.push(String::new());
        }
        if !apart {
            let block = blocks.last_mut().expect("one at least");
            block.push_str(line);
            block.push(' ');
        }
    }
    blocks
}

/// Sentences of a paragraph: they end with a mark before a space.
fn split(block: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    for word in block.split_whitespace() {
        let sentence = all.last_mut().expect("one at least");
        sentence.push_str(word);
        sentence.push(' ');
        if word.trim_end_matches([')', '*', '"', '”', '`']).ends_with(['.', '?', '!']) {
            all.push(String::new());
        }
    }
    all
}
