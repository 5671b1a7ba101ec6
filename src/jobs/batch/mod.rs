//! Many scenes, with many settings and seeds, on many machines: each combination is a unit with its own folder and one
//! atomic result. Machines share nothing but the folder of the results; the cluster's own scheduler decides which of
//! them runs a unit, and at what time.
//!
//! A unit is claimed by creating a file ([`crate::io::claim`]). Killed shards end with the same results, bit for bit,
//! as an uninterrupted run (`tests/it/batch/mod.rs`).

mod file;
mod merge;
mod page;
mod sbatch;
mod shard;
mod state;
mod unit;
mod work;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(crate) use self::file::{BatchEvaluation, BatchFile, BatchTraining, TableReaders};
use self::merge::MergedResults;
pub(crate) use self::merge::MergedRow;
pub(crate) use self::sbatch::{ArrayScript, script};
pub(crate) use self::shard::Shard;
pub(crate) use self::state::UnitState;
use self::unit::{BatchUnit, SceneInputs, UnitRequest};
use self::work::work;
use super::{JobError, export};
use crate::io::IoError;
use crate::io::claim::{self, Taken, Watch};
use crate::models::catalog::{self, ModelRole};
use crate::pipeline::observer::{Observer, Severity, Signal};
use crate::pipeline::semantics::lifting::build_map::{MaskPropagation, REGIONS};

/// Time between looks at a unit that another process holds.
const LOOK: Duration = Duration::from_millis(250);

/// A shard of a batch.
#[derive(Clone, Debug)]
pub(crate) struct BatchRequest {
    pub(crate) batch: BatchFile,
    /// Folder of all results.
    pub(crate) out: PathBuf,
    pub(crate) shard: Shard,
    /// True if units that failed are tried again.
    pub(crate) retry_failed: bool,
    /// Time that a unit's heartbeat may stand still before another process takes over.
    pub(crate) takeover: Duration,
}

/// Outcome of a shard.
#[derive(Clone, Debug, Default)]
pub(crate) struct BatchOutcome {
    /// Units of the shard.
    pub(crate) units: usize,
    /// Units that are done, now or before.
    pub(crate) done: usize,
    /// Units that failed, with the error.
    pub(crate) failed: Vec<(String, String)>,
    /// Units that other processes hold, with the holder.
    pub(crate) elsewhere: Vec<(String, String)>,
    /// True if the observer asked to stop; finished work is saved.
    pub(crate) stopped: bool,
}

/// A unit of the shard that can be run.
struct PlannedUnit<'a> {
    unit: BatchUnit<'a>,
    folder: PathBuf,
    asked: UnitRequest,
}

impl PlannedUnit<'_> {
    fn state(&self) -> Result<UnitState, IoError> {
        UnitState::of(&self.folder, &self.asked)
    }
}

/// End of an attempt to run a unit.
enum UnitOutcome {
    Done,
    Failed(String),
    /// Another process took over.
    Lost,
    /// The observer asked to stop; finished work is saved.
    Stopped,
    /// Another process works on it.
    Held {
        by: String,
        /// True if its heartbeat was seen to change.
        beating: bool,
    },
}

/// Lists the units of a shard and their states.
pub(crate) fn list(request: &BatchRequest) -> Result<Vec<(String, UnitState)>, JobError> {
    plan(request)?.iter().map(|p| Ok((p.asked.name(), p.state()?))).collect()
}

/// Number of units in a batch.
pub(crate) fn count(batch: &BatchFile) -> usize {
    unit::units(batch).len()
}

/// Runs the units of a shard, one after another. One that fails does not stop the others.
///
/// # Errors
/// Before anything runs: if a scene is missing, results would lie among inputs or are of other settings, or a network
/// is missing. Later, if the folder of the results cannot be written.
pub(crate) fn run(request: &BatchRequest, observer: &mut dyn Observer) -> Result<BatchOutcome, JobError> {
    let mut planned = plan(request)?;
    for p in &planned {
        if let UnitState::Changed(what) = p.state()? {
            return Err(changed(&p.folder, &what));
        }
    }
    check_networks(&request.batch)?;
    let mut outcome = BatchOutcome { units: planned.len(), ..BatchOutcome::default() };
    // A unit may have killed the process that worked on it: it comes last, so that it delays no other.
    planned.sort_by_key(|p| claim::was_left(&p.folder));
    let mut waiting: VecDeque<(PlannedUnit<'_>, Watch)> = planned.into_iter().map(|p| (p, Watch::default())).collect();
    // Number of held units in a row: if all are held, there is nothing to do but to wait.
    let mut held = 0;
    while let Some((p, mut watch)) = waiting.pop_front() {
        if observer.signal() == Signal::Cancel {
            outcome.stopped = true;
            break;
        }
        let name = p.asked.name();
        match attempt(request, &p, &mut watch, observer)? {
            UnitOutcome::Done => outcome.done += 1,
            UnitOutcome::Failed(why) => outcome.failed.push((name, why)),
            UnitOutcome::Stopped => {
                outcome.stopped = true;
                break;
            }
            UnitOutcome::Lost => outcome.elsewhere.push((name, "another process, which took over".into())),
            UnitOutcome::Held { by, beating: true } => outcome.elsewhere.push((name, by)),
            UnitOutcome::Held { by, beating: false } => {
                if held == 0 {
                    let text = format!("{name} is {by}'s, unless that has ended: its heartbeat is watched");
                    observer.note(Severity::Info, text);
                }
                waiting.push_back((p, watch));
                held += 1;
                if held >= waiting.len() {
                    std::thread::sleep(LOOK);
                }
                continue;
            }
        }
        held = 0;
    }
    Ok(outcome)
}

fn attempt(
    request: &BatchRequest,
    planned: &PlannedUnit<'_>,
    watch: &mut Watch,
    observer: &mut dyn Observer,
) -> Result<UnitOutcome, JobError> {
    let folder = &planned.folder;
    // A finished unit is not claimed.
    match planned.state()? {
        UnitState::Done => return Ok(UnitOutcome::Done),
        UnitState::Failed(why) if !request.retry_failed => return Ok(UnitOutcome::Failed(why)),
        UnitState::Changed(what) => return Err(changed(folder, &what)),
        _ => {}
    }
    export::make_folder(folder)?;
    match claim::take(folder, request.takeover, watch)? {
        Taken::Held { by, beating } => Ok(UnitOutcome::Held { by, beating }),
        Taken::Mine(claim) => {
            observer.note(Severity::Info, format!("Unit {}", planned.asked.name()));
            work(request, planned, &claim, observer)
        }
    }
}

/// Returns the shard's units, once all their inputs are known to exist.
fn plan(request: &BatchRequest) -> Result<Vec<PlannedUnit<'_>>, JobError> {
    let all = unit::units(&request.batch);
    unit::check_places(request, &all)?;
    let mut inputs: BTreeMap<&str, SceneInputs> = BTreeMap::new();
    let own = all.into_iter().enumerate().filter(|(k, _)| request.shard.has(*k));
    let planned = own.map(|(_, unit)| {
        let inputs = match inputs.entry(&unit.scene.name) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(unknown) => unknown.insert(SceneInputs::of(unit.scene)?),
        };
        let asked = unit.asked(&request.batch, inputs);
        Ok(PlannedUnit { unit, folder: request.out.join(unit.name()), asked })
    });
    planned.collect()
}

/// Reports missing networks before hours of training, not after.
fn check_networks(batch: &BatchFile) -> Result<(), JobError> {
    let Some(with) = &batch.objects else { return Ok(()) };
    let told = |key: &str, e: crate::models::ModelError| {
        let file = batch.path.display();
        JobError::Batch(format!("{file}, [objects], '{key}': {e}; 'fmlgs models' lists what is here"))
    };
    if let Some(name) = with.encoder.as_deref().filter(|name| *name != super::find_objects::NO_ENCODER) {
        crate::models::encoder(name).map_err(|e| told("encoder", e))?;
    }
    if let Some(name) = with.segmenter.as_deref().filter(|name| *name != REGIONS) {
        catalog::find(name, ModelRole::Segmenter).map_err(|e| told("segmenter", e))?;
    }
    if with.carry != MaskPropagation::Gaussians {
        catalog::find(&with.tracker, ModelRole::Segmenter).map_err(|e| told("tracker-model", e))?;
    }
    Ok(())
}

/// Merges the results of all units below `folders`, and writes `merged.json`, `merged.csv`, `merged.html` into `out`.
///
/// # Errors
/// If results do not go together, or a file cannot be read or written.
pub(crate) fn merge(folders: &[PathBuf], out: &Path, observer: &mut dyn Observer) -> Result<MergedResults, JobError> {
    let merged = merge::collect(folders, observer)?;
    export::make_folder(out)?;
    export::json(&out.join("merged.json"), &merged)?;
    export::text(&out.join("merged.csv"), &merged.csv())?;
    export::text(&out.join("merged.html"), &page::html(&merged))?;
    Ok(merged)
}

fn changed(folder: &Path, what: &str) -> JobError {
    JobError::Batch(format!(
        "{} holds results of other settings ({what}); give the settings another name or the results another folder \
         (--out), or remove it",
        folder.display()
    ))
}
