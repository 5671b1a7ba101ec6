//! HTTP requests, each on a thread of its own, so that the caller can stop waiting at any moment. Addresses of this
//! machine are never requested through a proxy.

use std::io::{self, Read};
use std::net::IpAddr;
use std::time::Duration;

use crossbeam_channel::{Receiver, bounded};
use ureq::config::ConfigBuilder;
use ureq::http::{HeaderMap, Response, StatusCode, Uri};
use ureq::typestate::AgentScope;
use ureq::{Agent, Body};

/// Interval at which a wait checks for cancellation.
pub(crate) const TICK: Duration = Duration::from_millis(20);

pub(crate) enum ResponsePart {
    /// Sent once: the status and the headers.
    Head(StatusCode, HeaderMap),
    Bytes(Vec<u8>),
    /// The connection failed; nothing follows. Without it, the body was read to its end.
    Failed(String),
}

/// Returns whether the host of an address is this machine: `localhost`, or a loopback address in standard spelling.
/// Other spellings (decimal, short, with a dot at the end) are not recognized.
pub(crate) fn is_loopback(host: &str) -> bool {
    let address = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(host);
    host.eq_ignore_ascii_case("localhost")
        || address.parse().is_ok_and(|address: IpAddr| address.to_canonical().is_loopback())
}

/// Settings of requests to `url`: any status is an answer, and no pause may be longer than `stall`.
pub(crate) fn config(url: &str, stall: Duration) -> ConfigBuilder<AgentScope> {
    let config = Agent::config_builder()
        .http_status_as_error(false)
        .timeout_resolve(Some(stall))
        .timeout_connect(Some(stall))
        .timeout_recv_response(Some(stall))
        .timeout_per_read(Some(stall))
        .timeout_per_write(Some(stall));
    let is_here = url.parse::<Uri>().is_ok_and(|uri| uri.host().is_some_and(is_loopback));
    if is_here { config.proxy(None) } else { config }
}

/// Sends a request on a thread of its own. The thread ends by the request's own time limits, or at the first piece that
/// the caller does not take.
pub(crate) fn ask(
    request: impl FnOnce() -> Result<Response<Body>, ureq::Error> + Send + 'static,
) -> io::Result<Receiver<ResponsePart>> {
    let (send, receive) = bounded(4);
    let talk = move || {
        let response = match request() {
            Ok(response) => response,
            Err(e) => {
                // The caller may have gone.
                let _ = send.send(ResponsePart::Failed(e.to_string()));
                return;
            }
        };
        let (head, body) = response.into_parts();
        if send.send(ResponsePart::Head(head.status, head.headers)).is_err() {
            return;
        }
        let mut reader = body.into_reader();
        loop {
            let mut bytes = vec![0; 1 << 16];
            let piece = match reader.read(&mut bytes) {
                Ok(0) => return,
                Ok(n) => {
                    bytes.truncate(n);
                    ResponsePart::Bytes(bytes)
                }
                Err(e) => ResponsePart::Failed(e.to_string()),
            };
            let failed = matches!(piece, ResponsePart::Failed(_));
            if send.send(piece).is_err() || failed {
                return;
            }
        }
    };
    std::thread::Builder::new().name("network".into()).spawn(talk)?;
    Ok(receive)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_machine_is_this_machine() {
        for host in ["127.0.0.1", "127.255.0.3", "localhost", "LOCALHOST", "[::1]", "[::ffff:127.0.0.1]"] {
            assert!(is_loopback(host), "{host}");
        }
        for host in [
            "127.evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "evil.localhost",
            "localhost.",
            "127.0.0.1.",
            "127.1",
            "2130706433",
            "0x7f000001",
            "0177.0.0.1",
            "0.0.0.0",
            "10.0.0.1",
            "[::]",
            "[::ffff:10.0.0.1]",
            "[::1%25lo]",
            "::1]",
            "",
        ] {
            assert!(!is_loopback(host), "{host}");
        }
    }
}
