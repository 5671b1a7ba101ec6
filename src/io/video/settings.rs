//! Settings of a video.

use std::path::{Path, PathBuf};

use super::{Result, VideoFileError};
use crate::scene::Camera;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VideoSettings {
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    pub(crate) fps: f64,
    /// From 0 (smallest file) to 100 (best picture).
    pub(crate) quality: u8,
    /// True if a video or frames of the same name may be replaced.
    pub(crate) overwrite: bool,
    pub(crate) encoder: VideoEncoder,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum VideoEncoder {
    #[default]
    BuiltIn,
    /// A program with ffmpeg's command line, fed through a pipe.
    Ffmpeg {
        /// The program: `ffmpeg`, or a path to it.
        program: PathBuf,
        /// Arguments for the output, after the program's own, so that they take precedence.
        args: Vec<String>,
    },
}

impl VideoSettings {
    /// Makes settings for a video of this size and rate: quality 80, built-in encoder, nothing is overwritten.
    pub(crate) fn new(width_px: u32, height_px: u32, fps: f64) -> Self {
        Self { width_px, height_px, fps, quality: 80, overwrite: false, encoder: VideoEncoder::BuiltIn }
    }

    /// Refuses settings that no format supports.
    pub(super) fn check(&self, path: &Path) -> Result<()> {
        /// Lowest and highest frames per second.
        const FPS: std::ops::RangeInclusive<f64> = 0.01..=240.0;
        let bad = |what, remedy| Err(VideoFileError::Setting { path: path.into(), what, remedy });
        let (w, h) = (self.width_px, self.height_px);
        if w == 0 || h == 0 || w.max(h) > Camera::MAX_SIDE_PX {
            let what = format!("{w} x {h} px is not between 1 and {} px a side", Camera::MAX_SIDE_PX);
            return bad(what, "choose another size");
        }
        if !FPS.contains(&self.fps) {
            let what = format!("{} frames per second are not between {} and {}", self.fps, FPS.start(), FPS.end());
            return bad(what, "choose another rate");
        }
        if self.quality > 100 {
            return bad(format!("quality {} is not between 0 and 100", self.quality), "choose another quality");
        }
        Ok(())
    }

    /// Refuses an existing path, unless it may be overwritten.
    pub(super) fn check_free(&self, path: &Path) -> Result<()> {
        if !self.overwrite && path.symlink_metadata().is_ok() {
            return Err(VideoFileError::Exists { path: path.into() });
        }
        Ok(())
    }

    pub(super) fn frame_bytes(&self) -> u64 {
        u64::from(self.width_px) * u64::from(self.height_px) * 3
    }

    /// Most frames, those of a day, so that every time fits the formats' numbers.
    pub(super) fn most_frames(&self) -> u64 {
        (86_400.0 * self.fps).max(1.0) as u64
    }

    /// Start of frame `frame`, in parts of a second, rounded once so that errors do not add up.
    pub(super) fn time(&self, frame: u64, parts_per_sec: f64) -> u64 {
        (frame as f64 * parts_per_sec / self.fps).round() as u64
    }

    /// H.264's quantizer, 51 to 12, for the quality.
    pub(super) fn quantizer(&self) -> u8 {
        51 - (u32::from(self.quality) * 39 / 100) as u8
    }
}
