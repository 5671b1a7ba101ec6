//! Temporary files beside their final place, and the removal of leftovers of killed processes.
//!
//! A process holds the lock of every temporary file that it writes, and the system frees the locks of a process that
//! ends. So a temporary file that can be locked is a leftover.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{Builder, NamedTempFile, TempDir};

use super::files::folder_of;
use super::scene_files::is_pending;

/// Part of the name of every temporary file, and of no other.
const MARK: &str = ".fmlgs-";

/// Returns whether a name is that of a temporary file of this program.
pub(super) fn is_temporary(name: &str) -> bool {
    name.starts_with('.') && name.contains(MARK)
}

/// Creates an empty temporary file beside `path`, its name ending in `.extension`.
pub(super) fn temporary_file(path: &Path, extension: &str) -> io::Result<NamedTempFile> {
    let name = path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "not a file name"))?;
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "a folder of that name exists"));
    }
    let folder = folder_of(path);
    sweep_once(folder);
    let (prefix, suffix) = (prefix(name), format!(".{extension}"));
    loop {
        let mut builder = Builder::new();
        builder.prefix(&prefix).suffix(&suffix);
        // Temporary files are private by default; the finished one has the usual permissions.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder)?;
        // Another process may have swept it before it was locked.
        if hold(file.as_file()) && file.path().exists() {
            return Ok(file);
        }
    }
}

/// A temporary folder that is protected from sweeping for as long as this lives.
pub(crate) struct TemporaryFolder {
    /// The folder; removed when this is dropped.
    pub(crate) folder: TempDir,
    _held: Option<File>,
}

/// Creates an empty temporary folder in `parent` for the final `name`.
pub(crate) fn temporary_folder(parent: &Path, name: &str) -> io::Result<TemporaryFolder> {
    sweep_once(parent);
    loop {
        let mut builder = Builder::new();
        let prefix = prefix(name.as_ref());
        builder.prefix(&prefix).suffix(".tmp");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent)?;
        // Not every system opens folders as files; those that do not are not swept either.
        let held = File::open(folder.path()).ok();
        if held.as_ref().is_none_or(hold) && folder.path().exists() {
            return Ok(TemporaryFolder { folder, _held: held });
        }
    }
}

fn prefix(name: &std::ffi::OsStr) -> std::ffi::OsString {
    let mut prefix = std::ffi::OsString::from(".");
    prefix.push(name);
    prefix.push(MARK);
    prefix
}

/// Locks a file of this process; `true` also if the file system has no locks.
fn hold(file: &File) -> bool {
    !cfg!(unix) || !matches!(file.try_lock(), Err(fs::TryLockError::WouldBlock))
}

/// [`sweep`], the first time that this process comes to a folder.
fn sweep_once(folder: &Path) {
    static SWEPT: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);
    let mut swept = SWEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if swept.get_or_insert_default().insert(folder.into()) {
        sweep(folder);
    }
}

/// Removes the temporary files and folders in `folder` that no process holds. Files that cannot be removed stay:
/// nothing depends on them.
pub(super) fn sweep(folder: &Path) {
    if !cfg!(unix) {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !is_temporary(&entry.file_name().to_string_lossy()) {
            continue;
        }
        let path = entry.path();
        let Ok(file) = File::open(&path) else { continue };
        // Checked under the lock: files of a decided save must stay.
        if file.try_lock().is_err() || is_pending(folder) {
            continue;
        }
        let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
        let _ = if is_folder { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_holds_is_swept_away() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        let held = temporary_file(&at("a.bin"), "tmp").expect("file");
        let held_folder = temporary_folder(folder.path(), "frames").expect("folder");
        let dead = temporary_file(&at("b.bin"), "mp4").expect("file").keep().expect("kept").1;
        let dead_folder = temporary_folder(folder.path(), "frames").expect("folder").folder.keep();
        fs::write(dead_folder.join("frame"), "x").expect("written");
        // Names of other programs, similar to those of this one.
        let others = [at(".hidden"), at(".a.bin.tmp"), at("a.fmlgs-b.tmp")];
        others.iter().for_each(|o| fs::write(o, "x").expect("written"));
        sweep(folder.path());
        assert!(held.path().exists() && held_folder.folder.path().exists());
        assert!(!dead.exists() && !dead_folder.exists());
        assert!(others.iter().all(|o| o.exists()));
        drop((held, held_folder));
        assert_eq!(fs::read_dir(folder.path()).expect("list").count(), others.len());
    }

    #[test]
    fn the_first_write_into_a_folder_clears_what_a_killed_process_left() {
        let folder = tempfile::tempdir().expect("folder");
        for make in
            [|f: &Path| drop(temporary_file(&f.join("a.bin"), "tmp")), |f: &Path| drop(temporary_folder(f, "b"))]
        {
            let here = tempfile::tempdir_in(folder.path()).expect("folder");
            let dead = here.path().join(".a.bin.fmlgs-1.tmp");
            fs::write(&dead, "x").expect("written");
            make(here.path());
            assert!(!dead.exists());
        }
    }
}
