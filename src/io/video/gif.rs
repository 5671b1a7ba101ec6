//! Animated GIF: every frame has a palette of its own, chosen by NeuQuant.

use std::path::{Path, PathBuf};

use gif::{DisposalMethod, EncodingError, Frame, Repeat};

use super::{Result, Sink, VideoFileError, VideoSettings};
use crate::io::atomic::Draft;
use crate::io::error::write_error;

pub(super) struct Gif {
    path: PathBuf,
    settings: VideoSettings,
    side_px: (u16, u16),
    encoder: gif::Encoder<Draft>,
    frames: u64,
}

impl Gif {
    pub(super) fn create(path: &Path, settings: &VideoSettings) -> Result<Self> {
        let side = |px: u32| u16::try_from(px).unwrap_or(u16::MAX);
        let side_px = (side(settings.width_px), side(settings.height_px));
        let draft = Draft::create(path)?;
        let start = || {
            let mut encoder = gif::Encoder::new(draft, side_px.0, side_px.1, &[])?;
            encoder.set_repeat(Repeat::Infinite)?;
            Ok(encoder)
        };
        let encoder = start().map_err(|e| error(path, e))?;
        Ok(Self { path: path.into(), settings: settings.clone(), side_px, encoder, frames: 0 })
    }
}

impl Sink for Gif {
    fn push(&mut self, rgb: &[u8]) -> Result<()> {
        // NeuQuant's step through the pixels: 1 samples all of them, 30 every thirtieth. It learns little from fewer
        // pixels than this.
        const ENOUGH: u64 = 50_000;
        let pixels = self.settings.frame_bytes() / 3;
        let coarsest = (pixels / ENOUGH).clamp(1, 30) as i32;
        let step = (1 + (100 - i32::from(self.settings.quality)) * 29 / 100).min(coarsest);
        // A small picture is repeated, one copy below the other.
        let (width, height) = self.side_px;
        let times = ENOUGH.div_ceil(pixels.max(1)).clamp(1, u64::from(u16::MAX / height.max(1))) as u16;
        let mut frame = Frame::from_rgb_speed(width, height * times, &rgb.repeat(usize::from(times)), step);
        frame.height = height;
        frame.buffer.to_mut().truncate(usize::from(width) * usize::from(height));
        let time = |frame| self.settings.time(frame, 100.0);
        frame.delay = u16::try_from(time(self.frames + 1) - time(self.frames)).unwrap_or(u16::MAX);
        frame.dispose = DisposalMethod::Keep;
        self.encoder.write_frame(&frame).map_err(|e| error(&self.path, e))?;
        self.frames += 1;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64> {
        let draft = self.encoder.into_inner().map_err(|e| error(&self.path, e))?;
        Ok(draft.commit()?)
    }
}

fn error(path: &Path, e: EncodingError) -> VideoFileError {
    match e {
        EncodingError::Io(cause) => write_error(path, cause).into(),
        other => VideoFileError::Encoder { path: path.into(), reason: other.to_string() },
    }
}
