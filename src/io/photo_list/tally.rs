//! Warnings about a list of photos, one for each kind of skipped or corrected entry.

use std::path::Path;

use crate::io::IoError;

/// Most names in a warning.
const NAMED: usize = 5;

/// Listed photos by outcome.
#[derive(Default)]
pub(super) struct ListTally {
    pub(super) listed: usize,
    pub(super) missing: Vec<String>,
    pub(super) outside: Vec<String>,
    /// Name, and the two files that match it.
    pub(super) several: Vec<(String, [String; 2])>,
    /// Name, the other listed name, and the one file that matches both.
    pub(super) shared: Vec<[String; 3]>,
    /// Listed name, and actual name.
    pub(super) renamed: Vec<(String, String)>,
    pub(super) linked: Vec<String>,
    /// Photos whose listed mask is missing.
    pub(super) unmasked: Vec<String>,
    pub(super) normalized: Vec<String>,
    /// Name and reason.
    pub(super) broken: Vec<(String, String)>,
}

impl ListTally {
    /// Returns the warnings, one for each kind that occurs.
    pub(super) fn warnings(&self, source: &Path) -> Vec<String> {
        let n = self.listed;
        let list = source.file_name().unwrap_or_default().to_string_lossy();
        let mut all = Vec::new();
        if let Some(first) = self.missing.first() {
            let count = self.missing.len();
            all.push(format!("{count} of {n} listed photos are missing and were skipped (first: {first})"));
        }
        if let Some(first) = self.outside.first() {
            all.push(format!(
                "{} of {n} listed photos lie outside of the folder and were skipped; copy them into it (first: {first})",
                self.outside.len()
            ));
        }
        if let Some((first, [a, b])) = self.several.first() {
            all.push(format!(
                "{} of {n} listed photos could each be one of several files and were skipped; rename the files (first: \
                 {first} could be {a} or {b})",
                self.several.len()
            ));
        }
        if let Some([first, other, file]) = self.shared.first() {
            all.push(format!(
                "{} of {n} listed photos were skipped because only the file of another is called like them (first: \
                 {first} and {other} would both be {file})",
                self.shared.len()
            ));
        }
        if !self.broken.is_empty() {
            let named: Vec<String> = self.broken.iter().map(|(name, why)| format!("{name}: {why}")).collect();
            all.push(format!(
                "{} of {n} listed photos have no usable pose and were skipped: {}",
                self.broken.len(),
                some_of(&named, "; ")
            ));
        }
        if !self.normalized.is_empty() {
            all.push(format!(
                "{} of {n} poses in {list} were scaled or their last row was not 0 0 0 1; they were normalized (first: {})",
                self.normalized.len(),
                self.normalized[0]
            ));
        }
        if let Some((first, called)) = self.renamed.first() {
            all.push(format!(
                "{} of {n} listed photos were found under other names than listed (first: {first} is {called})",
                self.renamed.len()
            ));
        }
        if let Some(first) = self.unmasked.first() {
            all.push(format!(
                "{} listed masks are missing, so all pixels of those photos count (first: that of {first})",
                self.unmasked.len()
            ));
        }
        if let Some(first) = self.linked.first() {
            let count = self.linked.len();
            all.push(format!("{count} of {n} photos are links to files outside of the folder (first: {first})"));
        }
        all
    }

    /// Returns the reason why no photo is left.
    pub(super) fn error(&self, source: &Path, root: &Path) -> IoError {
        if let (Some((name, why)), true) = (self.broken.first(), self.missing.is_empty()) {
            return IoError::syntax(source, format!("photo '{name}'"), why.clone());
        }
        if let (Some(entry), true) = (self.outside.first(), self.missing.is_empty()) {
            return IoError::Outside { path: source.into(), entry: entry.clone(), folder: root.into() };
        }
        if let (Some((name, [a, b])), true) = (self.several.first(), self.missing.is_empty()) {
            let reason = format!("it could be {a} or {b}; rename the files as they are listed");
            return IoError::syntax(source, format!("photo '{name}'"), reason);
        }
        if let (Some([first, other, file]), true) = (self.shared.first(), self.missing.is_empty()) {
            let reason = format!("it and {other} would both be {file}; rename the files as they are listed");
            return IoError::syntax(source, format!("photo '{first}'"), reason);
        }
        let first = self.missing.first().cloned().unwrap_or_default();
        IoError::NoPhotos { path: source.into(), listed: self.listed, first }
    }
}

/// Joins the first few of many names.
pub(crate) fn some_of(names: &[String], between: &str) -> String {
    let shown = names.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(between);
    match names.len().saturating_sub(NAMED) {
        0 => shown,
        more => format!("{shown}{between}and {more} more"),
    }
}
