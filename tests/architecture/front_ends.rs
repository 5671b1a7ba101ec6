//! The rule of the front ends: `ui`, `cli` and `agent` leave the work to `jobs`.

use super::rules::{Complaint, library_files, place_of, top_module, used_paths};
use super::source::{SourceFile, library_code};

/// Who goes through `jobs`.
const FRONT_ENDS: [&str; 3] = ["ui", "cli", "agent"];
/// Whose functions do the work of a use case. Their types and constants may be named.
const BELOW: [&str; 6] = ["io", "models", "render", "pipeline", "navigate", "measure"];

pub fn front_ends(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files).filter(|f| top_module(&f.path).is_some_and(|m| FRONT_ENDS.contains(&m))) {
        for path in used_paths(&library_code(&file.text), &place_of(&file.path)) {
            let last = path.iter().rfind(|name| *name != "self").map_or("", String::as_str);
            if BELOW.contains(&path[0].as_str()) && last.starts_with(|c: char| c.is_lowercase()) {
                complaints.push(format!("{}: {}", file.path, path.join("::")));
            }
        }
    }
    complaints
}
