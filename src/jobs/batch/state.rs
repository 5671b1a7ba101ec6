//! State of a unit, as its folder shows it; its result, and the error if it failed.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::unit::{self, UnitRequest};
use crate::io::{IoError, claim, trained};
use crate::jobs::experiment::{ObjectCounts, stored};
use crate::measure::Computer;
use crate::pipeline::observer::Evaluation;

/// File name of a unit's result: complete, or absent.
pub(super) const RESULT: &str = "result.json";
/// File name of a unit's failure.
pub(super) const FAILURE: &str = "failed.json";
/// Folder name of the trained scene of a finished unit.
pub(super) const SCENE: &str = "scene";
/// Version of both documents.
pub(super) const VERSION: u32 = 1;

/// Result of a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct UnitResult {
    pub(super) version: u32,
    /// Version of the program.
    pub(super) program: String,
    pub(crate) asked: UnitRequest,
    /// Quality on held-out photos, if there are any.
    pub(crate) evaluation: Option<Evaluation>,
    pub(crate) gaussians: usize,
    pub(crate) steps: u64,
    /// SHA-256 of the Gaussians as a `.ply`, without parts that differ from save to save.
    pub(crate) sha256: String,
    pub(crate) objects: Option<ObjectCounts>,
    /// Scores as `fmlgs eval --masks` prints them, without the single queries.
    pub(crate) masks: Option<Value>,
    pub(crate) secs: UnitSeconds,
    pub(super) host: String,
    pub(super) computer: Computer,
}

/// Seconds of work, those of interrupted runs included if they are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct UnitSeconds {
    pub(crate) training: f64,
    pub(crate) evaluation: f64,
    pub(crate) objects: Option<f64>,
}

/// Failure of a unit: the error in place of a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct UnitFailure {
    pub(super) version: u32,
    pub(super) program: String,
    pub(crate) asked: UnitRequest,
    pub(crate) error: String,
    pub(super) host: String,
}

/// State of a unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum UnitState {
    Waiting,
    /// It was stopped, and can be resumed.
    Begun,
    /// Another process seems to work on it; its name.
    Held(String),
    Done,
    /// The error.
    Failed(String),
    /// Its folder holds results of other settings; the difference.
    Changed(String),
}

impl UnitState {
    /// Returns the state of the unit in `folder` that is `asked` now.
    ///
    /// # Errors
    /// If a file there cannot be read.
    pub(super) fn of(folder: &Path, asked: &UnitRequest) -> Result<Self, IoError> {
        let there: Option<UnitRequest> = stored(&folder.join(unit::FILE))?;
        let failure: Option<UnitFailure> = stored(&folder.join(FAILURE))?;
        if let Some(failure) = failure {
            return Ok(Self::Failed(failure.error));
        }
        let changed = there.and_then(|there| there.difference(asked));
        let begun = !scenes(folder).is_empty();
        let done = is_done(folder);
        Ok(match (changed, claim::holder(folder)?) {
            (Some(what), _) if done || begun => Self::Changed(what),
            _ if done => Self::Done,
            (_, Some(by)) => Self::Held(by),
            _ if begun => Self::Begun,
            _ => Self::Waiting,
        })
    }
}

/// Returns whether the unit in `folder` has its result and its scene.
pub(super) fn is_done(folder: &Path) -> bool {
    folder.join(RESULT).is_file() && trained::is_scene(&folder.join(SCENE))
}

/// Returns the folders of the unit's scene, each with the number of the claim that worked in it; 0 is the finished one.
pub(super) fn scenes(folder: &Path) -> Vec<(u64, PathBuf)> {
    let number = |name: &str| match name.strip_prefix(SCENE)? {
        "" => Some(0),
        rest => rest.strip_prefix('-')?.parse().ok(),
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter_map(|e| Some((number(&e.file_name().to_string_lossy())?, e.path()))).collect()
}
