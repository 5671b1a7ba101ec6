//! Words of names and questions, as they are compared.

use super::parse::MAX_CHARS;

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
