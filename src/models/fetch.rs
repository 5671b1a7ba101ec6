//! Downloads of model files: resumed, checked, cancellable. Nothing is fetched that a person has not
//! asked for.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crossbeam_channel::{RecvTimeoutError, bounded};
use sha2::{Digest, Sha256};
use ureq::http::{Response, StatusCode};
use ureq::{Agent, Body};

/// A file to fetch.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// From where.
    pub url: &'a str,
    /// The file that it becomes, once it is complete and right.
    pub to: &'a Path,
    /// Its size, if that is known.
    pub bytes: Option<u64>,
    /// Its SHA-256 in hexadecimal digits, if that is known.
    pub sha256: Option<&'a str>,
}

/// How patient a download is.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// How long a server may say nothing.
    pub stall: Duration,
    /// How often a download that broke off is gone on with.
    pub attempts: u32,
    /// Wait before the second attempt; doubled before each further one.
    pub pause: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self { stall: Duration::from_secs(30), attempts: 5, pause: Duration::from_secs(1) }
    }
}

/// Why a file could not be fetched. What arrived before stays, and is gone on with the next time,
/// unless it was wrong.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// No connection.
    #[error("{url} cannot be reached: {problem}; check the network (and HTTPS_PROXY), or bring the file yourself")]
    Unreachable {
        /// From where.
        url: String,
        /// What happened.
        problem: String,
    },
    /// The server answered, but not with the file.
    #[error("{url} answered {status}; the address may have changed")]
    Refused {
        /// From where.
        url: String,
        /// HTTP status.
        status: u16,
    },
    /// The server went silent.
    #[error("{url} sent nothing for {secs} s, after {got} bytes; try again, what arrived is kept")]
    Stalled {
        /// From where.
        url: String,
        /// How long it was waited.
        secs: u64,
        /// Bytes that are there.
        got: u64,
    },
    /// The connection ended early.
    #[error("{url} ended after {got} of {expected} bytes; try again, what arrived is kept")]
    Truncated {
        /// From where.
        url: String,
        /// Bytes that are there.
        got: u64,
        /// Bytes that were promised.
        expected: u64,
    },
    /// Another size than the catalogue's.
    #[error("{url} offers {offered} bytes, but the file has {expected}; it is another file, and was not taken")]
    OtherSize {
        /// From where.
        url: String,
        /// Bytes that the server has.
        offered: u64,
        /// Bytes that it should have.
        expected: u64,
    },
    /// A page for people in place of the file.
    #[error("{url} is a web page, not a file (a sign-in, or an error page?)")]
    WebPage {
        /// From where.
        url: String,
    },
    /// The content is not what it should be.
    #[error("{path} has SHA-256 {got}, expected {expected}; it is broken or another file, and was refused")]
    Checksum {
        /// The file.
        path: PathBuf,
        /// What it has.
        got: String,
        /// What it should have.
        expected: String,
    },
    /// The file cannot be written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// Somebody asked to stop.
    #[error("cancelled after {got} bytes; what arrived is kept")]
    Cancelled {
        /// Bytes that are there.
        got: u64,
    },
}

impl FetchError {
    /// Whether trying again may help.
    fn is_passing(&self) -> bool {
        match self {
            Self::Unreachable { .. } | Self::Stalled { .. } | Self::Truncated { .. } => true,
            Self::Refused { status, .. } => *status == 429 || *status >= 500,
            _ => false,
        }
    }
}

/// Fetches a file. `progress` is told the bytes that are there and those that there will be, and
/// whether to go on.
///
/// # Errors
/// See [`FetchError`].
pub fn fetch(
    wanted: &Wanted<'_>,
    patience: Patience,
    progress: &mut dyn FnMut(u64, Option<u64>) -> bool,
) -> Result<(), FetchError> {
    if let Some(folder) = wanted.to.parent() {
        fs::create_dir_all(folder).map_err(|source| FetchError::File { path: folder.into(), source })?;
    }
    let config = Agent::config_builder()
        .http_status_as_error(false)
        .timeout_connect(Some(patience.stall))
        .timeout_recv_response(Some(patience.stall))
        .build();
    let agent: Agent = config.into();
    let part = Part::of(wanted);
    let mut pause = patience.pause;
    for attempt in 1.. {
        match receive(&agent, wanted, &part, patience.stall, progress) {
            Ok(()) => break,
            Err(e) if e.is_passing() && attempt < patience.attempts => {
                std::thread::sleep(pause);
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
    fs::rename(&part.path, wanted.to).map_err(|source| FetchError::File { path: wanted.to.into(), source })?;
    part.forget();
    Ok(())
}

/// Compares a file with its SHA-256.
///
/// # Errors
/// If they differ, or the file cannot be read.
pub fn check(path: &Path, expected: &str) -> Result<(), FetchError> {
    let got = sha256(path).map_err(|source| FetchError::File { path: path.into(), source })?;
    if got.eq_ignore_ascii_case(expected) {
        return Ok(());
    }
    Err(FetchError::Checksum { path: path.into(), got, expected: expected.to_owned() })
}

/// SHA-256 of a file, in hexadecimal digits.
///
/// # Errors
/// If it cannot be read.
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
    Ok(hasher.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

/// What has arrived so far, beside the file that it will become.
struct Part {
    path: PathBuf,
    /// Holds the tag that the server gave this version of the file.
    tag: PathBuf,
    /// Whether what arrived can be gone on with if the server gives no tag: a checksum will tell.
    is_checked: bool,
}

impl Part {
    fn of(wanted: &Wanted<'_>) -> Self {
        let beside = |ending: &str| {
            let mut name = wanted.to.as_os_str().to_owned();
            name.push(ending);
            PathBuf::from(name)
        };
        Self { path: beside(".part"), tag: beside(".part.tag"), is_checked: wanted.sha256.is_some() }
    }

    /// Bytes that can be gone on from, and the tag of their version.
    fn there(&self) -> (u64, Option<String>) {
        let tag = fs::read_to_string(&self.tag).ok().filter(|t| !t.is_empty());
        let bytes = fs::metadata(&self.path).map_or(0, |m| m.len());
        if tag.is_some() || self.is_checked { (bytes, tag) } else { (0, None) }
    }

    fn forget(&self) {
        // That they are gone already is as good.
        let _ = fs::remove_file(&self.path);
        let _ = fs::remove_file(&self.tag);
    }

    fn failed(&self, source: io::Error) -> FetchError {
        FetchError::File { path: self.path.clone(), source }
    }
}

/// One connection: goes on from what is there.
fn receive(
    agent: &Agent,
    wanted: &Wanted<'_>,
    part: &Part,
    stall: Duration,
    progress: &mut dyn FnMut(u64, Option<u64>) -> bool,
) -> Result<(), FetchError> {
    let url = wanted.url.to_owned();
    let (mut there, tag) = part.there();
    if wanted.bytes.is_some_and(|bytes| there > bytes) {
        part.forget();
        there = 0;
    }
    let mut request = agent.get(&url);
    if there > 0 {
        request = request.header("Range", format!("bytes={there}-"));
        if let Some(tag) = &tag {
            request = request.header("If-Range", tag);
        }
    }
    let response = request.call().map_err(|e| FetchError::Unreachable { url: url.clone(), problem: e.to_string() })?;
    let header = |name: &str| response.headers().get(name).and_then(|v| v.to_str().ok()).map(str::to_owned);
    let total = match response.status() {
        StatusCode::PARTIAL_CONTENT => {
            let (start, total) = header("content-range").as_deref().and_then(content_range).unwrap_or((u64::MAX, None));
            if start != there {
                // Another piece than was asked for.
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
    if let (Some(offered), Some(expected)) = (total, wanted.bytes)
        && offered != expected
    {
        return Err(FetchError::OtherSize { url, offered, expected });
    }
    // Weak tags do not promise the same bytes.
    let tag = header("etag").filter(|t| !t.starts_with("W/")).or_else(|| header("last-modified")).unwrap_or_default();
    fs::write(&part.tag, tag).map_err(|e| part.failed(e))?;
    let mut file = OpenOptions::new()
        .create(true)
        .append(there > 0)
        .write(true)
        .truncate(there == 0)
        .open(&part.path)
        .map_err(|e| part.failed(e))?;
    let pieces = pieces(response).map_err(|e| part.failed(e))?;
    let expected = wanted.bytes.or(total);
    loop {
        if !progress(there, expected) {
            return Err(FetchError::Cancelled { got: there });
        }
        match pieces.recv_timeout(stall) {
            Ok(Ok(piece)) => {
                there += piece.len() as u64;
                file.write_all(&piece).map_err(|e| part.failed(e))?;
            }
            // The reader ends by itself, or with the program: a blocked read cannot be called off.
            Err(RecvTimeoutError::Timeout) => {
                return Err(FetchError::Stalled { url, secs: stall.as_secs(), got: there });
            }
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    file.sync_all().map_err(|e| part.failed(e))?;
    match expected {
        Some(expected) if there < expected => Err(FetchError::Truncated { url, got: there, expected }),
        Some(expected) if there > expected => Err(FetchError::OtherSize { url, offered: there, expected }),
        _ => Ok(()),
    }
}

/// Start and total of "bytes 5-9/10".
fn content_range(value: &str) -> Option<(u64, Option<u64>)> {
    let (range, total) = value.strip_prefix("bytes ")?.split_once('/')?;
    Some((range.split_once('-')?.0.parse().ok()?, total.parse().ok()))
}

/// The body, read by a thread of its own, so that a silent server can be told from a slow one.
fn pieces(response: Response<Body>) -> io::Result<crossbeam_channel::Receiver<io::Result<Vec<u8>>>> {
    let (send, receive) = bounded(4);
    let read = move || {
        let mut reader = response.into_body().into_reader();
        loop {
            let mut piece = vec![0; 1 << 16];
            let read = reader.read(&mut piece).map(|n| {
                piece.truncate(n);
                piece
            });
            // The end: whoever receives sees that nobody sends any more.
            if read.as_ref().is_ok_and(Vec::is_empty) {
                return;
            }
            let failed = read.is_err();
            if send.send(read).is_err() || failed {
                return;
            }
        }
    };
    std::thread::Builder::new().name("download".into()).spawn(read)?;
    Ok(receive)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_content() {
        assert_eq!(content_range("bytes 5-9/10"), Some((5, Some(10))));
        assert_eq!(content_range("bytes 5-9/*"), Some((5, None)));
        for bad in ["", "bytes", "bytes x-9/10", "items 5-9/10"] {
            assert_eq!(content_range(bad), None, "{bad}");
        }
    }

    #[test]
    fn checksums_tell_files_apart() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a");
        fs::write(&path, "abc").expect("written");
        let known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert!(check(&path, &known.to_uppercase()).is_ok());
        fs::write(&path, "abd").expect("written");
        assert!(matches!(check(&path, known), Err(FetchError::Checksum { .. })));
        assert!(matches!(check(&folder.path().join("none"), known), Err(FetchError::File { .. })));
    }
}
