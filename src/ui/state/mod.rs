//! State of the window, changed by events alone: [`AppState::apply`] is a pure fold.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::Arc;

pub use self::located::{LocatedPhotos, PlacedPhoto};
pub use self::messages::{ErrorBox, LogLine};
pub(crate) use self::messages::{Toast, Tone};
pub use self::running::RunningJob;
use super::comparison::ComparedScene;
use super::history::ChangeHistory;
use super::labels::{PhraseTable, ScreenNames};
pub(crate) use super::train_history::TrainHistory;
use crate::jobs::go_to::Explored;
use crate::jobs::models::ModelList;
use crate::jobs::poses::front_door::PoseQuestion;
use crate::jobs::rearrange::RearrangedScene;
use crate::jobs::recent::RecentScene;
use crate::jobs::remove::StoredRemoval;
use crate::jobs::{OpenedScene, Scene};
use crate::math::format;
use crate::measure::Report;
use crate::pipeline::observer::{Progress, Severity};
use crate::pipeline::train::TrainConfig;
use crate::remote::LinkStatus;
use crate::render::RenderSettings;
use crate::scene::findings::IdentityEvidence;
use crate::scene::{GaussianCloud, IdentityId, Limits, Overrides, SceneFacts, ScenePlan, SemanticMap, text};
use crate::worker::{Event, JobEnd, JobId, JobInfo, JobLane, Makes, Versioned};

mod adding;
mod located;
mod messages;
mod running;
mod training;

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
    /// Other scenes beside it, each in a view of its own.
    pub beside: Vec<ComparedScene>,
    /// The latest scene made by a removal.
    pub(crate) removed: Option<StoredRemoval>,
    /// Folder of the latest scene that photos were added in.
    pub(crate) closer: Option<PathBuf>,
    /// Counts the scenes shown so far; changes when `scene` does.
    pub scene_number: u64,
    /// Decisions on what is left out for the scene, with their reasons.
    pub(crate) plan: ScenePlan,
    /// True if the Gaussians on screen are drawn with the 2-D filter of Mip-Splatting.
    pub(crate) antialias: bool,
    /// Objects and parts of the Gaussians on screen.
    pub semantics: Option<Versioned<SemanticMap>>,
    /// True if they are those of the training before, and no news.
    pub(crate) has_carried_objects: bool,
    /// Evidence on each of them by number, parts included; their Gaussians; and their labels on screen.
    pub(crate) facts: Vec<IdentityEvidence>,
    pub(crate) sizes: Vec<usize>,
    pub(crate) labels: ScreenNames,
    pub phrases: PhraseTable,
    /// Photos that were located in the scene.
    pub located: LocatedPhotos,
    /// Free space of the scene, if explored.
    pub explored: Option<Arc<Explored>>,
    /// Models and the engine that runs them, once listed.
    pub(crate) models: Option<Arc<ModelList>>,
    /// Count of models installed so far.
    pub(crate) models_installed: u64,
    /// Changes that can be undone and redone, by the user or the agent.
    pub(crate) changes: ChangeHistory,
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
    /// Opened photos or a video without camera poses, until the user has decided on them.
    pub(crate) unposed: Option<Box<PoseQuestion>>,
    /// Recently opened files and folders, newest first.
    pub recent: Vec<PathBuf>,
    /// What is known of them, once it is read.
    pub recent_scenes: Vec<RecentScene>,
    /// Error against run time, if a report is open.
    pub report: Option<ShownReport>,
    /// The report to compare with.
    pub second_report: Option<ShownReport>,
    /// Status of the connection to the server of the current scene, if it has one.
    pub(crate) link: Option<LinkStatus>,
    /// Name of the copy that the first edit has just made, until it is told.
    pub(crate) copied: Option<String>,
    short_jobs: BTreeMap<JobId, RunningJob>,
    next_toast: u64,
}

impl AppState {
    /// A window with nothing open.
    pub(crate) fn new(recent: Vec<PathBuf>) -> Self {
        Self { recent, ..Self::default() }
    }

    /// Applies one event.
    pub(crate) fn apply(&mut self, event: Event) {
        match event {
            Event::Started(job, info) => {
                let info = JobInfo { title: text::line(&info.title).into_owned(), ..info };
                if info.lane == JobLane::Short {
                    self.short_jobs.insert(job, RunningJob::begun(job, info));
                    return;
                }
                if info.makes == Makes::Gaussians {
                    // Objects belong to Gaussians that are about to change.
                    self.set_semantics(None);
                    self.training_job = Some(job);
                }
                self.say(Tone::Info, info.title.clone());
                self.job = Some(RunningJob::begun(job, info));
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
                        self.begin_curve();
                    }
                    self.history.push(metrics);
                }
            }
            Event::Evaluation(job, evaluation) => self.evaluated_in_training(job, evaluation),
            Event::Note(_, Severity::Info, text) => self.say(Tone::Info, text),
            Event::Note(job, Severity::Warning, text) => {
                if self.job.as_ref().is_some_and(|j| j.id == job && j.info.makes.changes_scene()) {
                    self.problem(Some(job), &text);
                }
                self.say(Tone::Warning, text);
            }
            Event::Ended(job, end) => self.ended(job, end),
        }
    }

    /// Takes a job that has ended off the screen.
    fn ended(&mut self, job: JobId, end: JobEnd) {
        let short = self.short_jobs.remove(&job);
        let long = self.job.take_if(|j| j.id == job);
        match end {
            JobEnd::Finished => {
                if long.is_some_and(|j| j.info.makes.changes_scene()) {
                    // Problems of the scene before do not apply to the new one.
                    self.problems.retain(|(of, _)| *of == Some(job));
                }
            }
            JobEnd::Cancelled => {
                if let Some(long) = long {
                    let reached = long.progress.filter(|_| long.info.makes == Makes::Gaussians).map(|p| p.done);
                    self.resumable.iter_mut().zip(reached).for_each(|((_, step), reached)| *step = reached);
                    self.toast(Tone::Info, format!("{}: stopped", long.info.title));
                }
            }
            JobEnd::Failed(failure) => {
                let info = short.or(long).map(|j| j.info).unwrap_or_else(|| JobInfo::long("Working"));
                match (failure.is_refusal, info.is_aside) {
                    (true, _) => self.toast(Tone::Warning, failure.message),
                    (false, true) => self.toast(Tone::Warning, format!("{}: {}", info.title, failure.message)),
                    (false, false) => self.fail(info.title, failure),
                }
            }
        }
    }

    /// Puts a path on top of the recent list, in place of any other path to the same place.
    pub(crate) fn remember(&mut self, path: PathBuf) {
        let real = |path: &PathBuf| std::fs::canonicalize(path).ok();
        let place = real(&path);
        self.recent.retain(|p| *p != path && (place.is_none() || real(p) != place));
        self.recent.insert(0, path);
        self.recent.truncate(MAX_RECENT);
    }

    /// Puts a scene that was made of the open one below it in the recent list, where it is found again.
    pub(crate) fn remember_made(&mut self, path: PathBuf) {
        let open = self.scene.as_ref().map(|scene| scene.path.clone()).filter(|open| self.recent.contains(open));
        self.remember(path);
        open.into_iter().for_each(|open| self.remember(open));
    }

    /// True if the Gaussians on screen are a result.
    pub(crate) fn is_trained(&self) -> bool {
        !self.is_training() && (self.training_job.is_some() || self.scene.as_ref().is_some_and(|s| s.trained))
    }

    /// True if a training is running or paused.
    pub fn is_training(&self) -> bool {
        self.is_running(Makes::Gaussians)
    }

    /// The job that the Training pane shows: a training of the open scene, or of one beside it.
    pub(crate) fn shown_training(&self) -> Option<&RunningJob> {
        self.job.as_ref().filter(|job| job.info.makes.is_training())
    }

    /// True if a job that makes this is running or paused.
    fn is_running(&self, makes: Makes) -> bool {
        self.job.as_ref().is_some_and(|j| j.info.makes == makes)
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
        let scene = self.scene.as_ref().map(|s| s.settings.clone()).unwrap_or_default();
        let sh_degree = if self.is_training() { scene.sh_degree } else { self.plan.sh_degree };
        RenderSettings { sh_degree, antialias: self.antialias, ..scene }
    }

    fn set_facts(&mut self, facts: SceneFacts) {
        self.plan = ScenePlan::new(facts, &self.plan.overrides);
    }

    fn with_job(&mut self, job: JobId, change: impl FnOnce(&mut RunningJob)) {
        let long = self.job.as_mut().filter(|j| j.id == job);
        long.or(self.short_jobs.get_mut(&job)).map(change);
    }

    /// Sets objects and parts, with their counts.
    pub(crate) fn set_semantics(&mut self, map: Option<Arc<SemanticMap>>) {
        self.facts = map.as_ref().map_or_else(Vec::new, |m| m.facts());
        self.sizes = self.facts.iter().map(|f| f.gaussians).collect();
        self.set_facts(self.plan.facts.clone().with_semantics(map.as_deref()));
        self.semantics = map.map(Versioned::new);
        self.has_carried_objects = false;
    }

    /// Shows an opened scene.
    pub(crate) fn opened(&mut self, scene: OpenedScene, is_demo: bool) {
        for warning in scene.dataset.iter().flat_map(|d| d.warnings.clone()) {
            self.toast(Tone::Warning, warning);
        }
        self.history =
            TrainHistory { steps: scene.history.steps.clone(), evaluations: scene.history.evaluations.clone() };
        self.training_job = None;
        self.previous = TrainHistory::default();
        let reached = self.history.steps.last().map(|s| s.step);
        self.resumable = scene.can_resume.then(|| scene.config.clone()).zip(reached);
        if !is_demo && scene.remote.is_none() {
            self.remember(scene.path.clone());
        }
        self.scene_number += 1;
        (self.explored, self.removed, self.closer) = (None, None, None);
        self.beside.clear();
        self.located = LocatedPhotos::default();
        self.set_facts(scene.facts.clone());
        self.antialias = scene.settings.antialias;
        self.set_semantics(scene.semantics.clone());
        (self.labels, self.phrases) = Default::default();
        self.scene = Some(Arc::new(scene));
    }

    /// Shows edited Gaussians, which continue in another folder as the same scene; returns them.
    pub(crate) fn rearranged(&mut self, done: RearrangedScene) -> Option<Arc<GaussianCloud>> {
        let RearrangedScene { cloud, map, folder, name, state, facts, stale: _ } = done;
        let before = self.scene.take()?;
        if !before.is_edited {
            let text = format!("Edits go into {}; {} stays as it is.", folder.display(), before.name);
            self.say(Tone::Info, text);
            self.copied = Some(name.clone());
            self.remember(folder.clone());
        }
        self.scene = Some(Arc::new(OpenedScene {
            scene: Scene {
                path: folder.clone(),
                name,
                cloud: Arc::clone(&cloud),
                state: Some(state),
                folder: Some(folder.clone()),
                ..before.scene.clone()
            },
            trained: true,
            semantics: map.clone(),
            report_out: folder.join("report"),
            out: folder,
            // The new folder has no training to continue.
            can_resume: false,
            is_edited: true,
            ..(*before).clone()
        }));
        self.resumable = None;
        self.explored = None;
        self.set_facts(facts);
        self.set_semantics(map);
        Some(cloud)
    }

    /// Sets the length of a unit, and reports it.
    pub(crate) fn scaled(&mut self, meters: f64, is_stored: bool) {
        if let Some(scene) = &mut self.scene {
            Arc::make_mut(scene).scene.meters_per_unit = Some(meters);
        }
        let kept = if is_stored { "saved with the scene" } else { "not saved: save or train the scene first" };
        self.toast(Tone::Good, format!("1 unit is {}, {kept}", format::length(1.0, Some(meters))));
    }

    /// True if neither an object or part nor its parts have a Gaussian.
    pub(crate) fn is_empty(&self, id: IdentityId) -> bool {
        self.sizes.get(id as usize) == Some(&0)
    }

    /// Reason why queries are impossible, as a sentence; `None` if they are possible.
    pub(crate) fn why_no_query(&self) -> Option<String> {
        if self.semantics.is_some() {
            return None;
        }
        let Some(scene) = &self.scene else { return Some("Nothing to query yet: open a scene first.".into()) };
        let why = match &scene.remote {
            Some(origin) => return Some(format!("Nothing to query yet: no objects are known on {}.", origin.host)),
            None if self.is_training() => "Nothing to query while training runs: objects come after it.",
            None if self.is_running(Makes::Objects) => "Nothing to query yet: objects are being found.",
            None if !self.is_trained() => {
                "Nothing to query yet: train, then find objects first (Ctrl+P, Find objects and parts)."
            }
            None if scene.dataset.is_some() => {
                "Nothing to query yet: find objects first (Ctrl+P, Find objects and parts)."
            }
            None => "Nothing to query yet: select an object by clicks first (Ctrl+P, New object).",
        };
        Some(why.into())
    }
}

#[cfg(test)]
mod tests;
