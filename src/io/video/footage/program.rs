//! Frames through a program with ffmpeg's command line, as pictures on a pipe.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use image::RgbImage;

use super::super::ffmpeg::{last_lines, plain_file};
use super::{FootageError, FramePixels, LEAST_PX, Turn, VideoFrame};
use crate::scene::Camera;

/// A program that is ended when this is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail harmlessly if it has ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Reads all frames; returns their number.
pub(super) fn visit<E: From<FootageError>>(
    path: &Path,
    program: &Path,
    visit: &mut dyn FnMut(usize, &VideoFrame<'_>) -> Result<(), E>,
) -> Result<usize, E> {
    let failed = |status: String, last_words: String| FootageError::Program {
        path: path.into(),
        program: program.into(),
        status,
        last_words,
    };
    let mut command = Command::new(program);
    command.args(["-hide_banner", "-loglevel", "error", "-nostats", "-nostdin", "-i"]).arg(plain_file(path));
    // It turns the picture by itself.
    command.args(["-map", "0:v:0", "-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "pipe:1"]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().map_err(|e| failed(e.to_string(), String::new()))?);
    let listen = |words| std::thread::Builder::new().name("ffmpeg errors".into()).spawn(move || last_lines(words));
    let words = running.0.stderr.take().map(listen).transpose().map_err(|e| failed(e.to_string(), String::new()))?;
    let mut pipe = running.0.stdout.take().map(BufReader::new);
    let mut shown = 0;
    while let Some(picture) = pipe.as_mut().and_then(next) {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        if width.min(height) < LEAST_PX {
            return Err(FootageError::TooSmall { path: path.into(), width, height }.into());
        }
        visit(shown, &VideoFrame { pixels: FramePixels::Rgb(&picture), turn: Turn::None })?;
        shown += 1;
    }
    drop(pipe);
    let status = running.0.wait().map_err(|e| failed(e.to_string(), String::new()))?;
    let said = words.and_then(|thread| thread.join().ok()).unwrap_or_default();
    if status.success() { Ok(shown) } else { Err(failed(status.to_string(), said).into()) }
}

/// The next picture: `P6`, width, height, 255, and the pixels. `None` at the end, or if it is cut off.
fn next(pipe: &mut impl BufRead) -> Option<RgbImage> {
    let mut word = || {
        let mut word = String::new();
        for byte in pipe.by_ref().bytes().take(20) {
            match byte.ok()? {
                b if b.is_ascii_whitespace() => return Some(word),
                b => word.push(char::from(b)),
            }
        }
        None
    };
    if word()? != "P6" {
        return None;
    }
    let size = [word()?, word()?].map(|side| side.parse::<u32>().ok());
    let [Some(width), Some(height)] = size else { return None };
    if word()? != "255" || width.max(height) > Camera::MAX_SIDE_PX {
        return None;
    }
    let mut rgb = vec![0; 3 * width as usize * height as usize];
    pipe.read_exact(&mut rgb).ok()?;
    RgbImage::from_raw(width, height, rgb)
}
