//! Atomic file writes: after an interruption the old file or the new one is there, never a mixture.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::IoError;
use super::error::write_error;
use super::files::{folder_of, sync_folder};
use super::scene_files::refuse_scene_file;
use super::temporary::temporary_file;

/// Progress callback with the number of Gaussians written; an error ends the writing.
pub(crate) type WriteProgress<'a> = dyn FnMut(usize) -> io::Result<()> + 'a;

/// Replaces `path` by the output of `fill`: a temporary file in the same folder is filled, synced and renamed over it,
/// and the folder is synced. On any failure the temporary file is removed and the old content of `path` stays. Links
/// are followed. A device or a pipe is written into.
pub(crate) fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), IoError> {
    let mut draft = Draft::create(path)?;
    fill(&mut draft).map_err(|cause| write_error(path, cause))?;
    draft.commit().map(drop)
}

/// A file being written: bytes go to a temporary file beside `path`, and [`Draft::commit`] puts that in place. Dropped
/// before that, it leaves nothing behind.
pub(crate) struct Draft {
    path: PathBuf,
    into: Into,
}

enum Into {
    /// A new file beside the old one.
    New(BufWriter<NamedTempFile>),
    /// A device or a pipe, which cannot be replaced.
    Stream(BufWriter<File>),
}

impl Draft {
    /// Starts a file at `path`; the old file stays until [`Draft::commit`].
    pub(crate) fn create(path: &Path) -> Result<Self, IoError> {
        let failed = |cause| write_error(path, cause);
        let real = behind_links(path).map_err(failed)?;
        refuse_scene_file(&real)?;
        if is_stream(&real) {
            let file = OpenOptions::new().write(true).open(&real).map_err(failed)?;
            return Ok(Self { path: path.into(), into: Into::Stream(BufWriter::with_capacity(1 << 20, file)) });
        }
        Self::beside(&real)
    }

    /// Starts a new file at `path`, which may be a file of a scene; the caller holds the scene's folder.
    pub(super) fn beside(path: &Path) -> Result<Self, IoError> {
        let file = temporary_file(path, "tmp").map_err(|cause| write_error(path, cause))?;
        Ok(Self { path: path.into(), into: Into::New(BufWriter::with_capacity(1 << 20, file)) })
    }

    /// Puts the file in its place and returns its size in bytes.
    ///
    /// # Errors
    /// [`IoError::Write`]; the old content of the path is then unchanged.
    pub(crate) fn commit(self) -> Result<u64, IoError> {
        let Self { path, into } = self;
        let end = || match into {
            Into::New(file) => {
                let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
                let bytes = file.as_file().metadata()?.len();
                put(file, &path)?;
                Ok(bytes)
            }
            Into::Stream(mut file) => {
                file.flush()?;
                Ok(0)
            }
        };
        end().map_err(|cause| write_error(&path, cause))
    }
}

impl Write for Draft {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.into {
            Into::New(file) => file.write(bytes),
            Into::Stream(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.into {
            Into::New(file) => file.flush(),
            Into::Stream(file) => file.flush(),
        }
    }
}

impl Seek for Draft {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.into {
            Into::New(file) => file.seek(to),
            Into::Stream(file) => file.seek(to),
        }
    }
}

/// Returns whether `path` is neither file nor folder, such as a device or a pipe; it is then written into.
pub(crate) fn is_stream(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Resolves the links of `path`, also if the end of the last one does not exist yet.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    /// Most links followed, as in Linux.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(to) => path = folder_of(&path).join(to),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("too many links that lead to one another"))
}

/// Syncs a temporary file, renames it to `path` and syncs the folder. It gets the permissions of the
/// file that it replaces.
pub(super) fn put(file: NamedTempFile, path: &Path) -> io::Result<()> {
    if let Ok(before) = fs::metadata(path).map(|m| m.permissions()) {
        file.as_file().set_permissions(before)?;
    }
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    sync_folder(folder_of(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("list")
            .map(|e| e.expect("entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn replaces_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        write(&path, |w| w.write_all(b"one")).expect("first");
        write(&path, |w| w.write_all(b"two")).expect("second");
        assert_eq!(fs::read(&path).expect("read"), b"two");
        assert_eq!(entries(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_draft_appears_when_it_is_committed() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        let mut draft = Draft::create(&path).expect("create");
        draft.write_all(b"x234").expect("write");
        draft.seek(SeekFrom::Start(0)).expect("seek");
        draft.write_all(b"1").expect("write");
        assert!(!path.exists());
        assert_eq!(draft.commit().expect("commit"), 4);
        assert_eq!(fs::read(&path).expect("read"), b"1234");
        let mut draft = Draft::create(&path).expect("create");
        draft.write_all(b"half").expect("write");
        drop(draft);
        assert_eq!(fs::read(&path).expect("read"), b"1234");
        assert_eq!(entries(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_full_disk_keeps_the_old_file() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        write(&path, |w| w.write_all(b"old")).expect("first");
        let e = write(&path, |w| {
            w.write_all(&[0; 1000])?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        })
        .expect_err("full");
        let text = e.to_string();
        assert!(matches!(&e, IoError::Write { cause, .. } if cause.kind() == io::ErrorKind::StorageFull));
        assert!(text.contains("a.bin") && text.contains("free some space"), "{text}");
        assert_eq!(fs::read(&path).expect("read"), b"old");
        assert_eq!(entries(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_missing_folder_or_a_folder_in_the_way_is_named() {
        let folder = tempfile::tempdir().expect("folder");
        let e = write(&folder.path().join("no/a.bin"), |w| w.write_all(b"x")).expect_err("missing");
        assert!(e.to_string().contains("does not exist"), "{e}");
        fs::create_dir(folder.path().join("b.bin")).expect("create");
        let e = write(&folder.path().join("b.bin"), |w| w.write_all(b"x")).expect_err("in the way");
        assert!(matches!(&e, IoError::Write { cause, .. } if cause.kind() == io::ErrorKind::IsADirectory));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_devices_written_into() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("deep")).expect("create");
        symlink("deep/real.bin", at("b.bin")).expect("link");
        symlink("b.bin", at("a.bin")).expect("link");
        for text in [b"one", b"two"] {
            write(&at("a.bin"), |w| w.write_all(text)).expect("written");
            assert_eq!(fs::read(at("deep/real.bin")).expect("read"), text);
        }
        assert!(at("a.bin").is_symlink() && at("b.bin").is_symlink());
        fs::set_permissions(at("deep/real.bin"), PermissionsExt::from_mode(0o600)).expect("permissions");
        write(&at("a.bin"), |w| w.write_all(b"private")).expect("written");
        assert_eq!(fs::metadata(at("deep/real.bin")).expect("there").permissions().mode() & 0o777, 0o600);

        // A pipe of its own: a fault here, run as root, must not replace a device of the system.
        let pipe = at("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        let source = pipe.clone();
        let reader = std::thread::Builder::new().name("reader".into());
        let reader = reader.spawn(move || fs::read(source).expect("read")).expect("thread");
        write(&pipe, |w| w.write_all(b"x")).expect("written into");
        assert!(fs::metadata(&pipe).expect("there").file_type().is_fifo());
        assert_eq!(reader.join().expect("reader"), b"x");
        symlink("d.bin", at("c.bin")).expect("link");
        symlink("c.bin", at("d.bin")).expect("link");
        assert!(write(&at("c.bin"), |w| w.write_all(b"x")).is_err(), "links without an end");
    }

    #[cfg(unix)]
    #[test]
    fn a_read_only_folder_is_named() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        write(&path, |w| w.write_all(b"old")).expect("first");
        fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o555)).expect("permissions");
        let result = write(&path, |w| w.write_all(b"new"));
        fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).expect("permissions");
        match result {
            Err(e) => {
                assert!(matches!(&e, IoError::Write { cause, .. } if cause.kind() == io::ErrorKind::PermissionDenied));
                assert!(e.to_string().contains("choose another folder"), "{e}");
                assert_eq!(fs::read(&path).expect("read"), b"old");
            }
            // The superuser may write anywhere.
            Ok(()) => assert_eq!(fs::read(&path).expect("read"), b"new"),
        }
    }
}
