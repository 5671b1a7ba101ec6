//! A video through a program with ffmpeg's command line, fed with raw frames.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

use tempfile::NamedTempFile;

use super::{Result, Sink, VideoFileError, VideoSettings};
use crate::io::atomic::put;
use crate::io::error::write_error;
use crate::io::temporary::temporary_file;

/// Lines of the program's error output that are kept for messages.
const LAST_LINES: usize = 12;
/// Longest line that is kept, in bytes.
const LINE_BYTES: u64 = 2000;

pub(super) struct Ffmpeg {
    path: PathBuf,
    program: PathBuf,
    draft: Option<NamedTempFile>,
    child: Child,
    frames_in: Option<ChildStdin>,
    last_words: Option<JoinHandle<String>>,
}

impl Ffmpeg {
    pub(super) fn create(path: &Path, settings: &VideoSettings, program: &Path, args: &[String]) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
        // The program chooses the format by the ending, so the temporary file has the same ending.
        let draft = temporary_file(path, &extension).map_err(|cause| write_error(path, cause))?;
        let (width, height) = (settings.width_px, settings.height_px);
        let mut command = Command::new(program);
        command
            .args(["-hide_banner", "-loglevel", "error", "-nostats", "-y"])
            .args(["-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", &format!("{width}x{height}")])
            .args(["-framerate", &settings.fps.to_string(), "-i", "pipe:0", "-an"])
            .args(usual(&extension, settings))
            .args(args)
            .arg(plain_file(draft.path()))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let start = |cause| VideoFileError::Program { program: program.into(), cause };
        let mut child = command.spawn().map_err(start)?;
        let frames_in = child.stdin.take();
        let last_words = child
            .stderr
            .take()
            .map(|words| std::thread::Builder::new().name("ffmpeg errors".into()).spawn(move || last_lines(words)));
        let mut ffmpeg =
            Self { path: path.into(), program: program.into(), draft: Some(draft), child, frames_in, last_words: None };
        // From here on dropping `ffmpeg` ends the program.
        ffmpeg.last_words = last_words.transpose().map_err(start)?;
        Ok(ffmpeg)
    }

    /// Ends the input, waits for the program, and returns its status and the last lines of its error output.
    fn wait(&mut self) -> io::Result<(std::process::ExitStatus, String)> {
        drop(self.frames_in.take());
        let status = self.child.wait()?;
        let words = self.last_words.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        Ok((status, words))
    }

    /// Makes the error of a program that ended, or did not take a frame.
    fn failed(&self, status: String, words: &str) -> VideoFileError {
        let last_words = if words.is_empty() { "(none)".into() } else { words.to_owned() };
        VideoFileError::ProgramFailed { path: self.path.clone(), program: self.program.clone(), status, last_words }
    }
}

impl Sink for Ffmpeg {
    fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let Some(frames_in) = &mut self.frames_in else {
            return Err(VideoFileError::Broken { path: self.path.clone() });
        };
        let Err(cause) = frames_in.write_all(rgb) else { return Ok(()) };
        // The program closed the pipe; its own message says more than "broken pipe".
        match self.wait() {
            Ok((status, words)) => Err(self.failed(status.to_string(), &words)),
            Err(_) => Err(self.failed(cause.to_string(), "")),
        }
    }

    fn finish(mut self: Box<Self>) -> Result<u64> {
        let (status, words) = self.wait().map_err(|cause| write_error(&self.path, cause))?;
        if !status.success() {
            return Err(self.failed(status.to_string(), &words));
        }
        let Some(draft) = self.draft.take() else { return Err(VideoFileError::Broken { path: self.path.clone() }) };
        let failed = |cause| write_error(&self.path, cause);
        // Looked up by name: the program may have replaced the file.
        let bytes = std::fs::metadata(draft.path()).map_err(failed)?.len();
        if bytes == 0 {
            return Err(self.failed("an empty file".into(), &words));
        }
        put(draft, &self.path).map_err(failed)?;
        Ok(bytes)
    }
}

impl Drop for Ffmpeg {
    fn drop(&mut self) {
        drop(self.frames_in.take());
        if self.draft.is_some() {
            // Canceled or failed. Both calls fail harmlessly if the program has ended.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// Default arguments for the usual containers, before the user's own: H.264 of the requested quality that every player
/// supports, with its colors tagged.
fn usual(extension: &str, settings: &VideoSettings) -> Vec<String> {
    if !["mp4", "m4v", "mov", "mkv"].contains(&extension.to_ascii_lowercase().as_str()) {
        return Vec::new();
    }
    let quantizer = settings.quantizer().to_string();
    let filter = "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv";
    let args = [
        ["-vf", filter],
        ["-pix_fmt", "yuv420p"],
        ["-color_primaries", "bt709"],
        ["-color_trc", "iec61966-2-1"],
        ["-colorspace", "bt709"],
        ["-color_range", "tv"],
        ["-c:v", "libx264"],
        ["-crf", &quantizer],
    ];
    args.as_flattened().iter().map(|a| (*a).to_owned()).collect()
}

/// Makes a path that is not taken for an option or a protocol.
pub(super) fn plain_file(path: &Path) -> std::ffi::OsString {
    let mut plain = std::ffi::OsString::from("file:");
    plain.push(path);
    plain
}

/// Reads to the end and returns the last lines.
pub(super) fn last_lines(words: impl Read) -> String {
    let mut reader = BufReader::new(words);
    let mut lines = VecDeque::new();
    loop {
        let mut line = Vec::new();
        match reader.by_ref().take(LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => break,
            Ok(_) => lines.push_back(String::from_utf8_lossy(&line).trim_end().to_owned()),
        }
        if lines.len() > LAST_LINES {
            lines.pop_front();
        }
    }
    lines.make_contiguous().join("\n")
}
