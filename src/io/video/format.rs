//! Formats of videos and their limits.

use std::path::Path;

use super::{Result, VideoFileError, VideoSettings};

/// A format that is written without other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// H.264 in MP4, `.mp4`: plays everywhere.
    Mp4,
    /// Animated GIF, `.gif`: 256 colors per frame.
    Gif,
    /// Animated WebP, `.webp`.
    WebP,
    /// A folder of numbered PNG files, without loss.
    Frames,
}

impl Format {
    pub(crate) const ALL: [Self; 4] = [Self::Mp4, Self::Gif, Self::WebP, Self::Frames];

    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::Mp4 => ".mp4",
            Self::Gif => ".gif",
            Self::WebP => ".webp",
            Self::Frames => "a folder without an ending (PNG frames)",
        }
    }

    /// Returns the format of a path: by its ending, or [`Format::Frames`] for an existing folder, a path with `/` at
    /// its end, or one without an ending.
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let folder = path.is_dir() || path.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
        if folder && path.file_name().is_some() {
            return Ok(Self::Frames);
        }
        match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
            Some("mp4" | "m4v") => Ok(Self::Mp4),
            Some("gif") => Ok(Self::Gif),
            Some("webp") => Ok(Self::WebP),
            None if path.file_name().is_some() => Ok(Self::Frames),
            _ => {
                let known = Self::ALL.map(Self::ending).join(", ");
                Err(VideoFileError::UnknownFormat { path: path.into(), known })
            }
        }
    }

    pub(super) fn check(self, path: &Path, settings: &VideoSettings) -> Result<()> {
        /// Largest longer and shorter side in level 5.2 of H.264, and so in openh264.
        const MP4_PX: (u32, u32) = (3840, 2160);
        const MP4_LEAST_PX: u32 = 16;
        /// Largest side of a WebP picture, which has 14 bits.
        const WEBP_PX: u32 = 16_383;
        /// Highest frame rate: delays below 20 ms are shown as 100 ms by most viewers.
        const GIF_FPS: f64 = 50.0;
        let (w, h, fps) = (settings.width_px, settings.height_px, settings.fps);
        let bad = |what, remedy| Err(VideoFileError::Setting { path: path.into(), what, remedy });
        let size = format!("{w} x {h} px");
        match self {
            Self::Mp4 if w.max(h) > MP4_PX.0 + 1 || w.min(h) > MP4_PX.1 + 1 => {
                let what = format!("{size} is more than the {} x {} px that the MP4 encoder takes", MP4_PX.0, MP4_PX.1);
                bad(what, "choose a smaller size, WebP, PNG frames or ffmpeg")
            }
            Self::Mp4 if w.min(h) < MP4_LEAST_PX => {
                let what = format!("{size} is less than the {MP4_LEAST_PX} px a side that the MP4 encoder takes");
                bad(what, "choose a larger size, GIF, WebP or PNG frames")
            }
            Self::WebP if w.max(h) > WEBP_PX => bad(
                format!("{size} is more than the {WEBP_PX} px a side of WebP"),
                "choose a smaller size or PNG frames",
            ),
            Self::Gif if fps > GIF_FPS => {
                let what = format!("{fps} frames per second are more than the {GIF_FPS} that viewers of GIF show");
                bad(what, "choose a lower rate, MP4 or WebP")
            }
            _ => Ok(()),
        }
    }
}
