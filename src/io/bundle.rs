//! Archives of files that the program ships: packed reproducibly, unpacked completely or not at all.

use std::fs;
use std::io::{self, Cursor, Read, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::IoError;
use super::error::write_error;
use super::files::folder_of;
use super::temporary::temporary_folder;

/// Packs files with their names (`photos/a.jpg`) into an archive. The same files make the same bytes.
pub(crate) fn pack(files: &[(String, Vec<u8>)]) -> io::Result<Vec<u8>> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(9))
        .last_modified_time(zip::DateTime::default());
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(name, options).map_err(io::Error::other)?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish().map_err(io::Error::other)?.into_inner())
}

/// Reads one file of the archive; `path` is for errors.
///
/// # Errors
/// If the archive is broken, or has no such file.
pub(crate) fn read(bytes: &[u8], name: &str, path: &Path) -> Result<Vec<u8>, IoError> {
    let broken = |e: &dyn std::fmt::Display| broken(path, name, e);
    let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
    let mut content = Vec::new();
    zip.by_name(name).map_err(|e| broken(&e))?.read_to_end(&mut content).map_err(|e| broken(&e))?;
    Ok(content)
}

/// Lists the files of the archive with their sizes in bytes; `path` is for errors.
///
/// # Errors
/// If the archive is broken.
pub(crate) fn sizes(bytes: &[u8], path: &Path) -> Result<Vec<(String, u64)>, IoError> {
    let broken = |e: zip::result::ZipError| broken(path, "the archive", &e);
    let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(broken)?;
    let count = zip.len();
    let mut of = |i: usize| {
        let file = zip.by_index(i)?;
        Ok((file.name()?.into_owned(), file.size()))
    };
    (0..count).map(|i| of(i).map_err(broken)).collect()
}

/// Unpacks the archive into `folder`, which must not exist. On an error the folder still does not exist.
///
/// # Errors
/// If the archive is broken, names a place outside the folder, or the folder cannot be made.
pub(crate) fn unpack(bytes: &[u8], folder: &Path) -> Result<(), IoError> {
    let failed = |cause| write_error(folder, cause);
    let parent = folder_of(folder);
    fs::create_dir_all(parent).map_err(failed)?;
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let draft = temporary_folder(parent, &name).map_err(failed)?;
    let mut zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(folder, "the archive", &e))?;
    for i in 0..zip.len() {
        let mut file = zip.by_index(i).map_err(|e| broken(folder, "the archive", &e))?;
        let inside = file.enclosed_name().ok_or_else(|| broken(folder, "a name", &"it leaves the folder"))?;
        let to = draft.folder.path().join(inside);
        let mut write = || {
            fs::create_dir_all(folder_of(&to))?;
            let mut out = fs::File::create(&to)?;
            io::copy(&mut file, &mut out)?;
            out.sync_all()
        };
        write().map_err(failed)?;
    }
    fs::rename(draft.folder.path(), folder).map_err(failed)?;
    let _ = draft.folder.keep();
    Ok(())
}

fn broken(path: &Path, place: &str, reason: &dyn std::fmt::Display) -> IoError {
    IoError::Syntax { path: path.into(), place: place.into(), reason: reason.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files() -> Vec<(String, Vec<u8>)> {
        vec![("a.txt".into(), b"one".to_vec()), ("deep/er/b.bin".into(), vec![7; 10_000])]
    }

    #[test]
    fn what_is_packed_is_unpacked_and_always_alike() {
        let bytes = pack(&files()).expect("packed");
        assert_eq!(bytes, pack(&files()).expect("again"));
        assert!(bytes.len() < 1_000, "compressed: {}", bytes.len());
        assert_eq!(read(&bytes, "a.txt", Path::new("x")).expect("read"), b"one");
        assert!(read(&bytes, "c.txt", Path::new("x.zip")).expect_err("missing").to_string().contains("x.zip"));
        let place = tempfile::tempdir().expect("folder");
        let folder = place.path().join("new/demo");
        unpack(&bytes, &folder).expect("unpacked");
        for (name, content) in files() {
            assert_eq!(fs::read(folder.join(name)).expect("there"), content);
        }
        let left = fs::read_dir(place.path().join("new")).expect("read").count();
        assert_eq!(left, 1, "nothing temporary stays");
    }

    #[test]
    fn what_is_there_is_kept_and_what_is_broken_leaves_nothing() {
        let place = tempfile::tempdir().expect("folder");
        let folder = place.path().join("demo");
        let bytes = pack(&files()).expect("packed");
        for bad in [bytes[..bytes.len() - 30].to_vec(), pack(&[("../out".into(), vec![1])]).expect("packed")] {
            unpack(&bad, &folder).expect_err("refused");
            assert!(!folder.exists() && !place.path().join("out").exists());
        }
        fs::create_dir(&folder).expect("made");
        fs::write(folder.join("own"), "mine").expect("written");
        unpack(&bytes, &folder).expect_err("occupied");
        assert_eq!(fs::read(folder.join("own")).expect("kept"), b"mine");
        assert_eq!(fs::read_dir(&folder).expect("read").count(), 1);
    }
}
