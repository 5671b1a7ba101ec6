//! Client of a server: one request per question, with limits of size and time for the answer.

use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use ureq::http::Response;
use ureq::{Agent, Body, RequestBuilder};

use super::address::Address;
use super::photos;
use super::token::random_name;
use super::wire::{
    CLIENT_HEADER, ClientRequest, GENERATION_HEADER, RUN_HEADER, STEP_HEADER, SceneSummary, ServerUpdate,
    VERSION_HEADER, is_understood, version,
};
use crate::io::snapshot::SceneSnapshot;
use crate::io::{http, memory};
use crate::scene::{PhotoPixels, text};

/// Longest silence of the server.
const STALL: Duration = Duration::from_secs(10);
/// Longest wait for an answer with Gaussians or a photo, or to a change: a training on the server has priority.
const WORK: Duration = Duration::from_secs(120);
/// Largest answer in JSON, with Gaussians, with a photo, and with a refusal, in bytes.
const JSON_BYTES: u64 = 64 << 20;
const SNAPSHOT_BYTES: u64 = 16 << 30;
const PHOTO_BYTES: u64 = 128 << 20;
const REFUSAL_BYTES: u64 = 2 << 10;

/// Least mean rate of an answer in bytes per second, checked after `PATIENCE`.
const SLOWEST: u64 = 1_000;
const PATIENCE: Duration = Duration::from_secs(30);

/// Returns whether an answer arrives so slowly that it may never end.
fn is_too_slow(bytes: usize, time: Duration) -> bool {
    time > PATIENCE && (bytes as u64) < SLOWEST * time.as_secs()
}

/// Reason for a missing answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ClientError {
    /// The server cannot be reached now; a later attempt may succeed.
    #[error("{0}")]
    Lost(String),
    /// The server refuses the request, or its answer is not valid.
    #[error("{0}")]
    Refused(String),
}

/// Answer, with the run of the server that it is from.
#[derive(Debug)]
pub(crate) struct ServerAnswer<T> {
    pub(crate) run: String,
    pub(crate) value: T,
}

/// Gaussians as received.
#[derive(Debug)]
pub(crate) struct Pulled {
    pub(crate) snapshot: SceneSnapshot,
    pub(crate) generation: u64,
    /// Training step.
    pub(crate) step: u64,
}

/// Client of one server.
#[derive(Debug)]
pub(crate) struct Client {
    agent: Agent,
    pub(crate) address: Address,
    name: String,
}

impl Client {
    /// # Errors
    /// Only if the system gives no random numbers.
    pub(crate) fn new(address: Address) -> std::io::Result<Self> {
        // A redirect would send the token to another address.
        let config = http::config(&address.base, STALL).max_redirects(0).max_redirects_will_error(false).build();
        Ok(Self { agent: config.into(), address, name: random_name()? })
    }

    /// Fetches the scene without its Gaussians.
    pub(crate) fn scene(&self) -> Result<ServerAnswer<SceneSummary>, ClientError> {
        self.json("/scene")
    }

    /// Fetches the events after number `since`; `have` is the generation of the client's Gaussians.
    pub(crate) fn news(&self, since: u64, have: u64) -> Result<ServerAnswer<ServerUpdate>, ClientError> {
        self.json(&format!("/news?since={since}&have={have}"))
    }

    /// Fetches the newest Gaussians if they are newer than generation `have`.
    pub(crate) fn snapshot(&self, have: u64) -> Result<Option<Pulled>, ClientError> {
        let response = self.get(&format!("/snapshot?since={have}"), WORK)?;
        if response.status() == 204 {
            return Ok(None);
        }
        let number = |name: &str| self.header(&response, name)?.parse().map_err(|_| self.odd("a header is no number"));
        let (generation, step) = (number(GENERATION_HEADER)?, number(STEP_HEADER)?);
        let bytes = self.bytes(response, SNAPSHOT_BYTES)?;
        let snapshot =
            SceneSnapshot::parse(&bytes, Path::new(&self.address.host)).map_err(|e| self.odd(&e.to_string()))?;
        Ok(Some(Pulled { snapshot, generation, step }))
    }

    /// Fetches a photo, with a longest side of at most `side_px` px.
    pub(crate) fn photo(&self, index: usize, side_px: u32) -> Result<PhotoPixels, ClientError> {
        let response = self.get(&format!("/photo?index={index}&side={side_px}"), WORK)?;
        photos::read(&self.bytes(response, PHOTO_BYTES)?).map_err(|e| self.odd(&e.to_string()))
    }

    /// Sends a command. The server refuses it if it cannot carry it out.
    pub(crate) fn ask(&self, ask: &ClientRequest) -> Result<(), ClientError> {
        let body = serde_json::to_vec(ask).map_err(|e| ClientError::Refused(e.to_string()))?;
        let request = self.signed(self.agent.post(format!("{}/ask", self.address.base)), WORK);
        self.checked(request.content_type("application/json").send(&body)).map(drop)
    }

    fn json<T: DeserializeOwned>(&self, path: &str) -> Result<ServerAnswer<T>, ClientError> {
        let response = self.get(path, STALL)?;
        let run = self.header(&response, RUN_HEADER)?;
        let bytes = self.bytes(response, JSON_BYTES)?;
        let value = serde_json::from_slice(&bytes).map_err(|e| self.odd(&format!("{path}: {e}")))?;
        Ok(ServerAnswer { run, value })
    }

    /// Sends a GET request and waits this long for the start of the answer.
    fn get(&self, path: &str, wait: Duration) -> Result<Response<Body>, ClientError> {
        self.checked(self.signed(self.agent.get(format!("{}{path}", self.address.base)), wait).call())
    }

    /// Adds the headers of this client, and the longest wait for the start of the answer.
    fn signed<B>(&self, request: RequestBuilder<B>, wait: Duration) -> RequestBuilder<B> {
        let request = request.config().timeout_recv_response(Some(wait)).build();
        let request = request.header("authorization", format!("Bearer {}", self.address.token.text()));
        request.header(VERSION_HEADER, version()).header(CLIENT_HEADER, &self.name)
    }

    /// Checks that the answer is from a server of a supported version, and that it is not a refusal.
    fn checked(&self, response: Result<Response<Body>, ureq::Error>) -> Result<Response<Body>, ClientError> {
        let host = &self.address.host;
        let response = response.map_err(|e| ClientError::Lost(format!("{host}: {e}")))?;
        let status = response.status().as_u16();
        let theirs = match response.headers().get(VERSION_HEADER).and_then(|v| v.to_str().ok()) {
            Some(theirs) => text::line(theirs).into_owned(),
            // Also the answer of a tunnel with a lost remote end.
            None if status >= 500 => return Err(ClientError::Lost(format!("{host} answers with {status}"))),
            None => return Err(ClientError::Refused(format!("what answers at {host} is no fmlgs server"))),
        };
        if !is_understood(&theirs) {
            let own = version();
            let text = format!("{host} speaks {theirs}, this program {own}: install the same fmlgs on both");
            return Err(ClientError::Refused(text));
        }
        match status {
            200 | 204 => Ok(response),
            429 | 503 => Err(ClientError::Lost(format!("{host} has too many clients at the moment"))),
            _ => {
                let why = self.bytes(response, REFUSAL_BYTES)?;
                let why = text::line(&String::from_utf8_lossy(&why)).into_owned();
                Err(ClientError::Refused(if why.is_empty() { format!("{host} answers with {status}") } else { why }))
            }
        }
    }

    fn header(&self, response: &Response<Body>, name: &str) -> Result<String, ClientError> {
        let value = response.headers().get(name).and_then(|v| v.to_str().ok());
        value.map(str::to_owned).ok_or_else(|| self.odd(&format!("the header '{name}' is missing")))
    }

    fn bytes(&self, response: Response<Body>, most: u64) -> Result<Vec<u8>, ClientError> {
        let host = &self.address.host;
        let most = most.min(memory::budget());
        let (mut reader, mut bytes) = (response.into_body().into_reader(), Vec::new());
        let (begin, mut piece) = (Instant::now(), vec![0; 1 << 16]);
        loop {
            match reader.read(&mut piece).map_err(|e| ClientError::Lost(format!("{host}: {e}")))? {
                0 => return Ok(bytes),
                n if (bytes.len() + n) as u64 > most => {
                    return Err(self.odd(&format!("it is longer than the {most} bytes that it may have here")));
                }
                n => bytes.extend_from_slice(&piece[..n]),
            }
            if is_too_slow(bytes.len(), begin.elapsed()) {
                return Err(ClientError::Lost(format!("{host} sends less than {SLOWEST} bytes a second")));
            }
        }
    }

    fn odd(&self, what: &str) -> ClientError {
        ClientError::Refused(format!("the answer of {} cannot be read: {what}", self.address.host))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_now_and_then_is_no_answer() {
        let secs = Duration::from_secs;
        assert!(is_too_slow(11, secs(31)) && is_too_slow(30_000, secs(40)));
        assert!(!is_too_slow(0, secs(29)) && !is_too_slow(31_000, secs(31)) && !is_too_slow(1 << 30, secs(900)));
    }
}
