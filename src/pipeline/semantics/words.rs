//! Words of names and questions, as they are compared.

use std::collections::HashSet;

use super::parse::{MAX_CHARS, is_glue};

/// Lower-case words of a name; an English plural counts like its singular.
pub(crate) fn words(text: &str) -> Vec<String> {
    written(text).map(|w| singular(&w)).collect()
}

/// Lower-case words of a name as they are written.
pub(super) fn written(text: &str) -> impl Iterator<Item = String> {
    // Nobody's name is longer, and comparing every letter of a pasted book would take long.
    let lower = text.chars().take(MAX_CHARS).collect::<String>().to_lowercase();
    let apart = lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty() && *w != "s");
    apart.map(str::to_owned).collect::<Vec<_>>().into_iter()
}

/// The words of a phrase that are not among these; articles and the like left out.
pub(super) fn not_in(phrase: &str, known: &HashSet<String>) -> Vec<String> {
    words(phrase).into_iter().filter(|w| !is_glue(w) && !known.contains(w)).collect()
}

/// A word without an English plural's ending.
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
