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

/// Follows the server until nothing runs there, then writes its Gaussians to `save`: those of a file bit for bit.
///
/// # Errors
/// If the server refuses, or is gone for a minute.
pub(crate) fn follow(
    client: &Client,
    observer: &mut dyn Observer,
    save: Option<&Path>,
) -> Result<Followed, ClientError> {
    let (mut run, mut since, mut have) = (String::new(), 0, 0);
    let (mut running, mut end) = (false, Followed::AtRest);
    let mut last = Instant::now();
    loop {
        if observer.signal() == Signal::Cancel {
            return Ok(Followed::Left);
        }
        let news = match client.news(since, have) {
            Ok(news) => news,
            Err(ClientError::Lost(why)) if last.elapsed() < GONE => {
                observer.note(Severity::Warning, format!("The connection is lost ({why}); trying again"));
                std::thread::sleep(RETRY);
                continue;
            }
            Err(e) => return Err(e),
        };
        last = Instant::now();
        if news.run != run {
            // Its numbers are others.
            let first = run.is_empty();
            (run, since, have) = (news.run, 0, 0);
            if !first {
                continue;
            }
        }
        let news = news.value;
        for event in news.events {
            match event {
                WireEvent::Started(title) => {
                    (running, end) = (true, Followed::AtRest);
                    observer.note(Severity::Info, title);
                }
                WireEvent::Step(metrics) => observer.step(metrics),
                WireEvent::Evaluation(evaluation) => observer.evaluation(evaluation),
                WireEvent::Note(severity, text) => observer.note(severity, text),
                WireEvent::Paused(paused) => {
                    observer.note(Severity::Info, if paused { "Paused" } else { "Goes on" }.into());
                }
                WireEvent::Finished(folder) => (running, end) = (false, Followed::Finished(folder)),
                WireEvent::Cancelled => (running, end) = (false, Followed::Cancelled),
                WireEvent::Failed(why) => (running, end) = (false, Followed::Failed(why)),
            }
        }
        since = news.next;
        if news.more {
            continue;
        }
        if let Some(progress) = news.progress.filter(|_| running) {
            observer.progress(progress);
        }
        if running {
            // What a window would show is fetched as it would be.
            if let Some(pulled) = client.snapshot(have)? {
                have = pulled.generation;
            }
            std::thread::sleep(EVERY);
            continue;
        }
        let pulled = client.snapshot(0)?;
        if let (Some(path), Some(pulled)) = (save, &pulled) {
            let written = match &pulled.snapshot.ply {
                Some(ply) => export::bytes(path, ply),
                None => pulled.snapshot.read(path).and_then(|(cloud, _)| export::ply(path, &cloud)),
            };
            written.map_err(|e| ClientError::Refused(e.to_string()))?;
        }
        // The server is told that all has come.
        let _ = client.news(since, pulled.map_or(0, |p| p.generation));
        return Ok(end);
    }
}
