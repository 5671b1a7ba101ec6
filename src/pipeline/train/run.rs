//! Training job: from photos to a trained scene, with progress, checkpoints and held-out scores.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::checkpoint::{self, Checkpoint, Header};
use super::device::StepResult;
use super::divergence::LossGuard;
use super::fit_report;
use super::folder::{FolderUse, claim, finished, objects_for, remade, resumable};
use super::inputs::{Compare, TrainInputs};
use super::outcome::{TrainEnd, TrainError, TrainOutcome};
use super::photo_fits::PhotoFits;
use super::photos::{before_backdrop, load_training, load_views, tell_marks, tell_of_pixels};
use super::trainer::{REPORT_STEPS, StepError, Trainer};
use super::window::StepWindow;
use super::{TrainConfig, TrainView, coarse, density, geometry, init, refine};
use crate::io::SceneFolder;
use crate::io::trained::{History, SceneInfo};
use crate::math::format::count;
use crate::pipeline::evaluate::scores;
use crate::pipeline::evaluate_fitted::fitted;
use crate::pipeline::observer::{Evaluation, Observer, Severity, Ticker};
use crate::render::Device;
use crate::scene::{Dataset, GaussianCloud};

/// Training steps between copies of the cloud for a rollback.
const SAFE_STEPS: u64 = 500;
/// Most rollbacks of a run before it fails.
const MAX_ROLLBACKS: u32 = 4;

/// Trains on `dataset` and saves into the folder `out`, if given. A checkpoint of the same run in that folder is
/// resumed; a finished run is returned as it is. Objects and parts of the scene there are transferred, and the earlier
/// scene is kept beside it. Blocks until done; all interaction is through `observer`.
///
/// # Errors
/// See [`TrainError`]. A checkpoint that cannot be saved during training is a warning; at the end it is an error.
pub(crate) fn run(
    dataset: &Dataset,
    config: &TrainConfig,
    out: Option<&Path>,
    observer: &mut dyn Observer,
) -> Result<TrainOutcome, TrainError> {
    run_on(dataset, config, out, FolderUse::default(), observer)
}

/// Trains as [`run`] does, with permissions for the folder.
pub(crate) fn run_on(
    dataset: &Dataset,
    config: &TrainConfig,
    out: Option<&Path>,
    may: FolderUse,
    observer: &mut dyn Observer,
) -> Result<TrainOutcome, TrainError> {
    config.check().map_err(TrainError::Config)?;
    let dataset = &*dataset.with_alpha(config.alpha);
    tell_of_pixels(dataset, config, observer);
    let (train, held) = dataset.split(config.holdout_every);
    if train.is_empty() {
        return Err(TrainError::NoPhotos(dataset.name.clone(), dataset.photos.len()));
    }
    tell_marks(dataset, config, observer);
    let scene = out.map(|folder| claim(folder, dataset)).transpose()?;
    let inputs = out.map(|_| TrainInputs::of(dataset, Compare::Contents).map_err(TrainError::Photo)).transpose()?;
    let saved = match (out, &inputs) {
        (Some(folder), Some(now)) => resumable(folder, dataset, (config, &train), (now, may), observer)?,
        _ => None,
    };
    if let (Some(folder), Some(saved)) = (out, &saved)
        && let Some(done) = finished(folder, saved, config)?
    {
        observer.note(Severity::Info, format!("All {} steps were done before; nothing has changed", config.steps));
        observer.cloud(Arc::clone(&done.cloud), done.steps);
        return Ok(done);
    }
    let refinement = saved.as_ref().and_then(|s| s.header.refinement.clone());
    let train = refine::those_of(refinement.as_ref(), dataset, train);
    let Some(mut views) = load_training(dataset, &train, config, observer)? else {
        return Ok(TrainOutcome::stopped_early());
    };
    let Some(tests) = load_views(dataset, &held, config, "Loading held-out photos", observer)? else {
        return Ok(TrainOutcome::stopped_early());
    };
    refine::absorb(refinement.as_ref(), &mut views);
    let dataset = &*before_backdrop(dataset, &views, observer);
    let mut job = Job::start(dataset, config, scene, &held, (views, tests), saved);
    (job.inputs, job.remake) = (inputs, may.remake);
    let told = |why| observer.note(Severity::Warning, why);
    job.device = if config.needs_cpu() { None } else { config.backend.gpu(told)? };
    match &job.device {
        Some(device) => {
            observer.note(Severity::Info, format!("Training on {}", device.describe()));
            job.trainer.move_to(device, job.coarse.as_ref().unwrap_or(&job.views))?;
        }
        None => observer.note(Severity::Info, format!("Training on the CPU{}", config.why_cpu())),
    }
    let end = job.train(observer)?;
    job.finish(end, observer)
}

struct Job<'a> {
    config: &'a TrainConfig,
    scene: Option<SceneFolder>,
    info: SceneInfo,
    photos: Vec<String>,
    /// Training inputs, for a later resume.
    inputs: Option<TrainInputs>,
    /// True if the folder is made again when it vanishes.
    remake: bool,
    views: Vec<TrainView>,
    /// Half-size views, during the steps that use them.
    coarse: Option<Vec<TrainView>>,
    tests: Vec<TrainView>,
    device: Option<Device>,
    trainer: Trainer,
    secs: f64,
    history: History,
    /// Measurements since the last row of `history`.
    unreported: StepWindow,
    safe: GaussianCloud,
    rollbacks: u32,
    guard: LossGuard,
    /// Gradients clipped since the last report of them.
    outliers: u64,
    /// True if the last checkpoint could not be saved.
    unsaved: bool,
}

impl<'a> Job<'a> {
    fn start(
        dataset: &Dataset,
        config: &'a TrainConfig,
        scene: Option<SceneFolder>,
        held: &[usize],
        (views, tests): (Vec<TrainView>, Vec<TrainView>),
        saved: Option<Checkpoint>,
    ) -> Self {
        let (extent, background) = (dataset.camera_extent().1, dataset.background.unwrap_or([0.0; 3]));
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
        let (mut secs, mut history, mut unreported) = (0.0, History::default(), StepWindow::default());
        let mut fits = {
            let refinement = saved.as_ref().and_then(|s| s.header.refinement.as_ref());
            let from = refinement.map_or(0, |r| r.from_step);
            PhotoFits::new(config, &views, &refine::free(refinement, &views), (from, extent))
        };
        fits.restore(saved.as_ref().map_or(&[], |s| &s.header.fits), &views);
        // More steps mean more coarse steps; a run that already trained at full size does not go back.
        let was_coarse = saved.as_ref().is_none_or(|s| s.header.step < coarse::steps(&s.header.config));
        let mut trainer = match saved {
            Some(mut s) => {
                let h = &mut s.header;
                (secs, history, unreported) =
                    (h.secs, std::mem::take(&mut h.history), std::mem::take(&mut h.unreported));
                s.trainer(config, background, extent, &views)
            }
            None => {
                let mut cloud = init::initial_cloud(dataset, &views, config.sh_degree, config.random_points, &mut rng);
                if config.surfels {
                    geometry::flatten(&mut cloud, extent, || density::gaussian(&mut rng));
                }
                let mut t = Trainer::new(cloud, config, background, extent, rng);
                if config.max_gaussians.is_none() {
                    let pixels = views.iter().map(|v| v.pixels.len()).max().unwrap_or(0);
                    t.budget = super::budget::worthwhile(pixels, t.cloud.len());
                }
                t
            }
        };
        (trainer.fits, trainer.cloud.render_mode) = (fits, config.render_mode());
        if dataset.background.is_none() {
            trainer.before_random_colors();
        }
        let mut info = SceneInfo::of(dataset, held, scene.as_ref().map_or(Path::new("."), SceneFolder::path));
        info.config = serde_json::to_value(config).unwrap_or_default();
        let photos = views.iter().map(|v| v.name.clone()).collect();
        let safe = trainer.cloud.clone();
        let coarse = (was_coarse && trainer.step < coarse::steps(config)).then(|| coarse::halved(&views));
        Self {
            config,
            scene,
            info,
            photos,
            inputs: None,
            remake: false,
            views,
            coarse,
            tests,
            device: None,
            trainer,
            secs,
            history,
            unreported,
            safe,
            rollbacks: 0,
            guard: LossGuard::default(),
            outliers: 0,
            unsaved: false,
        }
    }

    fn train(&mut self, observer: &mut dyn Observer) -> Result<TrainEnd, TrainError> {
        if self.trainer.step > 0 {
            observer.note(Severity::Info, format!("Continuing at step {} of {}", self.trainer.step, self.config.steps));
        }
        if self.trainer.cloud.len() > self.trainer.budget {
            let [have, may] = [self.trainer.cloud.len(), self.trainer.budget].map(|n| count(n as u64));
            observer.note(
                Severity::Warning,
                format!("{have} Gaussians to start from are over the budget of {may}; none will be added"),
            );
        }
        let mut ticker = Ticker::resumed("Training", self.config.steps, self.trainer.step, self.secs);
        let mut saved_at = Instant::now();
        while self.trainer.step < self.config.steps {
            if ticker.proceed(observer).is_err() {
                return Ok(TrainEnd::Cancelled);
            }
            let start = Instant::now();
            let results = self.step(observer)?;
            self.secs += start.elapsed().as_secs_f64();
            results.iter().for_each(|r| self.unreported.add(r.loss, r.psnr));
            let step = self.trainer.step;
            if step % REPORT_STEPS == 0 || step == self.config.steps {
                let window = std::mem::take(&mut self.unreported);
                let metrics = window.metrics(step, self.secs, self.trainer.cloud.len());
                self.history.steps.push(metrics);
                observer.step(metrics);
            }
            ticker.report(step, observer);
            if observer.wants_cloud() {
                self.trainer.fetch_cloud()?;
                observer.cloud(Arc::new(self.trainer.cloud.clone()), step);
            }
            if self.config.eval_every > 0 && step % self.config.eval_every == 0 && step < self.config.steps {
                self.evaluate(observer)?;
            }
            let due = self.config.checkpoint_secs;
            if due > 0.0 && saved_at.elapsed().as_secs_f64() >= due {
                match self.checkpoint(observer) {
                    // A full disk must not end the run: its state in memory would be lost.
                    Err(TrainError::Save(e)) if !std::mem::replace(&mut self.unsaved, true) => {
                        observer.note(Severity::Warning, format!("Checkpoint not saved, training continues: {e}"));
                    }
                    Err(TrainError::Save(_)) => {}
                    Err(e) => return Err(e),
                    Ok(()) if std::mem::take(&mut self.unsaved) => {
                        observer.note(Severity::Info, "Checkpoints are saved again".into());
                    }
                    Ok(()) => {}
                }
                saved_at = Instant::now();
            }
        }
        Ok(TrainEnd::Finished)
    }

    /// Runs one training step with its guard against divergence, and density control.
    fn step(&mut self, observer: &mut dyn Observer) -> Result<Vec<StepResult>, TrainError> {
        if self.coarse.is_some() && self.trainer.step >= coarse::steps(self.config) {
            self.coarse = None;
            if let Some(device) = &self.device {
                self.trainer.fetch()?;
                self.trainer.move_to(device, &self.views)?;
            }
        }
        let views = self.coarse.as_ref().unwrap_or(&self.views);
        let results = self.trainer.advance(views).map_err(|e| self.failed(e))?;
        for result in &results {
            if result.skipped > 0 && self.trainer.step % 100 == 0 {
                let text = format!("{} Gaussians had a gradient that is not finite", count(result.skipped as u64));
                observer.note(Severity::Warning, text);
            }
            self.outliers += result.outliers as u64;
            if self.outliers > 0 && self.trainer.step % 100 == 0 {
                let count = std::mem::take(&mut self.outliers);
                observer.note(Severity::Info, format!("{count} gradients were far above what is usual, and were cut"));
            }
            if self.guard.diverges(result.loss, self.trainer.step) {
                self.roll_back(result.loss, observer)?;
                return Ok(results);
            }
        }
        if self.trainer.control_density().map_err(|e| self.failed(e))?.is_some() {
            self.guard.clear();
        }
        if self.trainer.step % SAFE_STEPS == 0 {
            self.trainer.fetch_cloud()?;
            self.safe = self.trainer.cloud.clone();
        }
        Ok(results)
    }

    fn failed(&self, e: StepError) -> TrainError {
        match e {
            StepError::Render(e) => TrainError::Render(self.photos.first().cloned().unwrap_or_default(), e),
            StepError::Gpu(e) => TrainError::Gpu(e),
            StepError::NotFinite(e) => TrainError::NotFinite(e),
        }
    }

    fn roll_back(&mut self, loss: f64, observer: &mut dyn Observer) -> Result<(), TrainError> {
        self.rollbacks += 1;
        if self.rollbacks > MAX_ROLLBACKS {
            return Err(TrainError::Diverged(self.rollbacks));
        }
        let text = format!(
            "Step {}: the loss is {loss:.3}, far above what it was; back to the last good state with halved rates",
            self.trainer.step
        );
        observer.note(Severity::Warning, text);
        self.trainer.roll_back(self.safe.clone())?;
        self.guard.clear();
        Ok(())
    }

    fn evaluate(&mut self, observer: &mut dyn Observer) -> Result<(), TrainError> {
        if self.tests.is_empty() {
            return Ok(());
        }
        let count = self.trainer.cloud.len();
        let trainer = &mut self.trainer;
        let scores = scores(&self.tests, |camera| trainer.draw(camera)).map_err(|e| match e {
            StepError::Render(e) => TrainError::Render("held-out".into(), e),
            e => self.failed(e),
        })?;
        let mut e = Evaluation::of(scores, count, self.trainer.step, self.secs);
        if self.trainer.step >= self.config.steps {
            let (cloud, settings) = (self.trainer.cloud.clone(), self.trainer.render_settings());
            e.fitted = fitted(Arc::new(cloud), &settings, &self.tests, self.config.held_out_fit(), observer)
                .map_err(TrainError::Fit)?;
        }
        self.history.evaluations.push(e.clone());
        observer.evaluation(e);
        Ok(())
    }

    fn checkpoint(&mut self, observer: &mut dyn Observer) -> Result<(), TrainError> {
        if let Some(scene) = self.scene.take_if(|_| self.remake) {
            self.scene = Some(remade(scene, observer)?);
        }
        let Some(scene) = &self.scene else { return Ok(()) };
        self.trainer.fetch()?;
        let t = &self.trainer;
        let header = Header {
            config: self.config.clone(),
            photos: self.photos.clone(),
            inputs: self.inputs.clone(),
            step: t.step,
            secs: self.secs,
            count: t.cloud.len(),
            sh_degree: t.cloud.sh_degree,
            origin: t.cloud.origin,
            rng: t.rng.clone(),
            round: t.round.clone(),
            budget: t.budget,
            damping: t.schedule.damping,
            refinement: t.refinement.clone(),
            history: self.history.clone(),
            unreported: self.unreported.clone(),
            fits: t.fits.stored(&self.views),
        };
        checkpoint::save(scene, t, &header).map_err(TrainError::Save)
    }

    fn finish(mut self, end: TrainEnd, observer: &mut dyn Observer) -> Result<TrainOutcome, TrainError> {
        self.trainer.fetch_cloud()?;
        let checkpoint = self.checkpoint(observer);
        let scored = self.history.evaluations.last().is_some_and(|e| e.step == self.trainer.step);
        // An error of the evaluation is returned after the scene is saved.
        let evaluated = if end == TrainEnd::Finished && !scored { self.evaluate(observer) } else { Ok(()) };
        fit_report::tell(&self.trainer.fits, &self.views, observer);
        fit_report::store(&self.trainer.fits, &self.views, &mut self.info);
        if let Some(scene) = &self.scene {
            self.info.history = self.history.clone();
            let step = self.trainer.step; // of a stopped training, too
            if self.history.steps.last().map_or(0, |s| s.step) < step {
                self.info.history.steps.push(self.unreported.metrics(step, self.secs, self.trainer.cloud.len()));
            }
            let map = objects_for(scene, &self.trainer.cloud, observer).map_err(TrainError::Save)?;
            scene.save(&self.info, &self.trainer.cloud, map.as_ref()).map_err(TrainError::Save)?;
        }
        checkpoint?;
        evaluated?;
        let cloud = Arc::new(self.trainer.cloud);
        observer.cloud(Arc::clone(&cloud), self.trainer.step);
        Ok(TrainOutcome {
            cloud,
            evaluations: self.history.evaluations,
            end,
            steps: self.trainer.step,
            secs: self.secs,
        })
    }
}
