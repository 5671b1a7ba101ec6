//! Errors of reading a video: each names the file and the remedy.

use std::path::PathBuf;

use crate::io::IoError;

/// Video that cannot be read.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum FootageError {
    #[error("{path} is no video that can be read: {why}")]
    NoVideo { path: PathBuf, why: String },
    #[error("{path} has no picture, only {found}; a video with a picture is needed")]
    NoPicture { path: PathBuf, found: &'static str },
    #[error("{path} has no frames; record it again")]
    NoFrames { path: PathBuf },
    #[error("{path} is cut off: frame {frame} of {frames} lies beyond its end; copy it again")]
    CutOff { path: PathBuf, frame: usize, frames: usize },
    #[error("the frames of {path} are {width} x {height} px, too small for photos")]
    TooSmall { path: PathBuf, width: usize, height: usize },
    #[error(
        "{path} is a video in {codec}, which ffmpeg reads, and there is no 'ffmpeg' on the PATH. Install it \
         (ffmpeg.org), or convert the video: ffmpeg -i '{path}' -c:v libx264 -crf 16 video.mp4"
    )]
    NeedsProgram { path: PathBuf, codec: String },
    #[error(
        "frame {frame} of {path} cannot be decoded ({reason}); convert the video with ffmpeg: ffmpeg -i '{path}' -c:v libx264 -crf 16 video.mp4"
    )]
    Decoder { path: PathBuf, frame: usize, reason: String },
    #[error("{path}: '{program}' could not read it ({status}). Last output:\n{last_words}")]
    Program { path: PathBuf, program: PathBuf, status: String, last_words: String },
    #[error(transparent)]
    Io(#[from] IoError),
}
