//! The client's thread: pulls what is new from a server, and tells it as the worker tells its jobs, so that the window
//! folds both alike. Where the connection is lost it tries again, ever less often; what came so far stays.

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

/// Wishes that may wait.
const WISHES: usize = 64;
/// Each link has numbers of its own for its jobs.
const JOBS_OF_LINK: u64 = 1 << 32;
static LINKS: AtomicU64 = AtomicU64::new(0);

/// How the connection is.
#[derive(Clone, Debug)]
pub(crate) struct LinkStatus {
    /// The server, as it is shown.
    pub(crate) host: String,
    pub(crate) connected: bool,
    /// Why not.
    pub(crate) problem: Option<String>,
    /// When it is tried again; `None` where that would be of no use.
    pub(crate) retry_at: Option<Instant>,
}

/// A connection to a server. Dropping it ends its thread.
pub(crate) struct ServerLink {
    wishes: Sender<Wish>,
    jobs: Arc<AtomicU64>,
    first_job: u64,
    status: Arc<Mutex<LinkStatus>>,
}

impl ServerLink {
    /// Connects to a server and tells `source` what comes; what is made of its scene goes into `folders`. Fails only if
    /// the system gives no thread.
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

    /// How the connection is.
    pub(crate) fn status(&self) -> LinkStatus {
        lock(&self.status).clone()
    }

    /// Whether a job is this server's.
    pub(crate) fn owns(&self, job: JobId) -> bool {
        (self.first_job..self.first_job + JOBS_OF_LINK).contains(&job.0)
    }

    /// Asks the training to wait or to go on. Whether there was room for that.
    pub(crate) fn set_paused(&self, paused: bool) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Pause(paused))).is_ok()
    }

    /// Asks the training to end. Whether there was room for that.
    pub(crate) fn cancel(&self) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Cancel)).is_ok()
    }

    /// Asks for a change of objects and parts. Whether there was room for that.
    pub(crate) fn edit(&self, edit: Edit) -> bool {
        self.wishes.try_send(Wish::Ask(Ask::Edit(edit))).is_ok()
    }

    /// Takes the commands that only the server can carry out: photos.
    pub(crate) fn takes(&self) -> Elsewhere {
        let (wishes, jobs) = (self.wishes.clone(), Arc::clone(&self.jobs));
        Box::new(move |command| {
            let Command::Photo { index, max_side_px, photo } = command else { return None };
            let (index, side_px, title) = (*index, *max_side_px, photo.name.clone());
            let job = JobId(jobs.fetch_add(1, Ordering::Relaxed) + 1);
            // With a full queue the command is refused by the worker, which has no such file.
            wishes.try_send(Wish::Photo { job, index, side_px, title }).ok().map(|()| job)
        })
    }
}

/// What the window wants of the server.
enum Wish {
    Ask(Ask),
    Photo { job: JobId, index: usize, side_px: u32, title: String },
}

/// Where the thread tells what it learns.
struct Out {
    source: EventSource,
    status: Arc<Mutex<LinkStatus>>,
}

/// Why the thread stops asking for now.
enum Break {
    Client(ClientError),
    /// Nobody listens any more.
    Gone,
    /// The server was started anew.
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
