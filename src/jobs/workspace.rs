//! The scenes that a running program works on: where it keeps them, and in which state it knows each, so that changes
//! that another program saved since are not overwritten.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::edit::{self, EditRequest};
use super::evaluate::{self, EvaluateOptions, PhotoComparison};
use super::find_objects::{self, FindRequest};
use super::poses::front_door::{self, PoseQuestion, PoseRequest};
use super::rearrange::{self, RearrangeRequest, RearrangedScene};
use super::runs::{self, RunSummary};
use super::train::{self, TrainStart, Trained};
use super::{Folders, JobError, OpenedScene, Scene, demo, open, plan, report, scale};
use crate::io::{OpenError, trained};
use crate::pipeline::observer::{Evaluation, Interrupted, Observer};
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{TrainConfig, TrainError};
use crate::render::RenderSettings;
use crate::scene::{Dataset, GaussianCloud, Machine, SceneFacts, SemanticMap};

/// Folders of the program, the machine, and the known state of each scene.
pub struct Workspace {
    folders: Folders,
    machine: OnceLock<Machine>,
    known: Mutex<HashMap<PathBuf, Option<String>>>,
}

/// Result of opening a path.
#[derive(Debug)]
pub enum OpenedPath {
    /// A scene.
    Scene(Box<OpenedScene>),
    /// Photos or a video whose camera poses are unknown.
    Unposed(Box<PoseQuestion>),
}

/// Result of training in the workspace.
#[derive(Clone, Debug)]
pub enum TrainingEnd {
    /// All steps are done, or training was canceled and its state is stored.
    Trained(Box<TrainedRun>),
    /// Nothing was done: the training to go on with began with other photos or poses, and how they differ.
    InputsChanged(String),
}

/// Result of a training run, beside its Gaussians.
#[derive(Clone, Debug)]
pub struct TrainedRun {
    /// Evaluations of the whole run, oldest first.
    pub(crate) evaluations: Vec<Evaluation>,
    /// Folder of the trained scene.
    pub(crate) out: PathBuf,
    /// Objects and parts that were carried over from the scene before.
    pub(crate) semantics: Option<Arc<SemanticMap>>,
    /// All trainings of these photos that the program keeps.
    pub(crate) runs: Vec<RunSummary>,
    /// The step at which it was canceled, if it was.
    pub(crate) stopped_at: Option<u64>,
    /// Facts that the plan of the result is computed from.
    pub(crate) facts: SceneFacts,
}

/// Change of a scene's folder that another program made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ChangeElsewhere {
    /// Another state was saved; its id.
    Saved(Option<String>),
    /// The folder is no scene any more.
    Gone,
}

impl Workspace {
    /// Keeps what it makes in `folders`.
    pub fn new(folders: Folders) -> Self {
        Self { folders, machine: OnceLock::new(), known: Mutex::default() }
    }

    pub(crate) fn folders(&self) -> &Folders {
        &self.folders
    }

    /// Reads a dataset, a splat or a trained scene.
    pub fn open(&self, path: &Path, observer: &mut dyn Observer) -> Result<OpenedPath, JobError> {
        match open::open(path, &self.folders, self.machine(), observer) {
            Err(JobError::Open(OpenError::NoPoses(photos))) => {
                Ok(OpenedPath::Unposed(Box::new(PoseQuestion::of(*photos, &self.folders))))
            }
            opened => Ok(OpenedPath::Scene(Box::new(self.opened(opened?)))),
        }
    }

    /// Reads a scene to compare with; it does not become the one to work on.
    pub(crate) fn open_comparison(&self, path: &Path, observer: &mut dyn Observer) -> Result<OpenedScene, JobError> {
        open::open(path, &self.folders, self.machine(), observer)
    }

    /// Reads the trained demo that ships with the program.
    pub(crate) fn open_demo(&self, observer: &mut dyn Observer) -> Result<OpenedScene, JobError> {
        Ok(self.opened(demo::open(&self.folders, self.machine(), observer)?))
    }

    /// Renders the demo scene into posed photos, unless that was done before, and reads them.
    pub(crate) fn open_demo_photos(&self, observer: &mut dyn Observer) -> Result<OpenedScene, JobError> {
        Ok(self.opened(demo::open_photos(&self.folders, self.machine(), observer)?))
    }

    /// Finds the camera poses of photos or a video, and reads the result.
    pub(crate) fn find_poses(
        &self,
        request: &PoseRequest,
        observer: &mut dyn Observer,
    ) -> Result<OpenedScene, JobError> {
        let found = front_door::find_here(request, &self.folders, observer)?;
        found.tell(observer);
        Ok(self.opened(open::open(&found.out, &self.folders, self.machine(), observer)?))
    }

    /// Fits Gaussians to photos, in `out` or in the first folder that is free for these settings.
    ///
    /// # Errors
    /// If training fails, or was canceled before its first step.
    pub(crate) fn train(
        &self,
        dataset: &Dataset,
        config: &TrainConfig,
        out: Option<PathBuf>,
        from: &TrainStart,
        observer: &mut dyn Observer,
    ) -> Result<TrainingEnd, JobError> {
        // Other settings get a folder of their own; which one is seen when it is needed.
        let folders = out.into_iter().chain(std::iter::once_with(|| self.folders.fresh(dataset.source())));
        let done = match train::run(dataset, config, folders, from, observer) {
            Err(JobError::Train(TrainError::Checkpoint(e @ CheckpointError::OtherInputs { .. }))) => {
                return Ok(TrainingEnd::InputsChanged(e.to_string()));
            }
            done => done?,
        };
        self.knows(&done.out, done.state.clone());
        self.note_use(&done.out);
        let stopped_at = (!done.is_finished()).then_some(done.outcome.steps);
        if stopped_at == Some(0) {
            return Err(Interrupted.into());
        }
        let Trained { outcome, out, semantics, .. } = done;
        let cloud = &outcome.cloud;
        let facts = plan::facts(self.machine(), Some(dataset), Some((cloud, cloud.sh_degree)), config);
        let facts = facts.with_semantics(semantics.as_deref());
        let runs = runs::list(&self.folders, dataset.source());
        let evaluations = outcome.evaluations;
        Ok(TrainingEnd::Trained(Box::new(TrainedRun { evaluations, out, semantics, runs, stopped_at, facts })))
    }

    /// Measures PSNR and SSIM of `cloud` on held-out photos; it is of the trained scene in `out`, if there is one.
    pub fn evaluate(
        &self,
        dataset: Arc<Dataset>,
        cloud: Arc<GaussianCloud>,
        config: TrainConfig,
        settings: RenderSettings,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<Evaluation, JobError> {
        let info = if trained::is_scene(out) { Some(trained::load_info(out)?) } else { None };
        let folder = info.is_some().then(|| out.to_path_buf());
        let (cameras, edited) = info.map(|info| (info.cameras, info.edited)).unwrap_or_default();
        let scene = Scene { cloud, cameras, settings, config, folder, edited, ..Scene::default() };
        evaluate::photometric(&PhotoComparison::of(&scene, dataset, EvaluateOptions::default())?, observer)
    }

    /// Finds the objects and parts of a trained scene, and stores them with it.
    pub fn find_objects(
        &self,
        request: &FindRequest,
        observer: &mut dyn Observer,
    ) -> Result<Arc<SemanticMap>, JobError> {
        let done = find_objects::run(request, self.known(&request.folder).as_deref(), observer)?;
        self.knows(&request.folder, Some(done.state));
        Ok(Arc::new(done.found.map))
    }

    /// Changes objects and parts of the scene in `out`, and stores them with it.
    pub fn edit_objects(
        &self,
        cloud: &GaussianCloud,
        map: &SemanticMap,
        request: &EditRequest,
        out: &Path,
    ) -> Result<Arc<SemanticMap>, JobError> {
        let new = edit::apply(cloud, map, request)?;
        if let Some(state) = edit::store(out, self.known(out).as_deref(), &new, cloud)? {
            self.knows(out, Some(state));
        }
        Ok(new)
    }

    /// Changes the Gaussians of a scene, and stores them.
    pub(crate) fn rearrange(&self, request: &RearrangeRequest) -> Result<RearrangedScene, JobError> {
        let done = rearrange::run(request, self.known(&request.path).as_deref())?;
        self.knows(&done.folder, Some(done.state.clone()));
        Ok(done)
    }

    /// Stores the length of a unit of the scene in `out`. Returns false if there is no scene to store it with.
    pub(crate) fn set_scale(&self, out: &Path, meters_per_unit: f64) -> Result<bool, JobError> {
        scale::store(out, self.known(out).as_deref(), meters_per_unit)
    }

    /// Deletes the scene in `folder`, in the state that is known of it.
    ///
    /// # Errors
    /// As [`runs::delete_scene`].
    pub(crate) fn delete(&self, folder: &Path) -> Result<(), JobError> {
        runs::delete_scene(&self.folders, folder, self.known(folder).as_deref())
    }

    /// Returns how the scene in `folder` differs from its known state, if it does.
    pub(crate) fn changed_elsewhere(&self, folder: &Path) -> Option<ChangeElsewhere> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(folder).cloned()?;
        match trained::load_info(folder) {
            Ok(info) => (info.state != known).then_some(ChangeElsewhere::Saved(info.state)),
            // What never had a state was no scene.
            Err(_) => (known.is_some() && !trained::is_scene(folder)).then_some(ChangeElsewhere::Gone),
        }
    }

    fn opened(&self, mut scene: OpenedScene) -> OpenedScene {
        scene.reports = report::known(&scene.path, &scene.report_out);
        self.knows(&scene.out, scene.state.clone());
        self.note_use(&scene.out);
        scene
    }

    /// Records the state in which the scene in `folder` is known.
    fn knows(&self, folder: &Path, state: Option<String>) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.into(), state);
    }

    fn known(&self, folder: &Path) -> Option<String> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(folder).cloned().flatten()
    }

    /// Records this training as the one that its photos are opened with next time.
    fn note_use(&self, folder: &Path) {
        // A full disk is no error here: the user did not ask for this record.
        let _ = self.folders.note_use(folder);
    }

    /// Resources of the machine, looked up once.
    fn machine(&self) -> &Machine {
        self.machine.get_or_init(plan::machine)
    }
}
