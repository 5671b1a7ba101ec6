//! Settings that Python programs write as YAML (`config.yml`, `cfg.yml`), read as lines of text: no tag is followed.

use std::path::{Path, PathBuf};

use crate::io::{IoError, files};

/// Lines of such a file.
pub(super) struct YamlLines(Vec<String>);

impl YamlLines {
    /// Reads a file; one that is not there has no lines.
    pub(super) fn read(path: &Path) -> Result<Self, IoError> {
        let text = if path.is_file() { files::read_text(path)? } else { String::new() };
        Ok(Self::of(&text))
    }

    pub(super) fn of(text: &str) -> Self {
        Self(text.lines().map(str::to_owned).collect())
    }

    /// Returns the first value of a key at any depth, without tags and quotes.
    pub(super) fn value<'a>(&'a self, key: &'a str) -> Option<&'a str> {
        self.places(key).map(|(_, value)| value).find(|value| !value.is_empty() && !matches!(*value, "null" | "~"))
    }

    /// Returns whether a key has the value `true`.
    pub(super) fn is_on(&self, key: &str) -> bool {
        self.value(key) == Some("true")
    }

    /// Returns the first path of a key: plain text, or the parts of a path of Python as a list below it.
    pub(super) fn path(&self, key: &str) -> Option<PathBuf> {
        self.places(key).find_map(|(line, value)| match value.strip_prefix('*') {
            Some(anchor) => {
                let marked = format!("&{anchor}");
                let is_it = |l: &String| l.split_whitespace().any(|word| word == marked);
                self.parts(self.0.iter().position(is_it)?)
            }
            None if value.is_empty() => self.parts(line),
            None if matches!(value, "null" | "~") => None,
            None => Some(PathBuf::from(value)),
        })
    }

    /// Lines with this key, and its value there.
    fn places<'a>(&'a self, key: &'a str) -> impl Iterator<Item = (usize, &'a str)> {
        self.0.iter().enumerate().filter_map(move |(at, line)| {
            let rest = line.trim_start().strip_prefix(key)?.strip_prefix(':')?;
            (rest.is_empty() || rest.starts_with(' ')).then(|| (at, plain(rest)))
        })
    }

    /// Joins the list below a line.
    fn parts(&self, line: usize) -> Option<PathBuf> {
        let items = self.0.get(line + 1..)?.iter().map_while(|l| l.trim_start().strip_prefix("- "));
        let path: PathBuf = items.map(plain).collect();
        (path != PathBuf::new()).then_some(path)
    }
}

/// A value without tags, anchors and quotes.
fn plain(value: &str) -> &str {
    let mut value = value.trim();
    while value.starts_with(['!', '&']) {
        value = value.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim_start());
    }
    let quoted = |q: char| value.strip_prefix(q).and_then(|v| v.strip_suffix(q));
    quoted('\'').or_else(|| quoted('"')).unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_paths_of_python_are_read_and_tags_are_skipped() {
        let lines = YamlLines::of(
            "!!python/object:nerfstudio.engine.trainer.TrainerConfig\n\
             _target: !!python/name:nerfstudio.engine.trainer.Trainer ''\n\
             data: null\nmethod_name: splatfacto\nempty:\n\
             load_dir: &id001 !!python/object/apply:pathlib.PosixPath\n- /\n- data\n- a b\n\
             pipeline:\n  datamanager:\n    dataparser: !!python/object:X\n      data: *id001\n      mask: ~\n\
             \x20   background_color: 'white'\n    antialiased: true\n    dir: data/garden\n    data_dir: other\n",
        );
        assert_eq!((lines.value("method_name"), lines.value("background_color")), (Some("splatfacto"), Some("white")));
        assert_eq!((lines.value("data"), lines.value("mask"), lines.value("dat")), (Some("*id001"), None, None));
        assert!(lines.is_on("antialiased") && !lines.is_on("method_name") && !lines.is_on("none"));
        assert_eq!(lines.path("data"), Some("/data/a b".into()), "the first that is not null, by its anchor");
        assert_eq!((lines.path("dir"), lines.path("data_dir")), (Some("data/garden".into()), Some("other".into())));
        assert_eq!([lines.path("empty"), lines.path("mask"), lines.path("dat")], [None, None, None]);
        let dangling = YamlLines::of("data: *id009\ndir: !!python/object/apply:os.system\n");
        assert_eq!([dangling.path("data"), dangling.path("dir")], [None, None]);
    }
}
