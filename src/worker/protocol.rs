//! Messages to the worker ([`Command`]) and from it ([`Event`]).

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::failure::Failure;
pub use super::kind::{JobId, JobKind, WorkerThread};
use crate::io::unposed::Unposed;
use crate::jobs::clean::{MeasureRequest, MeasuredCloud};
use crate::jobs::edit::EditRequest;
use crate::jobs::export_all::ExportAllRequest;
use crate::jobs::go_to::{ApproachRequest, Approached, Explored};
use crate::jobs::inspect::{InspectRequest, InspectedPixel};
use crate::jobs::models::ModelList;
use crate::jobs::page::PageRequest;
use crate::jobs::phrases::{PhraseRow, PhrasesRequest};
use crate::jobs::rearrange::{RearrangeRequest, RearrangedScene};
use crate::jobs::recent::RunSummary;
use crate::jobs::remove::{RemoveRequest, RemovedScene};
use crate::jobs::report::ReportRequest;
use crate::jobs::select::{SelectRequest, Selected};
use crate::jobs::thumbnails::ThumbnailSet;
use crate::jobs::train::TrainStart;
use crate::jobs::video::VideoRequest;
use crate::jobs::{OpenedScene, find_objects};
use crate::measure::Report;
use crate::pipeline::observer::{Evaluation, Progress, Severity, StepMetrics};
use crate::pipeline::train::TrainConfig;
use crate::render::RenderSettings;
use crate::scene::{Camera, Dataset, GaussianCloud, HomeView, Photo, PhotoPixels, SceneFacts, SemanticMap};

/// Work of a job.
#[derive(Clone, Debug)]
pub enum Command {
    /// Read a dataset, a splat or a trained scene.
    Open {
        /// File or folder.
        path: PathBuf,
    },
    /// Read a scene whose Gaussians are to be seen beside those on screen.
    OpenBeside {
        /// File or folder.
        path: PathBuf,
    },
    /// Read the trained demo that ships with the program.
    Demo,
    /// Render the demo scene into posed photos, unless that was done before, and read them.
    DemoPhotos,
    /// Find the camera poses of photos with programs that are installed, and read the result.
    FindPoses(Box<Unposed>),
    /// Fit Gaussians to photos.
    Train {
        /// The photos.
        dataset: Arc<Dataset>,
        /// Settings of the training.
        config: TrainConfig,
        /// Folder of the trained scene and its checkpoints; `None` = a new one.
        out: Option<PathBuf>,
        /// Gaussians that it begins with.
        from: TrainStart,
    },
    /// Measure PSNR and SSIM on the held-out photos.
    Evaluate {
        /// The photos.
        dataset: Arc<Dataset>,
        /// The Gaussians.
        cloud: Arc<GaussianCloud>,
        /// Picture size, and the hold-out rule where the scene does not say which photos are.
        config: TrainConfig,
        /// Settings of drawing the Gaussians.
        settings: RenderSettings,
        /// Folder of the trained scene.
        out: PathBuf,
    },
    /// Find the objects and parts of a trained scene, and store them with it.
    FindObjects(Box<find_objects::FindRequest>),
    /// Take things out of a scene, into one of its own.
    Remove(Box<RemoveRequest>),
    /// Change the objects and parts of a scene, and store them with it.
    EditObjects {
        /// The Gaussians.
        cloud: Arc<GaussianCloud>,
        /// Objects and parts as they are.
        map: Arc<SemanticMap>,
        /// The change.
        request: EditRequest,
        /// Folder of the trained scene.
        out: PathBuf,
    },
    /// Change the Gaussians of a scene, and store them.
    Rearrange(Box<RearrangeRequest>),
    /// Measure Gaussians, to clean them.
    MeasureSplats(Box<MeasureRequest>),
    /// Find what clicks and strokes select.
    Select(Box<SelectRequest>),
    /// Write Gaussians in the format of the file's ending, and measure what that lost.
    Export {
        /// The Gaussians.
        cloud: Arc<GaussianCloud>,
        /// The file.
        path: PathBuf,
    },
    /// Load a photo, undistorted and at most `max_side_px` along its longer side.
    Photo {
        /// Its index in the dataset.
        index: usize,
        /// The photo.
        photo: Box<Photo>,
        /// Size limit in px.
        max_side_px: u32,
    },
    /// Write a picture as a `.png`.
    Picture {
        /// The picture.
        pixels: Arc<PhotoPixels>,
        /// The file.
        path: PathBuf,
    },
    /// Keep a small picture of a scene for the first page.
    KeepPicture {
        /// Path of the scene.
        of: PathBuf,
        /// The picture.
        pixels: Arc<PhotoPixels>,
    },
    /// Read the pictures that were kept of these scenes.
    RecentPictures(Vec<PathBuf>),
    /// List the trainings of those of these photos that have several.
    RecentRuns(Vec<PathBuf>),
    /// Fetch a model of the catalog, or install the user's files.
    InstallModel {
        /// Its name.
        id: String,
        /// The folder with its files; `None` = its address.
        brought: Option<PathBuf>,
    },
    /// List the models and the engine that runs them.
    ListModels,
    /// Explore the free space of a scene ahead of the first flight.
    Explore {
        /// The Gaussians.
        cloud: Arc<GaussianCloud>,
        /// The photos' cameras.
        cameras: Vec<Camera>,
        /// Up direction.
        up: DVec3,
    },
    /// Find the way to where an identity is seen best.
    Approach(Box<ApproachRequest>),
    /// Find the Gaussians of a pixel.
    Inspect(Box<InspectRequest>),
    /// Draw a video.
    Video(Box<VideoRequest>),
    /// Measure error against run time of drawing, and write it as a report.
    Measure(Box<ReportRequest>),
    /// Store how long a unit of the scene is.
    SetScale {
        /// Folder of the trained scene.
        out: PathBuf,
        /// Meters.
        meters_per_unit: f64,
    },
    /// Read a report.
    ReadReport {
        /// Its folder or file.
        path: PathBuf,
        /// True if it is compared with the report on screen.
        second: bool,
    },
    /// Ask a list of phrases of some views.
    Phrases(Box<PhrasesRequest>),
    /// Write every object and part, and their masks.
    ExportAll(Box<ExportAllRequest>),
    /// Write the scene as a page to show.
    ExportPage(Box<PageRequest>),
    /// Draw every object and part alone, small.
    Thumbnails {
        /// The Gaussians.
        cloud: Arc<GaussianCloud>,
        /// Objects and parts.
        map: Arc<SemanticMap>,
        /// Settings of drawing the Gaussians.
        settings: RenderSettings,
        /// Camera pose to draw from.
        home: HomeView,
    },
}

impl Command {
    /// Kind of the job.
    pub(crate) fn kind(&self) -> JobKind {
        match self {
            Self::Open { .. } => JobKind::Open,
            Self::OpenBeside { .. } => JobKind::Beside,
            Self::Demo => JobKind::Demo,
            Self::DemoPhotos => JobKind::DemoPhotos,
            Self::FindPoses(_) => JobKind::Poses,
            Self::Train { .. } => JobKind::Train,
            Self::Evaluate { .. } => JobKind::Evaluate,
            Self::FindObjects(_) => JobKind::Objects,
            Self::Remove(_) => JobKind::Remove,
            Self::EditObjects { .. } => JobKind::Edit,
            Self::Rearrange(_) => JobKind::Edit,
            Self::MeasureSplats(_) => JobKind::Clean,
            Self::Select(_) => JobKind::Select,
            Self::Export { .. } => JobKind::Export,
            Self::Photo { .. } => JobKind::Photo,
            Self::Picture { .. } | Self::KeepPicture { .. } | Self::RecentPictures(_) | Self::RecentRuns(_) => {
                JobKind::Picture
            }
            Self::Thumbnails { .. } => JobKind::Thumbnails,
            Self::ListModels => JobKind::Models,
            Self::Explore { .. } => JobKind::Explore,
            Self::InstallModel { .. } => JobKind::Model,
            Self::Approach(_) => JobKind::Approach,
            Self::Inspect(_) => JobKind::Inspect,
            Self::Video(_) => JobKind::Video,
            Self::Measure(_) => JobKind::Measure,
            Self::Phrases(_) => JobKind::Phrases,
            Self::ExportAll(_) => JobKind::ExportAll,
            Self::ExportPage(_) => JobKind::ExportPage,
            Self::SetScale { .. } => JobKind::Scale,
            Self::ReadReport { .. } => JobKind::Report,
        }
    }
}

/// Outcome of a finished job.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// A scene was read.
    Opened(Box<OpenedScene>),
    /// A scene to show beside it was read.
    Beside(Box<OpenedScene>),
    /// Photos were read, but their camera poses are unknown.
    Unposed(Box<Unposed>),
    /// Training is done, or was canceled and its state is stored; the Gaussians are in the slot.
    Trained {
        /// Evaluations of the whole run, oldest first.
        evaluations: Vec<Evaluation>,
        /// Folder of the trained scene.
        out: PathBuf,
        /// Objects and parts that were carried over from the scene before.
        semantics: Option<Arc<SemanticMap>>,
        /// All trainings of these photos that this program keeps.
        runs: Vec<RunSummary>,
        /// The step at which it was canceled, if it was.
        stopped_at: Option<u64>,
        /// Facts that the plan of the result is computed from.
        facts: Box<SceneFacts>,
    },
    /// Nothing was done: the training to go on with began with other photos or poses, and how they differ.
    InputsChanged(String),
    /// Held-out quality was measured.
    Evaluated(Evaluation),
    /// Objects and parts were found.
    Objects(Arc<SemanticMap>),
    /// A scene was made without some things.
    Removed(Box<RemovedScene>),
    /// Objects and parts were changed.
    Edited(Arc<SemanticMap>),
    /// Gaussians were changed.
    Rearranged(Box<RearrangedScene>),
    /// Gaussians were measured.
    SplatsMeasured(Arc<MeasuredCloud>),
    /// The length of a unit in meters, and whether it was stored.
    Scale(f64, bool),
    /// Gaussians that clicks and strokes select by now.
    Selected(Arc<Selected>),
    /// An edit was refused, and why.
    Refused(String),
    /// A file was written.
    Written(PathBuf),
    /// Phrases were asked; and where their masks are, if they were written.
    Phrases(Vec<PhraseRow>, Option<PathBuf>),
    /// A picture was kept.
    Kept,
    /// Pictures that were kept, with the scenes that they are of.
    RecentPictures(Vec<(PathBuf, PhotoPixels)>),
    /// Trainings of photos that have several.
    RecentRuns(Vec<(PathBuf, Vec<RunSummary>)>),
    /// A report was read or measured.
    Report {
        /// Path of the report.
        path: PathBuf,
        /// The report.
        report: Arc<Report>,
        /// True if it is compared with the report on screen.
        second: bool,
    },
    /// Thumbnails of objects and parts by number less one.
    Thumbnails(Arc<SemanticMap>, ThumbnailSet),
    /// The models were listed.
    Models(Arc<ModelList>),
    /// A model can be used now.
    ModelInstalled(String),
    /// The free space of a scene was explored.
    Explored(Arc<Explored>),
    /// The way to an identity, or why there is none; and what was learned of the scene.
    Approached(Arc<Explored>, Approached),
    /// The Gaussians of a pixel were found.
    Inspected(Arc<InspectedPixel>),
    /// A photo was loaded.
    Photo {
        /// Its index in the dataset.
        index: usize,
        /// The size limit that was asked for.
        max_side_px: u32,
        /// Its pixels.
        pixels: Arc<PhotoPixels>,
    },
}

/// Event of a job. Each sends `Started` first, and at last one of `Finished`, `Cancelled`, `Failed`.
#[derive(Clone, Debug)]
pub enum Event {
    /// The job has left the queue.
    Started {
        /// Number of the job.
        job: JobId,
        /// Kind of the job.
        kind: JobKind,
        /// Title, for display.
        title: String,
    },
    /// Progress of a job. May be dropped when events are not taken fast enough.
    Progress(JobId, Progress),
    /// Training measurements.
    Step(JobId, StepMetrics),
    /// A held-out evaluation.
    Evaluation(JobId, Evaluation),
    /// A line for the log.
    Note(JobId, Severity, String),
    /// The job now waits (`true`) or goes on (`false`).
    Paused(JobId, bool),
    /// The job has finished.
    Finished(JobId, Outcome),
    /// The job was canceled.
    Cancelled(JobId),
    /// The job has failed.
    Failed(JobId, Failure),
}

impl Event {
    /// The job that the event is about.
    pub fn job(&self) -> JobId {
        match self {
            Self::Started { job, .. } => *job,
            Self::Progress(job, _)
            | Self::Step(job, _)
            | Self::Evaluation(job, _)
            | Self::Note(job, ..)
            | Self::Paused(job, _)
            | Self::Finished(job, _)
            | Self::Cancelled(job)
            | Self::Failed(job, _) => *job,
        }
    }

    /// Returns whether the job is over.
    pub fn is_end(&self) -> bool {
        matches!(self, Self::Finished(..) | Self::Cancelled(_) | Self::Failed(..))
    }
}
