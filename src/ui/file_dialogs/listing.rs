//! Content of a folder, read beside the window's thread, and completion of a typed folder.

use std::path::{MAIN_SEPARATOR, Path, PathBuf};
use std::time::SystemTime;

use crossbeam_channel::{Receiver, bounded};

use crate::scene::text;
use crate::worker::Repaint;

/// Most entries that are listed.
const MOST: usize = 20_000;

/// A file or folder in a list.
#[derive(Clone, Debug)]
pub(super) struct FolderEntry {
    pub(super) path: PathBuf,
    /// Name as it is shown.
    pub(super) name: String,
    pub(super) is_folder: bool,
    pub(super) bytes: u64,
    pub(super) changed: Option<SystemTime>,
}

/// Content of a folder: folders first, by name.
#[derive(Debug, Default)]
pub(super) struct FolderListing {
    pub(super) entries: Vec<FolderEntry>,
    /// Sentence about what could not be read or is left out.
    pub(super) problem: Option<String>,
}

impl FolderEntry {
    pub(super) fn is_hidden(&self) -> bool {
        self.name.starts_with('.')
    }
}

/// Begins to read a folder; the window is drawn again once it is known.
pub(super) fn begin(folder: &Path, repaint: &Repaint) -> std::io::Result<Receiver<FolderListing>> {
    let (sender, receiver) = bounded(1);
    let (folder, repaint) = (folder.to_owned(), repaint.clone());
    std::thread::Builder::new().name("folder".into()).spawn(move || {
        // The dialog may be closed by now.
        let _ = sender.send(read(&folder));
        repaint();
    })?;
    Ok(receiver)
}

fn read(folder: &Path) -> FolderListing {
    let files = match std::fs::read_dir(folder) {
        Ok(files) => files,
        Err(e) => {
            let problem = Some(format!("This folder cannot be read: {e}. Choose another one."));
            return FolderListing { entries: Vec::new(), problem };
        }
    };
    let mut entries: Vec<FolderEntry> = files.flatten().take(MOST + 1).map(|file| entry(file.path())).collect();
    let problem = (entries.len() > MOST).then(|| format!("Only {MOST} of the entries are listed."));
    entries.truncate(MOST);
    entries.sort_by_cached_key(|e| (!e.is_folder, e.name.to_lowercase(), e.name.clone()));
    FolderListing { entries, problem }
}

/// An entry; links are followed, and those that lead nowhere are empty files.
fn entry(path: PathBuf) -> FolderEntry {
    let facts = std::fs::metadata(&path).ok();
    FolderEntry {
        name: path.file_name().map_or_else(String::new, |name| text::line(&name.to_string_lossy()).into_owned()),
        is_folder: facts.as_ref().is_some_and(std::fs::Metadata::is_dir),
        bytes: facts.as_ref().map_or(0, std::fs::Metadata::len),
        changed: facts.and_then(|f| f.modified().ok()),
        path,
    }
}

/// Entries whose names begin with the typed letters, in any case; `folders` leaves files out.
fn begun<'a>(
    entries: &'a [&FolderEntry],
    typed: &str,
    folders: bool,
) -> impl Iterator<Item = &'a FolderEntry> + use<'a> {
    let typed = typed.to_lowercase();
    let is_begun = move |e: &&FolderEntry| (e.is_folder || !folders) && e.name.to_lowercase().starts_with(&typed);
    entries.iter().copied().filter(is_begun)
}

/// The entry that a typed name means: the one of this name, or else the first that begins with it.
pub(super) fn named<'a>(entries: &'a [&FolderEntry], typed: &str, folders: bool) -> Option<&'a FolderEntry> {
    let is_it = |e: &&FolderEntry| e.name.to_lowercase() == typed.to_lowercase();
    begun(entries, typed, folders).find(is_it).or_else(|| begun(entries, typed, folders).next())
}

/// The typed name with what all entries that begin with it have in common; `None` if that is no more than is typed.
pub(super) fn continued(entries: &[&FolderEntry], typed: &str, folders: bool) -> Option<String> {
    let mut names = begun(entries, typed, folders).map(|e| e.name.as_str());
    let first = names.next().filter(|_| !typed.is_empty())?;
    let common = names.fold(first.chars().count(), |n, name| {
        let same = |(a, b): &(char, char)| a.to_lowercase().eq(b.to_lowercase());
        first.chars().zip(name.chars()).take(n).take_while(same).count()
    });
    (common > typed.chars().count()).then(|| first.chars().take(common).collect())
}

/// Folders that continue a typed one, each with a separator at its end.
pub(super) fn completions(typed: &str) -> Vec<String> {
    let Some((above, begun)) = typed.rsplit_once(std::path::is_separator) else { return Vec::new() };
    let above = format!("{above}{MAIN_SEPARATOR}");
    let Ok(files) = std::fs::read_dir(expanded(&above)) else { return Vec::new() };
    let continues = |name: &String| {
        name.to_lowercase().starts_with(&begun.to_lowercase()) && (begun.starts_with('.') || !name.starts_with('.'))
    };
    let folders = files.flatten().take(MOST).filter(|file| file.path().is_dir());
    let mut names: Vec<String> =
        folders.filter_map(|file| file.file_name().into_string().ok()).filter(continues).collect();
    names.sort_by_cached_key(|name| name.to_lowercase());
    names.into_iter().map(|name| format!("{above}{name}{MAIN_SEPARATOR}")).collect()
}

/// The path that a text stands for: `~` at its beginning is the user's folder.
pub(super) fn expanded(typed: &str) -> PathBuf {
    let home = typed.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with(std::path::is_separator));
    match home.zip(std::env::home_dir()) {
        Some((rest, home)) => home.join(rest.trim_start_matches(std::path::is_separator)),
        None => typed.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_begun_name_goes_on_as_far_as_all_that_fit_agree() {
        let entry = |name: &str, is_folder| FolderEntry {
            path: name.into(),
            name: name.into(),
            is_folder,
            bytes: 0,
            changed: None,
        };
        let all = [entry("Kitchen-1", true), entry("kitchen-2", true), entry("photos", true), entry("plan.txt", false)];
        let all: Vec<&FolderEntry> = all.iter().collect();
        for (typed, more) in [
            ("k", Some("Kitchen-")),
            ("ph", Some("photos")),
            ("pl", None),
            ("kitchen-1", None),
            ("x", None),
            ("", None),
        ] {
            assert_eq!(continued(&all, typed, true).as_deref(), more, "{typed}");
        }
        assert_eq!(continued(&all, "pl", false).as_deref(), Some("plan.txt"), "files count where they can be chosen");
        assert_eq!(continued(&all, "p", false), None, "photos or plan.txt");
        assert_eq!(named(&all, "KITCHEN-2", true).map(|e| e.name.as_str()), Some("kitchen-2"));
        assert_eq!(named(&all, "kit", true).map(|e| e.name.as_str()), Some("Kitchen-1"));
        assert!(named(&all, "plan", true).is_none());
    }

    #[test]
    fn a_folder_lists_folders_first_and_one_that_cannot_be_read_says_why() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["zebra", "Apple", ".cache"] {
            std::fs::create_dir(folder.path().join(name)).expect("made");
        }
        std::fs::write(folder.path().join("a.ply"), [0; 7]).expect("written");
        let listing = read(folder.path());
        let names: Vec<(&str, u64)> = listing
            .entries
            .iter()
            .filter(|e| !e.is_hidden())
            .map(|e| (&*e.name, e.bytes * u64::from(!e.is_folder)))
            .collect();
        assert_eq!(names, [("Apple", 0), ("zebra", 0), ("a.ply", 7)]);
        assert!(listing.problem.is_none() && listing.entries.len() == 4);
        assert!(read(&folder.path().join("gone")).problem.is_some_and(|p| p.contains("cannot be read")));
    }

    #[test]
    fn a_typed_folder_is_continued_by_those_that_exist() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["photos", "Phones", "other", ".hidden"] {
            std::fs::create_dir(folder.path().join(name)).expect("made");
        }
        let at = |name: &str| format!("{}{MAIN_SEPARATOR}{name}", folder.path().display());
        let all = |typed: &str| completions(&at(typed));
        let end = |name: &str| at(&format!("{name}{MAIN_SEPARATOR}"));
        assert_eq!(all("ph"), [end("Phones"), end("photos")]);
        assert_eq!(all(".h"), [end(".hidden")]);
        assert_eq!(all("").len(), 3);
        assert!(all("q").is_empty() && completions("ph").is_empty());
        assert!(expanded("~/a").ends_with("a") && !expanded("~/a").starts_with("~"));
        assert_eq!(expanded("~a"), Path::new("~a"));
    }
}
