//! The rooms of `pipeline/semantics` use only those before them.

use super::rules::{Complaint, library_files, place_of, used_paths};
use super::source::{SourceFile, library_code};

const SEMANTICS: &str = "pipeline::semantics::";
/// The rooms, in their order.
const ROOMS: [&str; 3] = ["lifting", "query", "evaluation"];

/// Files of a room that use a later one.
pub fn rooms(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files) {
        let inside = file.path.strip_prefix("src/pipeline/semantics/").unwrap_or_default();
        let room = ROOMS.iter().position(|room| inside.split('/').next() == Some(room));
        // Modules outside of the rooms are for all of them.
        let later = match (room, inside) {
            (_, "" | "mod.rs") => continue,
            (Some(room), _) => &ROOMS[room + 1..],
            (None, _) => &ROOMS[..],
        };
        for path in used_paths(&library_code(&file.text), &place_of(&file.path)) {
            let path = path.join("::");
            let used = path.strip_prefix(SEMANTICS).and_then(|p| p.split("::").next()).unwrap_or_default();
            if later.contains(&used) {
                complaints.push(format!("{}: uses '{path}', a later room", file.path));
            }
        }
    }
    complaints
}
