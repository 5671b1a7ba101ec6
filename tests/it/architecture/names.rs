//! The rule of names: what leaves its file has a name of its own.

use std::collections::BTreeMap;

use super::rules::{Complaint, library_files};
use super::source::{SourceFile, library_code};

/// No two types that others can see share a name, and none goes by a second one.
pub fn type_names(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    let mut places: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for file in library_files(files) {
        let code = library_code(&file.text);
        let items = code.lines().filter_map(|line| visible(line)?.split_once(' '));
        for (_, rest) in items.clone().filter(|(kind, _)| KINDS.contains(kind)) {
            let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            // A macro fills names in later.
            if !name.is_empty() {
                places.entry(name).or_default().push(&file.path);
            }
        }
        for (_, rest) in items.filter(|(kind, _)| *kind == "use") {
            let second = rest.split(" as ").skip(1).find(|name| is_type(name));
            complaints.extend(second.map(|name| format!("{}: a second name for a type: {name}", file.path)));
        }
    }
    let repeated = places.iter().filter(|(_, at)| at.len() > 1);
    complaints.extend(repeated.map(|(name, at)| format!("'{name}' is {} types: {}", at.len(), at.join(", "))));
    complaints
}

/// Keywords that define a type.
const KINDS: [&str; 5] = ["struct", "enum", "trait", "type", "union"];

/// An item that others can see, without its visibility.
fn visible(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix("pub")?;
    let rest = if rest.starts_with('(') { rest.split_once(')')?.1 } else { rest };
    rest.strip_prefix(' ')
}

/// Returns whether a name is written as types are: `Name`, not `NAME` or `name`.
fn is_type(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(char::is_uppercase) && letters.next().is_some_and(char::is_lowercase)
}
