//! Why a job did not do what was asked.

use std::error::Error;
use std::path::PathBuf;

use crate::io::memory::NoRoom;
use crate::io::{IoError, OpenError};
use crate::measure::{BeginError, ReportError, StudyError};
use crate::models::ModelError;
use crate::models::catalog::InstallError;
use crate::models::fetch::FetchError;
use crate::pipeline::depth::DepthError;
use crate::pipeline::observer::Interrupted;
use crate::pipeline::semantics::build_map::FindError;
use crate::pipeline::semantics::edit::EditError;
use crate::pipeline::semantics::segmenter::SegmentError;
use crate::pipeline::synth::SynthError;
use crate::pipeline::train::TrainError;
use crate::pipeline::train::config::UnreadableConfig;
use crate::pipeline::train::trainer::StepError;
use crate::pipeline::video::VideoError;
use crate::render::{DrawError, GpuError, RenderError};

/// Why a job did not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The observer asked to stop.
    #[error("cancelled")]
    Interrupted(#[from] Interrupted),
    /// Nothing that is known lies there.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Photos, where Gaussians are needed.
    #[error("{} holds photos but no Gaussians yet: train them first", .0.display())]
    NotTrained(PathBuf),
    /// Gaussians, where photos are needed.
    #[error("{} holds Gaussians; a folder of posed photos is needed here", .0.display())]
    NoPhotos(PathBuf),
    /// A splat, where a trained scene is needed.
    #[error("{} is no trained scene; the result is stored in its folder", .0.display())]
    NoScene(PathBuf),
    /// The photos of a scene are not known, or gone.
    #[error("{}: its photos are not known or no longer there", .0.display())]
    PhotosGone(PathBuf),
    /// No photo is held out.
    #[error("{}: no photo is held out, so there is nothing to measure on", .0.display())]
    NothingHeldOut(PathBuf),
    /// No photo that was trained on has this name.
    #[error("no photo that was trained on is called '{0}'")]
    UnknownPhoto(String),
    /// Nobody has found objects yet.
    #[error("{} knows no objects yet", .0.display())]
    NoObjects(PathBuf),
    /// A question without words.
    #[error("there is nothing to look for in the query; type an object's name")]
    EmptyQuery,
    /// Nothing is what was asked for.
    #[error("nothing here fits '{0}'")]
    NoMatch(String),
    /// Nothing is left to write.
    #[error("no Gaussian is left to write")]
    NoGaussians,
    /// A protocol lacks what it needs.
    #[error("{0}")]
    Protocol(String),
    /// Another program failed.
    #[error("{doing}: {} failed ({why}). Its last words:\n{said}", .program.display())]
    Program {
        /// The program.
        program: PathBuf,
        /// What it was to do.
        doing: &'static str,
        /// How it ended.
        why: String,
        /// What it said last.
        said: String,
    },
    /// COLMAP is needed and not installed.
    #[error("neither COLMAP nor GLOMAP is installed here: 'colmap' is not found on the PATH")]
    NoTools,
    /// Photos that do not hang together.
    #[error("{}: no camera poses were found; the photos overlap too little or show too little texture", .0.display())]
    NoPosesFound(PathBuf),
    /// The memory that is free is not enough.
    #[error(transparent)]
    Room(#[from] NoRoom),
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// Stored settings cannot be read.
    #[error(transparent)]
    Config(#[from] UnreadableConfig),
    /// Training failed.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// A step of training failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// Objects could not be found.
    #[error(transparent)]
    Find(#[from] FindError),
    /// Masks could not be found.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// An edit makes no sense.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A network failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model could not be put in place.
    #[error(transparent)]
    Install(#[from] InstallError),
    /// A view could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Depths could not be compared.
    #[error(transparent)]
    Depth(#[from] DepthError),
    /// The GPU failed, or there is none.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A frame could not be drawn.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// A video could not be made.
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
    /// A file for a result that is not as it must be.
    #[error("{0}")]
    Output(String),
    /// Synthetic photos could not be made.
    #[error(transparent)]
    Synth(#[from] SynthError),
}

impl JobError {
    /// Whether the observer asked to stop.
    pub(crate) fn is_cancelled(&self) -> bool {
        let fetch = matches!(self, Self::Install(InstallError::Fetch(FetchError::Cancelled { .. })));
        fetch || Interrupted::is_cause_of(self)
    }
}

/// The error and its causes, each once: many errors already quote their cause.
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
    fn each_cause_is_told_once() {
        let cause = || std::io::Error::other("disk full");
        assert_eq!(chain(&Outer::Silent(cause())), "cannot save: disk full");
        assert_eq!(chain(&Outer::Quoting(cause())), "cannot save: disk full");
    }
}
