//! Masklets of a video as in SA-V: one JSON file with `masklet`, a list of frames, each a list of run-length masks. The
//! n-th mask of every frame is of the same object.
//!
//! SA-V labels every fourth frame; the step between labeled frames follows from `video_frame_count`. The photo of frame
//! n has n as the last number in its name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::rle::Rle;
use super::{Region, Sheet, stem};
use crate::io::{IoError, files};
use crate::scene::Photo;

#[derive(Deserialize)]
struct File {
    masklet: Vec<Vec<Rle>>,
    #[serde(default)]
    video_frame_count: Option<f64>,
}

/// The masklets of one video.
pub struct Masklets {
    path: PathBuf,
    /// Labeled frames, each with a mask for every masklet.
    frames: Vec<Vec<Rle>>,
    /// Frames of the video for each labeled one.
    stride: u64,
}

impl Masklets {
    /// Parses a JSON file; `None` if it is of another kind.
    pub(crate) fn parse(file: serde_json::Value, path: &Path) -> Result<Option<Self>, IoError> {
        if !file["masklet"].is_array() {
            return Ok(None);
        }
        let File { masklet, video_frame_count } =
            serde_json::from_value(file).map_err(|e| files::json_error(path, &e))?;
        // 483 frames of which 121 are labeled: every fourth, the last of them frame 480.
        let ratio = video_frame_count.unwrap_or(0.0) / masklet.len().max(1) as f64;
        let stride = if ratio >= 1.0 { ratio.round().min(1e6) as u64 } else { 1 };
        Ok(Some(Self { path: path.into(), frames: masklet, stride }))
    }

    fn frame(&self, stem: &str) -> Option<usize> {
        let digits = stem.trim_end_matches(|c: char| !c.is_ascii_digit());
        let start = digits.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let number: u64 = digits[start..].parse().ok()?;
        let frame = usize::try_from(number / self.stride).ok()?;
        (number % self.stride == 0 && frame < self.frames.len()).then_some(frame)
    }

    /// Refuses photos of several videos, two of which have the same frame number.
    pub(super) fn of_one_video(&self, photos: &[Photo]) -> Result<(), IoError> {
        let mut of: HashMap<usize, &str> = HashMap::new();
        for photo in photos {
            let Some(frame) = self.frame(&stem(&photo.name)) else { continue };
            if let Some(other) = of.insert(frame, &photo.name) {
                let reason =
                    format!("the photos '{other}' and '{}' are both frame {frame} by their numbers", photo.name);
                return Err(IoError::syntax(&self.path, "masklet", reason));
            }
        }
        Ok(())
    }

    /// Returns whether the photo `stem` is a labeled frame.
    pub(crate) fn has(&self, stem: &str) -> bool {
        self.frame(stem).is_some()
    }

    /// Reads the masks of the photo `stem`, without names; empty if it is no labeled frame.
    pub(crate) fn regions(&self, stem: &str, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let Some(frame) = self.frame(stem) else { return Ok(Vec::new()) };
        let masks = &self.frames[frame];
        let read = |(i, rle): (usize, &Rle)| {
            sheet.check(&self.path, rle.size_px(), masks.len())?;
            let place = format!("masklet[{frame}][{i}]");
            let mask = rle.mask().map_err(|reason| IoError::Syntax { path: self.path.clone(), place, reason })?;
            Ok(Region { name: String::new(), level: None, parent: None, mask })
        };
        masks.iter().enumerate().map(read).collect()
    }
}
