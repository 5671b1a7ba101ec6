//! Lookup of listed photos: by the listed path, or else by a name changed through a move to another folder, system or
//! format. No path leads out of the data set's folder, whatever a list says; links inside it are followed.

use std::collections::HashMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use unicode_normalization::UnicodeNormalization;

use crate::io::{IoError, files, photo};

/// Finder for the photos of one list.
pub(crate) struct PhotoFinder<'a> {
    root: &'a Path,
    /// Real path and given path of the folder: lists may contain either.
    names: [PathBuf; 2],
    /// Contents of each folder that was searched.
    folders: Mutex<HashMap<PathBuf, Arc<Listing>>>,
}

/// Names in a folder, indexed for lookup.
#[derive(Default)]
struct Listing {
    by_fold: HashMap<String, Vec<String>>,
    /// Pictures by their folded stems.
    by_stem: HashMap<String, Vec<String>>,
    /// Folders `images_<factor>`, the least reduced first.
    reduced: Vec<String>,
}

impl Listing {
    fn of(folder: &Path) -> Self {
        let mut listing = Self::default();
        for name in files::names_in(folder).unwrap_or_default() {
            if let Some(stem) = photo::stem(&name) {
                listing.by_stem.entry(fold(stem)).or_default().push(name.clone());
            }
            if reduction(&name).is_some() && folder.join(&name).is_dir() {
                listing.reduced.push(name.clone());
            }
            listing.by_fold.entry(fold(&name)).or_default().push(name);
        }
        listing.reduced.sort_by_key(|name| reduction(name));
        listing
    }

    /// Returns the names that differ from this one in letter case at most.
    fn alike(&self, name: &str) -> &[String] {
        self.by_fold.get(&fold(name)).map_or(&[], Vec::as_slice)
    }

    /// Returns the pictures whose stem differs from this one in letter case at most.
    fn of_stem(&self, stem: &str) -> &[String] {
        self.by_stem.get(&fold(stem)).map_or(&[], Vec::as_slice)
    }
}

/// A file that exists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FoundFile {
    pub(crate) path: PathBuf,
    /// Listed name, relative to the folder of the list, with `/` between its parts.
    pub(crate) name: String,
    /// Name in the folder if it differs from the listed one.
    pub(crate) called: Option<String>,
    /// True if links lead to it out of the folder.
    pub(crate) linked: bool,
}

/// Outcome of a lookup.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Lookup {
    Found(FoundFile),
    /// These two match equally well.
    Several([String; 2]),
    Missing,
    /// The path leads out of the folder, and nothing inside matches its end.
    Outside,
}

/// The parts of a path in a list.
struct Parts {
    parts: Vec<String>,
    /// True if it begins outside of the folder, or on another computer.
    away: bool,
}

impl<'a> PhotoFinder<'a> {
    /// Makes a finder for the data set in `root`.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub(crate) fn new(root: &'a Path) -> Result<Self, IoError> {
        let failed = |cause| IoError::Read { path: root.into(), cause };
        let names = [fs::canonicalize(root).map_err(failed)?, std::path::absolute(root).map_err(failed)?];
        Ok(Self { root, names, folders: Mutex::default() })
    }

    /// Returns the name of a listed path for comparing lists: relative to the folder if it lies inside.
    pub(crate) fn key(&self, entry: &str) -> String {
        self.parts(entry).parts.join("/")
    }

    /// Looks for `entry` in the folder `below` the data set's; an empty `below` means that folder itself.
    pub(crate) fn find(&self, below: &str, entry: &str) -> Lookup {
        if entry.contains('\0') {
            return Lookup::Outside;
        }
        let base = if below.is_empty() { self.root.to_path_buf() } else { self.root.join(below) };
        // First with the backslash as a letter, as on Unix.
        if entry.contains('\\') {
            let plain = || Path::new(entry).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
            let path = base.join(entry);
            if plain() && path.is_file() {
                return self.found(path, entry.into(), None);
            }
        }
        let Parts { parts, away } = self.parts(entry);
        if parts.is_empty() {
            return Lookup::Outside;
        }
        // Then the end of the path, the longest first: the folder may have had another name or place.
        for first in 0..parts.len() {
            match self.walk(&base, &parts[first..]) {
                Walk::Found { path, parts: real } => {
                    let name = parts[first..].join("/");
                    let is_listed = first == 0 && !away && !entry.contains('\\') && real.is_none();
                    let called = (!is_listed).then(|| {
                        let inside = real.unwrap_or_else(|| name.clone());
                        if below.is_empty() { inside } else { format!("{below}/{inside}") }
                    });
                    return self.found(path, name, called);
                }
                Walk::Several(two) => return Lookup::Several(two),
                Walk::Missing => {}
            }
        }
        if away { Lookup::Outside } else { Lookup::Missing }
    }

    fn found(&self, path: PathBuf, name: String, called: Option<String>) -> Lookup {
        let linked = fs::canonicalize(&path).is_ok_and(|real| !real.starts_with(&self.names[0]));
        Lookup::Found(FoundFile { path, name, called, linked })
    }

    /// Splits a path, whatever system wrote it.
    fn parts(&self, entry: &str) -> Parts {
        let inside = self.names.iter().find_map(|name| Path::new(entry).strip_prefix(name).ok()?.to_str());
        let entry = inside.unwrap_or(entry).replace('\\', "/");
        let drive = |part: &str| part.len() == 2 && part.ends_with(':') && part.as_bytes()[0].is_ascii_alphabetic();
        let mut away = entry.starts_with('/');
        let mut parts: Vec<String> = Vec::new();
        for (i, part) in entry.split('/').enumerate() {
            match part {
                "" | "." => {}
                ".." => away |= parts.pop().is_none(),
                part if i == 0 && drive(part) => away = true,
                // A drive's letter leads out of any folder.
                part if cfg!(windows) && part.contains(':') => away = true,
                part => parts.push(part.into()),
            }
        }
        Parts { parts, away }
    }

    /// Follows the parts of a path down from `folder`, by their exact names if these exist.
    fn walk(&self, folder: &Path, parts: &[String]) -> Walk {
        let Some((file, folders)) = parts.split_last() else { return Walk::Missing };
        let mut at = folder.to_path_buf();
        let mut real = Vec::new();
        for part in folders {
            let next = at.join(part);
            if next.is_dir() {
                real.push(part.clone());
                at = next;
                continue;
            }
            let listing = self.listing(&at);
            let alike: Vec<&String> = listing.alike(part).iter().filter(|name| at.join(name).is_dir()).collect();
            // A data set that was shared with reduced photos only.
            let reduced = listing.reduced.iter().filter(|_| alike.is_empty() && fold(part) == "images");
            let reduced: Vec<&String> = reduced.take(1).collect();
            match if alike.is_empty() { reduced.as_slice() } else { alike.as_slice() } {
                [] => return Walk::Missing,
                [one] => {
                    at.push(one);
                    real.push((*one).clone());
                }
                [a, b, ..] => return Walk::several(&real, a, b),
            }
        }
        let exact = at.join(file);
        if exact.is_file() {
            return Walk::Found { path: exact, parts: (real != folders).then(|| joined(&real, file)) };
        }
        let listing = self.listing(&at);
        let there = |names: &[String]| -> Vec<String> {
            names.iter().filter(|name| at.join(name).is_file()).cloned().collect()
        };
        let stem = photo::stem(file);
        let mut same_stem = there(listing.of_stem(stem.unwrap_or(file)));
        // Phones and cameras store an unreadable file beside a readable one.
        if same_stem.iter().any(|name| !photo::is_unread(name)) {
            same_stem.retain(|name| !photo::is_unread(name));
        }
        let of_stem = |exact: &str| -> Vec<String> {
            same_stem.iter().filter(|name| photo::stem(name) == Some(exact)).cloned().collect()
        };
        // Listed without an ending, by convention `.png`.
        let mut added: Vec<String> = if stem.is_none() { of_stem(file) } else { Vec::new() };
        if let Some(png) = added.iter().find(|name| name.ends_with(".png")).cloned() {
            added = vec![png];
        }
        if let [one] = added.as_slice() {
            return Walk::Found { path: at.join(one), parts: (real != folders).then(|| joined(&real, one)) };
        }
        // Then with other letter case, then with another ending.
        let other_ending: Vec<String> = stem.map_or_else(Vec::new, of_stem);
        for fits in [added, there(listing.alike(file)), other_ending, same_stem.clone()] {
            match fits.as_slice() {
                [] => {}
                [one] => return Walk::Found { path: at.join(one), parts: Some(joined(&real, one)) },
                [a, b, ..] => return Walk::several(&real, a, b),
            }
        }
        Walk::Missing
    }

    fn listing(&self, folder: &Path) -> Arc<Listing> {
        let mut known = self.folders.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(known.entry(folder.into()).or_insert_with(|| Arc::new(Listing::of(folder))))
    }
}

/// Outcome of following a path; names are joined by `/`, and `None` if they are as listed.
enum Walk {
    Found { path: PathBuf, parts: Option<String> },
    Several([String; 2]),
    Missing,
}

impl Walk {
    fn several(folders: &[String], a: &str, b: &str) -> Self {
        Self::Several([joined(folders, a), joined(folders, b)])
    }
}

fn joined(folders: &[String], file: &str) -> String {
    folders.iter().map(String::as_str).chain([file]).collect::<Vec<_>>().join("/")
}

/// The factor of a folder `images_<factor>`.
pub(crate) fn reduction(name: &str) -> Option<u32> {
    name.strip_prefix("images_")?.parse().ok().filter(|factor| *factor > 1)
}

/// Folds a name: letter case and the composition of accents, in which systems differ.
pub(crate) fn fold(name: &str) -> String {
    name.nfc().collect::<String>().to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("folder");
        for file in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().expect("parent")).expect("create");
            fs::write(path, "x").expect("write");
        }
        folder
    }

    /// Listed name and actual name, if different, of a found file.
    fn of(search: Lookup) -> (String, Option<String>) {
        let Lookup::Found(file) = search else { panic!("{search:?}") };
        (file.name, file.called)
    }

    #[test]
    fn names_of_other_systems_lead_to_the_file() {
        let f = folder(&["images/a.jpg", "images/Sub/b.JPG", "images/c.png", "images/e\u{301}.png", "._x.png"]);
        let finder = PhotoFinder::new(f.path()).expect("folder");
        let inside = f.path().join("images/a.jpg").to_string_lossy().into_owned();
        for (entry, name, called) in [
            ("images/a.jpg", "images/a.jpg", None),
            ("./images//a.jpg", "images/a.jpg", None),
            ("images/../images/a.jpg", "images/a.jpg", None),
            (&*inside, "images/a.jpg", None),
            ("images/c", "images/c", None),
            ("images\\a.jpg", "images/a.jpg", Some("images/a.jpg")),
            ("Images/A.JPG", "Images/A.JPG", Some("images/a.jpg")),
            ("images/sub/B.jpg", "images/sub/B.jpg", Some("images/Sub/b.JPG")),
            ("images/a.png", "images/a.png", Some("images/a.jpg")),
            ("images/C", "images/C", Some("images/c.png")),
            ("images/\u{e9}.png", "images/\u{e9}.png", Some("images/e\u{301}.png")),
            ("/home/u/fox/images/a.jpg", "images/a.jpg", Some("images/a.jpg")),
            ("C:\\Users\\u\\fox\\images\\a.jpg", "images/a.jpg", Some("images/a.jpg")),
            ("../data/fox/images/a.jpg", "images/a.jpg", Some("images/a.jpg")),
            ("data/fox/images/a.jpg", "images/a.jpg", Some("images/a.jpg")),
        ] {
            assert_eq!(of(finder.find("", entry)), (name.into(), called.map(str::to_owned)), "{entry}");
        }
        assert_eq!(of(finder.find("images", "A.jpg")), ("A.jpg".into(), Some("images/a.jpg".into())));
        assert_eq!(of(finder.find("images", "x/y/c.png")), ("c.png".into(), Some("images/c.png".into())));
        assert_eq!(finder.find("", "x.png"), Lookup::Missing, "what systems leave is no photo");
    }

    #[test]
    fn nothing_outside_is_found_and_two_that_fit_are_told() {
        let outer = folder(&["secret.png", "scene/images/a.png", "scene/images/b.JPG", "scene/images/B.jpg"]);
        fs::write(outer.path().join("scene/images/d.jpg"), "x").expect("write");
        fs::write(outer.path().join("scene/images/d.webp"), "x").expect("write");
        let root = outer.path().join("scene");
        let finder = PhotoFinder::new(&root).expect("folder");
        for entry in ["../secret.png", "images/../../secret.png", "/etc/passwd", "..\\secret.png", "", ".", "a\0b"] {
            assert_eq!(finder.find("", entry), Lookup::Outside, "{entry:?}");
        }
        let absolute = outer.path().join("secret.png").to_string_lossy().into_owned();
        assert_eq!(finder.find("", &absolute), Lookup::Outside);
        assert_eq!(finder.find("", "images/none.png"), Lookup::Missing);
        for (entry, a, b) in
            [("images/b.jpg", "images/B.jpg", "images/b.JPG"), ("images/d.png", "images/d.jpg", "images/d.webp")]
        {
            assert_eq!(finder.find("", entry), Lookup::Several([a.into(), b.into()]), "{entry}");
        }
        assert_eq!(of(finder.find("", "images/B.jpg")).1, None, "the control: exact");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_told_where_they_leave_the_folder() {
        let outer = folder(&["store/a.png", "scene/own/b.png"]);
        let root = outer.path().join("scene");
        std::os::unix::fs::symlink("../store", root.join("images")).expect("link");
        std::os::unix::fs::symlink("own/b.png", root.join("c.png")).expect("link");
        let finder = PhotoFinder::new(&root).expect("folder");
        for (entry, is_linked) in [("images/a.png", true), ("c.png", false), ("own/b.png", false)] {
            let Lookup::Found(file) = finder.find("", entry) else { panic!("{entry}") };
            assert_eq!((file.linked, file.called), (is_linked, None), "{entry}");
        }
        // Another path of the same folder.
        std::os::unix::fs::symlink("scene", outer.path().join("alias")).expect("link");
        let alias = outer.path().join("alias");
        let finder = PhotoFinder::new(&alias).expect("folder");
        for named in [alias.join("own/b.png"), root.join("own/b.png")] {
            let named = fs::canonicalize(named.parent().expect("parent")).expect("real").join("b.png");
            assert_eq!(of(finder.find("", &named.to_string_lossy())), ("own/b.png".into(), None));
        }
    }
}
