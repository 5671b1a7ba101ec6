//! A program that runs for minutes: its lines become progress, and it is killed once it is not needed.
//!
//! The program ends with its job. On Linux it also ends with this process, however that ends.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};

use super::snapshots::Snapshots;
use crate::jobs::JobError;
use crate::pipeline::observer::{Observer, Ticker};

/// Last lines that are kept for errors.
const LAST_LINES: usize = 8;
/// Longest line that is kept, in bytes.
const LINE_BYTES: u64 = 2_000;
/// Time between checks of the observer while the program prints nothing.
const PATIENCE: Duration = Duration::from_millis(100);

/// A command to run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PoseStage {
    /// Its task, for display.
    pub(super) title: &'static str,
    pub(super) program: PathBuf,
    pub(super) args: Vec<String>,
    /// Folder in which it writes snapshots of the poses, if it does.
    pub(super) snapshots: Option<PathBuf>,
}

impl PoseStage {
    /// A command that writes no snapshots.
    pub(super) fn new(title: &'static str, program: PathBuf, args: Vec<String>) -> Self {
        Self { title, program, args, snapshots: None }
    }
}

/// A running program, killed when this is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail if it has ended, which is fine.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Returns all output of a program, nothing if it cannot be started.
pub(super) fn output(program: &Path, args: &[&str]) -> String {
    let said = quiet(program).args(args).stdin(Stdio::null()).output();
    said.map_or_else(|_| String::new(), |o| String::from_utf8_lossy(&[o.stdout, o.stderr].concat()).into_owned())
}

/// Runs a stage to its end.
///
/// # Errors
/// If it cannot be started or fails, or the observer asks to stop.
pub(super) fn run(stage: &PoseStage, photos: usize, observer: &mut dyn Observer) -> Result<(), JobError> {
    let failed = |why: String, said: &VecDeque<String>| JobError::Program {
        program: stage.program.clone(),
        doing: stage.title,
        why,
        said: said.iter().cloned().collect::<Vec<_>>().join("\n"),
    };
    let mut said = VecDeque::new();
    let mut command = quiet(&stage.program);
    command.args(&stage.args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().map_err(|e| failed(e.to_string(), &said))?);
    // Bounded: a program that prints faster than we read has to wait.
    let (sender, lines) = bounded(64);
    let listen = |from: Option<Box<dyn Read + Send>>| {
        let (sender, name) = (sender.clone(), "a program's words");
        from.map(|from| std::thread::Builder::new().name(name.into()).spawn(move || pass_on(from, &sender)))
    };
    let pipes = [
        listen(running.0.stdout.take().map(|p| Box::new(p) as Box<dyn Read + Send>)),
        listen(running.0.stderr.take().map(|p| Box::new(p) as Box<dyn Read + Send>)),
    ];
    for thread in pipes.into_iter().flatten() {
        thread.map_err(|e| failed(e.to_string(), &said))?;
    }
    drop(sender);
    let mut ticker = Ticker::new(stage.title, photos);
    let mut registered = 0;
    let mut snapshots = stage.snapshots.clone().map(|folder| Snapshots::new(folder, photos));
    ticker.report(0, observer);
    loop {
        ticker.proceed(observer)?;
        snapshots.iter_mut().for_each(|snapshots| snapshots.look(observer));
        match lines.recv_timeout(PATIENCE) {
            Ok(line) => {
                if let Some(done) = progress(&line, photos, &mut registered) {
                    ticker.report(done, observer);
                }
                said.push_back(line);
                said.drain(..said.len().saturating_sub(LAST_LINES));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    let status = running.0.wait().map_err(|e| failed(e.to_string(), &said))?;
    if status.success() { Ok(()) } else { Err(failed(status.to_string(), &said)) }
}

/// Returns a command that opens no windows and whose process does not outlive this one.
fn quiet(program: &Path) -> Command {
    let mut command = Command::new(program);
    // Without a display, COLMAP's use of Qt would end it.
    command.env("QT_QPA_PLATFORM", "offscreen");
    // Python imports nothing from the folder that the user happens to be in.
    command.env("PYTHONSAFEPATH", "1");
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::process::CommandExt;
        // SAFETY: prctl is async-signal-safe, takes numbers alone and changes the new process only.
        #[allow(unsafe_code)]
        unsafe {
            command.pre_exec(|| match libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) {
                0 => Ok(()),
                _ => Err(std::io::Error::last_os_error()),
            });
        }
    }
    command
}

/// Sends a program's lines, including those that overwrite one another.
fn pass_on(from: impl Read, to: &Sender<String>) {
    let mut reader = BufReader::new(from);
    loop {
        let mut line = Vec::new();
        match reader.by_ref().take(LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        for part in String::from_utf8_lossy(&line).split(['\r', '\n']).filter(|p| !p.trim().is_empty()) {
            if to.send(part.trim_end().to_owned()).is_err() {
                return;
            }
        }
    }
}

/// Returns the number of `photos` done, by a line of COLMAP or GLOMAP: "Processed file [3/96]", "Matching block [1/2,
/// 2/2]", "Registering image #7 (12)".
pub(super) fn progress(line: &str, photos: usize, registered: &mut u64) -> Option<u64> {
    if line.contains("Registering image #") || line.contains("Registering initial") {
        *registered += 1 + u64::from(line.contains("initial"));
        return Some((*registered).min(photos as u64));
    }
    let words = ["Processed file [", "Matching block [", "Processing block [", "Matching image ["];
    let inside = words.iter().find_map(|w| line.split_once(w))?.1.split_once(']')?.0;
    let of = |pair: &str| {
        let (done, all) = pair.split_once('/')?;
        Some((done.trim().parse::<f64>().ok()?, all.trim().parse::<f64>().ok().filter(|n| *n > 0.0)?))
    };
    let pairs: Vec<(f64, f64)> = inside.split(',').map(of).collect::<Option<_>>()?;
    let share = match pairs.as_slice() {
        [(done, all)] => done / all,
        // Rows of blocks, each with its columns.
        [(row, rows), (column, columns)] => {
            // COLMAP 4 says so before a block, earlier versions after it.
            let column = column - f64::from(u8::from(line.contains("Processing")));
            (row - 1.0 + column / columns) / rows
        }
        _ => return None,
    };
    Some((share.clamp(0.0, 1.0) * photos as f64).round() as u64)
}
