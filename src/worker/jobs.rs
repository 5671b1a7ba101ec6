//! Dispatch of each command to its job in [`crate::jobs`]. The only implementation of [`Jobs`] that ships.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::failure::{Failure, Stop};
use super::protocol::{Command, Outcome};
use super::thread::Jobs;
use crate::io::{self, OpenError, trained};
use crate::jobs::evaluate::{self, EvaluateOptions, PhotoComparison};
use crate::jobs::export_splat::{self, LossViews};
use crate::jobs::models::Source;
use crate::jobs::train::{TrainStart, Trained};
use crate::jobs::{
    Folders, JobError, OpenedScene, Scene, clean, demo, edit, export, export_all, find_objects, go_to, inspect, models,
    open, page, phrases, plan, poses, rearrange, recent, remove, report, scale, select, thumbnails, train, video,
};
use crate::measure::{End, FILE, Report};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{TrainConfig, TrainError};
use crate::render::RenderSettings;
use crate::scene::{Dataset, GaussianCloud, Machine};

/// Runs commands on the jobs.
pub struct PipelineJobs {
    folders: Folders,
    machine: OnceLock<Machine>,
    /// State in which the window knows the scene in a folder; changes that another program saved since are not
    /// overwritten.
    known: Mutex<HashMap<PathBuf, Option<String>>>,
}

impl PipelineJobs {
    /// Keeps what it makes in `folders`.
    pub fn new(folders: Folders) -> Self {
        Self { folders, machine: OnceLock::new(), known: Mutex::default() }
    }

    /// Records that the window knows the scene in `folder` in the state `state`.
    fn knows(&self, folder: &Path, state: Option<String>) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.into(), state);
    }

    /// The state in which the window knows the scene in `folder`.
    fn known(&self, folder: &Path) -> Option<String> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(folder).cloned().flatten()
    }

    /// Records this training as the one that its photos are opened with next time.
    fn uses(&self, folder: &Path) {
        // A full disk is no error here: the user did not ask for this record.
        let _ = self.folders.note_use(folder);
    }

    /// Resources of the machine, looked up once.
    fn machine(&self) -> &Machine {
        self.machine.get_or_init(plan::machine)
    }

    fn opened(&self, mut scene: OpenedScene) -> Outcome {
        scene.reports = report::known(&scene.path, &scene.report_out);
        self.knows(&scene.out, scene.state.clone());
        self.uses(&scene.out);
        Outcome::Opened(Box::new(scene))
    }

    fn train(
        &self,
        dataset: &Dataset,
        config: &TrainConfig,
        (out, from): (Option<PathBuf>, &TrainStart),
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Stop> {
        // Other settings get a folder of their own; which one is seen when it is needed.
        let folders = out.into_iter().chain(std::iter::once_with(|| self.folders.fresh(dataset.source())));
        let done = match train::run(dataset, config, folders, from, observer) {
            Err(JobError::Train(TrainError::Checkpoint(e @ CheckpointError::OtherInputs { .. }))) => {
                return Ok(Outcome::InputsChanged(e.to_string()));
            }
            done => done?,
        };
        self.knows(&done.out, done.state.clone());
        self.uses(&done.out);
        let stopped_at = (!done.is_finished()).then_some(done.outcome.steps);
        if stopped_at == Some(0) {
            return Err(Stop::Cancelled);
        }
        let Trained { outcome, out, semantics, .. } = done;
        let cloud = &outcome.cloud;
        let facts = plan::facts(self.machine(), Some(dataset), Some((cloud, cloud.sh_degree)), config);
        let facts = Box::new(facts.with_semantics(semantics.as_deref()));
        let runs = recent::runs(&self.folders, &dataset.root);
        Ok(Outcome::Trained { evaluations: outcome.evaluations, out, semantics, runs, stopped_at, facts })
    }
}

impl Jobs for PipelineJobs {
    fn run(&self, command: Command, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
        Ok(match command {
            Command::Open { path } => match open::open(&path, &self.folders, self.machine(), observer) {
                Err(JobError::Open(OpenError::NoPoses(photos))) => Outcome::Unposed(photos),
                opened => self.opened(opened?),
            },
            Command::OpenBeside { path } => {
                Outcome::Beside(Box::new(open::open(&path, &self.folders, self.machine(), observer)?))
            }
            Command::FindPoses(photos) => {
                let tools = poses::PoseTools::installed().ok_or(JobError::NoTools)?;
                let found = poses::find(&photos, &tools, &self.folders, observer)?;
                self.opened(open::open(&found, &self.folders, self.machine(), observer)?)
            }
            Command::Demo => self.opened(demo::open(&self.folders, self.machine(), observer)?),
            Command::DemoPhotos => self.opened(demo::open_photos(&self.folders, self.machine(), observer)?),
            Command::Train { dataset, config, out, from } => {
                return self.train(&dataset, &config, (out, &from), observer);
            }
            Command::Evaluate { dataset, cloud, config, settings, out } => {
                Outcome::Evaluated(measured(dataset, cloud, (config, settings), &out, observer)?)
            }
            Command::FindObjects(request) => {
                let known = self.known(&request.folder);
                let done = find_objects::run(&request, known.as_deref(), observer)?;
                self.knows(&request.folder, Some(done.state));
                let map = Arc::new(done.found.map);
                if request.known.is_some() { Outcome::Edited(map) } else { Outcome::Objects(map) }
            }
            Command::Remove(request) => Outcome::Removed(Box::new(remove::beside(&request, observer)?)),
            Command::EditObjects { cloud, map, request, out } => {
                let failed = |remedy| move |e: JobError| Stop::Failed(Failure::of(&e, remedy));
                let new = match edit::apply(&cloud, &map, &request) {
                    Err(JobError::Edit(why)) => return Ok(Outcome::Refused(why.to_string())),
                    done => done.map_err(failed("Nothing has changed."))?,
                };
                let stored = edit::store(&out, self.known(&out).as_deref(), &new, &cloud);
                if let Some(state) = stored.map_err(failed("The change is not stored."))? {
                    self.knows(&out, Some(state));
                }
                Outcome::Edited(new)
            }
            Command::Rearrange(request) => match rearrange::run(&request, self.known(&request.path).as_deref()) {
                Err(JobError::SplatEdit(why)) => Outcome::Refused(why.to_string()),
                Err(e) => return Err(Stop::Failed(Failure::of(&e, "Nothing has changed."))),
                Ok(done) => {
                    self.knows(&done.folder, Some(done.state.clone()));
                    Outcome::Rearranged(Box::new(done))
                }
            },
            Command::MeasureSplats(request) => Outcome::SplatsMeasured(Arc::new(clean::measured(*request, observer)?)),
            Command::Select(request) => match select::run(&request, observer) {
                Err(JobError::Edit(why)) => Outcome::Refused(why.to_string()),
                done => Outcome::Selected(Arc::new(done?)),
            },
            Command::SetScale { out, meters_per_unit } => {
                let stored = scale::store(&out, self.known(&out).as_deref(), meters_per_unit)?;
                Outcome::Scale(meters_per_unit, stored)
            }
            Command::Export { cloud, path } => {
                let views = LossViews::of_cloud(&cloud);
                export_splat::run(&cloud, &path, Some(&views), observer)?.tell_loss(observer);
                Outcome::Written(path)
            }
            Command::Photo { index, photo, max_side_px } => {
                let pixels = io::photo::load(&photo, max_side_px)?;
                Outcome::Photo { index, max_side_px, pixels: Arc::new(pixels) }
            }
            Command::Picture { pixels, path } => {
                export::picture(&path, &pixels)?;
                Outcome::Written(path)
            }
            Command::KeepPicture { of, pixels } => {
                // A full disk is no error here: the user did not ask for this record.
                if let Err(e) = recent::keep(&self.folders, &of, &pixels) {
                    observer.note(Severity::Warning, e.to_string());
                }
                Outcome::Kept
            }
            Command::RecentRuns(of) => Outcome::RecentRuns(recent::several(&self.folders, of)),
            Command::RecentPictures(of) => Outcome::RecentPictures(recent::load(&self.folders, of)),
            Command::InstallModel { id, brought } => {
                let source = brought.as_deref().map_or(Source::Fetch(None), Source::Brought);
                models::install(&id, source, observer)?;
                Outcome::ModelInstalled(id)
            }
            Command::Approach(request) => {
                let (explored, visited) = go_to::visit(*request);
                Outcome::Approached(explored, visited)
            }
            Command::Inspect(request) => Outcome::Inspected(Arc::new(inspect::run(*request)?)),
            Command::ListModels => Outcome::Models(Arc::new(models::list())),
            Command::Explore { cloud, cameras, up } => {
                Outcome::Explored(Arc::new(go_to::Explored::new(cloud, &cameras, up)))
            }
            Command::Video(request) => Outcome::Written(video::run(*request, observer)?.summary.path),
            Command::ExportAll(request) => Outcome::Written(export_all::run(&request, observer)?.folder),
            Command::ExportPage(request) => {
                page::run(&request, observer)?;
                Outcome::Written(request.out)
            }
            Command::Phrases(request) => Outcome::Phrases(phrases::run(&request, observer)?, request.export),
            Command::Measure(request) => {
                let done = report::run(&request, observer)?;
                if done.end == End::Cancelled {
                    let kept = request.out.join(FILE);
                    observer.note(Severity::Info, format!("What was measured so far is kept in {}", kept.display()));
                    return Err(Stop::Cancelled);
                }
                Outcome::Report { path: request.out, report: Arc::new(done.report), second: false }
            }
            Command::ReadReport { path, second } => {
                let report = Arc::new(Report::read(&path)?);
                Outcome::Report { path, report, second }
            }
            Command::Thumbnails { cloud, map, settings, home } => {
                let drawn = thumbnails::draw(&cloud, &map, &settings, &home)?;
                Outcome::Thumbnails(map, drawn)
            }
        })
    }
}

/// Held-out quality of `cloud`, which is of the trained scene in `out` if there is one.
fn measured(
    dataset: Arc<Dataset>,
    cloud: Arc<GaussianCloud>,
    (config, settings): (TrainConfig, RenderSettings),
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<crate::pipeline::observer::Evaluation, JobError> {
    let info = if trained::is_scene(out) { Some(trained::load_info(out)?) } else { None };
    let folder = info.is_some().then(|| out.to_path_buf());
    let (cameras, edited) = info.map(|info| (info.cameras, info.edited)).unwrap_or_default();
    let scene = Scene { cloud, cameras, settings, config, folder, edited, ..Scene::default() };
    evaluate::photometric(&PhotoComparison::of(&scene, dataset, EvaluateOptions::default())?, observer)
}
