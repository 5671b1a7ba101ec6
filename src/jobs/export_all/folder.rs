//! The folder of an export: nothing in it is replaced but what an export has written and nobody has changed since.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::io::folder_lock::FolderLock;
use crate::io::{IoError, atomic, files};
use crate::jobs::{JobError, export};

/// Says what an export has written.
pub(super) const LIST: &str = "export.json";

#[derive(Default, Serialize, Deserialize)]
struct List {
    /// Whether the export came to its end.
    complete: bool,
    /// SHA-256 of each file, by its place in the folder.
    files: BTreeMap<String, String>,
}

/// A folder that an export writes into.
pub(super) struct ExportFolder {
    root: PathBuf,
    /// As an earlier export has left it.
    before: BTreeMap<String, String>,
    now: BTreeMap<String, String>,
    _lock: FolderLock,
}

impl ExportFolder {
    /// Makes or takes over a folder.
    ///
    /// # Errors
    /// If it holds anything, unless that is of an earlier export; if somebody has changed what that wrote.
    pub(super) fn open(root: &Path) -> Result<Self, JobError> {
        export::make_folder(root)?;
        let lock = FolderLock::take(root, "exporting")?;
        let hidden = |e: &fs::DirEntry| e.file_name().to_string_lossy().starts_with('.');
        let holds_something = fs::read_dir(root).is_ok_and(|all| all.flatten().any(|e| !hidden(&e)));
        let list = root.join(LIST);
        let before = match list.is_file() {
            true => files::read_json::<List>(&list)?.files,
            false if holds_something => {
                let what = "holds something that 'fmlgs segment --all' has not written";
                return Err(IoError::Occupied { folder: root.into(), what }.into());
            }
            false => BTreeMap::new(),
        };
        let folder = Self { root: root.into(), before, now: BTreeMap::new(), _lock: lock };
        for (place, sum) in &folder.before {
            folder.is_as_written(place, sum)?;
        }
        folder.save(&folder.before, false)?;
        Ok(folder)
    }

    /// Whether a file of an earlier export is there.
    fn is_as_written(&self, place: &str, sum: &str) -> Result<bool, JobError> {
        let path = self.root.join(place);
        // A list that somebody wrote leads nowhere else.
        let is_within = Path::new(place).components().all(|c| matches!(c, std::path::Component::Normal(_)));
        if !is_within || !path.is_file() {
            return Ok(false);
        }
        if files::sha256(&path)? == sum {
            return Ok(true);
        }
        let text =
            format!("{} has been changed since it was exported: move it, or choose another folder", path.display());
        Err(JobError::Output(text))
    }

    /// Writes a file at a place in the folder by `fill`, which writes at once or not at all.
    pub(super) fn write(
        &mut self,
        place: &str,
        fill: impl FnOnce(&Path) -> Result<(), IoError>,
    ) -> Result<(), JobError> {
        let path = self.root.join(place);
        let is_ours = self.before.get(place).map(|sum| self.is_as_written(place, sum)).transpose()?;
        if is_ours != Some(true) && path.exists() {
            let text = format!("{} is there and was not exported: move it, or choose another folder", path.display());
            return Err(JobError::Output(text));
        }
        export::make_parent(&path)?;
        fill(&path)?;
        self.now.insert(place.to_owned(), files::sha256(&path)?);
        Ok(())
    }

    /// Takes away what the earlier export has left, if this one is complete, and says what is here.
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
        self.save(&files, complete)
    }

    fn save(&self, files: &BTreeMap<String, String>, complete: bool) -> Result<(), JobError> {
        let list = List { complete, files: files.clone() };
        Ok(atomic::write(&self.root.join(LIST), |w| Ok(serde_json::to_writer_pretty(w, &list)?))?)
    }
}
