//! Reads the tree, and reduces Rust text to what the compiler would see outside tests.

use std::path::Path;

/// One file of the tree.
pub struct SourceFile {
    /// Path from the package's root, with `/`.
    pub path: String,
    /// All of it.
    pub text: String,
}

/// Every `.rs` and `.wgsl` file under the folders that hold source.
pub fn read_tree(root: &Path) -> Vec<SourceFile> {
    let mut files = Vec::new();
    for folder in ["src", "shaders", "tests", "benches", "tools", "examples"] {
        read_folder(root, &root.join(folder), &mut files);
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    files
}

fn read_folder(root: &Path, folder: &Path, files: &mut Vec<SourceFile>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries {
        let path = entry.expect("readable folder").path();
        if path.is_dir() {
            if path.file_name().is_some_and(|name| name != "target") {
                read_folder(root, &path, files);
            }
        } else if path.extension().is_some_and(|e| e == "rs" || e == "wgsl") {
            let relative = path.strip_prefix(root).expect("under the root");
            let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            files.push(SourceFile { path: relative.to_string_lossy().replace('\\', "/"), text });
        }
    }
}

/// `text` with comments and the insides of strings and characters blanked, line breaks kept.
pub fn without_comments_and_strings(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = bytes.to_vec();
    let mut i = 0;
    while i < bytes.len() {
        let end = match bytes[i] {
            b'/' if bytes[i..].starts_with(b"//") => find(bytes, i, b"\n").unwrap_or(bytes.len()),
            b'/' if bytes[i..].starts_with(b"/*") => end_of_block_comment(bytes, i),
            b'"' => end_of_string(bytes, i),
            b'r' if !preceded_by_identifier(bytes, i) => match raw_string_hashes(bytes, i) {
                Some(hashes) => end_of_raw_string(bytes, i + 2 + hashes, hashes),
                None => i,
            },
            b'\'' => end_of_character(bytes, i),
            _ => i,
        };
        for byte in out.iter_mut().take(end).skip(i).filter(|b| **b != b'\n') {
            *byte = b' ';
        }
        i = end.max(i + 1);
    }
    String::from_utf8_lossy(&out).into_owned()
}

fn find(bytes: &[u8], from: usize, needle: &[u8]) -> Option<usize> {
    let at = bytes.get(from..)?.windows(needle.len()).position(|w| w == needle)?;
    Some(from + at)
}

fn end_of_block_comment(bytes: &[u8], start: usize) -> usize {
    let (mut depth, mut i) = (0, start);
    while i < bytes.len() {
        if bytes[i..].starts_with(b"/*") {
            depth += 1;
            i += 2;
        } else if bytes[i..].starts_with(b"*/") {
            depth -= 1;
            i += 2;
            if depth == 0 {
                return i;
            }
        } else {
            i += 1;
        }
    }
    i
}

fn end_of_string(bytes: &[u8], start: usize) -> usize {
    let mut i = start + 1;
    while i < bytes.len() && bytes[i] != b'"' {
        i += if bytes[i] == b'\\' { 2 } else { 1 };
    }
    (i + 1).min(bytes.len())
}

fn preceded_by_identifier(bytes: &[u8], i: usize) -> bool {
    // `br"..."` is a raw string too; any other letter before the `r` makes it part of a name.
    i > 0 && bytes[i - 1] != b'b' && (bytes[i - 1].is_ascii_alphanumeric() || bytes[i - 1] == b'_')
}

fn raw_string_hashes(bytes: &[u8], r: usize) -> Option<usize> {
    let hashes = bytes[r + 1..].iter().take_while(|b| **b == b'#').count();
    (bytes.get(r + 1 + hashes) == Some(&b'"')).then_some(hashes)
}

fn end_of_raw_string(bytes: &[u8], from: usize, hashes: usize) -> usize {
    let mut close = vec![b'"'];
    close.resize(1 + hashes, b'#');
    find(bytes, from, &close).map_or(bytes.len(), |at| at + close.len())
}

/// The end of a character literal, or `start` where the quote belongs to a lifetime.
fn end_of_character(bytes: &[u8], start: usize) -> usize {
    if bytes.get(start + 1) == Some(&b'\\') {
        return find(bytes, start + 3, b"'").map_or(bytes.len(), |at| at + 1);
    }
    // A character is at most four bytes long.
    let close = (start + 2..=start + 5).find(|&at| bytes.get(at) == Some(&b'\''));
    match close {
        Some(at) if std::str::from_utf8(&bytes[start + 1..at]).is_ok_and(|s| s.chars().count() == 1) => at + 1,
        _ => start,
    }
}

/// Text without comments, strings and `#[cfg(test)] mod name { ... }` blocks. Such a block ends
/// at the first closing brace with the indentation of its attribute, which rustfmt guarantees.
pub fn library_code(text: &str) -> String {
    let code = without_comments_and_strings(text);
    let mut kept = String::with_capacity(code.len());
    let mut lines = code.lines().peekable();
    while let Some(line) = lines.next() {
        let is_test_module = line.trim_start().starts_with("#[cfg(test)]")
            && lines.peek().is_some_and(|next| next.trim_start().starts_with("mod ") && next.contains('{'));
        if is_test_module {
            let close = format!("{}}}", &line[..line.len() - line.trim_start().len()]);
            lines.by_ref().find(|l| l.trim_end() == close);
        } else {
            kept.push_str(line);
        }
        kept.push('\n');
    }
    kept
}

/// Names that `text` declares as `#[cfg(test)] mod name;`.
pub fn test_module_files(text: &str) -> Vec<String> {
    let code = without_comments_and_strings(text);
    let lines: Vec<&str> = code.lines().map(str::trim).collect();
    let declared = |pair: &[&str]| match pair {
        ["#[cfg(test)]", declaration] => {
            let name = declaration.strip_prefix("pub(crate) ").unwrap_or(declaration);
            Some(name.strip_prefix("mod ")?.strip_suffix(';')?.to_owned())
        }
        _ => None,
    };
    lines.windows(2).filter_map(declared).collect()
}
