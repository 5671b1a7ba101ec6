//! The folder of an export: only files that an export wrote and that are unchanged since are replaced.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::io::error::write_error;
use crate::io::folder_lock::FolderLock;
use crate::io::{IoError, atomic, files};
use crate::jobs::{JobError, export};

/// File name of the list of exported files.
pub(super) const LIST: &str = "export.json";
/// File name of the journal of a running export: "- PLACE" before a file is there, "SHA256 PLACE" once it is. It tells
/// files of a killed export from files of others.
const BEGUN: &str = ".export-begun";

#[derive(Default, Serialize, Deserialize)]
struct List {
    /// True if the export finished.
    complete: bool,
    /// SHA-256 of each file, by its place in the folder.
    files: BTreeMap<String, String>,
}

/// A folder that an export writes into.
pub(super) struct ExportFolder {
    root: PathBuf,
    /// Files of an earlier export.
    before: BTreeMap<String, String>,
    now: BTreeMap<String, String>,
    /// Places where a killed export was about to write.
    begun: BTreeSet<String>,
    journal: fs::File,
    _lock: FolderLock,
}

impl ExportFolder {
    /// Creates or reopens a folder.
    ///
    /// # Errors
    /// If it holds anything but an earlier export, or files of that were changed.
    pub(super) fn open(root: &Path) -> Result<Self, JobError> {
        export::make_folder(root)?;
        let lock = FolderLock::take(root, "exporting")?;
        let hidden = |e: &fs::DirEntry| e.file_name().to_string_lossy().starts_with('.');
        let holds_something = fs::read_dir(root).is_ok_and(|all| all.flatten().any(|e| !hidden(&e)));
        let list = root.join(LIST);
        let mut before = match list.is_file() {
            true => files::read_json::<List>(&list)?.files,
            false if holds_something => {
                let what = "holds something that 'fmlgs segment --all' has not written";
                return Err(IoError::Occupied { folder: root.into(), what }.into());
            }
            false => BTreeMap::new(),
        };
        let path = root.join(BEGUN);
        let failed = |cause| write_error(&path, cause);
        let mut begun = BTreeSet::new();
        let text = if path.is_file() { files::read_text(&path)? } else { String::new() };
        for (sum, place) in text.lines().filter_map(|line| line.split_once(' ')) {
            if sum == "-" {
                before.remove(place);
                begun.insert(place.to_owned());
            } else {
                begun.remove(place);
                before.insert(place.to_owned(), sum.to_owned());
            }
        }
        let journal = fs::File::options().append(true).create(true).open(&path).map_err(failed)?;
        let folder = Self { root: root.into(), before, now: BTreeMap::new(), begun, journal, _lock: lock };
        for (place, sum) in &folder.before {
            folder.is_as_written(place, sum)?;
        }
        folder.save(&folder.before, false)?;
        Ok(folder)
    }

    /// Returns whether a file of an earlier export is there; fails if it was changed.
    fn is_as_written(&self, place: &str, sum: &str) -> Result<bool, JobError> {
        let path = self.root.join(place);
        if !is_within(place) || !path.is_file() {
            return Ok(false);
        }
        if files::sha256(&path)? == sum {
            return Ok(true);
        }
        let text =
            format!("{} has been changed since it was exported: move it, or choose another folder", path.display());
        Err(JobError::Output(text))
    }

    /// Writes a file at a place in the folder by `fill`, which writes the whole file or nothing.
    pub(super) fn write(
        &mut self,
        place: &str,
        fill: impl FnOnce(&Path) -> Result<(), IoError>,
    ) -> Result<(), JobError> {
        let path = self.root.join(place);
        let is_listed = self.before.get(place).map(|sum| self.is_as_written(place, sum)).transpose()?;
        let is_ours = is_listed == Some(true) || (is_listed.is_none() && self.begun.contains(place));
        if !is_ours && path.exists() {
            let text = format!("{} is there and was not exported: move it, or choose another folder", path.display());
            return Err(JobError::Output(text));
        }
        export::make_parent(&path)?;
        // Files are written whole or not at all, so a file found there later is ours.
        self.note("-", place)?;
        fill(&path)?;
        let sum = files::sha256(&path)?;
        self.note(&sum, place)?;
        self.now.insert(place.to_owned(), sum);
        Ok(())
    }

    fn note(&mut self, sum: &str, place: &str) -> Result<(), JobError> {
        Ok(writeln!(self.journal, "{sum} {place}").map_err(|cause| write_error(&self.root.join(BEGUN), cause))?)
    }

    /// Removes files of the earlier export that this one did not write, if this one is complete, and writes the list.
    pub(super) fn close(self, complete: bool) -> Result<(), JobError> {
        let mut files = self.now.clone();
        for (place, sum) in self.before.iter().filter(|(place, _)| !self.now.contains_key(*place)) {
            if complete && self.is_as_written(place, sum)? {
                let path = self.root.join(place);
                let remedy = "an earlier export's file cannot be removed: choose another folder";
                fs::remove_file(&path).map_err(|cause| IoError::Write { path, remedy, cause })?;
            } else if !complete {
                files.insert(place.clone(), sum.clone());
            }
        }
        // Files of a killed export that this one does not write are listed from now on.
        for place in
            self.begun.iter().filter(|place| !self.now.contains_key(*place) && !self.before.contains_key(*place))
        {
            let path = self.root.join(place);
            if is_within(place) && path.is_file() {
                match complete {
                    true => fs::remove_file(&path).map_err(|cause| write_error(&path, cause))?,
                    false => drop(files.insert(place.clone(), files::sha256(&path)?)),
                }
            }
        }
        self.save(&files, complete)?;
        let journal = self.root.join(BEGUN);
        fs::remove_file(&journal).map_err(|cause| write_error(&journal, cause).into())
    }

    fn save(&self, files: &BTreeMap<String, String>, complete: bool) -> Result<(), JobError> {
        let list = List { complete, files: files.clone() };
        Ok(atomic::write(&self.root.join(LIST), |w| Ok(serde_json::to_writer_pretty(w, &list)?))?)
    }
}

/// Returns whether a place lies in the folder: a forged list must not lead elsewhere.
fn is_within(place: &str) -> bool {
    Path::new(place).components().all(|c| matches!(c, std::path::Component::Normal(_)))
}
