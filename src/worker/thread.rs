//! The two threads that run jobs, and the handle that feeds them.

use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};

use super::failure::{Failure, Stop};
use super::observer::{CloudSnapshot, JobObserver, Repaint};
use super::protocol::{Command, Event, JobId, JobKind, Outcome, WorkerThread};
use super::{Control, Slot};
use crate::pipeline::observer::{Observer, Signal};

/// Events that may wait to be taken.
const EVENTS: usize = 1024;
/// Jobs that may wait on each lane.
const QUEUED: usize = 64;
/// Time that the end of the program waits for a job to reach a consistent state.
const FAREWELL: Duration = Duration::from_secs(5);

/// Does the work of a command. The program has one implementation ([`super::jobs::PipelineJobs`]);
/// tests of the contract have others.
pub trait Jobs: Send + Sync + 'static {
    /// Runs `command` to its end. Called from both lanes at once.
    fn run(&self, command: Command, observer: &mut dyn Observer) -> Result<Outcome, Stop>;
}

/// Too many jobs wait already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{QUEUED} jobs are waiting already; try again when some are done")]
pub struct QueueFull;

struct Queued {
    job: JobId,
    command: Command,
    control: Arc<Control>,
}

type Controls = Arc<Mutex<HashMap<JobId, Arc<Control>>>>;

/// Channels by which jobs that run elsewhere report events, as those of a worker do.
#[derive(Clone)]
pub(crate) struct EventSource {
    pub(crate) events: Sender<Event>,
    pub(crate) clouds: Arc<Slot<CloudSnapshot>>,
    pub(crate) repaint: Repaint,
}

/// Takes a command that is carried out elsewhere; its events come through an [`EventSource`].
pub(crate) type Elsewhere = Box<dyn Fn(&Command) -> Option<JobId> + Send>;

/// Runs jobs in the background. Dropping it cancels all of them and waits a few seconds.
pub struct Worker {
    long: Option<Sender<Queued>>,
    short: Option<Sender<Queued>>,
    events: Option<Receiver<Event>>,
    source: EventSource,
    elsewhere: Option<Elsewhere>,
    controls: Controls,
    next: AtomicU64,
    threads: Vec<JoinHandle<()>>,
}

impl Worker {
    /// Starts the threads. Fails only if the system gives none.
    pub fn start(jobs: impl Jobs, repaint: Repaint) -> std::io::Result<Self> {
        let jobs = Arc::new(jobs);
        let (event_sender, events) = bounded(EVENTS);
        let clouds = Arc::new(Slot::default());
        let controls = Controls::default();
        let mut threads = Vec::new();
        let mut lane = |name: &str, pool: Option<rayon::ThreadPool>| {
            let (sender, queue) = bounded::<Queued>(QUEUED);
            let (jobs, events, clouds, controls, repaint) =
                (Arc::clone(&jobs), event_sender.clone(), Arc::clone(&clouds), Arc::clone(&controls), repaint.clone());
            let work = move || {
                for queued in queue {
                    // The user waits for a scene to open: the job runs at normal priority.
                    let yields = !matches!(queued.command.kind(), JobKind::Open | JobKind::Demo);
                    let run = || run_one(&*jobs, queued, &events, &clouds, &controls, &repaint);
                    match &pool {
                        Some(pool) if yields => pool.install(run),
                        _ => run(),
                    }
                }
            };
            threads.push(std::thread::Builder::new().name(name.to_owned()).spawn(work)?);
            Ok::<_, std::io::Error>(Some(sender))
        };
        let (long, short) = (lane("long jobs", super::low_priority_pool::pool())?, lane("short jobs", None)?);
        let source = EventSource { events: event_sender, clouds, repaint };
        let elsewhere = None;
        Ok(Self { long, short, events: Some(events), source, elsewhere, controls, next: AtomicU64::new(1), threads })
    }

    /// Queues a job on its lane.
    pub fn submit(&self, command: Command) -> Result<JobId, QueueFull> {
        if let Some(job) = self.elsewhere.as_ref().and_then(|takes| takes(&command)) {
            return Ok(job);
        }
        let job = JobId(self.next.fetch_add(1, Ordering::Relaxed));
        let control = Arc::new(Control::default());
        lock(&self.controls).insert(job, Arc::clone(&control));
        let lane = match command.kind().lane() {
            WorkerThread::Long => &self.long,
            WorkerThread::Short => &self.short,
        };
        let queued = Queued { job, command, control };
        if lane.as_ref().is_some_and(|l| l.try_send(queued).is_ok()) {
            return Ok(job);
        }
        lock(&self.controls).remove(&job);
        Err(QueueFull)
    }

    /// Asks a job to end, whether it runs or waits. Does nothing if it is over.
    pub fn cancel(&self, job: JobId) {
        if let Some(c) = lock(&self.controls).get(&job) {
            c.cancel();
        }
    }

    /// Asks a job to wait or to go on. Does nothing if it is over.
    pub fn set_paused(&self, job: JobId, paused: bool) {
        if let Some(c) = lock(&self.controls).get(&job) {
            c.set_paused(paused);
        }
    }

    /// The next event, if one waits.
    pub(crate) fn next_event(&self) -> Option<Event> {
        self.events.as_ref()?.try_recv().ok()
    }

    /// The next event, waiting for it at most `limit`.
    pub fn wait_event(&self, limit: Duration) -> Option<Event> {
        self.events.as_ref()?.recv_timeout(limit).ok()
    }

    /// Slot in which the Gaussians in training are published.
    pub fn clouds(&self) -> &Slot<CloudSnapshot> {
        &self.source.clouds
    }

    /// Offers later commands to `elsewhere` first.
    pub(crate) fn set_elsewhere(&mut self, elsewhere: Option<Elsewhere>) {
        self.elsewhere = elsewhere;
    }

    /// Channels by which others report events beside those of the jobs.
    pub(crate) fn source(&self) -> EventSource {
        self.source.clone()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        for control in lock(&self.controls).values() {
            control.cancel();
        }
        // Without senders the lanes end after their jobs; without the receiver no job waits for
        // its events to be taken.
        (self.long, self.short, self.events) = (None, None, None);
        let start = Instant::now();
        while self.threads.iter().any(|t| !t.is_finished()) && start.elapsed() < FAREWELL {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

// Both maps and flags stay consistent if a holder panics: each change is a single call.
fn lock(controls: &Controls) -> MutexGuard<'_, HashMap<JobId, Arc<Control>>> {
    controls.lock().unwrap_or_else(PoisonError::into_inner)
}

fn run_one(
    jobs: &dyn Jobs,
    queued: Queued,
    events: &Sender<Event>,
    clouds: &Arc<Slot<CloudSnapshot>>,
    controls: &Controls,
    repaint: &Repaint,
) {
    let Queued { job, command, control } = queued;
    let mut observer = JobObserver {
        job,
        control,
        events: events.clone(),
        clouds: Arc::clone(clouds),
        repaint: repaint.clone(),
        last_cloud: None,
        paused: AtomicBool::new(false),
        alone: AtomicBool::new(false),
    };
    observer.send(Event::Started { job, kind: command.kind(), title: command.title() });
    let result = if observer.control.signal() == Signal::Cancel {
        Err(Stop::Cancelled)
    } else {
        catch_unwind(AssertUnwindSafe(|| jobs.run(command, &mut observer)))
            .unwrap_or_else(|payload| Err(Stop::Failed(panic_failure(payload.as_ref()))))
    };
    lock(controls).remove(&job);
    observer.send(match result {
        Ok(outcome) => Event::Finished(job, outcome),
        Err(Stop::Cancelled) => Event::Cancelled(job),
        Err(Stop::Failed(failure)) => Event::Failed(job, failure),
    });
}

/// Failure with the message of a panic, for display.
pub(super) fn panic_failure(payload: &(dyn Any + Send)) -> Failure {
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into());
    Failure {
        message: format!("Internal error: {text}"),
        remedy: "The scene on screen is unharmed. Please report this with the log.".into(),
    }
}
