//! Failures of a subcommand, and the exit codes that report them to a script.

use std::error::Error;
use std::process::ExitCode;

use super::{STOPPED, output};
use crate::io::OpenError;
use crate::io::results::MethodKind;
use crate::jobs::JobError;
use crate::jobs::error::chain;
use crate::jobs::poses::environment::TERMS;
use crate::measure::BeginError;
use crate::pipeline::observer::Interrupted;
use crate::pipeline::train::TrainError;
use crate::pipeline::train::checkpoint::CheckpointError;

/// Reason for which a subcommand failed.
#[derive(Debug)]
pub(crate) enum CliError {
    /// The arguments make no sense together; exit code 2, as for arguments that do not parse.
    Usage(String),
    /// The work failed; exit code 1.
    Failed(Box<dyn Error + Send + Sync>),
    /// A signal, in a batch; exit code [`STOPPED`]. The text says what was saved.
    Stopped(String),
    /// Ctrl-C or SIGTERM; exit code 130. The text says what was saved and how to go on.
    Cancelled(String),
}

impl CliError {
    /// A failure described by `text`: what, where, and what to do about it.
    pub(crate) fn failed(text: impl Into<String>) -> Self {
        Self::Failed(text.into().into())
    }

    /// A job that failed, with what can be done about it here.
    fn of_job(error: JobError) -> Self {
        let remedy = match &error {
            _ if error.is_cancelled() => return Self::Cancelled(chain(&error)),
            JobError::EmptyQuery => return Self::Usage(error.to_string()),
            JobError::NoPoseMaker(None) => {
                format!(
                    ". 'fmlgs poses PHOTOS --install' {TERMS}; without it, 'fmlgs poses PHOTOS --by-hand' shows commands"
                )
            }
            JobError::NotTrained(path) => format!(", with 'fmlgs train {} --out SCENE'", path.display()),
            JobError::PhotosGone(_) => "; give them with --photos".into(),
            JobError::Open(OpenError::NoPoses(photos)) => {
                format!(
                    "; find them with 'fmlgs poses {0}', or train at once with 'fmlgs train {0}'",
                    photos.folder.display()
                )
            }
            JobError::TestPhotos { .. } => {
                return Self::Usage(format!("--held-out-every has no effect here: {error}. Leave the option out"));
            }
            JobError::Train(TrainError::Checkpoint(CheckpointError::OtherInputs { .. })) => {
                return Self::Usage(format!("{error}. Choose another folder to train anew"));
            }
            JobError::Output(_) => return Self::Usage(error.to_string()),
            JobError::Report(BeginError::Other(..)) => " (--out); --fresh forgets it".into(),
            JobError::NothingHeldOut(_) => "; --held-out-every 0 compares with all photos".into(),
            JobError::NoObjects(path) => format!("; find them with 'fmlgs preprocess {}'", path.display()),
            JobError::NotGrouped { path, method } => match method.kind() {
                MethodKind::Embeddings if method.encoder().is_some() => {
                    format!("; its embeddings answer phrases: 'fmlgs query {} PHRASE'", path.display())
                }
                MethodKind::Embeddings => {
                    format!("; 'fmlgs import {} --out SCENE' and 'fmlgs preprocess SCENE' find some", path.display())
                }
                _ => format!("; 'fmlgs import {} --out SCENE' makes some", path.display()),
            },
            JobError::NoScene(path) => format!("; 'fmlgs import {} --out SCENE' makes one of a splat", path.display()),
            JobError::UnknownPhoto(_) => "; see 'fmlgs info'".into(),
            JobError::NoMatch(_) => "; see 'fmlgs query'".into(),
            _ => return Self::Failed(Box::new(error)),
        };
        Self::failed(format!("{error}{remedy}"))
    }

    /// Error of work that may have been canceled; `saved` names the results that are kept then.
    pub(crate) fn of_work(error: impl Error + Send + Sync + 'static, saved: &str) -> Self {
        if Interrupted::is_cause_of(&error) { Self::Cancelled(saved.into()) } else { error.into() }
    }

    /// Error of a measurement of views: without all of them there is no result.
    pub(crate) fn of_views(error: JobError) -> Self {
        Self::of_work(error, "not all views were measured")
    }

    /// Prints the error to standard error and returns its exit code.
    pub(crate) fn report(&self) -> ExitCode {
        match self {
            Self::Usage(text) => {
                output::note(&format!("error: {text}"));
                output::note("");
                output::note("For more information, try 'fmlgs --help'.");
                ExitCode::from(2)
            }
            Self::Failed(error) => {
                output::note(&format!("error: {}", chain(error.as_ref())));
                ExitCode::FAILURE
            }
            Self::Stopped(text) => {
                output::note(&format!("stopped: {text}"));
                ExitCode::from(STOPPED)
            }
            Self::Cancelled(text) => {
                output::note(&format!("canceled: {text}"));
                ExitCode::from(130)
            }
        }
    }
}

impl<E: Error + Send + Sync + 'static> From<E> for CliError {
    fn from(error: E) -> Self {
        let error: Box<dyn Error + Send + Sync> = Box::new(error);
        error.downcast::<JobError>().map_or_else(Self::Failed, |job| Self::of_job(*job))
    }
}
