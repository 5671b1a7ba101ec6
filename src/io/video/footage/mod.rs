//! Videos to read: H.264 in MP4 and QuickTime by the program itself, all else through ffmpeg where it is installed.
//!
//! Frames are handed on one at a time, in the order in which they are shown, turned as the file says.

mod error;
mod h264;
mod index;
mod program;
#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use image::{RgbImage, imageops};

use super::yuv::YuvView;
use crate::io::program::on_path;
pub use error::FootageError;
use index::VideoIndex;

/// Endings of videos that the program reads by itself, where they hold H.264.
const OWN: [&str; 3] = ["mp4", "mov", "m4v"];
/// Endings of videos that ffmpeg reads.
const OTHERS: [&str; 6] = ["mkv", "webm", "avi", "3gp", "mts", "mpg"];
/// Shorter side of a frame below which nothing can be found in it, px.
const LEAST_PX: usize = 32;

/// Video file whose frames can be read.
pub(crate) struct Footage {
    path: PathBuf,
    index: Option<VideoIndex>,
    /// The program that decodes it, if this one does not.
    program: Option<PathBuf>,
}

/// Turn of the picture, clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Turn {
    #[default]
    None,
    Quarter,
    Half,
    ThreeQuarters,
}

/// Frame of a video.
pub(crate) struct VideoFrame<'a> {
    pixels: FramePixels<'a>,
    turn: Turn,
}

enum FramePixels<'a> {
    Yuv(YuvView<'a>),
    Rgb(&'a RgbImage),
}

/// Returns whether a file is a video by its name.
pub(crate) fn is_video(path: &Path) -> bool {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    ending.is_some_and(|e| OWN.contains(&e.as_str()) || OTHERS.contains(&e.as_str()))
}

impl Footage {
    /// Opens a video. `path_variable` is where ffmpeg is looked for.
    ///
    /// # Errors
    /// If the file is no video, has no frames, or needs a program that is not there.
    pub(crate) fn open(path: &Path, path_variable: &OsStr) -> Result<Self, FootageError> {
        let program = on_path(path_variable, "ffmpeg");
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !OWN.contains(&ending.as_str()) {
            let codec = format!("the format .{ending}");
            let program = program.ok_or_else(|| FootageError::NeedsProgram { path: path.into(), codec })?;
            return Ok(Self { path: path.into(), index: None, program: Some(program) });
        }
        let index = VideoIndex::read(path)?;
        let (width, height) = index.size_px;
        if width.min(height) < LEAST_PX {
            return Err(FootageError::TooSmall { path: path.into(), width, height });
        }
        let program = match (&index.other_codec, program) {
            (None, _) => None,
            (Some(_), Some(program)) => Some(program),
            (Some(codec), None) => {
                return Err(FootageError::NeedsProgram { path: path.into(), codec: codec.clone() });
            }
        };
        Ok(Self { path: path.into(), index: Some(index), program })
    }

    /// Number of frames, if it is known before they are read.
    pub(crate) fn frames(&self) -> Option<usize> {
        self.index.as_ref().map(|index| index.samples.len())
    }

    /// Hands each frame with its number to `visit`, until that fails.
    ///
    /// # Errors
    /// Errors of `visit`, and of frames that cannot be decoded.
    pub(crate) fn visit<E: From<FootageError>>(
        &self,
        visit: &mut dyn FnMut(usize, &VideoFrame<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let read = match (&self.program, &self.index) {
            (Some(program), _) => program::visit(&self.path, program, visit),
            (None, Some(index)) => h264::visit(&self.path, index, visit),
            (None, None) => Ok(0),
        };
        match read? {
            0 => Err(FootageError::NoFrames { path: self.path.clone() }.into()),
            _ => Ok(()),
        }
    }
}

impl VideoFrame<'_> {
    /// Luma and size before the turn, 0 to 255.
    pub(crate) fn luma(&self) -> (Vec<f32>, (usize, usize)) {
        match &self.pixels {
            FramePixels::Yuv(view) => (view.luma(), view.size_px),
            FramePixels::Rgb(picture) => {
                let luma = picture.pixels().map(|p| super::yuv::luma(p.0.map(f32::from))).collect();
                (luma, (picture.width() as usize, picture.height() as usize))
            }
        }
    }

    /// Picture as it is shown.
    pub(crate) fn picture(&self) -> Option<RgbImage> {
        let stored = match &self.pixels {
            FramePixels::Yuv(view) => RgbImage::from_raw(view.size_px.0 as u32, view.size_px.1 as u32, view.rgb())?,
            FramePixels::Rgb(picture) => (*picture).clone(),
        };
        Some(match self.turn {
            Turn::None => stored,
            Turn::Quarter => imageops::rotate90(&stored),
            Turn::Half => imageops::rotate180(&stored),
            Turn::ThreeQuarters => imageops::rotate270(&stored),
        })
    }
}
