//! One worker per folder, among machines that share nothing but files: numbered claims, each with a heartbeat.
//!
//! The process that first creates claim `n + 1` takes over from the owner of claim `n`. Creating a file that must not
//! exist yet succeeds for one process only, on network file systems too, where locks may not work. A takeover is
//! allowed if claim `n` was given back or its heartbeat has stopped. Clocks of two machines are never compared: a
//! heartbeat has stopped if a waiting process sees no change for as long as the claim states. On the owner's own
//! machine nobody waits: its claim is locked, and the system frees the lock of a process that ends, however it ends.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
use serde::{Deserialize, Serialize};

use super::error::write_error;
use super::{IoError, files};

/// Folder of the claims.
const FOLDER: &str = "claims";
/// Size of every claim in bytes; fixed, so that a claim is overwritten in place by one write.
const BYTES: usize = 512;
/// Heartbeats within the time after which a stopped claim is taken over.
const BEATS: u32 = 12;

/// Content of a claim: the process that works in the folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Owner {
    host: String,
    /// System and mount namespace; two processes with the same value see each other's locks.
    machine: String,
    process: u32,
    /// True if the claim is locked for as long as the process lives.
    locked: bool,
    /// Seconds without a heartbeat after which the claim is taken over.
    takeover_secs: f64,
    beats: u64,
    /// True if the work has ended or was left to the next process.
    given_back: bool,
}

impl Owner {
    fn here(takeover: Duration) -> Self {
        let host = host();
        Self {
            machine: machine(&host),
            host,
            process: std::process::id(),
            locked: false,
            takeover_secs: takeover.as_secs_f64(),
            beats: 0,
            given_back: false,
        }
    }

    fn write(&self, file: &mut File) -> io::Result<()> {
        let text = serde_json::to_string(self)?;
        file.seek(SeekFrom::Start(0))?;
        file.write_all(format!("{text:<width$}\n", width = BYTES - 1).as_bytes())?;
        file.sync_data()
    }
}

/// Name of this machine, cut so that it fits a claim.
pub(crate) fn host() -> String {
    let plain = |c: &char| c.is_ascii_alphanumeric() || ".-_".contains(*c);
    sysinfo::System::host_name().unwrap_or_default().chars().filter(plain).take(64).collect()
}

/// Id of the running system and of this process's mount namespace: containers of one machine may not see each other's
/// locks.
fn machine(host: &str) -> String {
    let boot = fs::read_to_string("/proc/sys/kernel/random/boot_id");
    let mounts = fs::read_link("/proc/self/ns/mnt").map(|p| p.display().to_string()).unwrap_or_default();
    boot.map_or_else(|_| host.to_owned(), |boot| format!("{} {mounts}", boot.trim()))
}

/// Claims of a folder as a waiting process has seen them.
#[derive(Default)]
pub(crate) struct Watch {
    seen: Option<(u64, Vec<u8>, Instant)>,
    beating: bool,
}

/// Result of an attempt to take a folder.
pub(crate) enum Taken {
    Mine(Claim),
    /// Claimed by another process.
    Held {
        /// Host and process.
        by: String,
        /// True if its heartbeat was seen to change.
        beating: bool,
    },
}

/// Takes `folder`, which exists. A claim that cannot be parsed counts as one with the timeout `takeover`.
///
/// # Errors
/// If claims cannot be read or written.
pub(crate) fn take(folder: &Path, takeover: Duration, watch: &mut Watch) -> Result<Taken, IoError> {
    let claims = folder.join(FOLDER);
    fs::create_dir_all(&claims).map_err(|cause| write_error(&claims, cause))?;
    let number = match last(&claims)? {
        None => 1,
        Some((number, path)) => match held(number, &path, takeover, watch)? {
            Some(held) => return Ok(held),
            None => number + 1,
        },
    };
    let path = claims.join(format!("{number:06}.json"));
    let mut options = OpenOptions::new();
    match options.read(true).write(true).create_new(true).open(&path) {
        // Another process created the claim first.
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
            Ok(Taken::Held { by: "another process".into(), beating: false })
        }
        made => Claim::start(made.map_err(|cause| write_error(&path, cause))?, path, number, takeover).map(Taken::Mine),
    }
}

/// Returns the process that holds `folder`, if there is one as far as can be seen without waiting.
pub(crate) fn holder(folder: &Path) -> Result<Option<String>, IoError> {
    let Some((number, path)) = last(&folder.join(FOLDER))? else { return Ok(None) };
    let held = held(number, &path, Duration::MAX, &mut Watch::default())?;
    Ok(held.and_then(|held| match held {
        Taken::Held { by, .. } => Some(by),
        Taken::Mine(_) => None,
    }))
}

/// Returns whether the last owner of `folder` has neither ended nor given it back: it may still work, or have crashed.
pub(crate) fn was_left(folder: &Path) -> bool {
    let Ok(Some((_, path))) = last(&folder.join(FOLDER)) else { return false };
    let owner = files::read(&path, BYTES as u64).ok().and_then(|bytes| serde_json::from_slice::<Owner>(&bytes).ok());
    owner.is_none_or(|owner| !owner.given_back)
}

/// Returns number and path of the last claim.
fn last(claims: &Path) -> Result<Option<(u64, PathBuf)>, IoError> {
    let entries = match fs::read_dir(claims) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        entries => entries.map_err(|cause| IoError::Read { path: claims.into(), cause })?,
    };
    let number = |path: &Path| path.file_stem()?.to_str()?.parse().ok();
    Ok(entries.flatten().filter_map(|e| Some((number(&e.path())?, e.path()))).max_by_key(|(n, _)| *n))
}

/// Returns the claim as held by another process; `None` if it may be taken over.
fn held(number: u64, path: &Path, takeover: Duration, watch: &mut Watch) -> Result<Option<Taken>, IoError> {
    let bytes = match files::read(path, BYTES as u64) {
        // A later owner has removed it.
        Err(IoError::Read { cause, .. }) if cause.kind() == io::ErrorKind::NotFound => Vec::new(),
        bytes => bytes?,
    };
    let owner: Option<Owner> = serde_json::from_slice(&bytes).ok();
    let by = owner.as_ref().map_or("another process".into(), |o| format!("process {} on {}", o.process, o.host));
    if let Some(owner) = &owner
        && (owner.given_back || (owner.locked && owner.machine == machine(&host()) && is_free(path)))
    {
        return Ok(None);
    }
    let said = owner.and_then(|o| Duration::try_from_secs_f64(o.takeover_secs).ok()).unwrap_or(takeover);
    match &watch.seen {
        Some((n, b, since)) if *n == number && *b == bytes => {
            if since.elapsed() >= said {
                return Ok(None);
            }
        }
        before => {
            watch.beating = before.as_ref().is_some_and(|(n, ..)| *n == number);
            watch.seen = Some((number, bytes, Instant::now()));
        }
    }
    Ok(Some(Taken::Held { by, beating: watch.beating }))
}

/// Returns whether the lock of a file is free that its owner holds for life.
fn is_free(path: &Path) -> bool {
    // Some network file systems lock only what may be written.
    OpenOptions::new().read(true).write(true).open(path).is_ok_and(|file| file.try_lock().is_ok())
}

/// A folder claimed by this process. Dropped, it is given back.
pub(crate) struct Claim {
    number: u64,
    path: PathBuf,
    file: Arc<Mutex<(File, Owner)>>,
    lost: Arc<AtomicBool>,
    heart: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Claim {
    fn start(mut file: File, path: PathBuf, number: u64, takeover: Duration) -> Result<Self, IoError> {
        let failed = |cause| write_error(&path, cause);
        let mut owner = Owner::here(takeover);
        // Locked before the owner is written, as others try the lock once they can read it. If the lock fails, the
        // heartbeat alone has to do.
        owner.locked = cfg!(unix) && file.try_lock().is_ok();
        owner.write(&mut file).map_err(failed)?;
        let file = Arc::new(Mutex::new((file, owner)));
        let lost = Arc::<AtomicBool>::default();
        let (stop, stopped) = bounded(0);
        let heart = {
            let (file, lost, path) = (Arc::clone(&file), Arc::clone(&lost), path.clone());
            move || {
                while stopped.recv_timeout(takeover / BEATS) == Err(RecvTimeoutError::Timeout) {
                    if is_superseded(number, &path) {
                        lost.store(true, Ordering::SeqCst);
                        return;
                    }
                    let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                    let (file, owner) = &mut *file;
                    owner.beats += 1;
                    // If this fails for long, another process takes over.
                    let _ = owner.write(file);
                }
            }
        };
        let heart = std::thread::Builder::new().name("heartbeat".into()).spawn(heart).map_err(failed)?;
        Ok(Self { number, path, file, lost, heart: Some((stop, heart)) })
    }

    /// Number of claims of the folder so far, this one included.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Flag that is set once another process has taken over because this one stopped for too long.
    pub(crate) fn lost(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.lost)
    }

    /// Returns whether another process has taken over by now.
    pub(crate) fn is_lost(&self) -> bool {
        self.lost.load(Ordering::SeqCst) || is_superseded(self.number, &self.path)
    }

    /// Removes the claims before this one. To be called only once the work is done for good: earlier, a process with an
    /// old listing could take a number as free that was in use.
    pub(crate) fn forget_earlier(&self) {
        let Some(folder) = self.path.parent() else { return };
        for number in 1..self.number {
            let _ = fs::remove_file(folder.join(format!("{number:06}.json")));
        }
    }
}

/// Returns whether there is a claim after this one.
fn is_superseded(number: u64, path: &Path) -> bool {
    path.parent().is_some_and(|claims| matches!(last(claims), Ok(Some((n, _))) if n > number))
}

impl Drop for Claim {
    fn drop(&mut self) {
        if let Some((stop, heart)) = self.heart.take() {
            drop(stop);
            let _ = heart.join();
        }
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let (file, owner) = &mut *file;
        owner.given_back = true;
        // If this fails, the free lock or the stopped heartbeat says the same.
        let _ = owner.write(file);
    }
}

#[cfg(test)]
mod tests;
