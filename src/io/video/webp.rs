//! Animated WebP, with loss (without at quality 100), by libwebp.
//!
//! libwebp's encoder belongs to one thread, so it gets one. It keeps the compressed frames until the
//! end. A frame equal to the one before it makes that one longer; a video of equal frames becomes a
//! still picture.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, bounded};
use webp_animation::{ColorMode, EncoderOptions, EncodingConfig, EncodingType, Error};

use super::{Result, Sink, VideoFileError, VideoSettings};
use crate::io::atomic::Draft;
use crate::io::error::write_error;

pub(super) struct WebP {
    path: PathBuf,
    draft: Draft,
    encoder: Option<(Sender<Message>, JoinHandle<Film>)>,
}

/// Bytes of the file, or the error.
type Film = std::result::Result<Vec<u8>, Error>;

/// Messages to the encoder's thread. Without [`Message::End`], the video is discarded.
enum Message {
    Frame(Vec<u8>),
    End,
}

impl WebP {
    pub(super) fn create(path: &Path, settings: &VideoSettings) -> Result<Self> {
        let draft = Draft::create(path)?;
        // One frame waits while another is being encoded.
        let (to_encoder, inbox) = bounded(1);
        let of_thread = settings.clone();
        let thread = std::thread::Builder::new()
            .name("webp".into())
            .spawn(move || encode(&of_thread, &inbox))
            .map_err(|e| VideoFileError::Encoder { path: path.into(), reason: e.to_string() })?;
        Ok(Self { path: path.into(), draft, encoder: Some((to_encoder, thread)) })
    }

    /// Waits for the encoder's result.
    fn result(&mut self) -> Result<Vec<u8>> {
        let failed = |reason: String| VideoFileError::Encoder { path: self.path.clone(), reason };
        let Some((to_encoder, thread)) = self.encoder.take() else { return Err(failed("it has ended".into())) };
        drop(to_encoder);
        match thread.join() {
            Ok(result) => result.map_err(|e| failed(e.to_string())),
            Err(_) => Err(failed("it panicked".into())),
        }
    }
}

impl Sink for WebP {
    fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let sent = self.encoder.as_ref().is_some_and(|(to, _)| to.send(Message::Frame(rgb.to_vec())).is_ok());
        if sent { Ok(()) } else { self.result().map(drop) }
    }

    fn finish(mut self: Box<Self>) -> Result<u64> {
        if let Some((to_encoder, _)) = &self.encoder {
            // A failed thread does not receive; its result has the error.
            let _ = to_encoder.send(Message::End);
        }
        let film = self.result()?;
        let Self { path, mut draft, .. } = *self;
        draft.write_all(&film).map_err(|cause| write_error(&path, cause))?;
        Ok(draft.commit()?)
    }
}

/// Encodes frames until the end and returns the file.
fn encode(settings: &VideoSettings, inbox: &Receiver<Message>) -> Film {
    let encoding_type = if settings.quality == 100 { EncodingType::Lossless } else { EncodingType::new_lossy() };
    let options = EncoderOptions {
        // Every frame is a key frame: in a camera flight no part stays the same between frames.
        kmin: 0,
        kmax: 1,
        color_mode: ColorMode::Rgb,
        encoding_config: Some(EncodingConfig {
            encoding_type,
            quality: f32::from(settings.quality),
            ..EncodingConfig::default()
        }),
        ..EncoderOptions::default()
    };
    let mut encoder = webp_animation::Encoder::new_with_options((settings.width_px, settings.height_px), options)?;
    let time = |frame| i32::try_from(settings.time(frame, 1000.0)).unwrap_or(i32::MAX);
    let mut frames = 0;
    while let Ok(message) = inbox.recv() {
        match message {
            Message::Frame(rgb) => encoder.add_frame(&rgb, time(frames))?,
            Message::End => return Ok(encoder.finalize(time(frames))?.to_vec()),
        }
        frames += 1;
    }
    // Canceled: the result is not used.
    Ok(Vec::new())
}
