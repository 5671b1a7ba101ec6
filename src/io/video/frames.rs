//! PNG frames in a folder: `frame_00000.png`, `frame_00001.png` and so on.
//!
//! The frames are written into a temporary folder. At the end that folder is renamed, or its files are moved if the
//! final folder existed before. Other files in the folder stay.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::{Result, Sink, VideoFileError, VideoSettings};
use crate::io::error::write_error;
use crate::io::files::{folder_of, sync_folder};
use crate::io::temporary::{TemporaryFolder, temporary_folder};

pub(super) struct Frames {
    folder: PathBuf,
    /// True if `folder` existed before.
    existed: bool,
    draft: TemporaryFolder,
    size_px: (u32, u32),
    overwrite: bool,
    frames: u64,
    bytes: u64,
}

impl Frames {
    pub(super) fn create(folder: &Path, settings: &VideoSettings) -> Result<Self> {
        let failed = |cause| write_error(folder, cause);
        let existed = folder.is_dir();
        if !existed {
            settings.check_free(folder)?;
        } else if !settings.overwrite
            && let Some(taken) = numbered(folder).map_err(failed)?.into_iter().next()
        {
            return Err(VideoFileError::Exists { path: taken });
        }
        // Beside the frames' final place, so that they can be renamed.
        let draft = temporary_folder(if existed { folder } else { folder_of(folder) }, "frames").map_err(failed)?;
        let size_px = (settings.width_px, settings.height_px);
        let (folder, overwrite) = (folder.to_owned(), settings.overwrite);
        Ok(Self { folder, existed, draft, size_px, overwrite, frames: 0, bytes: 0 })
    }

    /// Moves the frames to their place.
    fn put(self) -> io::Result<Option<PathBuf>> {
        if !self.existed {
            // `rename` replaces an empty folder and refuses a full one.
            fs::rename(self.draft.folder.path(), &self.folder)?;
            // There is nothing left to remove.
            let _ = self.draft.folder.keep();
            return sync_folder(folder_of(&self.folder)).map(|()| None);
        }
        let before = numbered(&self.folder)?;
        if let Some(taken) = before.first().filter(|_| !self.overwrite) {
            return Ok(Some(taken.clone()));
        }
        for frame in 0..self.frames {
            fs::rename(self.draft.folder.path().join(name(frame)), self.folder.join(name(frame)))?;
        }
        // Old frames of a longer video would follow this video's last one.
        for stale in before.iter().filter(|p| number(p).is_some_and(|n| n >= self.frames)) {
            fs::remove_file(stale)?;
        }
        sync_folder(&self.folder).map(|()| None)
    }
}

impl Sink for Frames {
    fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let path = self.draft.folder.path().join(name(self.frames));
        let mut file = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
        let encoded = encoder.write_image(rgb, self.size_px.0, self.size_px.1, ExtendedColorType::Rgb8);
        encoded.map_err(|e| match e {
            ImageError::IoError(cause) => write_error(&path, cause).into(),
            other => VideoFileError::Encoder { path: path.clone(), reason: other.to_string() },
        })?;
        let written = fs::File::create_new(&path).and_then(|mut out| out.write_all(&file));
        written.map_err(|cause| write_error(&self.folder.join(name(self.frames)), cause))?;
        self.frames += 1;
        self.bytes += file.len() as u64;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64> {
        let (folder, bytes) = (self.folder.clone(), self.bytes);
        match self.put().map_err(|cause| write_error(&folder, cause))? {
            Some(path) => Err(VideoFileError::Exists { path }),
            None => Ok(bytes),
        }
    }
}

fn name(frame: u64) -> String {
    format!("frame_{frame:05}.png")
}

/// Returns the frame number in a file name made by [`name`].
fn number(path: &Path) -> Option<u64> {
    let digits = path.file_name()?.to_str()?.strip_prefix("frame_")?.strip_suffix(".png")?;
    digits.parse().ok().filter(|n| path.file_name().is_some_and(|f| f.to_str() == Some(&name(*n))))
}

fn numbered(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        found.extend(number(&path).map(|n| (n, path)));
    }
    found.sort();
    Ok(found.into_iter().map(|(_, path)| path).collect())
}
