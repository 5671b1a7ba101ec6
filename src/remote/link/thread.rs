//! Thread of a link, which asks the server and emits events.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::super::client::{Client, ClientError, Pulled};
use super::super::wire::{ClientRequest, SceneSummary, WireEvent};
use super::{EventSink, LinkCommand, LinkUpdate, SessionEnd, lock, new_job};
use crate::io::IoError;
use crate::jobs::open::{Origin, received};
use crate::jobs::workspace::TrainedRun;
use crate::jobs::{Folders, OpenedScene, phases, plan};
use crate::pipeline::observer::{Evaluation, Severity};
use crate::pipeline::train::TrainConfig;
use crate::scene::{GaussianCloud, Machine, SemanticMap, text};
use crate::worker::{CloudSnapshot, Event, Failure, JobEnd, JobId, JobInfo, Makes, Stop};

/// Time between two requests while a training runs, and at rest.
const BUSY: Duration = Duration::from_millis(300);
const AT_REST: Duration = Duration::from_millis(1500);
/// Time to the first attempt after a lost connection, and the longest time between two.
const FIRST_TRY: Duration = Duration::from_millis(500);
const LAST_TRY: Duration = Duration::from_secs(10);

pub(super) struct LinkThread {
    client: Client,
    folders: Folders,
    machine: Option<Machine>,
    command_receiver: Receiver<LinkCommand>,
    /// Photos that were requested while there was no connection.
    later: VecDeque<LinkCommand>,
    out: EventSink,
    /// Run of the server, number of the last event, and generation of the Gaussians that were received.
    run: String,
    since: u64,
    have: u64,
    /// Scene on screen.
    shown: Option<(SceneSummary, Arc<OpenedScene>)>,
    /// Local job of the server's training.
    training: Option<JobId>,
    evaluations: Vec<Evaluation>,
    /// Objects and parts of the newest Gaussians.
    map: Option<Arc<SemanticMap>>,
    /// True if a training runs on the server.
    busy: bool,
}

impl LinkThread {
    pub(super) fn new(
        client: Client,
        folders: Folders,
        command_receiver: Receiver<LinkCommand>,
        out: EventSink,
    ) -> Self {
        Self {
            client,
            folders,
            machine: None,
            command_receiver,
            later: VecDeque::new(),
            out,
            run: String::new(),
            since: 0,
            have: 0,
            shown: None,
            training: None,
            evaluations: Vec::new(),
            map: None,
            busy: false,
        }
    }

    pub(super) fn work(mut self) {
        let job = new_job();
        let title = format!("Connecting to {}", self.client.address.host);
        if self.out.send(Event::Started(job, JobInfo::long(title).makes(Makes::Scene))).is_err() {
            return;
        }
        if self.client.address.is_open() {
            let text = "The connection is not encrypted: others on the way can read it, the token included.";
            let _ = self.out.send(Event::Note(job, Severity::Warning, text.into()));
        }
        let mut opening = Some(job);
        let mut wait = FIRST_TRY;
        loop {
            let why = match self.session(&mut opening, &mut wait) {
                SessionEnd::Gone => return,
                SessionEnd::OtherRun => continue,
                SessionEnd::Client(why) => why,
            };
            let (problem, again) = match why {
                ClientError::Lost(problem) => (problem, true),
                ClientError::Refused(problem) => (problem, false),
            };
            let was_connected = lock(&self.out.status).connected;
            let retry_at = again.then(|| Instant::now() + wait);
            self.out.status(|s| (s.connected, s.problem, s.retry_at) = (false, Some(problem.clone()), retry_at));
            let host = &self.client.address.host;
            let text = match again {
                true => format!("The connection to {host} is lost ({problem}); what is on screen stays"),
                false => format!("{host} refuses: {problem}"),
            };
            // A refusal ends the open job; a lost connection keeps it for the next attempt.
            let told = match (again, opening.take_if(|_| !again), self.training.take_if(|_| !again)) {
                (false, Some(job), _) | (false, None, Some(job)) => {
                    self.out.send(Event::Ended(job, JobEnd::Failed(Failure::new(text, ""))))
                }
                _ if was_connected || !again => self.out.send(Event::Note(job, Severity::Warning, text)),
                _ => Ok(()),
            };
            if told.is_err() || !again || self.is_left_within(wait) {
                return;
            }
            wait = (wait * 2).min(LAST_TRY);
        }
    }

    /// Waits; returns true if the link was dropped. Photos are queued meanwhile, commands are dropped with a warning.
    fn is_left_within(&mut self, wait: Duration) -> bool {
        let until = Instant::now() + wait;
        loop {
            match self.command_receiver.recv_deadline(until) {
                Ok(photo @ LinkCommand::Photo { .. }) => self.later.push_back(photo),
                Ok(LinkCommand::Ask(_)) => {
                    let text = "There is no connection at the moment, so that was not passed on";
                    let note = Event::Note(new_job(), Severity::Warning, text.into());
                    if self.out.send(note).is_err() {
                        return true;
                    }
                }
                Err(RecvTimeoutError::Timeout) => return false,
                Err(RecvTimeoutError::Disconnected) => return true,
            }
        }
    }

    /// Exchanges messages with the server until the connection ends.
    fn session(&mut self, opening: &mut Option<JobId>, wait: &mut Duration) -> SessionEnd {
        match self.talk(opening, wait) {
            Err(why) => why,
            Ok(never) => match never {},
        }
    }

    fn talk(
        &mut self,
        opening: &mut Option<JobId>,
        wait: &mut Duration,
    ) -> Result<std::convert::Infallible, SessionEnd> {
        let summary = self.client.scene()?;
        let mut known = self.shown.as_ref().is_some_and(|(shown, _)| is_same(shown, &summary.value));
        // True if a restart of the server cut off a training of the same scene, which may go on in the new run.
        let mut cut_off = false;
        if summary.run != self.run {
            (self.run, self.since, self.have) = (summary.run, 0, 0);
            cut_off = known && self.training.is_some();
            known = cut_off;
            if let Some(job) = self.training.take() {
                self.ends(job, JobEnd::Cancelled)?;
            }
        }
        let summary = summary.value;
        if !known || opening.is_some() {
            self.open(summary.clone(), opening)?;
        }
        *wait = FIRST_TRY;
        if !lock(&self.out.status).connected {
            self.out.status(|s| (s.connected, s.problem, s.retry_at) = (true, None, None));
            let text = format!("Connected to {}", self.client.address.host);
            let job = new_job();
            self.out.send(Event::Note(job, Severity::Info, text))?;
        }
        loop {
            let news = self.client.news(self.since, self.have)?;
            if news.run != self.run {
                return Err(SessionEnd::OtherRun);
            }
            let mut news = news.value;
            for event in news.events.drain(..) {
                self.hear(event)?;
            }
            self.since = news.next;
            if std::mem::take(&mut cut_off) && self.training.is_none() {
                self.open(summary.clone(), opening)?;
            }
            if news.generation > self.have {
                self.pull()?;
            }
            if let (Some(job), Some(progress)) = (self.training, news.progress) {
                self.out.send(Event::Progress(job, progress))?;
            }
            if news.more {
                continue;
            }
            self.grant_until(Instant::now() + if self.busy { BUSY } else { AT_REST })?;
        }
    }

    /// Opens the server's scene in the window.
    fn open(&mut self, summary: SceneSummary, opening: &mut Option<JobId>) -> Result<(), SessionEnd> {
        let pulled = self.client.snapshot(0)?;
        let exact = pulled.as_ref().is_some_and(|p| p.snapshot.is_exact());
        let have = pulled.as_ref().map_or(0, |p| p.generation);
        let sent = pulled.map(|p| self.read(&p)).transpose()?;
        let machine = self.machine.get_or_insert_with(plan::machine);
        let host = self.client.address.host.clone();
        let origin = Origin { host, allow_edit: summary.allow_edit, photos: summary.photos };
        let scene = received(summary.info.clone(), sent, exact, origin, &self.folders, machine);
        let scene = scene.map_err(|e| ClientError::Refused(e.to_string()))?;
        self.have = have;
        self.map = scene.semantics.clone();
        self.shown = Some((summary, Arc::new(scene.clone())));
        let job = opening.take().unwrap_or_else(new_job);
        self.out.send(Event::Ended(job, JobEnd::Finished))?;
        self.out.update(LinkUpdate::Opened(Box::new(scene)))
    }

    /// Emits an event of the server as an event of a local job.
    fn hear(&mut self, event: WireEvent) -> Result<(), SessionEnd> {
        if let WireEvent::Started(title) = &event {
            let job = new_job();
            let title = format!("{} on {}", text::line(title), self.client.address.host);
            (self.training, self.busy) = (Some(job), true);
            self.evaluations.clear();
            let info = JobInfo::long(title).makes(Makes::Gaussians).pausable().phases(phases::TRAINING);
            return self.out.send(Event::Started(job, info));
        }
        let Some(job) = self.training else { return Ok(()) };
        match event {
            WireEvent::Started(_) => Ok(()),
            WireEvent::Step(metrics) => self.out.send(Event::Step(job, metrics)),
            WireEvent::Evaluation(evaluation) => {
                self.evaluations.push(evaluation.clone());
                self.out.send(Event::Evaluation(job, evaluation))
            }
            WireEvent::Note(severity, text) => self.out.send(Event::Note(job, severity, text)),
            WireEvent::Paused(paused) => self.out.send(Event::Paused(job, paused)),
            WireEvent::Finished(folder) => {
                self.pull()?;
                let run = Box::new(self.trained(folder));
                self.ends(job, JobEnd::Finished)?;
                self.out.update(LinkUpdate::Trained(job, run))
            }
            WireEvent::Cancelled => {
                self.pull()?;
                self.ends(job, JobEnd::Cancelled)
            }
            WireEvent::Failed(message) => self.ends(job, JobEnd::Failed(Failure::new(message, ""))),
        }
    }

    fn ends(&mut self, job: JobId, end: JobEnd) -> Result<(), SessionEnd> {
        (self.training, self.busy) = (None, false);
        self.out.send(Event::Ended(job, end))
    }

    fn trained(&mut self, folder: String) -> TrainedRun {
        let semantics = self.map.clone();
        let latest = self.out.clouds.newer_than(0);
        let cloud = latest.as_ref().map(|(_, snapshot)| (&*snapshot.cloud, snapshot.cloud.sh_degree));
        let dataset = self.shown.as_ref().and_then(|(_, scene)| scene.dataset.as_deref());
        let machine = self.machine.get_or_insert_with(plan::machine);
        let facts = plan::facts(machine, dataset, cloud, &TrainConfig::default());
        let facts = facts.with_semantics(semantics.as_deref());
        let evaluations = std::mem::take(&mut self.evaluations);
        TrainedRun { evaluations, out: folder.into(), semantics, runs: Vec::new(), stopped_at: None, facts }
    }

    /// Fetches the newest Gaussians and publishes them.
    fn pull(&mut self) -> Result<(), SessionEnd> {
        let Some(pulled) = self.client.snapshot(self.have)? else { return Ok(()) };
        let (cloud, map) = self.read(&pulled)?;
        self.have = pulled.generation;
        self.map = map.map(Arc::new);
        match (self.training, self.map.clone()) {
            (Some(job), _) => {
                self.out.clouds.publish(CloudSnapshot { job, cloud: Arc::new(cloud), step: pulled.step });
            }
            // At rest, only objects and parts change.
            (None, Some(map)) => self.out.update(LinkUpdate::Objects(map))?,
            (None, None) => {}
        }
        (self.out.repaint)();
        Ok(())
    }

    fn read(&self, pulled: &Pulled) -> Result<(GaussianCloud, Option<SemanticMap>), ClientError> {
        let read = pulled.snapshot.read(Path::new(&self.client.address.host));
        read.map_err(|e: IoError| ClientError::Refused(e.to_string()))
    }

    /// Passes requests on until the next news are due. A command ends the wait, as it causes news.
    fn grant_until(&mut self, due: Instant) -> Result<(), SessionEnd> {
        loop {
            match self.later.pop_front().map_or_else(|| self.command_receiver.recv_deadline(due), Ok) {
                Ok(LinkCommand::Ask(ask)) => return self.ask(&ask),
                Ok(LinkCommand::Photo { job, index, side_px, title, result }) => {
                    match self.client.photo(index, side_px) {
                        Err(ClientError::Lost(why)) => {
                            self.later.push_back(LinkCommand::Photo { job, index, side_px, title, result });
                            return Err(ClientError::Lost(why).into());
                        }
                        got => {
                            let failed = |e: ClientError| Stop::Failed(Failure::new(e.to_string(), ""));
                            self.photo(job, &title, result.give(got.map_err(failed)))?;
                        }
                    }
                }
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => return Err(SessionEnd::Gone),
            }
        }
    }

    /// Emits the events of a photo.
    fn photo(&self, job: JobId, title: &str, end: JobEnd) -> Result<(), SessionEnd> {
        self.out.send(Event::Started(job, JobInfo::short(format!("Loading {title}")).aside()))?;
        self.out.send(Event::Ended(job, end))
    }

    /// Sends a command. A refusal is reported and does not end the connection.
    fn ask(&mut self, ask: &ClientRequest) -> Result<(), SessionEnd> {
        match self.client.ask(ask) {
            Err(ClientError::Refused(why)) => self.out.update(LinkUpdate::Refused(why)),
            done => Ok(done?),
        }
    }
}

/// Returns whether two cards are of the same scene, apart from its history and saved state.
fn is_same(a: &SceneSummary, b: &SceneSummary) -> bool {
    let (mut a, mut b) = (a.clone(), b.clone());
    for summary in [&mut a, &mut b] {
        summary.info.history = Default::default();
        summary.info.state = None;
    }
    a == b
}
