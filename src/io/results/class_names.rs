//! Names that people give to the classes of Gaussian Grouping, in a text file beside its classifier.

use std::collections::BTreeMap;
use std::path::Path;

use crate::io::{IoError, files};
use crate::scene::identity::whole_names::key;
use crate::scene::text;

/// Name of the file: a class on each line, its number and its name.
pub(super) const FILE: &str = "class_names.txt";

/// Reads the names of classes below `classes`; none if there is no such file.
///
/// # Errors
/// If a line is not a number and a name, there is no such class, or two classes have one name.
pub(super) fn read(file: &Path, classes: usize) -> Result<BTreeMap<u32, String>, IoError> {
    let mut names = BTreeMap::new();
    if !file.is_file() {
        return Ok(names);
    }
    for (k, line) in files::read_text(file)?.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let bad = |reason: String| IoError::syntax(file, format!("line {}", k + 1), reason);
        let read = line.trim().split_once(char::is_whitespace).map(|(class, name)| (class.parse::<u32>(), name.trim()));
        let Some((Ok(class), name)) = read else {
            return Err(bad("expected the number of a class and its name, such as '5 kettle'".into()));
        };
        if class as usize >= classes {
            return Err(bad(format!("the classifier has no class {class}, only 0 to {}", classes.saturating_sub(1))));
        }
        let name = text::line(name).into_owned();
        if let Some((other, _)) = names.iter().find(|(_, known)| key(known) == key(&name)) {
            return Err(bad(format!("class {other} is called '{name}', too")));
        }
        if names.insert(class, name).is_some() {
            return Err(bad(format!("class {class} has a name already")));
        }
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<BTreeMap<u32, String>, String> {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join(FILE);
        std::fs::write(&file, text).expect("written");
        read(&file, 256).map_err(|e| e.to_string())
    }

    #[test]
    fn a_line_is_a_class_and_its_name() {
        let names = read_text("7 kettle\n\n 12\tteddy  bear \r\n255 a\u{1b}[2Jb\n").expect("read");
        assert_eq!(names.keys().copied().collect::<Vec<_>>(), [7, 12, 255]);
        assert_eq!((&*names[&7], &*names[&12]), ("kettle", "teddy  bear"));
        assert!(!names[&255].contains('\u{1b}'), "{:?}", names[&255]);
        assert!(read(Path::new("nowhere/class_names.txt"), 256).expect("no names").is_empty());
    }

    #[test]
    fn wrong_lines_are_named() {
        for (text, wanted) in [
            ("7 kettle\nkettle 7\n", "line 2"),
            ("7\n", "'5 kettle'"),
            ("-1 kettle\n", "line 1"),
            ("256 kettle\n", "0 to 255"),
            ("7 kettle\n7 mug\n", "class 7 has a name"),
            ("7 kettle\n8 The Kettle\n", "class 7 is called 'The Kettle', too"),
        ] {
            let e = read_text(text).expect_err(text);
            assert!(e.contains(wanted) && e.contains(FILE), "{text:?}: {e}");
        }
    }
}
