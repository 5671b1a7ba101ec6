//! Work on one unit: trains it, finds its objects, and compares both with held-out photos.
//!
//! The process with the unit's claim works in its own folder, which it takes over with all earlier work. A process
//! whose claim was taken finds its folder gone, so that it cannot damage the work of the next one.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use sha2::Digest;

use super::state::{FAILURE, RESULT, SCENE, UnitFailure, UnitResult, UnitSeconds, VERSION, is_done, scenes};
use super::unit::{self, UnitRequest};
use super::{BatchRequest, PlannedUnit, UnitOutcome};
use crate::io::claim::{Claim, host};
use crate::io::files::{Summed, hex};
use crate::io::{IoError, SceneFolder, splat_ply};
use crate::jobs::error::{chain, is_of_machine};
use crate::jobs::evaluate::EvaluateOptions;
use crate::jobs::experiment::{Experiment, ObjectCounts, TrainedFacts, once, stored};
use crate::jobs::find_objects::FindSettings;
use crate::jobs::train::IfChanged;
use crate::jobs::{JobError, Scene, evaluate_masks, export, open, plan};
use crate::measure::computer;
use crate::pipeline::observer::{Evaluation, Observer, Progress, Severity, Signal, StepMetrics};
use crate::scene::GaussianCloud;

const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// File name of the objects that were found, in the scene's folder.
const OBJECTS_FILE: &str = "objects-found.json";

/// Works on a unit in its folder, which is claimed. Failures are recorded there.
///
/// # Errors
/// If a failure cannot be recorded, or the folder holds results of other settings.
pub(super) fn work(
    request: &BatchRequest,
    planned: &PlannedUnit<'_>,
    claim: &Claim,
    observer: &mut dyn Observer,
) -> Result<UnitOutcome, JobError> {
    let PlannedUnit { folder, asked, .. } = planned;
    if is_done(folder) {
        return Ok(UnitOutcome::Done);
    }
    let failure: Option<UnitFailure> = stored(&folder.join(FAILURE))?;
    if let Some(failure) = &failure
        && !request.retry_failed
    {
        return Ok(UnitOutcome::Failed(failure.error.clone()));
    }
    let there: Option<UnitRequest> = stored(&folder.join(unit::FILE))?;
    if let Some(what) = there.as_ref().and_then(|there| there.difference(asked)) {
        set_aside(folder, claim.number(), failure.is_some(), &what)?;
    }
    if there.as_ref() != Some(asked) {
        export::json(&folder.join(unit::FILE), asked)?;
    }
    if failure.is_some() {
        let path = folder.join(FAILURE);
        std::fs::remove_file(&path).map_err(|cause| crate::io::error::write_error(&path, cause))?;
    }
    let own = match inherit(folder, claim.number()) {
        Err(_) if claim.is_lost() => return Ok(UnitOutcome::Lost),
        own => own?,
    };
    let observer = &mut UnitObserver { inner: observer, lost: claim.lost() };
    let made = catch_unwind(AssertUnwindSafe(|| make(request, planned, &own, observer)));
    let made = made.unwrap_or_else(|payload| Err(JobError::Batch(panic_text(&*payload))));
    match made {
        _ if claim.is_lost() => Ok(UnitOutcome::Lost),
        Ok(result) => {
            match SceneFolder::move_away(&own, &folder.join(SCENE)) {
                Err(_) if claim.is_lost() => return Ok(UnitOutcome::Lost),
                moved => moved?,
            }
            export::json(&folder.join(RESULT), &result)?;
            claim.forget_earlier();
            Ok(UnitOutcome::Done)
        }
        Err(e) if e.is_cancelled() => Ok(UnitOutcome::Stopped),
        // A full disk is not the unit's fault: others would fail the same way.
        Err(e) if is_of_machine(&e) => Err(e),
        Err(e) => {
            let error = chain(&e);
            let (program, host) = (PROGRAM.into(), host());
            let failure = UnitFailure { version: VERSION, program, asked: asked.clone(), error: error.clone(), host };
            export::json(&folder.join(FAILURE), &failure)?;
            Ok(UnitOutcome::Failed(error))
        }
    }
}

/// Moves failed work with other settings aside; refuses to move work that did not fail.
fn set_aside(folder: &Path, claim: u64, failed: bool, what: &str) -> Result<(), JobError> {
    for (number, path) in scenes(folder) {
        if !failed {
            return Err(super::changed(folder, what));
        }
        SceneFolder::move_away(&path, &folder.join(format!("earlier-{claim}-{number}")))?;
    }
    Ok(())
}

/// Returns the folder of this claim's number, with all earlier work on the unit moved into it.
fn inherit(folder: &Path, claim: u64) -> Result<PathBuf, IoError> {
    let own = folder.join(format!("{SCENE}-{claim}"));
    // Finished work comes first, then that of the latest claim, which is furthest along.
    let last = scenes(folder).into_iter().max_by_key(|(number, _)| if *number == 0 { u64::MAX } else { *number });
    if let Some((_, path)) = last {
        SceneFolder::move_away(&path, &own)?;
    }
    Ok(own)
}

fn make(
    request: &BatchRequest,
    planned: &PlannedUnit<'_>,
    folder: &Path,
    observer: &mut dyn Observer,
) -> Result<UnitResult, JobError> {
    let PlannedUnit { unit, asked, .. } = planned;
    let dataset = open::dataset(&unit.scene.path)?;
    dataset.warnings.iter().for_each(|w| observer.note(Severity::Warning, w.clone()));
    let config = plan::planned(&dataset, unit.config(), &unit.setting.train.plan);
    let experiment = Experiment { dataset: Arc::new(dataset), folder };
    let outcome = experiment.train(&config, IfChanged::AskClaimed, observer)?.finished()?;
    let (steps, trained) = (outcome.steps, TrainedFacts::of(&outcome));
    drop(outcome);
    let with = request.batch.objects.as_ref();
    let found = with.map(|with| find(&experiment, planned, with, observer)).transpose()?;
    let scene = open::scene(folder)?;
    let sha256 = checksum(&scene.cloud);
    let start = Instant::now();
    let (evaluation, masks) = compare(request, planned, &experiment, &scene, observer)?;
    let (objects, objects_secs) = found.map(|found| (found.objects, found.secs)).unzip();
    Ok(UnitResult {
        version: VERSION,
        program: PROGRAM.into(),
        asked: asked.clone(),
        evaluation,
        gaussians: trained.gaussians,
        steps,
        sha256,
        objects,
        masks,
        secs: UnitSeconds { training: trained.secs, evaluation: start.elapsed().as_secs_f64(), objects: objects_secs },
        host: host(),
        computer: computer::look(),
    })
}

/// Objects found before, and the save of the scene in which they were found.
#[derive(Serialize, Deserialize)]
struct FoundBefore {
    state: Option<String>,
    objects: ObjectCounts,
    secs: f64,
}

/// Finds objects, unless an earlier attempt has.
fn find(
    experiment: &Experiment<'_>,
    planned: &PlannedUnit<'_>,
    with: &FindSettings,
    observer: &mut dyn Observer,
) -> Result<FoundBefore, JobError> {
    let scene = open::scene(experiment.folder)?;
    let file = experiment.folder.join(OBJECTS_FILE);
    let is_of_scene = |before: &FoundBefore| before.state.is_some() && before.state == scene.state;
    // A damaged file costs no more than another search.
    let before = stored::<FoundBefore>(&file).ok().flatten().filter(is_of_scene);
    once(&file, before, || {
        let unit = planned.unit;
        let masks = unit.scene.masks.as_deref().filter(|_| with.segmenter.is_none());
        let side_px = plan::of_scene(&scene).object_side_px;
        let found = experiment.find(&scene, masks, side_px, with.clone(), observer)?;
        Ok(FoundBefore { state: found.state, objects: found.counts, secs: found.secs })
    })
}

/// Compares colors with held-out photos and objects with labels; `None` where there are none.
fn compare(
    request: &BatchRequest,
    planned: &PlannedUnit<'_>,
    experiment: &Experiment<'_>,
    scene: &Scene,
    observer: &mut dyn Observer,
) -> Result<(Option<Evaluation>, Option<serde_json::Value>), JobError> {
    let (eval, input) = (&request.batch.eval, planned.unit.scene);
    let options = EvaluateOptions {
        max_side_px: eval.max_side_px,
        keep_borders: eval.keep_borders,
        ..EvaluateOptions::default()
    };
    let (comparison, evaluation) = match experiment.compare(scene, options, observer) {
        Err(JobError::NothingHeldOut(_)) => return Ok((None, None)),
        compared => compared?,
    };
    observer.evaluation(evaluation.clone());
    let Some(labels) = &input.masks else { return Ok((Some(evaluation), None)) };
    observer.proceed()?;
    let query = input.query.as_deref();
    let scores = evaluate_masks::run(&comparison, &scene.path, labels, eval.protocol, query, &eval.recipe)?;
    Ok((Some(evaluation), Some(scores.json(eval.protocol, &eval.recipe))))
}

/// SHA-256 of Gaussians as they are stored.
fn checksum(cloud: &GaussianCloud) -> String {
    let mut sum = Summed::new(io::sink());
    // Hashing cannot fail.
    let _ = splat_ply::encode(&mut sum, cloud, None);
    hex(&sum.sum.finalize())
}

fn panic_text(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
    format!("the program failed ({text}); please report it")
}

/// Passes everything on, and cancels the work once another process has taken over.
struct UnitObserver<'a> {
    inner: &'a mut dyn Observer,
    lost: Arc<AtomicBool>,
}

impl Observer for UnitObserver<'_> {
    fn signal(&self) -> Signal {
        if self.lost.load(Ordering::SeqCst) { Signal::Cancel } else { self.inner.signal() }
    }
    fn progress(&mut self, progress: Progress) {
        self.inner.progress(progress);
    }
    fn step(&mut self, metrics: StepMetrics) {
        self.inner.step(metrics);
    }
    fn evaluation(&mut self, evaluation: Evaluation) {
        self.inner.evaluation(evaluation);
    }
    fn note(&mut self, severity: Severity, text: String) {
        self.inner.note(severity, text);
    }
}
