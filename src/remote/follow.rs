//! Following a server without a window: what it tells goes to an [`Observer`], its Gaussians into a file at the end.

use std::path::Path;
use std::time::{Duration, Instant};

use super::client::{Client, ClientError};
use super::wire::WireEvent;
use crate::jobs::export;
use crate::pipeline::observer::{Observer, Severity, Signal};

/// Time between two questions, and to the next try after a lost connection.
const EVERY: Duration = Duration::from_millis(300);
const RETRY: Duration = Duration::from_secs(2);
/// How long a server that is gone is waited for.
const GONE: Duration = Duration::from_secs(60);

/// How it ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Followed {
    /// Nothing runs there: a scene at rest.
    AtRest,
    /// The training is done, and saved in this folder of the server.
    Finished(String),
    /// It was asked to end.
    Cancelled,
    /// It went wrong.
    Failed(String),
    /// `observer` has had enough.
    Left,
}

/// Follows the server until nothing runs there, then writes its Gaussians to `save`: those of a file bit for bit. Of a
/// training that was canceled or went wrong nothing is written.
///
/// # Errors
/// If the server refuses, or is gone for a minute.
pub(crate) fn follow(
    client: &Client,
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
                std::thread::sleep(RETRY);
            }
            Err(e) => return Err(e),
        }
    }
    Ok(Followed::Left)
}

/// How far a server was followed.
struct Position {
    run: String,
    since: u64,
    have: u64,
    running: bool,
    end: Followed,
    /// When the server was heard last.
    heard: Instant,
}

impl Position {
    fn new() -> Self {
        let (run, end, heard) = (String::new(), Followed::AtRest, Instant::now());
        Self { run, since: 0, have: 0, running: false, end, heard }
    }

    /// Asks once for what is new. Whether that was the end.
    fn go_on(
        &mut self,
        client: &Client,
        observer: &mut dyn Observer,
        save: Option<&Path>,
    ) -> Result<bool, ClientError> {
        let news = client.news(self.since, self.have)?;
        self.heard = Instant::now();
        if news.run != self.run {
            // Its numbers are others, and it says anew whether something runs.
            let first = std::mem::replace(&mut self.run, news.run).is_empty();
            (self.since, self.have, self.running, self.end) = (0, 0, false, Followed::AtRest);
            if !first {
                return Ok(false);
            }
        }
        let news = news.value;
        news.events.into_iter().for_each(|event| self.hear(event, observer));
        self.since = news.next;
        if news.more {
            return Ok(false);
        }
        if let Some(progress) = news.progress.filter(|_| self.running) {
            observer.progress(progress);
        }
        if self.running {
            // What a window would show is fetched as it would be.
            if let Some(pulled) = client.snapshot(self.have)? {
                self.have = pulled.generation;
            }
            std::thread::sleep(EVERY);
            return Ok(false);
        }
        let pulled = client.snapshot(0)?;
        let is_result = matches!(self.end, Followed::AtRest | Followed::Finished(_));
        if let (Some(path), Some(pulled)) = (save.filter(|_| is_result), &pulled) {
            let written = match &pulled.snapshot.ply {
                Some(ply) => export::bytes(path, ply),
                None => pulled.snapshot.read(path).and_then(|(cloud, _)| export::ply(path, &cloud)),
            };
            written.map_err(|e| ClientError::Refused(e.to_string()))?;
        }
        // The server is told that all has come; if it has gone meanwhile, it knows.
        let _ = client.news(self.since, pulled.map_or(0, |p| p.generation));
        Ok(true)
    }

    fn hear(&mut self, event: WireEvent, observer: &mut dyn Observer) {
        match event {
            WireEvent::Started(title) => {
                (self.running, self.end) = (true, Followed::AtRest);
                observer.note(Severity::Info, title);
            }
            WireEvent::Step(metrics) => observer.step(metrics),
            WireEvent::Evaluation(evaluation) => observer.evaluation(evaluation),
            WireEvent::Note(severity, text) => observer.note(severity, text),
            WireEvent::Paused(paused) => {
                observer.note(Severity::Info, if paused { "Paused" } else { "Goes on" }.into());
            }
            WireEvent::Finished(folder) => (self.running, self.end) = (false, Followed::Finished(folder)),
            WireEvent::Cancelled => (self.running, self.end) = (false, Followed::Cancelled),
            WireEvent::Failed(why) => (self.running, self.end) = (false, Followed::Failed(why)),
        }
    }
}
