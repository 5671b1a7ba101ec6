//! Reports on disk: read with clear errors, written without ever losing the one before.

use std::path::{Path, PathBuf};

use super::computer::Computer;
use super::document::{Report, VERSION};
use crate::io::{self, IoError};

/// Name of the document in a report's folder.
pub const FILE: &str = "report.json";
const PROGRAM: &str = env!("CARGO_PKG_VERSION");
const MOST_BYTES: u64 = 256 << 20;

/// Error of reading a report.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum ReportError {
    #[error("{path}: not a report: {cause}", path = .0.display(), cause = .1)]
    Json(PathBuf, serde_json::Error),
    #[error("{path}: a report of version {found}, this program reads {VERSION}; make it anew with 'fmlgs report'", path = .path.display())]
    Version { path: PathBuf, found: u64 },
    #[error(transparent)]
    File(#[from] IoError),
}

/// Error of resuming a report.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum BeginError {
    #[error(transparent)]
    Read(#[from] ReportError),
    #[error("{path}: a report of another {what}; move it away, or write to another folder", path = .0.display(), what = .1)]
    Other(PathBuf, &'static str),
}

/// Returns whether a path is a report's folder or looks like its document. The content of the file is not checked.
pub fn is_report(path: &Path) -> bool {
    let file = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
    let is_scene = path.is_dir() && path.join(io::trained::SCENE_FILE).exists();
    if is_scene || file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("json")) {
        return false;
    }
    if file.file_name().is_some_and(|n| n == FILE) {
        return file.is_file();
    }
    let Ok(head) = io::files::read_start(&file, 256) else { return false };
    let head = String::from_utf8_lossy(&head);
    ["\"version\"", "\"program\"", "\"scene\""].iter().all(|word| head.contains(word))
}

impl Report {
    /// The report of `scene` in a folder, to go on with, or an empty one.
    pub(crate) fn begin(folder: &Path, scene: &str, computer: &Computer) -> Result<Self, BeginError> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(Self::empty(scene, computer));
        }
        match Self::read(&path)? {
            before if before.scene != scene => Err(BeginError::Other(path, "scene")),
            before if before.computer != *computer => Err(BeginError::Other(path, "machine or build")),
            before if before.program != PROGRAM => Err(BeginError::Other(path, "version of the program")),
            before => Ok(before),
        }
    }

    pub(crate) fn empty(scene: &str, computer: &Computer) -> Self {
        let (scene, computer) = (scene.into(), computer.clone());
        Self { version: VERSION, program: PROGRAM.into(), scene, computer, commands: Vec::new(), stages: Vec::new() }
    }

    /// Reads a report: the JSON file, or the folder that it is in.
    pub fn read(path: &Path) -> Result<Self, ReportError> {
        let path = if path.is_dir() { path.join(FILE) } else { path.to_owned() };
        let text = io::files::read(&path, MOST_BYTES)?;
        let json = |e| ReportError::Json(path.clone(), e);
        let value: serde_json::Value = serde_json::from_slice(&text).map_err(json)?;
        match value.get("version").and_then(serde_json::Value::as_u64) {
            Some(found) if found != u64::from(VERSION) => return Err(ReportError::Version { path, found }),
            _ => {}
        }
        let mut report: Self = serde_json::from_value(value).map_err(json)?;
        // As earlier reports spell it.
        report.computer.build = report.computer.build.replace("optimised", "optimized");
        let (before, now) = ("localisation", "localization");
        for stage in &mut report.stages {
            stage.measures.iter_mut().filter(|m| m.name == before).for_each(|m| m.name = now.into());
            for point in &mut stage.points {
                if point.method == before {
                    point.method = now.into();
                }
                if let Some(values) = point.values.remove(before) {
                    point.values.insert(now.into(), values);
                }
            }
        }
        Ok(report)
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
    use crate::measure::tests::example;

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().expect("folder");
        let report = example();
        report.write(&folder.path().join(FILE)).expect("written");
        assert_eq!(Report::read(folder.path()).expect("folder"), report);
        assert_eq!(Report::read(&folder.path().join(FILE)).expect("file"), report);
    }

    #[test]
    fn names_as_earlier_reports_spell_them_are_read_as_now() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join(FILE);
        let mut now = example();
        let stage = &mut now.stages[0];
        stage.measures[0].name = "localization".into();
        for point in &mut stage.points {
            let (_, values) = point.values.pop_first().expect("measured");
            point.values.insert("localization".into(), values);
            point.method = "localization".into();
        }
        let text = serde_json::to_string(&now).expect("JSON");
        let before = text.replace("localization", "localisation");
        assert_ne!(text, before);
        std::fs::write(&path, before).expect("written");
        assert_eq!(Report::read(&path).expect("read"), now);
    }

    #[test]
    fn a_report_is_known_from_its_name_or_its_head() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        assert!(!is_report(folder.path()));
        example().write(&at("mine.json")).expect("written");
        std::fs::write(at("other.json"), "{\"frames\": []}").expect("written");
        assert!(is_report(&at("mine.json")) && !is_report(&at("other.json")) && !is_report(&at("none.json")));
        std::fs::write(at(FILE), "{").expect("written");
        assert!(is_report(folder.path()) && is_report(&at(FILE)), "one that is broken is told as such");
        std::fs::write(at(io::trained::SCENE_FILE), "{}").expect("written");
        assert!(!is_report(folder.path()), "a scene that holds a report is a scene");
    }

    #[test]
    fn a_report_is_resumed_where_it_is_the_same_measurement() {
        let folder = tempfile::tempdir().expect("folder");
        let report = Report { program: env!("CARGO_PKG_VERSION").into(), ..example() };
        let here = report.computer.clone();
        let empty = Report::begin(folder.path(), "x", &here).expect("nothing there yet");
        assert!(empty.stages.is_empty() && empty.scene == "x");
        report.write(&folder.path().join(FILE)).expect("written");
        assert_eq!(Report::begin(folder.path(), &report.scene, &here).expect("the same"), report);
        assert!(matches!(Report::begin(folder.path(), "x", &here), Err(BeginError::Other(_, "scene"))));
        let there = Computer { cores: 1 + here.cores, ..here };
        assert!(matches!(Report::begin(folder.path(), &report.scene, &there), Err(BeginError::Other(..))));
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
