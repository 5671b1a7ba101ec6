//! Connection of the window to a server. A thread pulls news and emits them as the worker emits the events of its
//! jobs, so that the window handles both alike. After a lost connection it retries at growing intervals; the received
//! data stays.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};

use self::thread::LinkThread;
use super::Address;
use super::client::{Client, ClientError};
use super::wire::ClientRequest;
use crate::jobs::workspace::TrainedRun;
use crate::jobs::{Folders, OpenedScene};
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{PhotoPixels, SemanticMap};
use crate::worker::{CloudSnapshot, Event, JobId, RemotePhotos, Repaint, Slot, Task, TaskResult};

mod thread;

/// Maximum number of queued requests.
const MAX_COMMANDS: usize = 64;
/// Updates that may wait for the window; the thread waits when there are more.
const UPDATES: usize = 1024;
/// Number of the next job on another computer.
static NEXT_JOB: AtomicU64 = AtomicU64::new(1);

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

/// Update of the window by its server.
pub(crate) enum LinkUpdate {
    /// An event of a job on the server.
    Event(Event),
    /// The server's scene.
    Opened(Box<OpenedScene>),
    /// The server's training has ended.
    Trained(JobId, Box<TrainedRun>),
    /// Objects and parts were changed.
    Objects(Arc<SemanticMap>),
    /// The server refused a request, and why.
    Refused(String),
}

/// Connection to a server. Dropping it ends its thread.
pub(crate) struct ServerLink {
    command_sender: Sender<LinkCommand>,
    updates: Receiver<LinkUpdate>,
    status: Arc<Mutex<LinkStatus>>,
}

impl ServerLink {
    /// Connects to a server; Gaussians in training go into the slot, files made from its scene into `folders`. Fails only
    /// if the system gives no random numbers or no thread.
    pub(crate) fn start(
        address: Address,
        folders: Folders,
        clouds: Arc<Slot<CloudSnapshot>>,
        repaint: Repaint,
    ) -> std::io::Result<Self> {
        let (command_sender, command_receiver) = bounded(MAX_COMMANDS);
        let (sender, updates) = bounded(UPDATES);
        let host = address.host.clone();
        let status = LinkStatus { host, connected: false, problem: None, retry_at: None };
        let status = Arc::new(Mutex::new(status));
        let out = EventSink { updates: sender, clouds, repaint, status: Arc::clone(&status) };
        let thread = LinkThread::new(Client::new(address)?, folders, command_receiver, out);
        std::thread::Builder::new().name("remote scene".into()).spawn(move || thread.work())?;
        Ok(Self { command_sender, updates, status })
    }

    /// The next update, if one waits.
    pub(crate) fn next_update(&self) -> Option<LinkUpdate> {
        self.updates.try_recv().ok()
    }

    /// Status of the connection.
    pub(crate) fn status(&self) -> LinkStatus {
        lock(&self.status).clone()
    }

    /// Asks the training to pause or to go on. Returns false if the queue is full.
    pub(crate) fn set_paused(&self, paused: bool) -> bool {
        self.command_sender.try_send(LinkCommand::Ask(ClientRequest::Pause(paused))).is_ok()
    }

    /// Asks the training to end. Returns false if the queue is full.
    pub(crate) fn cancel(&self) -> bool {
        self.command_sender.try_send(LinkCommand::Ask(ClientRequest::Cancel)).is_ok()
    }

    /// Asks for an edit of objects and parts. Returns false if the queue is full.
    pub(crate) fn edit(&self, edit: Edit) -> bool {
        self.command_sender.try_send(LinkCommand::Ask(ClientRequest::Edit(edit))).is_ok()
    }

    /// Returns the loader of the server's photos.
    pub(crate) fn photos(&self) -> RemotePhotos {
        let command_sender = self.command_sender.clone();
        Box::new(move |index, photo, side_px| {
            let (task, result) = Task::pair(new_job());
            let title = photo.name.clone();
            let command = LinkCommand::Photo { job: task.job(), index, side_px, title, result };
            match command_sender.try_send(command) {
                Err(TrySendError::Full(_)) => None,
                // After the end of the link the task is canceled at once.
                Ok(()) | Err(TrySendError::Disconnected(_)) => Some(task),
            }
        })
    }
}

/// Number of a new job on another computer.
fn new_job() -> JobId {
    JobId::Remote(NEXT_JOB.fetch_add(1, Ordering::Relaxed))
}

/// Request of the window to the server.
enum LinkCommand {
    Ask(ClientRequest),
    Photo { job: JobId, index: usize, side_px: u32, title: String, result: TaskResult<PhotoPixels> },
}

/// Output of the thread: updates, Gaussians and status.
struct EventSink {
    updates: Sender<LinkUpdate>,
    clouds: Arc<Slot<CloudSnapshot>>,
    repaint: Repaint,
    status: Arc<Mutex<LinkStatus>>,
}

/// Reason for which the thread stops asking.
enum SessionEnd {
    Client(ClientError),
    /// The window has dropped the link.
    Gone,
    /// The server was restarted.
    OtherRun,
}

impl From<ClientError> for SessionEnd {
    fn from(e: ClientError) -> Self {
        Self::Client(e)
    }
}

impl EventSink {
    fn send(&self, event: Event) -> Result<(), SessionEnd> {
        self.update(LinkUpdate::Event(event))
    }

    fn update(&self, update: LinkUpdate) -> Result<(), SessionEnd> {
        let told = self.updates.send(update).map_err(|_| SessionEnd::Gone);
        (self.repaint)();
        told
    }

    fn status(&self, change: impl FnOnce(&mut LinkStatus)) {
        change(&mut lock(&self.status));
        (self.repaint)();
    }
}

fn lock(status: &Mutex<LinkStatus>) -> MutexGuard<'_, LinkStatus> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}
