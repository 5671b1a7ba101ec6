//! Installs official files as published: the ONNX Runtime library from its archive, and ready graphs.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

use flate2::read::GzDecoder;
use serde_json::json;
use sha2::{Digest, Sha256};
use tar::{Archive, EntryType};
use zip::ZipArchive;

use super::engine::engine;
use super::template::{failed, put_in_place};
use super::{ModelError, lama};
use crate::io::files::hex;
use crate::io::temporary::temporary_folder;

/// Largest library, bytes; the CPU releases have 20 to 40 MB.
const MOST: u64 = 512 << 20;
/// Most unpacked bytes of an archive that are searched for it.
const MOST_UNPACKED: u64 = 4 << 30;

/// Extracts the library from an archive to the file `name` in `folder`, and writes its description: both or neither.
/// Names inside the archive only select the entry, never the output path.
pub(super) fn library(archive: &Path, name: &str, folder: &Path, description: &str) -> Result<(), ModelError> {
    let refused = |problem: String| ModelError::Metadata { path: archive.into(), problem };
    let mut file = crate::io::files::open(archive).map_err(|e| refused(e.to_string()))?;
    let bytes = found(&mut file, name).map_err(refused)?;
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
    let held = temporary_folder(folder, description).map_err(|e| failed(folder, e))?;
    let draft = held.folder.path();
    let path = draft.join(name);
    let written = File::create(&path).and_then(|mut out| out.write_all(&bytes).and_then(|()| out.sync_all()));
    written.map_err(|e| failed(&path, e))?;
    let about = json!({
        "version": 1, "kind": "engine",
        "checkpoint_sha256": super::fetch::sha256(archive).map_err(|e| failed(archive, e))?,
        "graphs": { "library": { "file": name, "bytes": bytes.len(), "sha256": hex(&Sha256::digest(&bytes)) } },
    });
    put_in_place(draft, folder, vec![name.to_owned()], description, &about)
}

/// Copies a ready graph to the file `name` in `folder`, and writes its description: both or neither.
pub(super) fn graph(graph: &Path, name: &str, folder: &Path, description: &str) -> Result<(), ModelError> {
    engine()?.load_file(graph)?;
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
    let held = temporary_folder(folder, description).map_err(|e| failed(folder, e))?;
    let draft = held.folder.path();
    let bytes = std::fs::copy(graph, draft.join(name)).map_err(|e| failed(graph, e))?;
    let sha256 = super::fetch::sha256(&draft.join(name)).map_err(|e| failed(graph, e))?;
    put_in_place(draft, folder, vec![name.to_owned()], description, &lama::description(name, bytes, &sha256))
}

/// Returns whether a file in an archive is the library, which may have its version in its name.
fn is_library(path: &Path, name: &str) -> bool {
    let Some(file) = path.file_name().and_then(|n| n.to_str()) else { return false };
    // libonnxruntime.so.1.24.4, libonnxruntime.1.24.4.dylib
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let version = |rest: &str| rest.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    file.strip_prefix(name).is_some_and(version)
        || file.strip_prefix(stem).and_then(|rest| rest.strip_suffix(ending)).is_some_and(version)
}

/// Finds the library in an archive and returns its bytes.
fn found(file: &mut File, name: &str) -> Result<Vec<u8>, String> {
    let mut start = [0; 2];
    let read = file.read_exact(&mut start).and_then(|()| file.seek(SeekFrom::Start(0)));
    let broken = |e: &dyn std::fmt::Display| format!("the archive is broken: {e}; the download may be incomplete");
    read.map_err(|e| broken(&e))?;
    match &start {
        [0x1f, 0x8b] => {
            // Whatever size the archive states, no more than this is unpacked.
            let mut archive = Archive::new(GzDecoder::new(BufReader::new(file)).take(MOST_UNPACKED));
            for entry in archive.entries().map_err(|e| broken(&e))? {
                let entry = entry.map_err(|e| broken(&e))?;
                let path = entry.path().map_err(|e| broken(&e))?.into_owned();
                if entry.header().entry_type() == EntryType::Regular && is_library(&path, name) {
                    let bytes = entry.size();
                    return whole(entry, bytes);
                }
            }
        }
        b"PK" => {
            let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|e| broken(&e))?;
            for i in 0..archive.len() {
                let entry = archive.by_index(i).map_err(|e| broken(&e))?;
                let path = entry.enclosed_name().unwrap_or_default();
                if entry.is_file() && is_library(&path, name) {
                    let bytes = entry.size();
                    return whole(entry, bytes);
                }
            }
        }
        _ => return Err("it is neither a .tgz nor a .zip archive".into()),
    }
    Err(format!("no '{name}' is in it; it is another archive"))
}

/// Reads an entry whole; its length must be the stated one.
fn whole(entry: impl Read, stated: u64) -> Result<Vec<u8>, String> {
    if stated > MOST {
        return Err(format!("its library has {stated} bytes, more than the {MOST} that are possible"));
    }
    let mut bytes = Vec::new();
    // One more byte reveals an entry that is longer than stated.
    entry.take(stated + 1).read_to_end(&mut bytes).map_err(|e| format!("its library cannot be read: {e}"))?;
    if bytes.len() as u64 != stated || bytes.is_empty() {
        return Err(format!("its library has {} of the {stated} bytes that are stated", bytes.len()));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tgz(entries: &[(&str, EntryType, &[u8])]) -> Vec<u8> {
        let mut archive = tar::Builder::new(flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast()));
        for (name, kind, bytes) in entries {
            let mut header = tar::Header::new_gnu();
            // Written directly, because the crate refuses such a name.
            header.as_old_mut().name[..name.len()].copy_from_slice(name.as_bytes());
            header.set_entry_type(*kind);
            header.set_size(bytes.len() as u64);
            header.set_cksum();
            archive.append(&header, *bytes).expect("appended");
        }
        archive.into_inner().expect("a file").finish().expect("finished")
    }

    const SO: &str = "libonnxruntime.so";

    fn taken(archive: &[u8]) -> Result<(Vec<u8>, usize), String> {
        let folder = tempfile::tempdir().expect("folder");
        let (from, to) = (folder.path().join("a"), folder.path().join("models/deep"));
        std::fs::write(&from, archive).expect("written");
        let done = library(&from, SO, &to, "onnxruntime.json");
        let here = std::fs::read_dir(folder.path()).expect("a folder").count();
        let left = std::fs::read_dir(&to).map_or(0, Iterator::count);
        assert!(here <= 2 && (left == 0 || done.is_ok()), "nothing is left of what was refused");
        done.map_err(|e| e.to_string())?;
        for graph in super::super::manifest::graphs(&to.join("onnxruntime.json")).expect("a description") {
            graph.check(&to).expect("described as it is");
        }
        Ok((std::fs::read(to.join(SO)).expect("there"), left))
    }

    #[test]
    fn the_library_and_nothing_else_is_taken_out() {
        use EntryType::{Regular, Symlink};
        let all = tgz(&[
            ("x/lib/libonnxruntime.so", Symlink, b""),
            ("x/lib/libonnxruntime_providers_shared.so", Regular, b"other"),
            ("x/lib/libonnxruntime.so.1.24.4", Regular, b"the library"),
        ]);
        assert_eq!(taken(&all).expect("taken"), (b"the library".to_vec(), 2));
        // A path in the archive leads nowhere.
        let outside = tgz(&[("../../libonnxruntime.so.1.2", Regular, b"the library")]);
        assert_eq!(taken(&outside).expect("taken").1, 2);
        assert!(is_library(Path::new("lib/libonnxruntime.1.24.4.dylib"), "libonnxruntime.dylib"));
        assert!(is_library(Path::new("lib/onnxruntime.dll"), "onnxruntime.dll"));
        assert!(!is_library(Path::new("lib/onnxruntime_providers_shared.dll"), "onnxruntime.dll"));
        for (bytes, says) in [
            (tgz(&[("x/lib/libonnxruntime.so", Symlink, b"")]), "no 'libonnxruntime.so'"),
            (tgz(&[("libonnxruntime.so", Regular, b"")]), "0 of the 0 bytes"),
            (b"hello".to_vec(), "neither"),
            (b"P".to_vec(), "broken"),
        ] {
            let error = taken(&bytes).expect_err(says);
            assert!(error.contains(says), "{says}: {error}");
        }
        let noise: Vec<u8> = (0..60_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        let whole = tgz(&[("libonnxruntime.so", Regular, &noise)]);
        for i in 0..50 {
            assert!(taken(&whole[..whole.len() * i / 50]).is_err(), "cut at {i} of 50");
        }
    }

    #[test]
    fn archives_of_windows_are_zip_files() {
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        let options = zip::write::SimpleFileOptions::default();
        for (name, bytes) in [("x/readme", &b"hello"[..]), ("x/lib/libonnxruntime.so", b"the library")] {
            zip.start_file(name, options).expect("started");
            zip.write_all(bytes).expect("written");
        }
        let bytes = zip.finish().expect("finished").into_inner();
        assert_eq!(taken(&bytes).expect("taken").0, b"the library");
    }
}
