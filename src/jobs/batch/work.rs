//! Work on one unit: trains it, finds its objects, and compares both with held-out photos.
//!
//! The process with the unit's claim works in its own folder, which it takes over with all earlier work. A process
//! whose claim was taken finds its folder gone, so that it cannot damage the work of the next one.

use std::any::Any;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::BatchRequest;
use super::state::{
    FAILURE, ObjectCounts, RESULT, SCENE, UnitFailure, UnitResult, UnitSeconds, VERSION, is_done, read, scenes,
};
use super::unit::{self, BatchUnit, UnitRequest};
use crate::io::claim::{Claim, host};
use crate::io::files::hex;
use crate::io::{IoError, SceneFolder, splat_ply};
use crate::jobs::error::{chain, is_of_machine};
use crate::jobs::evaluate::{EvaluateOptions, PhotoComparison, photometric};
use crate::jobs::find_objects::{self, FindRequest, FindSettings};
use crate::jobs::{JobError, Scene, evaluate_masks, export, open, plan, train};
use crate::measure::computer;
use crate::pipeline::observer::{Evaluation, Interrupted, Observer, Progress, Severity, Signal, StepMetrics};
use crate::scene::{Dataset, GaussianCloud, Level};

const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// File name of the objects that were found, in the scene's folder.
const OBJECTS_FILE: &str = "objects-found.json";

/// End of the work on a unit.
pub(super) enum Worked {
    Done,
    Failed(String),
    /// Another process took over.
    Lost,
    /// The observer asked to stop; finished work is saved.
    Stopped,
}

/// Works on a unit in its `folder`, which is claimed. Failures are recorded there.
///
/// # Errors
/// If a failure cannot be recorded, or the folder holds results of other settings.
pub(super) fn work(
    request: &BatchRequest,
    unit: BatchUnit,
    asked: &UnitRequest,
    (folder, claim): (&Path, &Claim),
    observer: &mut dyn Observer,
) -> Result<Worked, JobError> {
    if is_done(folder) {
        return Ok(Worked::Done);
    }
    let failure: Option<UnitFailure> = read(&folder.join(FAILURE))?;
    if let Some(failure) = &failure
        && !request.retry_failed
    {
        return Ok(Worked::Failed(failure.error.clone()));
    }
    let there: Option<UnitRequest> = read(&folder.join(unit::FILE))?;
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
        Err(_) if claim.is_lost() => return Ok(Worked::Lost),
        own => own?,
    };
    let observer = &mut UnitObserver { inner: observer, lost: claim.lost() };
    let made = catch_unwind(AssertUnwindSafe(|| make(request, unit, asked, &own, observer)));
    let made = made.unwrap_or_else(|payload| Err(JobError::Batch(panic_text(&*payload))));
    match made {
        _ if claim.is_lost() => Ok(Worked::Lost),
        Ok(result) => {
            match SceneFolder::move_away(&own, &folder.join(SCENE)) {
                Err(_) if claim.is_lost() => return Ok(Worked::Lost),
                moved => moved?,
            }
            export::json(&folder.join(RESULT), &result)?;
            claim.forget_earlier();
            Ok(Worked::Done)
        }
        Err(e) if e.is_cancelled() => Ok(Worked::Stopped),
        // A full disk is not the unit's fault: others would fail the same way.
        Err(e) if is_of_machine(&e) => Err(e),
        Err(e) => {
            let error = chain(&e);
            let (program, host) = (PROGRAM.into(), host());
            let failure = UnitFailure { version: VERSION, program, asked: asked.clone(), error: error.clone(), host };
            export::json(&folder.join(FAILURE), &failure)?;
            Ok(Worked::Failed(error))
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
    unit: BatchUnit,
    asked: &UnitRequest,
    folder: &Path,
    observer: &mut dyn Observer,
) -> Result<UnitResult, JobError> {
    let batch = &request.batch;
    let dataset = open::dataset(&unit.scene(batch).path)?;
    dataset.warnings.iter().for_each(|w| observer.note(Severity::Warning, w.clone()));
    let overrides = &batch.settings[unit.setting].train.plan;
    let config = plan::planned(&dataset, unit.config(batch), overrides);
    let done = train::run(&dataset, &config, [folder.to_path_buf()], &train::IfChanged::AskClaimed.into(), observer)?;
    if !done.is_finished() {
        return Err(Interrupted.into());
    }
    let (dataset, (steps, training)) = (Arc::new(dataset), (done.outcome.steps, done.outcome.secs));
    drop(done);
    let mut found = None;
    if let Some(with) = &batch.objects {
        found = Some(objects(request, unit, (folder, with), &dataset, observer)?);
    }
    let scene = open::scene(folder)?;
    let sha256 = checksum(&scene.cloud);
    let start = Instant::now();
    let (evaluation, masks) = compare(request, unit, &scene, dataset, observer)?;
    let evaluation_secs = start.elapsed().as_secs_f64();
    let (objects, objects_secs) = found.unzip();
    Ok(UnitResult {
        version: VERSION,
        program: PROGRAM.into(),
        asked: asked.clone(),
        evaluation,
        gaussians: scene.cloud.len(),
        steps,
        sha256,
        objects,
        masks,
        secs: UnitSeconds { training, evaluation: evaluation_secs, objects: objects_secs },
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

/// Finds objects, unless an earlier attempt has, and returns their counts and the seconds taken.
fn objects(
    request: &BatchRequest,
    unit: BatchUnit,
    (folder, with): (&Path, &FindSettings),
    dataset: &Arc<Dataset>,
    observer: &mut dyn Observer,
) -> Result<(ObjectCounts, f64), JobError> {
    let scene = open::scene(folder)?;
    let kept = folder.join(OBJECTS_FILE);
    let before = std::fs::read(&kept).ok().and_then(|json| serde_json::from_slice::<FoundBefore>(&json).ok());
    if let Some(before) = before.filter(|b| b.state.is_some() && b.state == scene.state) {
        return Ok((before.objects, before.secs));
    }
    let find = FindRequest {
        folder: folder.into(),
        cloud: Arc::clone(&scene.cloud),
        settings: scene.settings.clone(),
        dataset: Arc::clone(dataset),
        holdout_every: scene.config.holdout_every,
        masks: unit.scene(&request.batch).masks.clone().filter(|_| with.segmenter.is_none()),
        known: None,
        side_px: plan::of_scene(&scene).object_side_px,
        with: with.clone(),
    };
    let done = find_objects::run(&find, scene.state.as_deref(), observer)?;
    let map = &done.found.map;
    let count = |level: Level| map.identities.iter().filter(|(_, i)| i.level == level).count();
    let (objects, parts, seeds) = (count(Level::Object), count(Level::Part), map.seeds.clone());
    let objects = ObjectCounts { objects, parts, seeds };
    let found = FoundBefore { state: open::scene(folder)?.state, objects, secs: done.secs };
    export::json(&kept, &found)?;
    Ok((found.objects, found.secs))
}

/// Compares colors with held-out photos and objects with labels; `None` where there are none.
fn compare(
    request: &BatchRequest,
    unit: BatchUnit,
    scene: &Scene,
    dataset: Arc<Dataset>,
    observer: &mut dyn Observer,
) -> Result<(Option<Evaluation>, Option<serde_json::Value>), JobError> {
    let (eval, input) = (&request.batch.eval, unit.scene(&request.batch));
    let options = EvaluateOptions {
        max_side_px: eval.max_side_px,
        keep_borders: eval.keep_borders,
        ..EvaluateOptions::default()
    };
    let mut comparison = match PhotoComparison::of(scene, dataset, options) {
        Err(JobError::NothingHeldOut(_)) => return Ok((None, None)),
        comparison => comparison?,
    };
    let evaluation = photometric(&comparison, observer)?;
    observer.evaluation(evaluation.clone());
    let Some(labels) = &input.masks else { return Ok((Some(evaluation), None)) };
    comparison.state = scene.state.clone();
    observer.proceed()?;
    let query = input.query.as_deref();
    let scores = evaluate_masks::run(&comparison, &scene.path, labels, eval.protocol, query, &eval.recipe)?;
    Ok((Some(evaluation), Some(scores.json(eval.protocol, &eval.recipe))))
}

/// SHA-256 of Gaussians as they are stored.
fn checksum(cloud: &GaussianCloud) -> String {
    struct Sum(Sha256);
    impl Write for Sum {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.update(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let mut sum = Sum(Sha256::new());
    // Hashing cannot fail.
    let _ = splat_ply::encode(&mut sum, cloud, None);
    hex(&sum.0.finalize())
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
