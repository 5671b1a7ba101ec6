//! One request to a chat model server and its answer: chunks as they arrive, with a time limit for silence, and
//! cancelable.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};
use ureq::Agent;

use super::secret::Secret;
use super::settings::RequestTimeouts;
use crate::io::http::{self, ResponsePart, TICK};

/// Reason for a missing answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Broken {
    Connection(String),
    Stall,
    TooLong,
    Status {
        code: u16,
        /// Wait that the server asks for.
        retry_after: Option<Duration>,
        body: String,
    },
    Cancelled,
}

impl Broken {
    /// Returns whether another attempt may help.
    pub(crate) fn is_passing(&self) -> bool {
        match self {
            Self::Connection(_) | Self::Stall => true,
            Self::Status { code, .. } => *code == 429 || *code == 408 || *code >= 500,
            Self::TooLong | Self::Cancelled => false,
        }
    }
}

/// Head of an answer: true if a stream of events follows.
pub(crate) struct Head {
    pub(crate) is_stream: bool,
}

/// Sends `body`, or a request without one, and passes each chunk of the answer to `take`, which returns true once it
/// needs no more. The address and the key go into the connection only.
///
/// # Errors
/// See [`Broken`].
pub(crate) fn exchange(
    url: &str,
    key: Option<&Secret>,
    body: Option<String>,
    timeouts: &RequestTimeouts,
    most_bytes: usize,
    cancel: &AtomicBool,
    take: &mut dyn FnMut(&Head, &[u8]) -> bool,
) -> Result<(), Broken> {
    let pieces = ask(url, key, body, timeouts).map_err(|e| Broken::Connection(e.to_string()))?;
    let begin = Instant::now();
    let mut heard = Instant::now();
    let mut head: Option<(Head, u16, Option<Duration>)> = None;
    let (mut refused, mut bytes) = (Vec::new(), 0_usize);
    loop {
        if cancel.load(Ordering::Relaxed) {
            return Err(Broken::Cancelled);
        }
        if heard.elapsed() > timeouts.stall || begin.elapsed() > timeouts.answer {
            return Err(Broken::Stall);
        }
        match pieces.recv_timeout(TICK) {
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => break,
            Ok(ResponsePart::Failed(problem)) => return Err(Broken::Connection(problem)),
            Ok(ResponsePart::Head(status, headers)) => {
                heard = Instant::now();
                let header = |name: &str| headers.get(name).and_then(|v| v.to_str().ok());
                let retry_after = header("retry-after").and_then(|v| v.trim().parse::<f64>().ok());
                let retry_after = retry_after.filter(|s| (0.0..1e6).contains(s)).map(Duration::from_secs_f64);
                let is_stream = header("content-type").is_some_and(|t| t.starts_with("text/event-stream"));
                head = Some((Head { is_stream }, status.as_u16(), retry_after));
            }
            Ok(ResponsePart::Bytes(piece)) => {
                heard = Instant::now();
                bytes += piece.len();
                if bytes > most_bytes {
                    return Err(Broken::TooLong);
                }
                match &head {
                    Some((head, 200..300, _)) => {
                        if take(head, &piece) {
                            return Ok(());
                        }
                    }
                    // The body of a refusal holds the reason.
                    _ => refused.extend(piece),
                }
            }
        }
    }
    match head {
        Some((_, 200..300, _)) => Ok(()),
        Some((_, code, retry_after)) => {
            Err(Broken::Status { code, retry_after, body: String::from_utf8_lossy(&refused).into_owned() })
        }
        None => Err(Broken::Connection("the connection ended".into())),
    }
}

fn ask(
    url: &str,
    key: Option<&Secret>,
    body: Option<String>,
    timeouts: &RequestTimeouts,
) -> std::io::Result<Receiver<ResponsePart>> {
    let config = http::config(url, 2 * timeouts.stall)
        // A redirect would send the key and the user's words to another server.
        .max_redirects(0)
        .max_redirects_will_error(false)
        .timeout_global(Some(timeouts.answer + timeouts.stall))
        .build();
    let (agent, bearer) = (Agent::from(config), key.map(Secret::bearer));
    match body {
        Some(body) => {
            let request = agent.post(url).header("Content-Type", "application/json");
            let request = bearer.into_iter().fold(request, |r, key| r.header("Authorization", key));
            http::ask(move || request.send(body))
        }
        None => {
            let request = bearer.into_iter().fold(agent.get(url), |r, key| r.header("Authorization", key));
            http::ask(move || request.call())
        }
    }
}

/// Waits, unless canceled; returns true if the full time has passed.
pub(crate) fn wait(time: Duration, cancel: &AtomicBool) -> bool {
    let begin = Instant::now();
    while begin.elapsed() < time {
        if cancel.load(Ordering::Relaxed) {
            return false;
        }
        std::thread::sleep(TICK.min(time.saturating_sub(begin.elapsed())));
    }
    true
}
