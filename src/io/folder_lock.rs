//! One writer per folder: a file in it is locked for as long as a process writes there.
//!
//! The system frees the lock of a process that ends, however it ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use super::IoError;
use super::error::write_error;

pub(super) const FILE: &str = ".fmlgs.lock";
/// Longest description of the lock's holder that is read, bytes.
const MAX_BYTES: u64 = 200;

/// A folder locked for writing by this process.
#[derive(Debug)]
pub(crate) struct FolderLock {
    folder: PathBuf,
    /// Locked until it is closed.
    _file: File,
}

impl FolderLock {
    /// Locks `folder`, which exists, for `what` ("training").
    pub(crate) fn take(folder: &Path, what: &str) -> Result<Self, IoError> {
        let path = folder.join(FILE);
        let failed = |cause| write_error(&path, cause);
        loop {
            let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = options.map_err(failed)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = file.take(MAX_BYTES).read_to_string(&mut holder);
                    let holder = if holder.is_empty() { "another process".into() } else { holder };
                    return Err(IoError::Busy { folder: folder.into(), holder });
                }
                // Some network file systems have no locks; users there have to take care.
                Err(TryLockError::Error(e)) if e.kind() != io::ErrorKind::Unsupported => return Err(failed(e)),
                _ => {}
            }
            // The previous holder may have removed the file between opening and locking.
            if !is_at(&file, &path) {
                continue;
            }
            let told = format!("{}({what})", process());
            // Shown to users only, so a full disk does not matter.
            let _ = file.set_len(0).and_then(|()| file.rewind()).and_then(|()| file.write_all(told.as_bytes()));
            return Ok(Self { folder: folder.into(), _file: file });
        }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }
}

/// Process that writes into a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FolderHolder {
    /// Its work, such as "training"; empty if it did not say.
    pub(crate) what: String,
    /// True if it is this process.
    pub(crate) is_own: bool,
}

/// Returns the process that has locked `folder`, if one has.
pub(crate) fn holder(folder: &Path) -> Option<FolderHolder> {
    let file = File::open(folder.join(FILE)).ok()?;
    if !matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) {
        return None;
    }
    let mut told = String::new();
    let _ = file.take(MAX_BYTES).read_to_string(&mut told);
    let what = told.split_once('(').and_then(|(_, what)| what.strip_suffix(')')).unwrap_or_default();
    Some(FolderHolder { what: what.into(), is_own: told.starts_with(&process()) })
}

/// Beginning of the description of this process.
fn process() -> String {
    format!("process {} ", std::process::id())
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Removed while it is still locked, so that it cannot be another process's lock.
        if cfg!(unix) {
            let _ = fs::remove_file(self.folder.join(FILE));
        }
    }
}

/// Returns whether `file` is still the file at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |m: fs::Metadata| (m.dev(), m.ino());
    matches!((file.metadata().map(id), fs::metadata(path).map(id)), (Ok(a), Ok(b)) if a == b)
}

/// Always true: outside of Unix the lock file is never removed.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_is_told_of_the_first() {
        let folder = tempfile::tempdir().expect("folder");
        let first = FolderLock::take(folder.path(), "training").expect("free");
        let e = FolderLock::take(folder.path(), "finding objects").expect_err("taken");
        let text = e.to_string();
        assert!(text.contains("training") && text.contains(&std::process::id().to_string()), "{text}");
        assert_eq!(holder(folder.path()), Some(FolderHolder { what: "training".into(), is_own: true }));
        drop(first);
        assert_eq!(holder(folder.path()), None);
        drop(FolderLock::take(folder.path(), "finding objects").expect("free again"));
        assert_eq!(fs::read_dir(folder.path()).expect("list").count(), usize::from(!cfg!(unix)));
        // A lock file left by a killed process blocks nobody.
        fs::write(folder.path().join(FILE), "process 1 (training)").expect("written");
        assert_eq!(holder(folder.path()), None, "the control: nobody holds it");
        let other = File::open(folder.path().join(FILE)).expect("there");
        other.lock().expect("locked");
        assert_eq!(holder(folder.path()), Some(FolderHolder { what: "training".into(), is_own: false }));
        drop(other);
        drop(FolderLock::take(folder.path(), "training").expect("free"));
        assert!(FolderLock::take(&folder.path().join("missing"), "x").is_err());
    }
}
