//! State of the window, changed by events alone: [`AppState::apply`] is a pure fold.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

pub use self::messages::{ErrorBox, LogLine};
pub(crate) use self::messages::{Toast, Tone};
pub use self::running::RunningJob;
use super::actions::Action;
use super::beside::Beside;
use super::history::ChangeHistory;
use super::labels::{PhraseTable, ScreenNames};
pub(crate) use super::train_history::TrainHistory;
use crate::io::unposed::Unposed;
use crate::jobs::OpenedScene;
use crate::jobs::clean::MeasuredCloud;
use crate::jobs::demo::QUESTION;
use crate::jobs::go_to::{Approached, Explored};
use crate::jobs::inspect::InspectedPixel;
use crate::jobs::models::ModelList;
use crate::jobs::recent::RunSummary;
use crate::jobs::remove::RemovedScene;
use crate::jobs::select::Selected;
use crate::jobs::thumbnails::ThumbnailSet;
use crate::math::format;
use crate::measure::Report;
use crate::pipeline::observer::{Evaluation, Progress, Severity};
use crate::pipeline::train::TrainConfig;
use crate::remote::LinkStatus;
use crate::render::RenderSettings;
use crate::scene::findings::IdentityEvidence;
use crate::scene::{GaussianCloud, Limits, Overrides, PhotoPixels, SceneFacts, ScenePlan, SemanticMap, text};
use crate::worker::{Event, JobId, JobKind, Outcome, Versioned, WorkerThread};

mod asking;
mod edited;
mod messages;
mod opened;
mod running;

/// Length of the recent list.
const MAX_RECENT: usize = 8;

/// A report on screen.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownReport {
    /// Path of the report.
    pub(crate) path: PathBuf,
    pub(crate) report: Arc<Report>,
}

/// State of the window.
#[derive(Clone, Debug, Default)]
pub struct AppState {
    /// The scene on screen.
    pub scene: Option<Arc<OpenedScene>>,
    /// Another scene in the second view.
    pub beside: Option<Beside>,
    /// The latest scene made by a removal.
    pub(crate) removed: Option<RemovedScene>,
    /// Counts the scenes shown so far; changes when `scene` does.
    pub(crate) scene_number: u64,
    /// Decisions on what is left out for the scene, with their reasons.
    pub(crate) plan: ScenePlan,
    /// True if the Gaussians on screen are drawn with the 2-D filter of Mip-Splatting.
    pub(crate) antialias: bool,
    /// Objects and parts of the Gaussians on screen.
    pub semantics: Option<Versioned<SemanticMap>>,
    /// Evidence on each of them by number, parts included; their Gaussians; and their labels on screen.
    pub(crate) facts: Vec<IdentityEvidence>,
    pub(crate) sizes: Vec<usize>,
    pub(crate) labels: ScreenNames,
    pub phrases: PhraseTable,
    /// New thumbnails of objects and parts, until they are taken over.
    pub(crate) thumbnails: Option<(Arc<SemanticMap>, ThumbnailSet)>,
    /// Free space of the scene, if explored.
    pub explored: Option<Arc<Explored>>,
    /// The flight that was searched last, until the window takes it.
    pub(crate) visited: Option<Approached>,
    /// The pixel inspected last, until the window takes it.
    pub(crate) inspected: Option<Arc<InspectedPixel>>,
    /// Edited Gaussians, until the view takes them; measures of Gaussians, until the pane takes them.
    pub(crate) rearranged: Option<Arc<GaussianCloud>>,
    pub(crate) splats_measured: Option<Arc<MeasuredCloud>>,
    /// Result of the selection tool's clicks and strokes, until the tool takes it.
    pub(crate) selected: Option<(JobId, Arc<Selected>)>,
    /// Models and the engine that runs them, once listed.
    pub(crate) models: Option<Arc<ModelList>>,
    /// Count of models installed so far.
    pub(crate) models_installed: u64,
    /// Changes that can be undone and redone, by the user or the agent.
    pub(crate) changes: ChangeHistory,
    /// The newest short job that has ended; they end in order.
    pub(crate) short_jobs_done: JobId,
    /// The running long job.
    pub job: Option<RunningJob>,
    /// History of the current scene's training.
    pub history: TrainHistory,
    /// History of the previous training, while another is shown.
    pub(crate) previous: TrainHistory,
    /// Settings of the training that can continue, and the training step that it has reached.
    pub(crate) resumable: Option<(TrainConfig, u64)>,
    /// Job whose Gaussians are on screen.
    pub(crate) training_job: Option<JobId>,
    /// The log, oldest first.
    pub log: VecDeque<LogLine>,
    /// Problems of the open scene, with the job that reported each.
    pub problems: Vec<(Option<JobId>, String)>,
    /// Messages on screen, oldest first.
    pub(crate) toasts: Vec<Toast>,
    /// The error on screen.
    pub error: Option<ErrorBox>,
    /// Opened photos without camera poses, until the user has decided on them.
    pub(crate) unposed: Option<Box<Unposed>>,
    /// Recently opened files and folders, newest first.
    pub recent: Vec<PathBuf>,
    /// All trainings of recent folders with several.
    pub recent_runs: Vec<(PathBuf, Vec<RunSummary>)>,
    /// Thumbnails of recent scenes, until the window takes them.
    pub(crate) recent_pictures: Vec<(PathBuf, PhotoPixels)>,
    /// Recently loaded photos, by index and size limit, until the window takes them.
    pub(crate) photos: BTreeMap<(usize, u32), Arc<PhotoPixels>>,
    /// Jobs of photos that could not be loaded, until the window marks them.
    pub(crate) failed_photos: Vec<JobId>,
    /// Error against run time, if a report is open.
    pub report: Option<ShownReport>,
    /// The report to compare with.
    pub second_report: Option<ShownReport>,
    /// Status of the connection to the server of the current scene, if it has one.
    pub(crate) link: Option<LinkStatus>,
    short_jobs: BTreeMap<JobId, (JobKind, String)>,
    next_toast: u64,
}

impl AppState {
    /// A window with nothing open.
    pub(crate) fn new(recent: Vec<PathBuf>) -> Self {
        Self { recent, ..Self::default() }
    }

    /// Applies one event; returns the actions that the window carries out next.
    pub(crate) fn apply(&mut self, event: Event) -> Vec<Action> {
        match event {
            Event::Started { job, kind, title } if kind.lane() == WorkerThread::Short => {
                self.short_jobs.insert(job, (kind, text::line(&title).into_owned()));
            }
            Event::Started { job, kind, title } => {
                let title = text::line(&title).into_owned();
                if kind == JobKind::Train {
                    // Objects belong to Gaussians that are about to change.
                    self.set_semantics(None);
                    self.training_job = Some(job);
                }
                self.say(Tone::Info, title.clone());
                self.job = Some(RunningJob::begun(job, kind, title));
            }
            Event::Progress(job, progress) => {
                let stage = text::line(&progress.stage).into_owned();
                self.with_job(job, |j| j.goes_on(Progress { stage, ..progress }));
            }
            Event::Paused(job, paused) => self.with_job(job, |j| j.paused = paused),
            Event::Step(job, metrics) => {
                if self.training_job == Some(job) {
                    // A training that starts over is another one; the previous is kept for comparison.
                    if self.history.steps.first().is_some_and(|first| metrics.step <= first.step) {
                        self.previous = std::mem::take(&mut self.history);
                    }
                    self.history.push(metrics);
                }
            }
            Event::Evaluation(job, evaluation) => self.evaluated(job, evaluation),
            Event::Note(_, Severity::Info, text) => self.say(Tone::Info, text),
            Event::Note(job, Severity::Warning, text) => {
                if self.job.as_ref().is_some_and(|j| j.id == job && j.kind.makes_scene()) {
                    self.problem(Some(job), &text);
                }
                self.say(Tone::Warning, text);
            }
            Event::Finished(job, outcome) => return self.finished(job, outcome),
            Event::Cancelled(job) => {
                if let Some(ended) = self.end(job) {
                    let reached = ended.progress.as_ref().filter(|_| ended.kind == JobKind::Train).map(|p| p.done);
                    self.resumable.iter_mut().zip(reached).for_each(|((_, step), reached)| *step = reached);
                    self.toast(Tone::Info, format!("{}: canceled", ended.title));
                    // Results measured before the cancellation are shown.
                    let scene = self.scene.as_ref().filter(|_| ended.kind == JobKind::Measure);
                    return scene.map(|s| Action::OpenReport(s.report_out.clone())).into_iter().collect();
                }
            }
            Event::Failed(job, failure) => self.failed(job, failure),
        }
        Vec::new()
    }

    /// Puts a path on top of the recent list.
    pub(crate) fn remember(&mut self, path: PathBuf) {
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(MAX_RECENT);
    }

    /// True if the Gaussians on screen are a result.
    pub(crate) fn is_trained(&self) -> bool {
        !self.is_training() && (self.training_job.is_some() || self.scene.as_ref().is_some_and(|s| s.trained))
    }

    /// True if a training is running or paused.
    pub fn is_training(&self) -> bool {
        self.job.as_ref().is_some_and(|j| j.kind == JobKind::Train)
    }

    /// Updates the plan for the user's overrides and the settings of the next training.
    pub(crate) fn replan(&mut self, overrides: &Overrides, limits: Limits) {
        if self.plan.overrides != *overrides || self.plan.facts.limits != limits {
            let dataset = self.scene.as_ref().and_then(|s| s.dataset.as_deref());
            let facts = self.plan.facts.clone().with_limits(limits, dataset);
            self.plan = ScenePlan::new(facts, overrides);
        }
    }

    /// Render settings of the Gaussians on screen: those of their training, without what the plan leaves out.
    pub(crate) fn render_settings(&self) -> RenderSettings {
        let scene = self.scene.as_ref().map(|s| s.render.clone()).unwrap_or_default();
        let sh_degree = if self.is_training() { scene.sh_degree } else { self.plan.sh_degree };
        RenderSettings { sh_degree, antialias: self.antialias, ..scene }
    }

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

    fn set_facts(&mut self, facts: SceneFacts) {
        self.plan = ScenePlan::new(facts, &self.plan.overrides);
    }

    fn with_job(&mut self, job: JobId, change: impl FnOnce(&mut RunningJob)) {
        if let Some(j) = self.job.as_mut().filter(|j| j.id == job) {
            change(j);
        }
    }

    /// Takes the long job off the screen if it is `job`.
    fn end(&mut self, job: JobId) -> Option<RunningJob> {
        self.end_short(job);
        self.job.take_if(|j| j.id == job)
    }

    /// Takes a short job off the list if it is `job`.
    fn end_short(&mut self, job: JobId) -> Option<(JobKind, String)> {
        let ended = self.short_jobs.remove(&job)?;
        if !job.is_remote() {
            self.short_jobs_done = self.short_jobs_done.max(job);
        }
        Some(ended)
    }

    fn evaluated(&mut self, job: JobId, evaluation: Evaluation) {
        if self.training_job == Some(job) {
            self.say(
                Tone::Info,
                format!(
                    "Step {}: held-out PSNR {:.2} dB, SSIM {:.3}",
                    evaluation.step, evaluation.psnr, evaluation.ssim
                ),
            );
            self.history.evaluations.push(evaluation);
        }
    }

    fn finished(&mut self, job: JobId, outcome: Outcome) -> Vec<Action> {
        let ended = self.end(job);
        if ended.as_ref().is_some_and(|j| j.kind.makes_scene()) {
            // Problems of the scene before do not apply to the new one.
            self.problems.retain(|(of, _)| *of == Some(job));
        }
        let mut next = Vec::new();
        match outcome {
            Outcome::Opened(scene) => {
                let kind = ended.map(|j| j.kind);
                self.opened(*scene, matches!(kind, Some(JobKind::Demo | JobKind::DemoPhotos)));
                next.extend(match kind {
                    Some(JobKind::Demo) => Some(Action::Ask(QUESTION.into())),
                    Some(JobKind::DemoPhotos) => Some(Action::StartTraining),
                    _ => None,
                });
            }
            Outcome::Beside(scene) => {
                self.beside = Beside::of(*scene);
                if self.beside.is_none() {
                    self.toast(Tone::Warning, "There is nothing to compare with: it has no Gaussians.");
                }
            }
            Outcome::Removed(removed) => next.push(self.take_removed(*removed)),
            Outcome::Rearranged(done) => self.take_rearranged(*done),
            Outcome::SplatsMeasured(measured) => {
                self.say(Tone::Info, format!("{} measured", format::things(measured.cloud.len(), "Gaussian")));
                self.splats_measured = Some(measured);
            }
            Outcome::Trained { evaluations, out, semantics, runs, stopped_at, facts } => {
                let carried = semantics.is_some();
                if self.training_job == Some(job) {
                    self.history.evaluations = evaluations;
                    self.set_facts(*facts);
                    self.set_semantics(semantics);
                    self.scene = self.scene.take().map(|s| Arc::new(OpenedScene { runs, ..s.trained_in(&out) }));
                    let reached = stopped_at.or(self.history.steps.last().map(|s| s.step));
                    self.resumable.iter_mut().zip(reached).for_each(|((_, step), reached)| *step = reached);
                }
                self.say(Tone::Info, format!("Saved to {}{}", out.display(), self.elsewhere()));
                if let Some(ended) = ended.filter(|_| stopped_at.is_some()) {
                    self.toast(Tone::Info, format!("{}: canceled", ended.title));
                    return next;
                }
                let quality = self.history.evaluations.last().map(|e| format!(", held-out PSNR {:.2} dB", e.psnr));
                self.toast(Tone::Good, format!("Training finished{}", quality.unwrap_or_default()));
                let has_masks = self.scene.as_ref().is_some_and(|s| s.masks.is_some());
                next.extend((has_masks && !carried).then_some(Action::FindObjects));
            }
            Outcome::InputsChanged(how) => next.push(Action::AskHowToTrain(how)),
            Outcome::Evaluated(mut e) => {
                if let Some(last) = self.history.steps.last() {
                    (e.step, e.secs) = (last.step, last.secs);
                }
                self.history.evaluations.retain(|old| old.step < e.step);
                self.toast(Tone::Good, format!("Held-out PSNR {:.2} dB, SSIM {:.3}", e.psnr, e.ssim));
                self.history.evaluations.push(e);
            }
            Outcome::Objects(map) => {
                self.toast(Tone::Good, format!("{} found", map.identities.counted()));
                self.set_semantics(Some(map));
            }
            Outcome::Edited(map) => self.set_semantics(Some(map)),
            Outcome::Refused(why) => self.toast(Tone::Warning, why),
            Outcome::Scale(meters, stored) => {
                let scaled = |s: &Arc<OpenedScene>| OpenedScene { metres_per_unit: Some(meters), ..(**s).clone() };
                self.scene = self.scene.as_ref().map(scaled).map(Arc::new);
                let kept = if stored { "saved with the scene" } else { "not saved: save or train the scene first" };
                self.toast(Tone::Good, format!("1 unit is {}, {kept}", format::length(1.0, Some(meters))));
            }
            Outcome::Models(models) => self.models = Some(models),
            Outcome::ModelInstalled(id) => {
                self.models_installed += 1;
                self.toast(Tone::Good, format!("Model {id} is ready"));
            }
            Outcome::Approached(explored, visited) => {
                self.explored = Some(explored);
                self.visited = Some(visited);
            }
            Outcome::Inspected(pixel) => self.inspected = Some(pixel),
            Outcome::Selected(selected) => self.selected = Some((job, selected)),
            Outcome::Explored(explored) => self.explored = Some(explored),
            Outcome::Report { path, report, second } => {
                *(if second { &mut self.second_report } else { &mut self.report }) = Some(ShownReport { path, report });
            }
            Outcome::Thumbnails(map, drawn) => self.thumbnails = Some((map, drawn)),
            Outcome::Phrases(rows, to) => self.phrases.finished(rows, to),
            Outcome::Written(path) => self.toast(Tone::Good, format!("Saved to {}", path.display())),
            Outcome::Unposed(photos) => self.unposed = Some(photos),
            Outcome::Kept => {}
            Outcome::RecentRuns(runs) => self.recent_runs = runs,
            Outcome::RecentPictures(pictures) => self.recent_pictures = pictures,
            Outcome::Photo { index, max_side_px, pixels } => {
                self.photos.insert((index, max_side_px), pixels);
            }
        }
        next
    }
}

#[cfg(test)]
mod tests;
