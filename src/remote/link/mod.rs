//! Connection of the window to a server. A thread pulls news and emits them as the worker emits the events of its
//! jobs, so that the window handles both alike. After a lost connection it retries at growing intervals; the received
//! data stays.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crossbeam_channel::{Sender, bounded};

use self::thread::LinkThread;
use super::Address;
use super::client::{Client, ClientError};
use super::wire::Ask;
use crate::jobs::Folders;
use crate::pipeline::semantics::edit::Edit;
use crate::worker::{Command, Elsewhere, Event, EventSource, JobId};

mod thread;

/// Maximum number of queued requests.
const WISHES: usize = 64;
/// Size of the range of job numbers that each link has.
const JOBS_OF_LINK: u64 = 1 << 32;
static LINKS: AtomicU64 = AtomicU64::new(0);

/// Status of the connection.
#[derive(Clone, Debug)]
pub(crate) struct LinkStatus {
    /// Name of the server for display.
    pub(crate) host: String,
    pub(crate) connected: bool,
    /// Reason for a lost connection.
    pub(crate) problem: Option<String>,
    /// Time of the next attempt; `None` if there is none.
    pub(crate) retry_at: Option<Instant>,
}

/// Connection to a server. Dropping it ends its thread.
pub(crate) struct ServerLink {
    wishes: Sender<Wish>,
    jobs: Arc<AtomicU64>,
    first_job: u64,
    status: Arc<Mutex<LinkStatus>>,
}

impl ServerLink {
    /// Connects to a server and sends its events to `source`; files made from its scene go into `folders`. Fails only
    /// if the system gives no random numbers or no thread.
    pub(crate) fn start(address: Address, folders: Folders, source: EventSource) -> std::io::Result<Self> {
        let (wishes, wished) = bounded(WISHES);
        let first_job = JobId::REMOTE.0 + JOBS_OF_LINK * LINKS.fetch_add(1, Ordering::Relaxed);
        let jobs = Arc::new(AtomicU64::new(first_job));
        let host = address.host.clone();
        let status = LinkStatus { host, connected: false, problem: None, retry_at: None };
        let status = Arc::new(Mutex::new(status));
        let out = Out { source, status: Arc::clone(&status) };
        let thread = LinkThread::new(Client::new(address)?, folders, wished, out, Arc::clone(&jobs));
        std::thread::Builder::new().name("remote scene".into()).spawn(move || thread.work())?;
        Ok(Self { wishes, jobs, first_job, status })
    }

    /// Status of the connection.
    pub(crate) fn status(&self) -> LinkStatus {
        lock(&self.status).clone()
    }

    /// Returns whether a job belongs to this link.
    pub(crate) fn owns(&self, job: JobId) -> bool {
        (self.first_job..self.first_job + JOBS_OF_LINK).contains(&job.0)
    }

    /// Asks the training to pause or to go on. Returns false if the queue is full.
    pub(crate) fn set_paused(&self, paused: bool) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Pause(paused))).is_ok()
    }

    /// Asks the training to end. Returns false if the queue is full.
    pub(crate) fn cancel(&self) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Cancel)).is_ok()
    }

    /// Asks for an edit of objects and parts. Returns false if the queue is full.
    pub(crate) fn edit(&self, edit: Edit) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Edit(edit))).is_ok()
    }

    /// Returns a handler of the commands that only the server can carry out: photos.
    pub(crate) fn takes(&self) -> Elsewhere {
        let (wishes, jobs) = (self.wishes.clone(), Arc::clone(&self.jobs));
        Box::new(move |command| {
            let Command::Photo { index, max_side_px, photo } = command else { return None };
            let (index, side_px, title) = (*index, *max_side_px, photo.name.clone());
            let job = JobId(jobs.fetch_add(1, Ordering::Relaxed) + 1);
            // If the queue is full, the worker gets the command and refuses it, as it has no such file.
            wishes.try_send(Wish::Photo { job, index, side_px, title }).ok().map(|()| job)
        })
    }
}

/// Request of the window to the server.
enum Wish {
    Ask(Ask),
    Photo { job: JobId, index: usize, side_px: u32, title: String },
}

/// Output of the thread: events and status.
struct Out {
    source: EventSource,
    status: Arc<Mutex<LinkStatus>>,
}

/// Reason for which the thread stops asking.
enum Break {
    Client(ClientError),
    /// The window has dropped the link.
    Gone,
    /// The server was restarted.
    OtherRun,
}

impl From<ClientError> for Break {
    fn from(e: ClientError) -> Self {
        Self::Client(e)
    }
}

impl Out {
    fn tell(&self, event: Event) -> Result<(), Break> {
        let told = self.source.events.send(event).map_err(|_| Break::Gone);
        (self.source.repaint)();
        told
    }

    fn status(&self, change: impl FnOnce(&mut LinkStatus)) {
        change(&mut lock(&self.status));
        (self.source.repaint)();
    }
}

fn lock(status: &Mutex<LinkStatus>) -> MutexGuard<'_, LinkStatus> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}
