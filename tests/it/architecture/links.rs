//! Links of documents lead somewhere: to a file of the project, and to a heading in it.

use std::path::{Component, Path, PathBuf};

use super::rules::Complaint;
use super::source::SourceFile;

/// Relative links in `documents` without a file below `root`, or without the heading that they name.
pub fn links(root: &Path, documents: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for document in documents {
        let folder = Path::new(&document.path).parent().unwrap_or(Path::new(""));
        for target in targets(&document.text) {
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() { document.path.clone().into() } else { joined(folder, file) };
            let of_document = |d: &&SourceFile| Path::new(&d.path) == path;
            let known = documents.iter().find(of_document).map(|d| d.text.clone());
            let text = known.or_else(|| std::fs::read_to_string(root.join(&path)).ok());
            let leads = match text {
                Some(text) => heading.is_empty() || headings(&text).any(|h| h == heading),
                None => heading.is_empty() && root.join(&path).exists(),
            };
            if !leads {
                complaints.push(format!("{}: the link to '{target}' leads nowhere", document.path));
            }
        }
    }
    complaints
}

/// Targets of the relative links of a Markdown text.
fn targets(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|t| !t.contains("://") && !t.starts_with("mailto:") && !t.contains(char::is_whitespace))
}

/// `file` seen from `folder`, without steps up.
fn joined(folder: &Path, file: &str) -> PathBuf {
    let mut path = PathBuf::new();
    for part in folder.join(file).components() {
        match part {
            Component::ParentDir => drop(path.pop()),
            other => path.push(other),
        }
    }
    path
}

/// Names that links have for the headings of a Markdown text.
fn headings(text: &str) -> impl Iterator<Item = String> {
    let titles = text.lines().filter(|l| l.starts_with('#')).map(|l| l.trim_start_matches('#').trim().to_lowercase());
    titles
        .map(|t| t.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect::<String>().replace(' ', "-"))
}
