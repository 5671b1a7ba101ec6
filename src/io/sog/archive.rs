//! Archive of a bundled SOG, read within limits.

use std::io::{Cursor, Read};
use std::path::Path;

use zip::ZipArchive;

use super::{META_FILE, missing};
use crate::io::IoError;

/// Most entries of an archive; a SOG has eight.
const MAX_ENTRIES: usize = 64;
/// Unpacked bytes allowed for every archive.
const FREE_BYTES: u64 = 1 << 20;
/// Unpacked bytes per further byte of the archive. Pictures hardly shrink, JSON by 20 at most.
const MAX_RATIO: u64 = 32;

pub(super) struct Archive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    /// Folder of `meta.json` in the archive, with its slash.
    prefix: String,
    /// Bytes that may still be unpacked.
    left: u64,
    limit: u64,
    path: &'a Path,
}

impl<'a> Archive<'a> {
    pub(super) fn open(bytes: &'a [u8], path: &'a Path) -> Result<Self, IoError> {
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(path, "the archive", &e.to_string()))?;
        if zip.len() > MAX_ENTRIES {
            return Err(IoError::Count {
                path: path.into(),
                what: "entries (a SOG archive holds eight)".into(),
                claimed: zip.len() as u64,
                possible: MAX_ENTRIES as u64,
            });
        }
        let mut prefix = None;
        for name in zip.file_names() {
            let name = name.map_err(|e| broken(path, "a name in the archive", &e.to_string()))?;
            if let Some(folder) = name.strip_suffix(META_FILE).filter(|f| f.is_empty() || f.ends_with('/')) {
                prefix = Some(folder.to_owned());
            }
        }
        let prefix = prefix.ok_or_else(|| missing(path, META_FILE))?;
        let limit = FREE_BYTES.saturating_add(MAX_RATIO.saturating_mul(bytes.len() as u64));
        Ok(Self { zip, prefix, left: limit, limit, path })
    }

    /// Unpacks the entry `name` beside `meta.json`.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, IoError> {
        let path = self.path;
        let full = format!("{}{name}", self.prefix);
        let place = format!("entry '{}'", name.chars().take(60).collect::<String>());
        let entry = match self.zip.by_name(&full) {
            Ok(entry) => entry,
            Err(zip::result::ZipError::FileNotFound) => return Err(missing(path, name)),
            Err(e) => return Err(broken(path, &place, &e.to_string())),
        };
        let over = |bytes| IoError::OverBudget {
            path: path.into(),
            what: "unpacking the archive",
            bytes,
            limit: self.limit,
            remedy: "it is no SOG archive",
        };
        if entry.size() > self.left {
            return Err(over(entry.size()));
        }
        // The claimed size may be wrong, so the reading is bounded as well.
        let mut bytes = Vec::new();
        entry.take(self.left + 1).read_to_end(&mut bytes).map_err(|e| broken(path, &place, &e.to_string()))?;
        let used = bytes.len() as u64;
        if used > self.left {
            return Err(over(used));
        }
        self.left -= used;
        Ok(bytes)
    }
}

fn broken(path: &Path, place: &str, reason: &str) -> IoError {
    IoError::Syntax { path: path.into(), place: place.into(), reason: reason.into() }
}
