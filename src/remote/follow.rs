//! Client without a window: events of the server go to an [`Observer`], its Gaussians into a file at the end.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{RecvTimeoutError, bounded};

use super::client::{Client, ClientError};
use super::wire::WireEvent;
use crate::io::http::TICK;
use crate::jobs::export;
use crate::pipeline::observer::{Observer, Severity, Signal};
use crate::scene::text;

/// Time between two requests, and to the next attempt after a lost connection.
const EVERY: Duration = Duration::from_millis(300);
const RETRY: Duration = Duration::from_secs(2);
/// Longest time without an answer of the server.
const GONE: Duration = Duration::from_secs(60);

/// End of the connection to a server.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Followed {
    /// No training runs on the server: a scene at rest.
    AtRest,
    /// The training has finished, and is saved in this folder of the server.
    Finished(String),
    /// The training was canceled.
    Cancelled,
    /// The training failed.
    Failed(String),
    /// `observer` canceled.
    Left,
}

/// Follows the server until no training runs, then writes its Gaussians to `save`: those of a file bit for bit. After
/// a canceled or failed training nothing is written.
///
/// # Errors
/// If the server refuses, or cannot be reached for a minute.
pub(crate) fn follow(
    client: &Arc<Client>,
    observer: &mut dyn Observer,
    save: Option<&Path>,
) -> Result<Followed, ClientError> {
    let mut now = Position::new();
    while observer.signal() != Signal::Cancel {
        match now.go_on(client, observer, save) {
            Ok(true) => return Ok(now.end),
            Ok(false) => {}
            Err(ClientError::Lost(why)) if now.heard.elapsed() < GONE => {
                observer.note(Severity::Warning, format!("The connection is lost ({why}); trying again"));
                wait(RETRY, observer);
            }
            Err(e) => return Err(e),
        }
    }
    Ok(Followed::Left)
}

/// Waits for `time`, or until `observer` cancels.
fn wait(time: Duration, observer: &dyn Observer) {
    let begin = Instant::now();
    while begin.elapsed() < time && observer.signal() != Signal::Cancel {
        std::thread::sleep(TICK);
    }
}

/// Runs `ask` on a thread of its own, so that a silent server does not block. `None` once `observer` cancels; the
/// request then ends by its own time limits.
fn attended<T: Send + 'static>(
    client: &Arc<Client>,
    observer: &dyn Observer,
    ask: impl FnOnce(&Client) -> Result<T, ClientError> + Send + 'static,
) -> Result<Option<T>, ClientError> {
    let (send, receive) = bounded(1);
    let client = Arc::clone(client);
    let talk = move || {
        // The receiver may be gone.
        let _ = send.send(ask(&client));
    };
    let thread = std::thread::Builder::new().name("network".into()).spawn(talk);
    thread.map_err(|e| ClientError::Refused(format!("no thread can be started: {e}")))?;
    loop {
        match receive.recv_timeout(TICK) {
            Ok(answer) => return answer.map(Some),
            Err(RecvTimeoutError::Timeout) if observer.signal() != Signal::Cancel => {}
            Err(RecvTimeoutError::Timeout) => return Ok(None),
            Err(RecvTimeoutError::Disconnected) => return Err(ClientError::Lost("the request broke off".into())),
        }
    }
}

/// Progress of following a server.
struct Position {
    run: String,
    since: u64,
    have: u64,
    running: bool,
    end: Followed,
    /// Time of the last answer.
    heard: Instant,
}

impl Position {
    fn new() -> Self {
        let (run, end, heard) = (String::new(), Followed::AtRest, Instant::now());
        Self { run, since: 0, have: 0, running: false, end, heard }
    }

    /// Asks once for news; returns true at the end.
    fn go_on(
        &mut self,
        client: &Arc<Client>,
        observer: &mut dyn Observer,
        save: Option<&Path>,
    ) -> Result<bool, ClientError> {
        let (since, have) = (self.since, self.have);
        let Some(news) = attended(client, observer, move |client| client.news(since, have))? else { return Ok(false) };
        self.heard = Instant::now();
        if news.run != self.run {
            // Another run numbers its events anew and reports again whether a training runs.
            let first = std::mem::replace(&mut self.run, news.run).is_empty();
            (self.since, self.have, self.running, self.end) = (0, 0, false, Followed::AtRest);
            if !first {
                return Ok(false);
            }
        }
        let news = news.value;
        let is_empty = news.events.is_empty();
        news.events.into_iter().for_each(|event| self.hear(event, observer));
        self.since = news.next;
        if news.more {
            if is_empty {
                wait(EVERY, observer);
            }
            return Ok(false);
        }
        if let Some(progress) = news.progress.filter(|_| self.running) {
            observer.progress(progress);
        }
        if self.running {
            // Intermediate Gaussians are fetched as a window would fetch them.
            let have = self.have;
            if let Some(Some(pulled)) = attended(client, observer, move |client| client.snapshot(have))? {
                self.have = pulled.generation;
            }
            wait(EVERY, observer);
            return Ok(false);
        }
        let Some(pulled) = attended(client, observer, |client| client.snapshot(0))? else { return Ok(false) };
        let is_result = matches!(self.end, Followed::AtRest | Followed::Finished(_));
        if let (Some(path), Some(pulled)) = (save.filter(|_| is_result), &pulled) {
            let written = match &pulled.snapshot.ply {
                Some(ply) => export::bytes(path, ply),
                None => pulled.snapshot.read(path).and_then(|(cloud, _)| export::ply(path, &cloud)),
            };
            written.map_err(|e| ClientError::Refused(e.to_string()))?;
        } else if let (Some(path), None) = (save.filter(|_| is_result), &pulled) {
            let text = format!("{} has no Gaussians, so {} was not written", client.address.host, path.display());
            return Err(ClientError::Refused(text));
        }
        // The last request confirms to the server that all has arrived; a server that has ended needs no confirmation.
        let (since, generation) = (self.since, pulled.map_or(0, |p| p.generation));
        let _ = attended(client, observer, move |client| client.news(since, generation));
        Ok(true)
    }

    fn hear(&mut self, event: WireEvent, observer: &mut dyn Observer) {
        match event {
            WireEvent::Started(title) => {
                (self.running, self.end) = (true, Followed::AtRest);
                observer.note(Severity::Info, text::line(&title).into_owned());
            }
            WireEvent::Step(metrics) => observer.step(metrics),
            WireEvent::Evaluation(evaluation) => observer.evaluation(evaluation),
            // The server's text may hold line breaks and control characters.
            WireEvent::Note(severity, text) => observer.note(severity, text::line(&text).into_owned()),
            WireEvent::Paused(paused) => {
                observer.note(Severity::Info, if paused { "Paused" } else { "Goes on" }.into());
            }
            WireEvent::Finished(folder) => {
                (self.running, self.end) = (false, Followed::Finished(text::line(&folder).into_owned()));
            }
            WireEvent::Cancelled => (self.running, self.end) = (false, Followed::Cancelled),
            WireEvent::Failed(why) => {
                (self.running, self.end) = (false, Followed::Failed(text::line(&why).into_owned()));
            }
        }
    }
}
