//! Errors of writing a video: each names the file and the remedy.

use std::path::PathBuf;

use crate::io::IoError;

/// A video that could not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum VideoFileError {
    #[error("{path} does not say a format that can be written: use one of {known}; other formats need ffmpeg")]
    UnknownFormat { path: PathBuf, known: String },
    #[error("{path}: {what}; {remedy}")]
    Setting { path: PathBuf, what: String, remedy: &'static str },
    #[error("{path} exists; choose another name, or allow overwriting")]
    Exists { path: PathBuf },
    #[error("frame {frame} has {found} bytes instead of {expected} (width x height x 3)")]
    FrameBytes { frame: u64, found: u64, expected: u64 },
    #[error("{path}: a video has at most {most} frames; write several videos")]
    TooManyFrames { path: PathBuf, most: u64 },
    #[error("{path} was not written: it has no frames")]
    NoFrames { path: PathBuf },
    #[error("{path} was not written: an earlier frame failed")]
    Broken { path: PathBuf },
    #[error("{path} was not written: the encoder failed ({reason}); try another format or size")]
    Encoder { path: PathBuf, reason: String },
    #[error("cannot start '{program}': {cause}; install ffmpeg or give its path, or use the built-in encoder")]
    Program { program: PathBuf, cause: std::io::Error },
    #[error("{path} was not written: '{program}' ended with {status}. Last output:\n{last_words}")]
    ProgramFailed { path: PathBuf, program: PathBuf, status: String, last_words: String },
    #[error(transparent)]
    Io(#[from] IoError),
}
