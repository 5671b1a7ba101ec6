//! Server side of HTTP/1.1, with limits of size and time for requests and answers. Only the part of the protocol that
//! this program's client needs is supported; all else is refused.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Largest head of a request, in bytes and in header lines.
const HEAD_BYTES: usize = 8 << 10;
const HEAD_LINES: usize = 32;
/// Longest time for a request to arrive, from its first byte on: slow senders are cut off.
const REQUEST: Duration = Duration::from_secs(5);
/// Longest silence of an authenticated connection between requests.
const IDLE: Duration = Duration::from_secs(30);
/// Longest standstill of an answer, and least mean rate of an answer or a body, in bytes per second.
const STALL: Duration = Duration::from_secs(10);
const SLOWEST: f64 = 8192.0;
/// Longest wait of one write. A write that times out does not report the time of its last progress, so this is the
/// accuracy of the standstill timer.
const LOOK: Duration = Duration::from_millis(500);
/// Largest number of bytes per write.
const PIECE: usize = 64 << 10;

/// Request without its body.
#[derive(Debug)]
pub(super) struct RequestHead {
    pub(super) method: String,
    /// Path, without the query after `?`.
    pub(super) path: String,
    query: String,
    /// Headers, with names in lower case.
    headers: Vec<(String, String)>,
    deadline: Instant,
}

/// Answer to a request.
#[derive(Clone, Debug)]
pub(super) struct Response {
    pub(super) status: u16,
    kind: &'static str,
    headers: Vec<(&'static str, String)>,
    body: Arc<Vec<u8>>,
    /// True if the connection ends after it.
    pub(super) last: bool,
}

/// Connection to a client.
pub(super) struct Connection {
    stream: TcpStream,
    /// Bytes that were read but not used yet.
    carry: Vec<u8>,
    /// True once a request on it had the token.
    pub(super) is_known: bool,
}

impl Response {
    pub(super) fn new(status: u16, kind: &'static str, body: Arc<Vec<u8>>) -> Self {
        Self { status, kind, headers: Vec::new(), body, last: false }
    }

    /// Returns a refusal in words, after which the connection ends.
    pub(super) fn refusal(status: u16, text: impl Into<String>) -> Self {
        let body = Arc::new(text.into().into_bytes());
        Self { last: true, ..Self::new(status, "text/plain; charset=utf-8", body) }
    }

    /// Returns whether sending it may take a while.
    pub(super) fn is_large(&self) -> bool {
        self.body.len() > PIECE
    }

    pub(super) fn with(mut self, name: &'static str, value: impl ToString) -> Self {
        self.headers.push((name, value.to_string()));
        self
    }
}

impl RequestHead {
    /// Value of a header; `None` if it is missing or repeated.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(n, _)| n == name).map(|(_, value)| value.as_str());
        all.next().filter(|_| all.next().is_none())
    }

    /// Returns whether a header is present.
    pub(super) fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|(n, _)| n == name)
    }

    /// Number in the query, as in `?since=3`.
    pub(super) fn number(&self, name: &str) -> Option<u64> {
        self.query.split('&').find_map(|part| part.strip_prefix(name)?.strip_prefix('=')?.parse().ok())
    }

    fn parse(bytes: &[u8], deadline: Instant) -> Result<Option<(Self, usize)>, Response> {
        let mut lines = [httparse::EMPTY_HEADER; HEAD_LINES];
        let mut request = httparse::Request::new(&mut lines);
        let length = match request.parse(bytes) {
            Ok(httparse::Status::Complete(length)) => length,
            Ok(httparse::Status::Partial) if bytes.len() < HEAD_BYTES => return Ok(None),
            Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => {
                return Err(Response::refusal(431, "the request's headers are too long"));
            }
            Err(_) => return Err(Response::refusal(400, "this is no request")),
        };
        let target = request.path.filter(|t| t.starts_with('/') && request.version == Some(1));
        let (Some(target), Some(method)) = (target, request.method) else {
            return Err(Response::refusal(400, "this is no request of HTTP/1.1"));
        };
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let headers = request.headers.iter().map(|h| {
            let value = std::str::from_utf8(h.value).map_err(|_| Response::refusal(400, "a header is no text"))?;
            Ok((h.name.to_ascii_lowercase(), value.trim().to_owned()))
        });
        let headers = headers.collect::<Result<_, Response>>()?;
        let head = Self { method: method.into(), path: path.into(), query: query.into(), headers, deadline };
        Ok(Some((head, length)))
    }
}

impl Connection {
    pub(super) fn new(stream: TcpStream) -> Self {
        let _ = stream.set_nodelay(true);
        Self { stream, carry: Vec::new(), is_known: false }
    }

    /// Reads the next request; `None` if there are no more.
    pub(super) fn head(&mut self) -> Result<Option<RequestHead>, Response> {
        let mut deadline = Instant::now() + if self.carry.is_empty() && self.is_known { IDLE } else { REQUEST };
        loop {
            if let Some((head, length)) = RequestHead::parse(&self.carry, deadline)? {
                self.carry.drain(..length);
                return Ok(Some(head));
            }
            let silent = self.carry.is_empty();
            match self.read(HEAD_BYTES - self.carry.len().min(HEAD_BYTES - 1), deadline) {
                Ok(0) => return Ok(None),
                Ok(_) if silent => deadline = Instant::now() + REQUEST,
                Ok(_) => {}
                Err(e) if is_timeout(&e) && !silent => return Err(Response::refusal(408, "the request took too long")),
                Err(_) => return Ok(None),
            }
        }
    }

    /// Reads the body that belongs to `head`, of at most `most` bytes.
    pub(super) fn body(&mut self, head: &RequestHead, most: usize) -> Result<Vec<u8>, Response> {
        if head.has("transfer-encoding") || (head.has("content-length") && head.header("content-length").is_none()) {
            return Err(Response::refusal(400, "the body's length is not stated as one number"));
        }
        let length = head.header("content-length").unwrap_or("0");
        if length.is_empty() || !length.bytes().all(|b| b.is_ascii_digit()) {
            return Err(Response::refusal(400, "the body's length is no number"));
        }
        let Some(length) = length.parse().ok().filter(|length| *length <= most) else {
            return Err(Response::refusal(413, format!("a body here has at most {most} bytes")));
        };
        let deadline = head.deadline + Duration::from_secs_f64(length as f64 / SLOWEST);
        while self.carry.len() < length {
            match self.read((length - self.carry.len()).min(PIECE), deadline) {
                Ok(0) => return Err(Response::refusal(400, "the body ends early")),
                Ok(_) => {}
                Err(_) => return Err(Response::refusal(408, "the request took too long")),
            }
        }
        let rest = self.carry.split_off(length);
        Ok(std::mem::replace(&mut self.carry, rest))
    }

    fn read(&mut self, most: usize, deadline: Instant) -> io::Result<usize> {
        self.stream.set_read_timeout(Some(left(deadline)?))?;
        let before = self.carry.len();
        self.carry.resize(before + most, 0);
        let read = self.stream.read(&mut self.carry[before..]);
        self.carry.truncate(before + read.as_ref().map_or(0, |n| *n));
        read
    }

    /// Writes an answer; an error if the client does not take all of it in time.
    pub(super) fn answer(&mut self, response: &Response) -> io::Result<()> {
        let (status, kind, length) = (response.status, response.kind, response.body.len());
        let connection = if response.last { "close" } else { "keep-alive" };
        let mut head = format!("HTTP/1.1 {status} {}\r\nConnection: {connection}\r\n", reason(status));
        head += "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n";
        if status != 204 {
            head += &format!("Content-Type: {kind}\r\nContent-Length: {length}\r\n");
        }
        for (name, value) in &response.headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += "\r\n";
        let deadline = Instant::now() + STALL + Duration::from_secs_f64(length as f64 / SLOWEST);
        let mut stands_still = Instant::now() + STALL;
        for mut bytes in [head.as_bytes(), &response.body] {
            while !bytes.is_empty() {
                self.stream.set_write_timeout(Some(left(deadline.min(stands_still))?.min(LOOK)))?;
                match self.stream.write(&bytes[..bytes.len().min(PIECE)]) {
                    Ok(0) => return Err(ErrorKind::WriteZero.into()),
                    Ok(n) => {
                        bytes = &bytes[n..];
                        stands_still = Instant::now() + STALL;
                    }
                    Err(e) if is_timeout(&e) || e.kind() == ErrorKind::Interrupted => {}
                    Err(e) => return Err(e),
                }
            }
        }
        Ok(())
    }

    /// Closes the connection so that the last answer still arrives: pending input is read first, within limits.
    pub(super) fn end(mut self) {
        let _ = self.stream.shutdown(Shutdown::Write);
        let deadline = Instant::now() + Duration::from_millis(200);
        self.carry.clear();
        for _ in 0..16 {
            match self.read(PIECE, deadline) {
                Ok(n) if n > 0 => self.carry.clear(),
                _ => return,
            }
        }
    }
}

/// Time until a deadline; an error if it has passed.
fn left(deadline: Instant) -> io::Result<Duration> {
    let left = deadline.saturating_duration_since(Instant::now());
    if left.is_zero() { Err(ErrorKind::TimedOut.into()) } else { Ok(left) }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock)
}

fn reason(status: u16) -> &'static str {
    ureq::http::StatusCode::from_u16(status).ok().and_then(|s| s.canonical_reason()).unwrap_or("Refused")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Option<(RequestHead, usize)>, u16> {
        RequestHead::parse(text.as_bytes(), Instant::now()).map_err(|refused| refused.status)
    }

    #[test]
    fn heads_are_read_whole_or_not_at_all() {
        let text = "GET /news?since=12&have=3 HTTP/1.1\r\nHost: x\r\nA: 1\r\na: 2\r\n\r\nrest";
        let (head, length) = parse(text).expect("a request").expect("whole");
        assert_eq!((&*head.method, &*head.path, &text[length..]), ("GET", "/news", "rest"));
        assert_eq!((head.number("since"), head.number("have"), head.number("sinc")), (Some(12), Some(3), None));
        assert!(head.header("host") == Some("x") && head.header("a").is_none() && head.has("a"));
        for at in 0..length {
            assert!(matches!(parse(&text[..at]), Ok(None)), "{at}");
        }
    }

    #[test]
    fn what_is_no_request_is_refused() {
        let refused = |text: &str| parse(text).expect_err("refused");
        assert_eq!(refused("\0\0\0\0"), 400);
        assert_eq!(refused("GET /x HTTP/1.0\r\n\r\n"), 400);
        assert_eq!(refused("GET http://other/x HTTP/1.1\r\n\r\n"), 400);
        assert_eq!(refused(&format!("GET /{} HTTP/1.1\r\n", "x".repeat(HEAD_BYTES))), 431);
        assert_eq!(refused(&format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(40))), 431);
    }
}
