//! Errors of jobs.

use std::error::Error;
use std::path::PathBuf;

use super::poses::MakerKind;
use crate::io::memory::NoRoom;
use crate::io::results::Method;
use crate::io::video::footage::FootageError;
use crate::io::{IoError, OpenError};
use crate::measure::{BeginError, ReportError, StudyError};
use crate::models::ModelError;
use crate::models::catalog::InstallError;
use crate::models::fetch::FetchError;
use crate::pipeline::cleaning::{CleanError, RuleError};
use crate::pipeline::depth::DepthError;
use crate::pipeline::locate::LocateError;
use crate::pipeline::observer::Interrupted;
use crate::pipeline::removal::RemovalError;
use crate::pipeline::semantics::lifting::edit::EditError;
use crate::pipeline::semantics::lifting::error::FindError;
use crate::pipeline::semantics::query::foreign::ForeignError;
use crate::pipeline::splat_edit::SplatEditError;
use crate::pipeline::synth::SynthError;
use crate::pipeline::train::TrainError;
use crate::pipeline::train::config::UnreadableConfig;
use crate::pipeline::train::trainer::StepError;
use crate::pipeline::video::VideoError;
use crate::render::{DrawError, GpuError, RenderError};

/// Error of a job.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum JobError {
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error("{} holds photos but no Gaussians yet: train them first", .0.display())]
    NotTrained(PathBuf),
    #[error("{} holds Gaussians; a folder of posed photos is needed here", .0.display())]
    NoPhotos(PathBuf),
    #[error("{} is not a trained scene, in whose folder the result is stored", .0.display())]
    NoScene(PathBuf),
    #[error("{}: its photos cannot be found", .0.display())]
    PhotosGone(PathBuf),
    #[error("{}: no photo is held out, so there is nothing to measure on", .0.display())]
    NothingHeldOut(PathBuf),
    /// The data set itself marks its held-out photos.
    #[error("{} marks {marked} of its {all} photos as test: these are held out, not every n-th", .data.display())]
    TestPhotos {
        /// The data set.
        data: PathBuf,
        /// Number of photos that it marks.
        marked: usize,
        /// Number of all its photos.
        all: usize,
    },
    #[error("no photo that was trained on is called '{0}'")]
    UnknownPhoto(String),
    #[error("the photo '{0}' is held out to measure with, so nothing is learned from it; choose another one")]
    HeldOut(String),
    #[error("{} has no objects yet", .0.display())]
    NoObjects(PathBuf),
    /// Result of another method without objects.
    #[error("{}: the result of {} has no objects yet", .path.display(), .method.name())]
    NotGrouped {
        /// The result.
        path: PathBuf,
        /// Method that made it.
        method: Method,
    },
    #[error(transparent)]
    Foreign(#[from] ForeignError),
    #[error("the query is empty; type an object's name")]
    EmptyQuery,
    #[error("no match for '{0}'")]
    NoMatch(String),
    /// A list of sentences cannot be asked.
    #[error("{0}")]
    Questions(String),
    /// Several things fit where one is meant.
    #[error("several things fit '{text}': ask for '{names}', or for all of them")]
    SeveralFit {
        /// The query.
        text: String,
        /// Full names.
        names: String,
    },
    /// Found only by embedding; changes need a name.
    #[error("no name here says '{text}'; by embedding it may be {name}: to change that, ask for '{name}'")]
    OnlyLooks {
        /// The query.
        text: String,
        /// Full name of the best match.
        name: String,
    },
    #[error("{0}")]
    Phrases(String),
    #[error("no Gaussians left to export")]
    NoGaussians,
    #[error("{0}")]
    Protocol(String),
    /// Another program failed.
    #[error("{doing}: {} failed ({why}). Last output:\n{said}", .program.display())]
    Program {
        /// The program.
        program: PathBuf,
        /// Its task.
        doing: &'static str,
        /// Reason of its failure.
        why: String,
        /// Its last output.
        said: String,
    },
    /// No maker of camera poses is here, or not the wanted one.
    #[error("{}", no_maker(*.0))]
    NoPoseMaker(Option<MakerKind>),
    /// The maker that is built in failed.
    #[error("finding camera poses: {0}; the photos may overlap too little or have too little texture")]
    #[cfg(feature = "sfm")]
    BuiltInPoses(String),
    /// There is no Python for an environment of its own.
    #[error("there is no Python ('python3' on the PATH) to install pycolmap into; install Python from python.org")]
    NoPython,
    #[error(transparent)]
    Footage(#[from] FootageError),
    /// A video that gives too few different photos.
    #[error("{}: the camera hardly moves, so there are too few different photos; walk around things while recording", .0.display())]
    StillVideo(PathBuf),
    /// Photos that overlap too little.
    #[error("{}: no camera poses were found; the photos overlap too little or have too little texture", .0.display())]
    NoPosesFound(PathBuf),
    /// Too little free memory.
    #[error(transparent)]
    Room(#[from] NoRoom),
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Config(#[from] UnreadableConfig),
    #[error(transparent)]
    Train(#[from] TrainError),
    /// A step of training failed.
    #[error(transparent)]
    Step(#[from] StepError),
    #[error(transparent)]
    Find(#[from] FindError),
    #[error(transparent)]
    Edit(#[from] EditError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Install(#[from] InstallError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Remove(#[from] RemovalError),
    #[error(transparent)]
    SplatEdit(#[from] SplatEditError),
    #[error(transparent)]
    Clean(#[from] CleanError),
    #[error(transparent)]
    CleanRule(#[from] RuleError),
    #[error(transparent)]
    Depth(#[from] DepthError),
    #[error(transparent)]
    Locate(#[from] LocateError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Video(#[from] VideoError),
    /// A report cannot be resumed.
    #[error(transparent)]
    Report(#[from] BeginError),
    /// A report cannot be read.
    #[error(transparent)]
    ReadReport(#[from] ReportError),
    /// A measurement failed.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// A file for a result that is not valid.
    #[error("{0}")]
    Output(String),
    /// Units of a batch that cannot be run or merged.
    #[error("{0}")]
    Batch(String),
    #[error(transparent)]
    Synth(#[from] SynthError),
    /// Photos that cannot be added to a scene.
    #[error("{0}")]
    AddPhotos(String),
}

impl JobError {
    pub(crate) fn is_cancelled(&self) -> bool {
        let fetch = matches!(
            self,
            Self::Install(
                InstallError::Fetch(FetchError::Cancelled { .. }) | InstallError::Model(ModelError::Cancelled)
            )
        );
        fetch || Interrupted::is_cause_of(self)
    }
}

/// Sentence on a maker of camera poses that is not here.
fn no_maker(wanted: Option<MakerKind>) -> String {
    match wanted {
        None => "nothing here finds camera poses: neither COLMAP ('colmap' on the PATH, from colmap.github.io) nor pycolmap \
                 (in the active Python) is installed"
            .into(),
        Some(MakerKind::Colmap) => {
            "COLMAP is not installed: 'colmap' is not found on the PATH; get it from colmap.github.io".into()
        }
        Some(MakerKind::Pycolmap) => {
            "pycolmap is not found in the active Python (VIRTUAL_ENV, or 'python3' on the PATH); 'pip install pycolmap' \
             adds it"
                .into()
        }
        Some(MakerKind::BuiltIn) => {
            "this program was built without its own maker of poses; build it with 'cargo build --release --features sfm \
             --ignore-rust-version'"
                .into()
        }
    }
}

/// Returns whether the machine failed, not the request: the disk is full or cannot be written to.
pub(crate) fn is_of_machine(error: &(dyn Error + 'static)) -> bool {
    use std::io::ErrorKind as K;
    let mut next = Some(error);
    while let Some(cause) = next {
        let kind = cause.downcast_ref::<std::io::Error>().map(std::io::Error::kind);
        if let Some(K::StorageFull | K::QuotaExceeded | K::ReadOnlyFilesystem) = kind {
            return true;
        }
        next = cause.source();
    }
    false
}

/// Joins the error and its causes, each once: many errors already quote their cause.
pub(crate) fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text.push_str(": ");
            text.push_str(&cause_text);
        }
        next = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    enum Outer {
        #[error("cannot save")]
        Silent(#[source] std::io::Error),
        #[error("cannot save: {0}")]
        Quoting(#[source] std::io::Error),
    }

    #[test]
    fn a_full_disk_is_the_machines_fault_however_deep_it_lies() {
        let of = |kind: std::io::ErrorKind| {
            let (path, remedy) = (PathBuf::from("x"), "");
            IoError::Write { path, remedy, cause: kind.into() }
        };
        let full = || of(std::io::ErrorKind::StorageFull);
        assert!(is_of_machine(&JobError::Io(full())) && is_of_machine(&JobError::Train(TrainError::Save(full()))));
        assert!(is_of_machine(&JobError::Io(of(std::io::ErrorKind::ReadOnlyFilesystem))));
        assert!(!is_of_machine(&JobError::Io(of(std::io::ErrorKind::NotFound))));
        assert!(!is_of_machine(&JobError::EmptyQuery));
    }

    #[test]
    fn each_cause_is_told_once() {
        let cause = || std::io::Error::other("disk full");
        assert_eq!(chain(&Outer::Silent(cause())), "cannot save: disk full");
        assert_eq!(chain(&Outer::Quoting(cause())), "cannot save: disk full");
    }
}
