//! Requests for paths: what is chosen, the formats that it may have, and the names that go with them.

use std::path::{Path, PathBuf};

use crate::ui::file_kind::FileKind;

/// A format of files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileFormat {
    /// Name in the list, such as "PLY (.ply)".
    pub(crate) name: &'static str,
    /// Endings with their dots, the first of which is written. One without a dot is the whole name of the file; an
    /// empty one is that of a folder.
    pub(crate) endings: Vec<&'static str>,
}

impl FileFormat {
    pub(crate) fn new(name: &'static str, endings: &[&'static str]) -> Self {
        Self { name, endings: endings.to_vec() }
    }

    /// Length of the longest ending that a name has.
    fn length_in(&self, name: &str) -> Option<usize> {
        let name = name.to_lowercase();
        let has = |ending: &&&str| match ending.starts_with('.') {
            true => name.len() > ending.len() && name.ends_with(**ending),
            false => !ending.is_empty() && name == **ending,
        };
        self.endings.iter().filter(has).map(|ending| ending.len()).max()
    }

    pub(super) fn fits(&self, name: &str) -> bool {
        self.length_in(name).is_some()
    }

    /// True if it is written as a folder.
    pub(super) fn is_folder(&self) -> bool {
        self.endings.first().is_some_and(|ending| ending.is_empty())
    }

    /// Endings as dialogs of systems take them: without the dot.
    pub(super) fn extensions(&self) -> Vec<&'static str> {
        let last = |ending: &&'static str| match ending.strip_prefix('.') {
            Some(rest) => Some(rest),
            None => Path::new(*ending)
                .extension()
                .and_then(|e| e.to_str())
                .and_then(|e| ending.get(ending.len() - e.len()..)),
        };
        self.endings.iter().filter_map(last).collect()
    }
}

/// Purpose of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PathPurpose {
    /// A folder; `creates` if it may be a new one.
    Folder { creates: bool },
    /// A file that exists.
    Open,
    /// A file to write, with the proposed name.
    Save(String),
}

/// A request for a path.
#[derive(Clone, Debug)]
pub(in crate::ui) struct FileRequest {
    pub(super) title: String,
    pub(super) kind: FileKind,
    pub(super) purpose: PathPurpose,
    /// Formats that can be chosen; none for folders.
    pub(super) formats: Vec<FileFormat>,
    /// Format that is proposed.
    pub(super) format: usize,
    /// True if nothing may be there yet, except for an empty folder.
    pub(super) is_new: bool,
    /// Folder in which the dialog opens, if not that of the last choice.
    pub(super) start: Option<PathBuf>,
}

impl FileRequest {
    /// A folder that exists.
    pub(in crate::ui) fn folder(kind: FileKind, title: &str) -> Self {
        let purpose = PathPurpose::Folder { creates: false };
        Self { title: title.to_owned(), kind, purpose, formats: Vec::new(), format: 0, is_new: false, start: None }
    }

    /// A folder to write into.
    pub(in crate::ui) fn new_folder(kind: FileKind, title: &str) -> Self {
        Self { purpose: PathPurpose::Folder { creates: true }, ..Self::folder(kind, title) }
    }

    /// A file of one of these formats.
    pub(in crate::ui) fn file(kind: FileKind, title: &str, formats: Vec<FileFormat>) -> Self {
        Self { purpose: PathPurpose::Open, formats, ..Self::folder(kind, title) }
    }

    /// A file to write. The proposed name is `stem` with the ending of the first format.
    pub(in crate::ui) fn save(kind: FileKind, title: &str, stem: &str, formats: Vec<FileFormat>) -> Self {
        Self { purpose: PathPurpose::Save(stem.to_owned()), formats, ..Self::folder(kind, title) }
    }

    /// A folder that is to be made. The proposed name is `name`.
    pub(in crate::ui) fn made_folder(kind: FileKind, title: &str, name: &str) -> Self {
        Self { is_new: true, ..Self::save(kind, title, name, vec![FileFormat::new("Folder", &[""])]) }
    }

    /// The same, in a dialog that opens in this folder.
    pub(in crate::ui) fn within(self, folder: Option<PathBuf>) -> Self {
        Self { start: folder, ..self }
    }

    /// The same with another proposed format.
    pub(in crate::ui) fn with_format(self, format: usize) -> Self {
        Self { format, ..self }
    }

    pub(in crate::ui) fn kind(&self) -> FileKind {
        self.kind
    }

    pub(super) fn creates(&self) -> bool {
        matches!(self.purpose, PathPurpose::Folder { creates: true } | PathPurpose::Save(_))
    }

    pub(super) fn saves(&self) -> bool {
        matches!(self.purpose, PathPurpose::Save(_))
    }

    pub(super) fn is_folder(&self) -> bool {
        matches!(self.purpose, PathPurpose::Folder { .. })
    }

    /// The proposed name; empty unless a file is written.
    pub(super) fn proposed(&self) -> String {
        match &self.purpose {
            PathPurpose::Save(stem) => self.named(stem, self.format),
            _ => String::new(),
        }
    }

    /// Index of the format that a name asks for, by its longest ending.
    pub(super) fn format_of(&self, name: &str) -> Option<usize> {
        let lengths = self.formats.iter().enumerate().filter_map(|(i, f)| Some((f.length_in(name)?, i)));
        lengths.max_by_key(|(length, i)| (*length, usize::MAX - i)).map(|(_, i)| i)
    }

    /// The name without the ending of its format; `None` if the format says all of it.
    pub(super) fn stem<'a>(&self, name: &'a str) -> Option<&'a str> {
        let length = self.format_of(name).and_then(|i| self.formats.get(i)?.length_in(name));
        name.get(..name.len() - length.unwrap_or(0)).filter(|stem| !stem.is_empty())
    }

    /// The stem with the ending of a format.
    pub(super) fn named(&self, stem: &str, format: usize) -> String {
        match self.formats.get(format).and_then(|f| f.endings.first()) {
            Some(whole) if !whole.starts_with('.') && !whole.is_empty() => (*whole).to_owned(),
            Some(ending) => format!("{stem}{ending}"),
            None => stem.to_owned(),
        }
    }

    /// The name with the ending of a format added, if it has none that is known.
    pub(super) fn completed(&self, name: &str, format: usize) -> String {
        if self.format_of(name).is_some() { name.to_owned() } else { self.named(name, format) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaussians() -> FileRequest {
        let formats =
            [("PLY", ".ply"), ("Compressed PLY", ".compressed.ply"), ("SOG folder", "meta.json"), ("Frames", "")];
        let formats = formats.map(|(name, ending)| FileFormat::new(name, &[ending])).to_vec();
        FileRequest::save(FileKind::Gaussians, "Export Gaussians", "dots", formats)
    }

    #[test]
    fn endings_choose_formats_and_formats_choose_endings() {
        let request = gaussians();
        assert_eq!(request.proposed(), "dots.ply");
        assert_eq!(request.clone().with_format(1).proposed(), "dots.compressed.ply");
        for (name, format, stem) in [
            ("a.ply", Some(0), Some("a")),
            ("A.Compressed.PLY", Some(1), Some("A")),
            ("meta.json", Some(2), None),
            ("a.json", None, Some("a.json")),
            (".ply", None, Some(".ply")),
            ("a", None, Some("a")),
        ] {
            assert_eq!((request.format_of(name), request.stem(name)), (format, stem), "{name}");
        }
        assert_eq!([0, 1, 2, 3].map(|i| request.named("a", i)), ["a.ply", "a.compressed.ply", "meta.json", "a"]);
        for (name, complete) in [("a", "a.ply"), ("a.v2", "a.v2.ply"), ("a.compressed.ply", "a.compressed.ply")] {
            assert_eq!(request.completed(name, 0), complete);
        }
        assert_eq!(request.completed("a", 3), "a", "frames go into a folder");
        let extensions: Vec<_> = request.formats.iter().map(FileFormat::extensions).collect();
        assert_eq!(extensions, [vec!["ply"], vec!["compressed.ply"], vec!["json"], vec![]]);
    }
}
