//! Trainings: how one begins, goes on and ends.

use std::sync::Arc;

use super::{AppState, Tone, TrainHistory};
use crate::jobs::OpenedScene;
use crate::jobs::workspace::TrainedRun;
use crate::pipeline::observer::Evaluation;
use crate::pipeline::train::TrainConfig;
use crate::scene::SemanticMap;
use crate::worker::JobId;

/// State that a training replaces. One that ends before its first step puts it back.
#[derive(Clone, Debug)]
pub(crate) struct BeforeTraining {
    reached: Option<u64>,
    job: Option<JobId>,
    semantics: Option<Arc<SemanticMap>>,
    history: TrainHistory,
    previous: TrainHistory,
    resumable: Option<(TrainConfig, u64)>,
}

impl AppState {
    /// The settings of a training started now.
    pub(crate) fn next_training(&self, config: &TrainConfig) -> TrainConfig {
        TrainConfig { max_side_px: self.plan.train_side_px, ..config.clone() }
    }

    /// The step at which a training with these settings would continue; `None` if it cannot or has no steps left.
    pub(crate) fn continues_at(&self, config: &TrainConfig) -> Option<u64> {
        let (before, step) = self.resumable.as_ref()?;
        (before.is_same_but_for_steps(config) && (1..config.steps).contains(step)).then_some(*step)
    }

    /// True if there is a training beside which another could begin.
    pub(crate) fn can_begin_anew(&self) -> bool {
        self.resumable.as_ref().is_some_and(|(_, step)| *step > 0)
    }

    /// Returns the state that a training would replace, which continues at step `reached` or is a new one.
    pub(crate) fn before_training(&self, reached: Option<u64>) -> BeforeTraining {
        BeforeTraining {
            reached,
            job: self.training_job,
            semantics: self.semantics.as_deref().map(Arc::clone),
            history: self.history.clone(),
            previous: self.previous.clone(),
            resumable: self.resumable.clone(),
        }
    }

    /// Shows the start of a training that continues at step `reached`, or is a new one.
    pub(crate) fn begin_training(&mut self, config: TrainConfig, reached: Option<u64>) {
        self.resumable = Some((config, reached.unwrap_or(0)));
        if reached.is_none() {
            self.begin_curve();
        }
    }

    /// Begins a curve; the one before is kept for comparison.
    pub(super) fn begin_curve(&mut self) {
        if !self.history.steps.is_empty() {
            self.previous = std::mem::take(&mut self.history);
        }
    }

    /// True while a training runs that did not continue another.
    pub(crate) fn trains_anew(&self) -> bool {
        self.is_training() && self.resumable.as_ref().is_some_and(|(_, step)| *step == 0)
    }

    /// Puts back what a training has replaced, if it has not done a step. Returns whether it has not.
    pub(crate) fn undo_start(&mut self, before: BeforeTraining) -> bool {
        let last = |history: &TrainHistory| history.steps.last().map(|s| s.step);
        if last(&self.history) != before.reached.and_then(|_| last(&before.history)) {
            return false;
        }
        self.training_job = before.job;
        (self.history, self.previous) = (before.history, before.previous);
        self.resumable = before.resumable;
        self.set_semantics(before.semantics);
        self.has_carried_objects = true;
        true
    }

    /// Shows the end of a training. Returns true if its objects are to be found next.
    pub(crate) fn trained(&mut self, job: JobId, run: TrainedRun) -> bool {
        let TrainedRun { evaluations, out, semantics, runs, stopped_at, facts } = run;
        let carried = semantics.is_some();
        if self.training_job == Some(job) {
            self.history.evaluations = evaluations;
            self.set_facts(facts);
            self.set_semantics(semantics);
            self.has_carried_objects = carried;
            self.scene = self.scene.take().map(|s| Arc::new(OpenedScene { runs, ..s.trained_in(&out) }));
            let reached = stopped_at.or(self.history.steps.last().map(|s| s.step));
            self.resumable.iter_mut().zip(reached).for_each(|((_, step), reached)| *step = reached);
        }
        let origin = self.scene.as_ref().and_then(|scene| scene.remote.as_ref());
        let host = origin.map_or_else(String::new, |origin| format!(" on {}", origin.host));
        self.say(Tone::Info, format!("Saved to {}{host}", out.display()));
        if let Some(step) = stopped_at {
            let whole = self.resumable.as_ref().map_or_else(String::new, |(config, _)| format!(" of {}", config.steps));
            self.toast(Tone::Info, format!("Training stopped at step {step}{whole}, saved"));
            return false;
        }
        let quality = self.history.evaluations.last().map(|e| format!(", held-out PSNR {:.2} dB", e.psnr));
        self.toast(Tone::Good, format!("Training finished{}", quality.unwrap_or_default()));
        !carried && self.scene.as_ref().is_some_and(|s| s.masks.is_some())
    }

    /// Shows a held-out evaluation of the Gaussians on screen.
    pub(crate) fn evaluated(&mut self, mut e: Evaluation) {
        if let Some(last) = self.history.steps.last() {
            (e.step, e.secs) = (last.step, last.secs);
        }
        self.history.evaluations.retain(|old| old.step < e.step);
        self.toast(Tone::Good, format!("Held-out PSNR {:.2} dB, SSIM {:.3}", e.psnr, e.ssim));
        self.history.evaluations.push(e);
    }

    pub(super) fn evaluated_in_training(&mut self, job: JobId, evaluation: Evaluation) {
        if self.training_job == Some(job) {
            let Evaluation { step, psnr, ssim, .. } = &evaluation;
            self.say(Tone::Info, format!("Step {step}: held-out PSNR {psnr:.2} dB, SSIM {ssim:.3}"));
            self.history.evaluations.push(evaluation);
        }
    }
}
