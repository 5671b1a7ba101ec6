//! Videos: MP4, GIF, WebP, or PNG frames in a folder, and any format of an ffmpeg program.
//!
//! Frames are encoded one at a time and not kept. The output is written to a temporary place and gets its name when
//! [`VideoWriter::finish`] succeeds; a writer that is dropped before leaves nothing behind. Two formats keep more than
//! a frame in memory: WebP all *compressed* frames (its container begins with the total size), MP4 about 16 bytes per
//! frame for its index.

mod error;
mod ffmpeg;
pub(crate) mod footage;
mod format;
mod frames;
mod gif;
mod mp4;
mod settings;
mod webp;
mod yuv;

use std::path::{Path, PathBuf};

pub(crate) use error::VideoFileError;
pub(crate) use format::Format;
pub(crate) use settings::{VideoEncoder, VideoSettings};

pub(crate) type Result<T> = std::result::Result<T, VideoFileError>;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct VideoSummary {
    /// The file, or the folder of PNG frames.
    pub(crate) path: PathBuf,
    /// Its format; `None` if ffmpeg chose it by the file's name.
    pub(crate) format: Option<Format>,
    pub(crate) frames: u64,
    pub(crate) bytes: u64,
    /// Playing time in seconds.
    pub(crate) secs: f64,
    /// Width and height of the video in px: those of the frames, rounded down to even numbers in MP4.
    pub(crate) size_px: (u32, u32),
}

pub(crate) struct VideoWriter {
    path: PathBuf,
    format: Option<Format>,
    settings: VideoSettings,
    size_px: (u32, u32),
    frames: u64,
    /// `None` once a frame has failed.
    sink: Option<Box<dyn Sink>>,
}

/// Encoder of one format. Dropped without `finish`, it removes its output.
trait Sink: Send {
    /// Takes the next frame: sRGB, `width * height * 3` bytes.
    fn push(&mut self, rgb: &[u8]) -> Result<()>;
    /// Completes the video, puts it in its place and returns its size in bytes.
    fn finish(self: Box<Self>) -> Result<u64>;
}

impl VideoWriter {
    /// Starts a video at `path`, in the format of the path's ending (see [`Format::of`]); with [`VideoEncoder::Ffmpeg`]
    /// any ending that the program knows.
    ///
    /// # Errors
    /// [`VideoFileError`]: an ending that no format has, a size or rate that the format cannot hold, a file that exists
    /// (unless [`VideoSettings::overwrite`]), a folder that cannot be written to, a program that is missing.
    pub(crate) fn create(path: &Path, settings: &VideoSettings) -> Result<Self> {
        settings.check(path)?;
        let (format, sink): (_, Box<dyn Sink>) = match &settings.encoder {
            VideoEncoder::Ffmpeg { program, args } => {
                settings.check_free(path)?;
                (None, Box::new(ffmpeg::Ffmpeg::create(path, settings, program, args)?))
            }
            VideoEncoder::BuiltIn => {
                let format = Format::of(path)?;
                format.check(path, settings)?;
                if format != Format::Frames {
                    settings.check_free(path)?;
                }
                let sink: Box<dyn Sink> = match format {
                    Format::Mp4 => Box::new(mp4::Mp4::create(path, settings)?),
                    Format::Gif => Box::new(gif::Gif::create(path, settings)?),
                    Format::WebP => Box::new(webp::WebP::create(path, settings)?),
                    Format::Frames => Box::new(frames::Frames::create(path, settings)?),
                };
                (Some(format), sink)
            }
        };
        let even = if format == Some(Format::Mp4) { !1 } else { !0 };
        let size_px = (settings.width_px & even, settings.height_px & even);
        Ok(Self { path: path.into(), format, settings: settings.clone(), size_px, frames: 0, sink: Some(sink) })
    }

    /// Adds the next frame: sRGB, `width * height * 3` bytes, row by row from the top. After an error of
    /// the encoder or the disk the video is lost: every further call fails, and nothing is left on disk.
    pub(crate) fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let expected = self.settings.frame_bytes();
        if rgb.len() as u64 != expected {
            return Err(VideoFileError::FrameBytes { frame: self.frames, found: rgb.len() as u64, expected });
        }
        if self.frames == self.settings.most_frames() {
            let most = self.settings.most_frames();
            return Err(VideoFileError::TooManyFrames { path: self.path.clone(), most });
        }
        let Some(sink) = &mut self.sink else { return Err(VideoFileError::Broken { path: self.path.clone() }) };
        if let Err(e) = sink.push(rgb) {
            self.sink = None;
            return Err(e);
        }
        self.frames += 1;
        Ok(())
    }

    /// Completes the video and puts it in its place.
    ///
    /// # Errors
    /// [`VideoFileError`]: no frames, a frame that failed before, a full disk. Nothing is left then.
    pub(crate) fn finish(mut self) -> Result<VideoSummary> {
        let Some(sink) = self.sink.take() else { return Err(VideoFileError::Broken { path: self.path }) };
        if self.frames == 0 {
            return Err(VideoFileError::NoFrames { path: self.path });
        }
        let bytes = sink.finish()?;
        let secs = self.frames as f64 / self.settings.fps;
        Ok(VideoSummary {
            path: self.path,
            format: self.format,
            frames: self.frames,
            bytes,
            secs,
            size_px: self.size_px,
        })
    }
}

#[cfg(test)]
mod tests;
