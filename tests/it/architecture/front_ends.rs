//! The rules of the front ends: `ui`, `cli` and `agent` leave the work to `jobs`.

use super::rules::{Complaint, library_files, place_of, top_module, used_paths};
use super::source::{SourceFile, library_code};

const FRONT_ENDS: [&str; 3] = ["ui", "cli", "agent"];

/// Modules that do the work of use cases. Front ends may name their types and constants.
const BELOW: [&str; 6] = ["io", "models", "render", "pipeline", "navigate", "measure"];

/// Types that open, store, draw, train or ask: no data, so that naming one is doing it oneself.
const AT_WORK: [&str; 10] = [
    "Device",
    "FileMasks",
    "Labels",
    "Navigator",
    "QueryEngine",
    "Renderer",
    "SceneFolder",
    "Segmenter",
    "Study",
    "Trainer",
];

/// Exceptions that front ends may name: paths or beginnings of paths.
const ALLOWED: [(&str, &str); 19] = [
    ("io::files::read", "a file of settings: the agent's policy"),
    ("io::http", "the way to a chat model is the agent's own"),
    ("measure::axis::ticks", "how reports are drawn"),
    ("measure::defaults", "the text of reports"),
    ("measure::is_report", "the name of a file"),
    ("measure::labels", "how reports are drawn"),
    ("measure::look", "how reports are drawn"),
    ("measure::stability", "the program checks itself; no scene is opened"),
    ("measure::survey", "the text of a survey"),
    ("measure::table", "the text of reports"),
    ("measure::turned", "settings with a knob turned"),
    ("navigate::camera_spline::steps_of", "frames of so many seconds"),
    ("pipeline::semantics::query::query_engine::ask_by_name", "names are compared in a scene that was opened"),
    ("pipeline::semantics::query::language", "words are read by the names of a scene that was opened"),
    ("pipeline::semantics::query::matching", "the Gaussians of an answer"),
    ("pipeline::semantics::query::names", "names are compared in a scene that was opened"),
    ("pipeline::semantics::query::reading", "words are compared with the names in a scene that was opened"),
    ("pipeline::semantics::query::timing::ms_since", "a clock"),
    ("render::real_gpu", "what the window itself is drawn by"),
];

/// Front ends name no function and no module of those in [`BELOW`], and nothing that is [`AT_WORK`], but what is
/// [`ALLOWED`].
pub fn front_ends(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files).filter(|f| top_module(&f.path).is_some_and(|m| FRONT_ENDS.contains(&m))) {
        // The window's own device is that of the process.
        let device = |name: &str| name == "Device" && file.path == "src/ui/mod.rs";
        for path in used_paths(&library_code(&file.text), &place_of(&file.path)) {
            let path = path.join("::");
            let path = path.trim_end_matches("::self");
            let upper = |name: &&str| name.starts_with(char::is_uppercase);
            let names_work = match path.split("::").find(upper) {
                Some(name) => AT_WORK.contains(&name) && !device(name),
                None => true,
            };
            let inside = |beginning: &str| path == beginning || path.starts_with(&format!("{beginning}::"));
            if names_work && BELOW.iter().any(|m| inside(m)) && !ALLOWED.iter().any(|(p, _)| inside(p)) {
                complaints.push(format!("{}: names '{path}': leave that to a job in 'jobs'", file.path));
            }
        }
    }
    complaints
}
