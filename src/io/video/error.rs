//! What can go wrong with a video: every error names the file and the remedy.

use std::path::PathBuf;

use crate::io::IoError;

/// A video that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum VideoFileError {
    /// An ending that no format has.
    #[error("{path} does not say a format that can be written: use one of {known}; other formats need ffmpeg")]
    UnknownFormat {
        /// The path.
        path: PathBuf,
        /// The endings there are.
        known: String,
    },
    /// A setting that no video can have, or not this format.
    #[error("{path}: {what}; {remedy}")]
    Setting {
        /// The path.
        path: PathBuf,
        /// The setting and its value.
        what: String,
        /// What the person can do.
        remedy: &'static str,
    },
    /// Something of that name is there already.
    #[error("{path} exists; choose another name, or allow overwriting")]
    Exists {
        /// The file in the way.
        path: PathBuf,
    },
    /// A frame of another size than announced.
    #[error("frame {frame} has {found} bytes instead of {expected} (width x height x 3)")]
    FrameBytes {
        /// Which frame, from 0.
        frame: u64,
        /// Its bytes.
        found: u64,
        /// What it should have.
        expected: u64,
    },
    /// More frames than a video may have.
    #[error("{path}: a video has at most {most} frames; write several videos")]
    TooManyFrames {
        /// The video.
        path: PathBuf,
        /// The limit.
        most: u64,
    },
    /// A video without a frame.
    #[error("{path} was not written: it has no frames")]
    NoFrames {
        /// The video.
        path: PathBuf,
    },
    /// The video was given up at an earlier error.
    #[error("{path} was not written: an earlier frame failed")]
    Broken {
        /// The video.
        path: PathBuf,
    },
    /// An encoder that gives up.
    #[error("{path} was not written: the encoder failed ({reason}); try another format or size")]
    Encoder {
        /// The video.
        path: PathBuf,
        /// What the encoder says.
        reason: String,
    },
    /// A program that does not start.
    #[error("cannot start '{program}': {cause}; install ffmpeg or give its path, or use the built-in encoder")]
    Program {
        /// The program.
        program: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A program that ended with an error.
    #[error("{path} was not written: '{program}' ended with {status}. Its last words:\n{last_words}")]
    ProgramFailed {
        /// The video.
        path: PathBuf,
        /// The program.
        program: PathBuf,
        /// Exit status or signal.
        status: String,
        /// The last lines of its error output.
        last_words: String,
    },
    /// The disk, the folder.
    #[error(transparent)]
    Io(#[from] IoError),
}
