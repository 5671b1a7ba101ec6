//! Choices for a video: its format, size, aspect ratio and quality.

use serde::{Deserialize, Serialize};
use strum::VariantArray;

/// Format of a video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, Serialize, Deserialize)]
pub(crate) enum VideoFile {
    #[default]
    Mp4,
    Gif,
    WebP,
    Frames,
}

impl VideoFile {
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Mp4 => "MP4 (.mp4)",
            Self::Gif => "GIF (.gif)",
            Self::WebP => "WebP (.webp)",
            Self::Frames => "PNG frames (folder)",
        }
    }

    pub(super) fn about(self) -> &'static str {
        match self {
            Self::Mp4 => "H.264: plays everywhere. 3840 \u{d7} 2160 px at most.",
            Self::Gif => "256 colors per frame, 50 frames/s at most.",
            Self::WebP => "For web pages.",
            Self::Frames => "A numbered picture for each frame, without loss.",
        }
    }

    /// Ending of its file; empty for a folder.
    pub(super) fn ending(self) -> &'static str {
        match self {
            Self::Mp4 => ".mp4",
            Self::Gif => ".gif",
            Self::WebP => ".webp",
            Self::Frames => "",
        }
    }
}

/// Height of a video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, Serialize, Deserialize)]
pub(crate) enum VideoHeight {
    P480,
    #[default]
    P720,
    P1080,
    P2160,
    Window,
}

impl VideoHeight {
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::P480 => "480p",
            Self::P720 => "720p",
            Self::P1080 => "1080p",
            Self::P2160 => "4K",
            Self::Window => "As the view",
        }
    }
}

/// Aspect ratio of a video.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, Serialize, Deserialize)]
pub(crate) enum VideoAspect {
    #[default]
    Wide,
    Classic,
    Square,
    Window,
}

impl VideoAspect {
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Wide => "16:9",
            Self::Classic => "4:3",
            Self::Square => "1:1",
            Self::Window => "As the view",
        }
    }
}

/// All choices for a video.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct VideoChoice {
    pub(crate) file: VideoFile,
    pub(crate) height: VideoHeight,
    pub(crate) aspect: VideoAspect,
    /// From 0 (smallest file) to 100 (best picture).
    pub(crate) quality: u8,
    /// True if the answer to the query is marked in every frame.
    pub(crate) mark: bool,
}

impl Default for VideoChoice {
    fn default() -> Self {
        let (file, height, aspect) = Default::default();
        Self { file, height, aspect, quality: 80, mark: false }
    }
}

impl VideoChoice {
    /// Width and height in px, even ones as H.264 needs; `view_px` is the size of the view.
    pub(crate) fn size_px(self, view_px: [u32; 2]) -> [u32; 2] {
        let view = view_px.map(|side| f64::from(side.max(1)));
        let height = match self.height {
            VideoHeight::P480 => 480.0,
            VideoHeight::P720 => 720.0,
            VideoHeight::P1080 => 1080.0,
            VideoHeight::P2160 => 2160.0,
            VideoHeight::Window => view[1],
        };
        let ratio = match self.aspect {
            VideoAspect::Wide => 16.0 / 9.0,
            VideoAspect::Classic => 4.0 / 3.0,
            VideoAspect::Square => 1.0,
            VideoAspect::Window => view[0] / view[1],
        };
        [height * ratio, height].map(|side| ((side / 2.0).round().max(1.0) * 2.0) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_the_aspect_that_was_asked_for() {
        let of = |height, aspect| VideoChoice { height, aspect, ..VideoChoice::default() }.size_px([1207, 721]);
        assert_eq!(VideoChoice::default().size_px([1206, 720]), [1280, 720], "not as the window is");
        assert_eq!(of(VideoHeight::P480, VideoAspect::Wide), [854, 480]);
        assert_eq!(of(VideoHeight::P1080, VideoAspect::Classic), [1440, 1080]);
        assert_eq!(of(VideoHeight::P2160, VideoAspect::Square), [2160, 2160]);
        assert_eq!(of(VideoHeight::Window, VideoAspect::Window), [1208, 722]);
        assert_eq!(of(VideoHeight::P720, VideoAspect::Window), [1206, 720]);
        assert_eq!(VideoChoice::default().size_px([0, 0]), [1280, 720]);
    }
}
