//! The rules: each takes the tree and returns the violations.

use super::source::{SourceFile, library_code, test_module_files};

/// One sentence that names the file and the rule.
pub type Complaint = String;

/// Each module of the library and the other modules it may use, in the order of the data flow.
const MODULES: [(&str, &[&str]); 14] = [
    ("math", &[]),
    ("scene", &["math"]),
    ("io", &["math", "scene"]),
    ("models", &["math", "scene", "io"]),
    ("render", &["math", "scene"]),
    ("pipeline", &["math", "scene", "io", "models", "render"]),
    ("navigate", &["math", "scene", "render"]),
    ("measure", &["math", "scene", "io", "models", "render", "pipeline", "navigate"]),
    ("jobs", &["math", "scene", "io", "models", "render", "pipeline", "navigate", "measure"]),
    ("worker", &["math", "scene", "io", "models", "render", "pipeline", "navigate", "measure", "jobs"]),
    ("remote", &["math", "scene", "io", "models", "render", "pipeline", "navigate", "measure", "jobs", "worker"]),
    ("agent", &["math", "scene", "io", "render", "pipeline", "navigate", "jobs"]),
    (
        "cli",
        &[
            "math", "scene", "io", "models", "render", "pipeline", "navigate", "measure", "jobs", "worker", "remote",
            "agent",
        ],
    ),
    (
        "ui",
        &[
            "math", "scene", "io", "models", "render", "pipeline", "navigate", "measure", "jobs", "worker", "remote",
            "agent",
        ],
    ),
];

/// Longest Rust file in lines.
const RUST_LINES: usize = 400;
/// Longest WGSL file in lines.
const WGSL_LINES: usize = 250;

/// Modules of the library use only what [`MODULES`] allows; test code is exempt.
pub fn module_order(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files) {
        let Some(module) = top_module(&file.path) else { continue };
        let Some((_, allowed)) = MODULES.iter().find(|(name, _)| *name == module) else {
            complaints.push(format!("{}: module '{module}' is not in the table of modules", file.path));
            continue;
        };
        for used in used_modules(&library_code(&file.text), depth(&file.path)) {
            let known = MODULES.iter().any(|(name, _)| *name == used);
            if known && used != module && !allowed.contains(&used.as_str()) {
                complaints.push(format!("{}: '{module}' may not use '{used}'", file.path));
            }
        }
    }
    complaints
}

/// Modules that may name the CPU and the GPU renderer; `measure` draws in double precision to measure by it.
const BEHIND: [&str; 2] = ["render", "measure"];

/// Everybody else draws by the doors of `render`, whatever is behind them; test code is exempt.
pub fn render_doors(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files).filter(|f| !top_module(&f.path).is_some_and(|m| BEHIND.contains(&m))) {
        for behind in names_after(&library_code(&file.text), &["render::".to_owned()]) {
            if ["cpu", "gpu"].contains(&behind.as_str()) {
                complaints.push(format!("{}: names 'render::{behind}': use what 'render' itself offers", file.path));
            }
        }
    }
    complaints
}

/// No file is longer than its cap.
pub fn size_caps(files: &[SourceFile]) -> Vec<Complaint> {
    let cap = |path: &str| if path.ends_with(".wgsl") { WGSL_LINES } else { RUST_LINES };
    let too_long = |f: &SourceFile| {
        let (lines, cap) = (f.text.lines().count(), cap(&f.path));
        (lines > cap).then(|| format!("{}: {lines} lines, the cap is {cap}: split it by concern", f.path))
    };
    files.iter().filter_map(too_long).collect()
}

/// Every Rust file starts with `//! text`, every shader with `// text`.
pub fn headers(files: &[SourceFile]) -> Vec<Complaint> {
    let mark = |path: &str| if path.ends_with(".wgsl") { "//" } else { "//!" };
    let headless = |f: &SourceFile| {
        let mark = mark(&f.path);
        let first = f.text.lines().next().unwrap_or_default();
        let said = first.strip_prefix(mark).is_some_and(|rest| !rest.trim().is_empty());
        (!said).then(|| format!("{}: the first line must be '{mark} what this file is for'", f.path))
    };
    files.iter().filter_map(headless).collect()
}

/// `shaders/<kernel>.wgsl` comes with `src/render/gpu/<kernel>.rs` and `src/render/cpu/<kernel>.rs`.
pub fn kernels(files: &[SourceFile]) -> Vec<Complaint> {
    let kernel = |f: &SourceFile| {
        let name = f.path.strip_prefix("shaders/")?.strip_suffix(".wgsl")?;
        (!name.contains('/')).then(|| name.to_owned())
    };
    let mut complaints = Vec::new();
    for name in files.iter().filter_map(kernel) {
        for (side, role) in [("gpu", "its launcher"), ("cpu", "its CPU counterpart")] {
            let wanted = format!("src/render/{side}/{name}.rs");
            if !files.iter().any(|f| f.path == wanted) {
                complaints.push(format!("shaders/{name}.wgsl: {role} {wanted} is missing"));
            }
        }
    }
    complaints
}

/// The library reports through `Observer` and return values; only the command line prints.
pub fn printing(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files).filter(|f| top_module(&f.path) != Some("cli")) {
        let code = library_code(&file.text);
        for call in ["print!", "println!", "eprint!", "eprintln!"] {
            if words_ending_in_bang(&code).any(|word| word == call) {
                complaints.push(format!("{}: {call} outside src/cli", file.path));
            }
        }
    }
    complaints
}

/// Fewest words of a comment that says what a dependency is for.
const REASON_WORDS: usize = 3;

/// Every dependency in `manifest` (Cargo.toml) has a comment that says what it is for: at the end of its line, or on
/// the lines directly above it.
pub fn dependencies(manifest: &str) -> Vec<Complaint> {
    let (mut inside, mut above, mut complaints) = (false, 0, Vec::new());
    for line in manifest.lines().map(str::trim) {
        let (code, comment) = line.split_at(start_of_comment(line));
        let words = comment.split_whitespace().filter(|word| word.contains(char::is_alphabetic)).count();
        if code.is_empty() && !comment.is_empty() {
            above += words;
            continue;
        }
        let name = match code.trim().strip_prefix('[').and_then(|table| table.strip_suffix(']')) {
            Some(table) => {
                inside = table.ends_with("dependencies");
                // `[dependencies.name]`
                table.split_once("dependencies.").map(|(_, name)| name)
            }
            None => code.split_once('=').filter(|_| inside).map(|(name, _)| name.trim()),
        };
        if let Some(name) = name.filter(|_| words.max(above) < REASON_WORDS) {
            complaints.push(format!("Cargo.toml: dependency '{name}' has no comment that says what it is for"));
        }
        above = 0;
    }
    complaints
}

/// Where the comment of a line of TOML starts, at its first `#` outside quotes; its length if it has none.
fn start_of_comment(line: &str) -> usize {
    let outside = |at: usize| line[..at].matches('"').count() % 2 == 0;
    line.match_indices('#').map(|(at, _)| at).find(|at| outside(*at)).unwrap_or(line.len())
}

/// The files of the library, without those declared as `#[cfg(test)] mod name;` and what is
/// below them.
pub fn library_files(files: &[SourceFile]) -> impl Iterator<Item = &SourceFile> {
    let mut test_modules = Vec::new();
    for file in files.iter().filter(|f| f.path.starts_with("src/")) {
        let folder = file.path.strip_suffix("/mod.rs").or(file.path.strip_suffix(".rs")).unwrap_or(&file.path);
        test_modules.extend(test_module_files(&file.text).iter().map(|name| format!("{folder}/{name}")));
    }
    files.iter().filter(move |f| {
        let is_test = test_modules.iter().any(|m| f.path == format!("{m}.rs") || f.path.starts_with(&format!("{m}/")));
        f.path.starts_with("src/") && !is_test
    })
}

/// `io` for `src/io/ply.rs`; `None` for the crate's own roots.
pub fn top_module(path: &str) -> Option<&str> {
    let inside = path.strip_prefix("src/")?;
    match inside.split_once('/') {
        Some((module, _)) => Some(module),
        None => inside.strip_suffix(".rs").filter(|name| !["lib", "main"].contains(name)),
    }
}

/// Number of `super::` from the file to the crate's root.
fn depth(path: &str) -> usize {
    let inside = path.strip_prefix("src/").unwrap_or(path);
    inside.split('/').filter(|part| *part != "mod.rs").count()
}

/// The crate's own modules that `code` names by `crate::`, by a group `crate::{..}`, or by as
/// many `super::` as lead to the root.
fn used_modules(code: &str, depth: usize) -> Vec<String> {
    // A longer chain of `super::` leads elsewhere.
    names_after(code, &["crate::".to_owned(), "super::".repeat(depth)])
}

/// The path segments that follow any of `starts`, each at the start of a name.
fn names_after(code: &str, starts: &[String]) -> Vec<String> {
    let flat: String = code.split_whitespace().collect::<Vec<_>>().join(" ");
    let flat = flat.replace(" ::", "::").replace(":: ", "::");
    let mut used = Vec::new();
    for start in starts {
        for (at, _) in flat.match_indices(start) {
            // So is a name such as `my_crate::`.
            let before = &flat[..at];
            let chained = start.starts_with("super::") && before.ends_with(':');
            if chained || before.ends_with(|c: char| c.is_alphanumeric() || c == '_') {
                continue;
            }
            used.extend(first_names(&flat[at + start.len()..]));
        }
    }
    used
}

/// The first path segment of what follows, or of each member of a `{..}` group.
fn first_names(rest: &str) -> Vec<String> {
    let name = |s: &str| s.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let Some(group) = rest.strip_prefix('{') else { return vec![name(rest)] };
    let (mut level, mut start, mut names) = (0_usize, 0, Vec::new());
    for (i, c) in group.char_indices() {
        match c {
            '{' => level += 1,
            '}' if level > 0 => level -= 1,
            ',' | '}' if level == 0 => {
                names.push(name(&group[start..i]));
                start = i + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    names
}

fn words_ending_in_bang(code: &str) -> impl Iterator<Item = &str> {
    code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '!')).filter(|w| w.ends_with('!'))
}

/// No channel without a bound, no address as a key that outlives what lies there, no progress but a ticker's.
pub fn habits(files: &[SourceFile]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for file in library_files(files) {
        let code = library_code(&file.text);
        let flat: String = code.split_whitespace().collect::<Vec<_>>().join(" ");
        let mut forbid = |found: bool, what: &str| {
            if found {
                complaints.push(format!("{}: {what}", file.path));
            }
        };
        forbid(flat.contains("unbounded(") || flat.contains("mpsc::channel"), "a channel without a bound");
        // The difference of two addresses is a place in a text.
        let kept = flat.match_indices("as_ptr(").any(|(at, _)| {
            let rest: String = flat[at..].chars().take(40).collect();
            rest.contains("as usize") && !rest.contains("as usize -") && !flat[..at].ends_with("- line.")
        });
        forbid(kept, "an address as a key: count generations");
        let makes =
            flat.match_indices("Progress {").any(|(at, _)| flat[..at].ends_with([' ', '(']) && is_literal(&flat, at));
        forbid(makes && file.path != "src/pipeline/observer.rs", "progress is reported by a Ticker");
    }
    complaints
}

/// Returns whether the braces after a type's name at `at` make a new value: no definition, no struct update.
fn is_literal(flat: &str, at: usize) -> bool {
    let before = flat[..at].trim_end();
    let inside = flat[at..].split('}').next().unwrap_or_default();
    !["struct", "impl", "for", "->"].iter().any(|word| before.ends_with(word)) && !inside.contains("..")
}

/// No two files of the library use each other, on whatever detour. A folder's `mod.rs` and the files in the folder
/// are one thing here: what they share, the folder defines.
pub fn cycles(files: &[SourceFile]) -> Vec<Complaint> {
    let files: Vec<&SourceFile> = library_files(files).collect();
    let places: Vec<Vec<String>> = files.iter().map(|f| place_of(&f.path)).collect();
    let find =
        |path: &[String]| (0..=path.len()).rev().find_map(|n| places.iter().position(|p| p[..] == path[..n] && n > 0));
    let uses = |i: usize| -> Vec<usize> {
        let used = used_paths(&library_code(&files[i].text), &places[i]);
        let all = used.iter().filter_map(|path| find(path));
        // Along one line of folders nothing counts: parents name their children.
        all.filter(|&j| !places[j].starts_with(&places[i]) && !places[i].starts_with(&places[j])).collect()
    };
    let graph: Vec<Vec<usize>> = (0..files.len()).map(uses).collect();
    let reaches = |from: usize, to: usize| {
        let (mut seen, mut open) = (vec![false; graph.len()], vec![from]);
        while let Some(i) = open.pop() {
            for &j in &graph[i] {
                if j == to {
                    return true;
                }
                if !std::mem::replace(&mut seen[j], true) {
                    open.push(j);
                }
            }
        }
        false
    };
    let mut complaints = Vec::new();
    for (i, used) in graph.iter().enumerate() {
        for &j in used.iter().filter(|&&j| reaches(j, i)) {
            complaints.push(format!("{} uses {}, which comes back to it", files[i].path, files[j].path));
        }
    }
    complaints.sort();
    complaints.dedup();
    complaints
}

/// Module path of a file of `src` below the crate's root.
pub fn place_of(path: &str) -> Vec<String> {
    let inside = path.strip_prefix("src/").unwrap_or(path).trim_end_matches(".rs").trim_end_matches("/mod");
    inside.split('/').map(str::to_owned).collect()
}

/// Paths below the crate's root that `code`, which stands at `place`, names by `crate::` or `super::`.
pub fn used_paths(code: &str, place: &[String]) -> Vec<Vec<String>> {
    let flat: String = code.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut paths = Vec::new();
    let starts = |at: usize| !flat[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
    for (at, _) in flat.match_indices("crate::").filter(|(at, _)| starts(*at)) {
        expand(&flat[at + 7..], Vec::new(), &mut paths);
    }
    for (at, _) in flat.match_indices("super::").filter(|(at, _)| starts(*at)) {
        let (mut rest, mut base) = (&flat[at..], place.to_vec());
        while let Some(after) = rest.strip_prefix("super::") {
            base.pop();
            rest = after;
        }
        expand(rest, base, &mut paths);
    }
    paths
}

/// Paths of `a::{b, c::d}` after `base` that are names.
fn expand(rest: &str, base: Vec<String>, paths: &mut Vec<Vec<String>>) {
    let rest = rest.trim_start();
    if let Some(group) = rest.strip_prefix('{') {
        let (mut level, mut start) = (0_usize, 0);
        for (i, c) in group.char_indices() {
            match c {
                '{' => level += 1,
                '}' if level > 0 => level -= 1,
                ',' | '}' if level == 0 => {
                    expand(&group[start..i], base.clone(), paths);
                    start = i + 1;
                    if c == '}' {
                        return;
                    }
                }
                _ => {}
            }
        }
        return;
    }
    let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    if name.is_empty() {
        return;
    }
    let mut path = base;
    let after = &rest[name.len()..];
    path.push(name);
    match after.strip_prefix("::") {
        Some(more) if !more.starts_with('<') && !more.starts_with('*') => expand(more, path, paths),
        _ => paths.push(path),
    }
}
