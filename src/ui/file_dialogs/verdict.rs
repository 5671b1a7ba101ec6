//! Meaning of a typed name in a folder: a path to return, a folder to go to, or what is in the way.

use std::path::{Path, PathBuf};

use super::listing::expanded;
use super::request::{FileRequest, PathPurpose};
use crate::scene::text;

/// Consequence of a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum NameVerdict {
    Chosen(PathBuf),
    /// An existing file that would be replaced.
    Replaces(PathBuf),
    /// A folder to show.
    Enter(PathBuf),
    /// A folder that would have to be made.
    Missing(PathBuf),
    /// Sentence for the user.
    Refused(String),
}

/// Judges a name that was typed while `folder` was shown.
pub(super) fn judge(request: &FileRequest, folder: &Path, name: &str, format: usize) -> NameVerdict {
    let name = name.trim();
    if name.is_empty() {
        return match request.purpose {
            PathPurpose::Folder { .. } => NameVerdict::Chosen(folder.into()),
            _ => NameVerdict::Refused("Type a name, or choose a file.".into()),
        };
    }
    let typed = folder.join(expanded(name));
    match request.purpose {
        PathPurpose::Save(_) => judge_new(request, typed, name.ends_with(std::path::is_separator), format),
        _ if typed.is_dir() => NameVerdict::Enter(typed),
        PathPurpose::Open if typed.exists() => NameVerdict::Chosen(typed),
        PathPurpose::Folder { .. } if typed.exists() => {
            NameVerdict::Refused(format!("\u{201c}{}\u{201d} is a file. Choose a folder.", text::line(name)))
        }
        PathPurpose::Folder { creates: true } => NameVerdict::Missing(typed),
        _ => NameVerdict::Refused(format!("There is no \u{201c}{}\u{201d} here.", text::line(name))),
    }
}

/// Judges the path of a file to write.
fn judge_new(request: &FileRequest, typed: PathBuf, is_folder: bool, format: usize) -> NameVerdict {
    let makes_folder = request.formats.get(format).is_some_and(|f| f.is_folder());
    let Some(name) = typed.file_name().map(|n| n.to_string_lossy().into_owned()) else {
        return NameVerdict::Enter(typed);
    };
    if request.is_new && typed.is_dir() {
        let is_empty = std::fs::read_dir(&typed).is_ok_and(|mut all| all.next().is_none());
        return if is_empty { NameVerdict::Chosen(typed) } else { NameVerdict::Enter(typed) };
    }
    if typed.is_dir() && (is_folder || !makes_folder) {
        return NameVerdict::Enter(typed);
    }
    if is_folder {
        return NameVerdict::Missing(typed);
    }
    let path = typed.with_file_name(request.completed(&name, format));
    let parent = path.parent().unwrap_or(Path::new("/"));
    if !parent.exists() {
        return NameVerdict::Missing(parent.into());
    }
    if !parent.is_dir() {
        return NameVerdict::Refused(format!("{} is a file. Choose a folder.", text::path(parent)));
    }
    if path.is_dir() && !makes_folder {
        return NameVerdict::Refused(format!("{} is a folder. Choose another name.", text::path(&path)));
    }
    match path.symlink_metadata() {
        Ok(_) if request.is_new => {
            NameVerdict::Refused(format!("{} is there already. Choose another name.", text::path(&path)))
        }
        Ok(_) => NameVerdict::Replaces(path),
        Err(_) => NameVerdict::Chosen(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ui::file_dialogs::request::FileFormat;
    use crate::ui::file_kind::FileKind;

    #[test]
    fn names_are_chosen_entered_completed_or_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("sub")).expect("made");
        std::fs::write(at("a.ply"), "").expect("written");
        let formats = vec![FileFormat::new("PLY", &[".ply"]), FileFormat::new("Frames", &[""])];
        let save = FileRequest::save(FileKind::Gaussians, "Export", "a", formats.clone());
        let of = |request: &FileRequest, name: &str, format| judge(request, folder.path(), name, format);
        assert_eq!(of(&save, "b", 0), NameVerdict::Chosen(at("b.ply")));
        assert_eq!(of(&save, "a", 0), NameVerdict::Replaces(at("a.ply")));
        assert_eq!(of(&save, "sub", 0), NameVerdict::Enter(at("sub")));
        assert_eq!(of(&save, "sub", 1), NameVerdict::Replaces(at("sub")), "frames go into it");
        assert_eq!(of(&save, "sub/b.ply", 0), NameVerdict::Chosen(at("sub/b.ply")));
        assert_eq!(of(&save, "new/er/b", 0), NameVerdict::Missing(at("new/er")));
        assert_eq!(of(&save, "new/", 0), NameVerdict::Missing(at("new/")));
        assert!(!at("new").exists(), "nothing is made silently");
        for name in ["", "a.ply/b"] {
            assert!(matches!(of(&save, name, 0), NameVerdict::Refused(_)), "{name}");
        }
        let open = FileRequest::file(FileKind::Scenes, "Open", formats);
        assert_eq!(of(&open, "a.ply", 0), NameVerdict::Chosen(at("a.ply")));
        assert!(matches!(of(&open, "b.ply", 0), NameVerdict::Refused(_)));
        let [old, new] = [FileRequest::folder, FileRequest::new_folder].map(|of| of(FileKind::Masks, "Masks"));
        assert_eq!(of(&old, "", 0), NameVerdict::Chosen(folder.path().into()));
        assert_eq!(of(&old, "sub", 0), NameVerdict::Enter(at("sub")));
        assert_eq!(of(&new, "b", 0), NameVerdict::Missing(at("b")));
        let copy = FileRequest::made_folder(FileKind::Scenes, "Copy", "fox-copy");
        assert_eq!(of(&copy, &copy.proposed(), 0), NameVerdict::Chosen(at("fox-copy")), "it need not be there");
        assert_eq!(of(&copy, "sub", 0), NameVerdict::Chosen(at("sub")), "an empty one");
        std::fs::write(at("sub/b.ply"), "").expect("written");
        assert_eq!(of(&copy, "sub", 0), NameVerdict::Enter(at("sub")), "what is in it stays");
        assert!(matches!(of(&copy, "a.ply", 0), NameVerdict::Refused(_)), "nothing is replaced");
        for (request, name) in [(&old, "b"), (&old, "a.ply"), (&new, "a.ply")] {
            assert!(matches!(of(request, name, 0), NameVerdict::Refused(_)), "{name}");
        }
    }
}
