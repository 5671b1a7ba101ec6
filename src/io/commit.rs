//! Changes of several files of one folder, carried out together or not at all.
//!
//! Each file is first written beside its place. Then one file, the journal, is put into the folder: it lists the
//! renames, and from then on the change is decided. A process that finds a journal carries out the rest of it; without
//! a journal the old files are valid.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::atomic::Draft;
use super::error::write_error;
use super::files::sync_folder;
use super::scene_files::{JOURNAL, is_pending};
use super::temporary::{is_temporary, temporary_file};
use super::{IoError, files};
use tempfile::NamedTempFile;

const MAX_BYTES: u64 = 1 << 16;

#[derive(Default, Serialize, Deserialize)]
struct Journal {
    /// Temporary names and final names.
    put: Vec<(String, String)>,
    remove: Vec<String>,
}

/// A change of several files. Dropped before [`Commit::finish`], it leaves nothing behind.
pub(super) struct Commit<'a> {
    folder: &'a Path,
    drafts: Vec<(NamedTempFile, String)>,
    remove: Vec<String>,
}

impl<'a> Commit<'a> {
    /// Starts a change in `folder`, which the caller holds.
    pub(crate) fn new(folder: &'a Path) -> Self {
        Self { folder, drafts: Vec::new(), remove: Vec::new() }
    }

    /// Writes the new content of `name` to a temporary file.
    pub(crate) fn add(
        &mut self,
        name: &str,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), IoError> {
        let path = self.folder.join(name);
        let write = || {
            let mut file = io::BufWriter::with_capacity(1 << 20, temporary_file(&path, "tmp")?);
            fill(&mut file)?;
            let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.as_file().sync_all()?;
            Ok(file)
        };
        self.drafts.push((write().map_err(|cause| write_error(&path, cause))?, name.into()));
        Ok(())
    }

    /// Marks `name` for removal, if it exists.
    pub(crate) fn remove(&mut self, name: &str) {
        self.remove.push(name.into());
    }

    /// Puts all files in place.
    ///
    /// # Errors
    /// If the change could not be decided: all is as before. Or if it was, but not all files could be renamed: the next
    /// process that opens the folder completes it.
    pub(crate) fn finish(self) -> Result<(), IoError> {
        let Self { folder, drafts, remove } = self;
        let name = |file: &NamedTempFile| file.path().file_name().map(|n| n.to_string_lossy().into_owned());
        let put = drafts.iter().filter_map(|(file, to)| Some((name(file)?, to.clone()))).collect();
        let path = folder.join(JOURNAL);
        let text = serde_json::to_vec(&Journal { put, remove }).map_err(|e| write_error(&path, io::Error::other(e)))?;
        let mut journal = Draft::beside(&path)?;
        journal.write_all(&text).map_err(|cause| write_error(&path, cause))?;
        // Kept and held until all files are in place, so that no sweep removes them.
        let kept: Vec<_> = drafts.into_iter().map(|(file, _)| file.into_parts()).collect();
        if let Err(e) = journal.commit() {
            // Dropping the parts removes the files, unless the journal is in place after all.
            if is_pending(folder) {
                kept.into_iter().for_each(|(_, path)| drop(path.keep()));
            }
            return Err(e);
        }
        let _held: Vec<File> = kept
            .into_iter()
            .map(|(file, path)| {
                let _ = path.keep();
                file
            })
            .collect();
        carry_out(folder)
    }
}

/// Carries out a decided change; the caller holds the folder. Does nothing without a journal.
pub(super) fn carry_out(folder: &Path) -> Result<(), IoError> {
    if !is_pending(folder) {
        return Ok(());
    }
    let path = folder.join(JOURNAL);
    let journal: Journal =
        serde_json::from_slice(&files::read(&path, MAX_BYTES)?).map_err(|e| files::json_error(&path, &e))?;
    // Names alone: a journal from elsewhere must not reach outside the folder.
    let plain = |name: &str| !name.is_empty() && !name.contains(['/', '\\']) && name != ".." && name != ".";
    let names = journal.put.iter().map(|(_, to)| to).chain(&journal.remove);
    if !journal.put.iter().all(|(from, _)| is_temporary(from) && plain(from)) || !names.clone().all(|n| plain(n)) {
        return Err(IoError::syntax(&path, "names", "they are not those of an interrupted save; remove the file"));
    }
    let rename = || {
        for (from, to) in &journal.put {
            match fs::rename(folder.join(from), folder.join(to)) {
                // It was renamed before the interruption.
                Err(e) if e.kind() == io::ErrorKind::NotFound => {}
                done => done?,
            }
        }
        for name in &journal.remove {
            match fs::remove_file(folder.join(name)) {
                Err(e) if e.kind() == io::ErrorKind::NotFound => {}
                done => done?,
            }
        }
        sync_folder(folder)?;
        fs::remove_file(&path)?;
        sync_folder(folder)
    };
    rename().map_err(|cause| write_error(&path, cause))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change<'a>(folder: &'a Path, to: &str) -> Commit<'a> {
        let mut c = Commit::new(folder);
        for name in ["a", "b"] {
            c.add(name, |w| w.write_all(to.as_bytes())).expect("written");
        }
        c.remove("c");
        c
    }

    fn state(folder: &Path) -> Vec<(String, String)> {
        let entry = |e: io::Result<fs::DirEntry>| {
            let e = e.expect("entry");
            (e.file_name().to_string_lossy().into_owned(), fs::read_to_string(e.path()).expect("text"))
        };
        let mut all: Vec<_> = fs::read_dir(folder).expect("list").map(entry).collect();
        all.sort();
        all
    }

    fn of(texts: &[(&str, &str)]) -> Vec<(String, String)> {
        texts.iter().map(|(a, b)| ((*a).into(), (*b).into())).collect()
    }

    #[test]
    fn all_change_or_none() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["a", "b", "c"] {
            fs::write(folder.path().join(name), "old").expect("written");
        }
        drop(change(folder.path(), "never"));
        assert_eq!(state(folder.path()), of(&[("a", "old"), ("b", "old"), ("c", "old")]));
        change(folder.path(), "new").finish().expect("finished");
        assert_eq!(state(folder.path()), of(&[("a", "new"), ("b", "new")]));
        let mut full = change(folder.path(), "more");
        full.add("d", |_| Err(io::ErrorKind::StorageFull.into())).expect_err("full");
        drop(full);
        assert_eq!(state(folder.path()), of(&[("a", "new"), ("b", "new")]));
    }

    /// Interrupted after the decision and after any number of renames, the change is completed by the next process.
    #[test]
    fn what_was_decided_is_carried_out_by_whoever_comes_next() {
        for renamed in 0..=2 {
            let folder = tempfile::tempdir().expect("folder");
            for name in ["a", "b", "c"] {
                fs::write(folder.path().join(name), "old").expect("written");
            }
            let put: Vec<_> = ["a", "b"].map(|n| (format!(".{n}.fmlgs-1.tmp"), n.to_owned())).into();
            for (from, to) in &put {
                fs::write(folder.path().join(from), "new").expect("written");
                if put.iter().position(|p| &p.1 == to).expect("there") < renamed {
                    fs::rename(folder.path().join(from), folder.path().join(to)).expect("renamed");
                }
            }
            let journal = Journal { put, remove: vec!["c".into()] };
            fs::write(folder.path().join(JOURNAL), serde_json::to_vec(&journal).expect("json")).expect("written");
            super::super::temporary::sweep(folder.path());
            carry_out(folder.path()).expect("carried out");
            carry_out(folder.path()).expect("nothing to do");
            assert_eq!(state(folder.path()), of(&[("a", "new"), ("b", "new")]), "{renamed}");
        }
    }

    #[test]
    fn a_journal_that_reaches_out_of_the_folder_is_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let inner = folder.path().join("scene");
        fs::create_dir(&inner).expect("created");
        fs::write(folder.path().join("precious"), "x").expect("written");
        for text in [
            r#"{"put": [], "remove": ["../precious"]}"#,
            r#"{"put": [["../precious", "a"]], "remove": []}"#,
            r#"{"put": [["precious", "a"]], "remove": []}"#,
            r#"{"put": [], "remove": [".."]}"#,
            "{",
        ] {
            fs::write(inner.join(JOURNAL), text).expect("written");
            assert!(carry_out(&inner).is_err(), "{text}");
        }
        assert!(folder.path().join("precious").exists());
    }

    #[test]
    fn what_cannot_be_carried_out_stays_decided() {
        let journals = [(vec![(".a.fmlgs-1.tmp".into(), "a".into())], vec![]), (vec![], vec!["a".into()])];
        for (put, remove) in journals {
            let folder = tempfile::tempdir().expect("folder");
            let at = |name: &str| folder.path().join(name);
            // A folder that is not empty: nothing is renamed over it, and it is not removed as a file.
            fs::create_dir_all(at("a/full")).expect("created");
            fs::write(at(".a.fmlgs-1.tmp"), "new").expect("written");
            fs::write(at(JOURNAL), serde_json::to_vec(&Journal { put, remove }).expect("json")).expect("written");
            carry_out(folder.path()).expect_err("in the way");
            assert!(at(".a.fmlgs-1.tmp").exists() && is_pending(folder.path()));
        }
    }
}
