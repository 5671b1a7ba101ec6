//! Words of names and questions, as used in comparisons.

use std::collections::HashSet;

use super::parse::{MAX_CHARS, is_glue};

/// Returns the lower-case words of a name; an English plural counts like its singular.
pub(crate) fn words(text: &str) -> Vec<String> {
    written(text).map(|w| singular(&w)).collect()
}

/// Returns the lower-case words of a name as they are written.
pub(super) fn written(text: &str) -> impl Iterator<Item = String> {
    // No name is longer, and comparing every letter of a long text would be slow.
    let lower = text.chars().take(MAX_CHARS).collect::<String>().to_lowercase();
    let apart = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty() && *w != "s");
    apart.map(str::to_owned).collect::<Vec<_>>().into_iter()
}

/// Returns the words of a phrase that are not among these; articles and the like are left out.
pub(super) fn not_in(phrase: &str, known: &HashSet<String>) -> Vec<String> {
    words(phrase).into_iter().filter(|w| !is_glue(w) && !known.contains(w)).collect()
}

/// Returns a word without an English plural's ending.
pub(crate) fn singular(word: &str) -> String {
    for (end, instead) in [("knives", "knife"), ("shelves", "shelf"), ("ies", "y")] {
        if let Some(stem) = word.strip_suffix(end).filter(|s| s.len() > 1 || end.len() > 3) {
            return format!("{stem}{instead}");
        }
    }
    for end in ["sses", "xes", "ches", "shes"] {
        if word.ends_with(end) {
            return word[..word.len() - 2].into();
        }
    }
    match word.strip_suffix('s') {
        Some(stem) if stem.chars().count() > 2 && !stem.ends_with(['s', 'u', 'i']) => stem.into(),
        _ => word.into(),
    }
}
