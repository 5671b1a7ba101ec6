//! Downloads of model files: resumed, checked, cancellable. Nothing is fetched without a request of the user.
//!
//! No more is read than the size in a description, else [`FileToFetch::most`]: 16 MiB for a description itself, a
//! tenth more than the list says for a checkpoint.

mod answer;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use sha2::{Digest, Sha256};
use ureq::Agent;
use ureq::http::StatusCode;

use crate::io::files;
use crate::io::http::{self, ResponsePart, TICK};
use crate::scene::text;

use answer::{content_range, elsewhere};

/// Least number of bytes within the time of a stall: a server that sends a byte now and then counts as stalled.
const LEAST_BYTES: u64 = 1024;

/// Most redirects of a server, and characters of an address that are shown.
const MOST_HOPS: usize = 10;
const SHOWN: usize = 200;

/// Largest file of unknown size, bytes: a description.
pub const MOST_UNPROMISED: u64 = 16 << 20;

/// File to fetch.
#[derive(Clone, Copy, Debug)]
pub struct FileToFetch<'a> {
    /// Address.
    pub url: &'a str,
    /// Path of the complete and checked file.
    pub to: &'a Path,
    /// Size in bytes, if known.
    pub bytes: Option<u64>,
    /// Largest size in bytes, if the size is not known.
    pub most: u64,
    /// SHA-256 in hexadecimal digits, if known.
    pub sha256: Option<&'a str>,
}

/// Timeouts and retries of a download.
#[derive(Clone, Copy, Debug)]
pub struct Timeouts {
    /// Longest silence of a server.
    pub stall: Duration,
    /// Number of attempts before an interrupted download fails.
    pub attempts: u32,
    /// Wait before the second attempt; doubled before each further one.
    pub pause: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        Self { stall: Duration::from_secs(30), attempts: 5, pause: Duration::from_secs(1) }
    }
}

/// Reasons for which a file could not be fetched. A valid partial download stays and is resumed the next time.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum FetchError {
    #[error("{url} cannot be reached: {problem}; check the network (and HTTPS_PROXY), or bring the file yourself")]
    Unreachable { url: String, problem: String },
    #[error("{url} answered {status}; the address may have changed")]
    Refused { url: String, status: u16 },
    #[error("{url} sends on to '{to}', which is no address of a server (http or https), so nothing was fetched there")]
    Elsewhere { url: String, to: String },
    #[error("{url} sent nothing for {secs} s, after {got} bytes; try again, what arrived is kept")]
    Stalled { url: String, secs: u64, got: u64 },
    #[error("{url} ended after {got} of {expected} bytes; try again, what arrived is kept")]
    Truncated { url: String, got: u64, expected: u64 },
    #[error("{url} offers {offered} bytes, but the file has {expected}; it is another file, and was not taken")]
    OtherSize { url: String, offered: u64, expected: u64 },
    #[error("{url} is larger than the {most} bytes that it may have; it is another file, and was not taken")]
    TooLarge { url: String, most: u64 },
    #[error("{url} is a web page, not a file (a sign-in, or an error page?)")]
    WebPage { url: String },
    #[error("{path} has SHA-256 {got}, expected {expected}; it is broken or another file, and was refused")]
    Checksum { path: PathBuf, got: String, expected: String },
    #[error("{path}: {source}")]
    File { path: PathBuf, source: io::Error },
    #[error("canceled after {got} bytes; what arrived is kept")]
    Cancelled { got: u64 },
}

impl FetchError {
    fn is_passing(&self) -> bool {
        match self {
            Self::Unreachable { .. } | Self::Stalled { .. } | Self::Truncated { .. } => true,
            Self::Refused { status, .. } => *status == 429 || *status >= 500,
            _ => false,
        }
    }
}

/// Fetches a file. `progress` receives the bytes so far and the total, and returns false to cancel.
pub fn fetch(
    wanted: &FileToFetch<'_>,
    timeouts: Timeouts,
    progress: &mut dyn FnMut(u64, Option<u64>) -> bool,
) -> Result<(), FetchError> {
    if let Some(folder) = wanted.to.parent() {
        fs::create_dir_all(folder).map_err(|source| FetchError::File { path: folder.into(), source })?;
    }
    // Redirects are followed by hand, so that each address is checked before it is requested.
    let config = http::config(wanted.url, 2 * timeouts.stall).max_redirects(0).max_redirects_will_error(false);
    let agent = Agent::from(config.build());
    let part = Part::of(wanted);
    let mut pause = timeouts.pause;
    for attempt in 1.. {
        match receive(&agent, wanted, &part, timeouts.stall, progress) {
            Ok(()) => break,
            Err(e) if e.is_passing() && attempt < timeouts.attempts => {
                let begin = Instant::now();
                while begin.elapsed() < pause {
                    let (there, _) = part.there();
                    if !progress(there, wanted.bytes) {
                        return Err(FetchError::Cancelled { got: there });
                    }
                    std::thread::sleep(TICK.min(pause));
                }
                pause *= 2;
            }
            Err(e) => return Err(e),
        }
    }
    if let Some(expected) = wanted.sha256 {
        let checked = check(&part.path, expected);
        if matches!(checked, Err(FetchError::Checksum { .. })) {
            part.forget();
        }
        checked?;
    }
    // The tag first: if the program ends between the two, no tag is left beside a whole file.
    let _ = fs::remove_file(&part.tag);
    fs::rename(&part.path, wanted.to).map_err(|source| FetchError::File { path: wanted.to.into(), source })
}

/// Compares a file with its expected SHA-256.
pub(crate) fn check(path: &Path, expected: &str) -> Result<(), FetchError> {
    let got = sha256(path).map_err(|source| FetchError::File { path: path.into(), source })?;
    if got.eq_ignore_ascii_case(expected) {
        return Ok(());
    }
    Err(FetchError::Checksum { path: path.into(), got, expected: expected.to_owned() })
}

/// SHA-256 of a file, in hexadecimal digits.
pub fn sha256(path: &Path) -> io::Result<String> {
    let mut file = File::open(path)?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => break,
            n => hasher.update(&buffer[..n]),
        }
    }
    Ok(files::hex(&hasher.finalize()))
}

/// Partial download, beside the final file.
pub(super) struct Part {
    path: PathBuf,
    /// File with the server's tag of this version of the file.
    tag: PathBuf,
    /// True if it can be resumed without a tag of the server, because a checksum verifies the result.
    is_checked: bool,
}

impl Part {
    pub(super) fn of(wanted: &FileToFetch<'_>) -> Self {
        let beside = |ending: &str| {
            let mut name = wanted.to.as_os_str().to_owned();
            name.push(ending);
            PathBuf::from(name)
        };
        Self { path: beside(".part"), tag: beside(".part.tag"), is_checked: wanted.sha256.is_some() }
    }

    /// Number of bytes to resume from, and the tag of their version.
    pub(super) fn there(&self) -> (u64, Option<String>) {
        let tag = fs::read_to_string(&self.tag).ok().filter(|t| !t.is_empty());
        let bytes = fs::metadata(&self.path).map_or(0, |m| m.len());
        if tag.is_some() || self.is_checked { (bytes, tag) } else { (0, None) }
    }

    /// Opens the file, cut to its first `there` bytes, and locks it for this process.
    fn open(&self, there: u64) -> Result<File, FetchError> {
        let mut file =
            OpenOptions::new().create(true).write(true).truncate(false).open(&self.path).map_err(|e| self.failed(e))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let busy = "another program is fetching it; wait for that, or end it";
                return Err(self.failed(io::Error::other(busy)));
            }
            // Some file systems do not support locks.
            Err(TryLockError::Error(_)) => {}
        }
        file.set_len(there).and_then(|()| file.seek(SeekFrom::End(0))).map_err(|e| self.failed(e))?;
        Ok(file)
    }

    fn forget(&self) {
        // The files may be gone already.
        let _ = fs::remove_file(&self.path);
        let _ = fs::remove_file(&self.tag);
    }

    fn failed(&self, source: io::Error) -> FetchError {
        FetchError::File { path: self.path.clone(), source }
    }
}

/// Makes one connection and resumes from the bytes on disk.
fn receive(
    agent: &Agent,
    wanted: &FileToFetch<'_>,
    part: &Part,
    stall: Duration,
    progress: &mut dyn FnMut(u64, Option<u64>) -> bool,
) -> Result<(), FetchError> {
    let most = wanted.bytes.unwrap_or(wanted.most);
    let (mut there, tag) = part.there();
    if there > most {
        part.forget();
        there = 0;
    }
    let (mut url, mut hops) = (wanted.url.to_owned(), 0);
    let (mut wait, status, headers) = loop {
        let mut request = agent.get(&url);
        if there > 0 {
            request = request.header("Range", format!("bytes={there}-"));
            if let Some(tag) = &tag {
                request = request.header("If-Range", tag);
            }
        }
        let pieces = http::ask(move || request.call()).map_err(|e| part.failed(e))?;
        let mut wait = Wait { pieces, stall, since: Instant::now(), got: 0 };
        let (status, headers) = match wait.next(there, wanted.bytes, progress) {
            Ok(Some(ResponsePart::Head(status, headers))) => (status, headers),
            Ok(Some(ResponsePart::Failed(problem))) => return Err(FetchError::Unreachable { url, problem }),
            Ok(_) => return Err(FetchError::Unreachable { url, problem: "the connection ended".into() }),
            Err(ended) => return Err(ended.error(url, stall, there)),
        };
        let to = headers.get("location").filter(|_| status.is_redirection() && hops < MOST_HOPS);
        let Some(to) = to.map(|to| String::from_utf8_lossy(to.as_bytes()).into_owned()) else {
            break (wait, status, headers);
        };
        let Some(next) = elsewhere(&url, &to) else {
            return Err(FetchError::Elsewhere { url, to: text::elided(&to, SHOWN) });
        };
        (url, hops) = (next, hops + 1);
    };
    let too_large = |offered| match wanted.bytes {
        Some(expected) => FetchError::OtherSize { url: url.clone(), offered, expected },
        None => FetchError::TooLarge { url: url.clone(), most },
    };
    let header = |name: &str| headers.get(name).and_then(|v| v.to_str().ok()).map(str::to_owned);
    let total = match status {
        StatusCode::PARTIAL_CONTENT => {
            let (start, total) = header("content-range").as_deref().and_then(content_range).unwrap_or((u64::MAX, None));
            if start != there {
                // The server sent another range than the requested one.
                part.forget();
                return Err(FetchError::Truncated { url, got: 0, expected: wanted.bytes.or(total).unwrap_or(0) });
            }
            total
        }
        StatusCode::OK => {
            there = 0;
            header("content-length").and_then(|l| l.parse().ok())
        }
        StatusCode::RANGE_NOT_SATISFIABLE if wanted.bytes == Some(there) => return Ok(()),
        StatusCode::RANGE_NOT_SATISFIABLE => {
            part.forget();
            return Err(FetchError::Truncated { url, got: 0, expected: wanted.bytes.unwrap_or(0) });
        }
        status => return Err(FetchError::Refused { url, status: status.as_u16() }),
    };
    if header("content-type").is_some_and(|t| t.starts_with("text/html")) {
        return Err(FetchError::WebPage { url });
    }
    match (total, wanted.bytes) {
        (Some(offered), Some(expected)) if offered != expected => return Err(too_large(offered)),
        (Some(offered), None) if offered > most => return Err(too_large(offered)),
        _ => {}
    }
    let mut file = part.open(there)?;
    // Weak tags do not promise the same bytes.
    let tag = header("etag").filter(|t| !t.starts_with("W/")).or_else(|| header("last-modified")).unwrap_or_default();
    fs::write(&part.tag, tag).map_err(|e| part.failed(e))?;
    let expected = wanted.bytes.or(total);
    loop {
        match wait.next(there, expected, progress) {
            Ok(Some(ResponsePart::Bytes(piece))) => {
                if there + piece.len() as u64 > most {
                    // A file that is too long is another file, so its first bytes are useless too.
                    part.forget();
                    return Err(too_large(there + piece.len() as u64));
                }
                there += piece.len() as u64;
                file.write_all(&piece).map_err(|e| part.failed(e))?;
            }
            // Without a known size, an interrupted answer cannot be told from a whole file.
            Ok(Some(ResponsePart::Failed(problem))) if expected.is_none() => {
                return Err(FetchError::Unreachable { url, problem });
            }
            Ok(_) => break,
            Err(ended) => return Err(ended.error(url, stall, there)),
        }
    }
    file.sync_all().map_err(|e| part.failed(e))?;
    match expected {
        Some(expected) if there < expected => Err(FetchError::Truncated { url, got: there, expected }),
        _ => Ok(()),
    }
}

/// Reason for which a wait ended without a piece.
enum Ended {
    Stalled,
    Cancelled,
}

impl Ended {
    fn error(self, url: String, stall: Duration, got: u64) -> FetchError {
        match self {
            Self::Stalled => FetchError::Stalled { url, secs: stall.as_secs(), got },
            Self::Cancelled => FetchError::Cancelled { got },
        }
    }
}

/// Waits for pieces until the server stalls or the user cancels.
struct Wait {
    pieces: Receiver<ResponsePart>,
    stall: Duration,
    /// Time at which at least [`LEAST_BYTES`] had last arrived.
    since: Instant,
    /// Bytes that arrived since then.
    got: u64,
}

impl Wait {
    /// Returns the next piece; `None` at the end.
    fn next(
        &mut self,
        there: u64,
        expected: Option<u64>,
        progress: &mut dyn FnMut(u64, Option<u64>) -> bool,
    ) -> Result<Option<ResponsePart>, Ended> {
        loop {
            let asked = Instant::now();
            if !progress(there, expected) {
                return Err(Ended::Cancelled);
            }
            // `progress` may have waited while the user paused; this is not a stall of the server.
            self.since += asked.elapsed();
            let piece = match self.pieces.recv_timeout(TICK) {
                Ok(piece) => piece,
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) if self.since.elapsed() > self.stall => return Err(Ended::Stalled),
                Err(RecvTimeoutError::Timeout) => continue,
            };
            self.got += match &piece {
                ResponsePart::Bytes(bytes) => bytes.len() as u64,
                _ => LEAST_BYTES,
            };
            if self.got >= LEAST_BYTES {
                (self.since, self.got) = (Instant::now(), 0);
            } else if self.since.elapsed() > self.stall {
                return Err(Ended::Stalled);
            }
            return Ok(Some(piece));
        }
    }
}
