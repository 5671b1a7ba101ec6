//! Reports on disk: read with clear errors, written without ever losing the one before.

use std::path::{Path, PathBuf};

use super::document::{Report, VERSION};
use crate::io::{self, IoError};

/// Name of the document in a report's folder.
pub const FILE: &str = "report.json";
/// Largest document that is read.
const MOST_BYTES: u64 = 256 << 20;

/// Why a report cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// It cannot be read or written.
    #[error("{path}: {cause}", path = .0.display(), cause = .1)]
    File(PathBuf, std::io::Error),
    /// It is too large to be one.
    #[error("{path}: {size} bytes are too many for a report", path = .0.display(), size = .1)]
    Large(PathBuf, u64),
    /// It is not one.
    #[error("{path}: not a report: {cause}", path = .0.display(), cause = .1)]
    Json(PathBuf, serde_json::Error),
    /// It is one of another version.
    #[error("{path}: a report of version {found}, this program reads {VERSION}; make it anew with 'fmlgs report'", path = .path.display())]
    Version {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u64,
    },
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] IoError),
}

impl Report {
    /// Reads a report: the JSON file, or the folder that it is in.
    ///
    /// # Errors
    /// If there is none, or it is damaged, or of another version.
    pub fn read(path: &Path) -> Result<Self, ReportError> {
        let path = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
        let file = |e| ReportError::File(path.clone(), e);
        let size = std::fs::metadata(&path).map_err(file)?.len();
        if size > MOST_BYTES {
            return Err(ReportError::Large(path, size));
        }
        let text = std::fs::read(&path).map_err(file)?;
        let json = |e| ReportError::Json(path.clone(), e);
        let value: serde_json::Value = serde_json::from_slice(&text).map_err(json)?;
        match value.get("version").and_then(serde_json::Value::as_u64) {
            Some(found) if found != u64::from(VERSION) => return Err(ReportError::Version { path, found }),
            _ => {}
        }
        serde_json::from_value(value).map_err(json)
    }

    /// Writes it as JSON.
    ///
    /// # Errors
    /// If it cannot be written; an older one is then still there.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let text = serde_json::to_vec_pretty(self).map_err(|e| ReportError::Json(path.to_owned(), e))?;
        Ok(io::atomic::write(path, |w| w.write_all(&text))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::example;

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().expect("folder");
        let report = example();
        report.write(&folder.path().join(FILE)).expect("written");
        assert_eq!(Report::read(folder.path()).expect("folder"), report);
        assert_eq!(Report::read(&folder.path().join(FILE)).expect("file"), report);
    }

    #[test]
    fn what_is_no_report_is_refused_by_name() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join(FILE);
        let says = |text: &str, words: &str| {
            std::fs::write(&path, text).expect("written");
            let error = Report::read(&path).expect_err("no report").to_string();
            assert!(error.contains("report.json") && error.contains(words), "{error}");
        };
        says("{", "not a report");
        says("{\"version\": 1, \"points\": []}", "version 1");
        says("{\"version\": 2}", "not a report");
        assert!(matches!(Report::read(&folder.path().join("none")), Err(ReportError::File(..))));
    }
}
