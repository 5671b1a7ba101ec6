//! Shared state of a server: the log of a training, its newest Gaussians, and the clients. The training only adds
//! to it. Snapshots are packed on the thread of a client's request, and so rarely that they cost the training next to
//! nothing.

use std::collections::HashMap;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::token::random_name;
use super::wire::{SceneSummary, ServerUpdate, WireEvent};
use crate::io::snapshot;
use crate::pipeline::observer::Progress;
use crate::scene::GaussianCloud;
use crate::worker::Control;

/// Shortest time between two snapshots of a training.
const SNAPSHOT_EVERY: Duration = Duration::from_millis(1000);
/// Shortest time between two snapshots, as a multiple of the time to copy one on the training thread, and of the time
/// to pack one on a thread of low priority.
const COPY_SHARE: u32 = 150;
const PACK_SHARE: u32 = 10;
/// Maximum number of events in one answer, and in the log. If the log is full, every other training step is dropped.
const PER_ANSWER: usize = 2000;
const LOGGED: usize = 200_000;
/// Maximum number of clients, and time for which one counts as present after its last answer: it may be reading
/// Gaussians.
const CLIENTS: usize = 64;
const THERE: Duration = Duration::from_secs(10);

/// State that the threads of a server share.
pub(super) struct Hub {
    /// Name of this run of the server.
    pub(super) run: String,
    /// Scene without its Gaussians.
    pub(super) summary: SceneSummary,
    pub(super) control: Control,
    log: Mutex<Log>,
    latest: Mutex<Latest>,
    packed: Mutex<Option<PackedSnapshot>>,
    pace: Mutex<Pace>,
    clients: Mutex<HashMap<String, Client>>,
    /// Number of large answers that are being sent.
    pub(super) sending: AtomicUsize,
}

/// Snapshot that is ready to be sent.
#[derive(Clone)]
pub(super) struct PackedSnapshot {
    pub(super) generation: u64,
    /// Training step.
    pub(super) step: u64,
    pub(super) bytes: Arc<Vec<u8>>,
}

#[derive(Default)]
struct Log {
    events: Vec<(u64, WireEvent)>,
    next: u64,
    progress: Option<Progress>,
}

#[derive(Default)]
struct Latest {
    generation: u64,
    /// Gaussians of a training with their step, not packed yet.
    live: Option<(Arc<GaussianCloud>, u64)>,
}

struct Pace {
    /// True if a client waits for newer Gaussians.
    wanted: bool,
    next: Instant,
    /// Start of the copy that the training is making.
    copying: Option<Instant>,
}

struct Client {
    seen: Instant,
    since: u64,
    have: u64,
    /// Number of its requests that are being answered.
    open: usize,
}

impl Client {
    fn is_there(&self) -> bool {
        self.open > 0 || self.seen.elapsed() < THERE
    }
}

impl Hub {
    pub(super) fn new(summary: SceneSummary) -> io::Result<Self> {
        Ok(Self {
            run: random_name()?,
            summary,
            control: Control::default(),
            log: Mutex::default(),
            latest: Mutex::default(),
            packed: Mutex::default(),
            pace: Mutex::new(Pace { wanted: false, next: Instant::now(), copying: None }),
            clients: Mutex::default(),
            sending: AtomicUsize::new(0),
        })
    }

    /// Adds an event to the log.
    pub(super) fn report(&self, event: WireEvent) {
        let mut log = lock(&self.log);
        log.next += 1;
        let number = log.next;
        log.events.push((number, event));
        if log.events.len() > LOGGED {
            thin(&mut log.events);
        }
    }

    /// Sets the progress of the training; only the latest is kept.
    pub(super) fn progress(&self, progress: Option<Progress>) {
        lock(&self.log).progress = progress;
    }

    /// Returns whether the training should copy its Gaussians now.
    pub(super) fn wants_cloud(&self) -> bool {
        let mut pace = lock(&self.pace);
        let now = Instant::now();
        let wants = pace.wanted && now >= pace.next;
        pace.copying = wants.then_some(now);
        wants
    }

    /// Publishes the Gaussians of a training.
    pub(super) fn publish(&self, cloud: Arc<GaussianCloud>, step: u64) {
        {
            let mut pace = lock(&self.pace);
            let cost = pace.copying.take().map_or(Duration::ZERO, |since| since.elapsed());
            pace.next = Instant::now() + SNAPSHOT_EVERY.max(cost * COPY_SHARE);
            pace.wanted = false;
        }
        let mut latest = lock(&self.latest);
        latest.generation += 1;
        let before = latest.live.replace((cloud, step));
        drop(latest);
        // The old Gaussians are freed outside the lock, which others may wait for.
        drop(before);
    }

    /// Publishes a packed snapshot of a scene at rest.
    pub(super) fn publish_packed(&self, bytes: Vec<u8>) {
        let mut packed = lock(&self.packed);
        let mut latest = lock(&self.latest);
        latest.generation += 1;
        latest.live = None;
        *packed = Some(PackedSnapshot { generation: latest.generation, step: 0, bytes: Arc::new(bytes) });
    }

    /// Returns the newest snapshot if it is newer than generation `since`; packs it first if necessary.
    pub(super) fn snapshot(&self, since: u64) -> Option<PackedSnapshot> {
        if lock(&self.latest).generation <= since {
            return None;
        }
        // One thread packs; threads that wait here get the same snapshot.
        let mut packed = lock(&self.packed);
        let (generation, live) = {
            let latest = lock(&self.latest);
            (latest.generation, latest.live.clone())
        };
        if let Some((cloud, step)) = live.filter(|_| packed.as_ref().is_none_or(|p| p.generation < generation)) {
            let start = Instant::now();
            let bytes = Arc::new(snapshot::of_training(&cloud).ok()?);
            let mut pace = lock(&self.pace);
            pace.next = pace.next.max(Instant::now() + start.elapsed() * PACK_SHARE);
            *packed = Some(PackedSnapshot { generation, step, bytes });
        }
        packed.clone()
    }

    /// Returns the events after number `since`, for a client that has the Gaussians of generation `have` and wants
    /// newer ones.
    pub(super) fn news(&self, client: Option<&str>, since: u64, have: u64) -> ServerUpdate {
        let generation = lock(&self.latest).generation;
        if have >= generation {
            lock(&self.pace).wanted = true;
        }
        if let Some(name) = client {
            self.saw(name, since, have);
        }
        let log = lock(&self.log);
        let first = log.events.partition_point(|(number, _)| *number <= since);
        let rest = &log.events[first..];
        let told = &rest[..rest.len().min(PER_ANSWER)];
        ServerUpdate {
            events: told.iter().map(|(_, event)| event.clone()).collect(),
            next: told.last().map_or(log.next, |(number, _)| *number),
            more: told.len() < rest.len(),
            progress: log.progress.clone(),
            generation,
        }
    }

    fn saw(&self, name: &str, since: u64, have: u64) {
        let mut clients = lock(&self.clients);
        if clients.len() >= CLIENTS && !clients.contains_key(name) {
            clients.retain(|_, client| client.is_there());
        }
        if clients.len() < CLIENTS || clients.contains_key(name) {
            let open = clients.get(name).map_or(0, |client| client.open);
            clients.insert(name.to_owned(), Client { seen: Instant::now(), since, have, open });
        }
    }

    /// Records the start or the end of a client's request. Until its end the client counts as present.
    pub(super) fn answering(&self, client: &str, begins: bool) {
        if let Some(client) = lock(&self.clients).get_mut(client) {
            client.seen = Instant::now();
            client.open = if begins { client.open + 1 } else { client.open.saturating_sub(1) };
        }
    }

    /// Number of clients that are present, and number of them that lack events or Gaussians.
    pub(super) fn watchers(&self) -> (usize, usize) {
        let (next, generation) = (lock(&self.log).next, lock(&self.latest).generation);
        let mut clients = lock(&self.clients);
        clients.retain(|_, client| client.is_there());
        let lack = clients.values().filter(|c| c.since < next || c.have < generation).count();
        // A client that receives a large answer sends no other requests meanwhile.
        (clients.len(), lack.max(self.sending.load(Ordering::Acquire)))
    }
}

/// Drops every other training step.
fn thin(events: &mut Vec<(u64, WireEvent)>) {
    let mut odd = false;
    events.retain(|(_, event)| {
        let is_step = matches!(event, WireEvent::Step(_));
        odd ^= is_step;
        !is_step || odd
    });
}

// The data behind these locks stays consistent after a panic: it is changed by single calls.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::trained::SceneInfo;
    use crate::pipeline::observer::StepMetrics;

    fn hub() -> Hub {
        Hub::new(SceneSummary { info: SceneInfo::default(), allow_edit: false, photos: false }).expect("random numbers")
    }

    fn cloud(n: usize) -> Arc<GaussianCloud> {
        Arc::new(GaussianCloud::isotropic(vec![[0.5; 3]; n], -3.0, 1.0))
    }

    #[test]
    fn the_log_is_told_in_order_and_in_pieces() {
        let hub = hub();
        let step = |step| WireEvent::Step(StepMetrics { step, ..StepMetrics::default() });
        (0..PER_ANSWER as u64 + 5).for_each(|i| hub.report(step(i)));
        let first = hub.news(None, 0, 0);
        assert!(first.more && first.events.len() == PER_ANSWER && first.events[0] == step(0));
        let rest = hub.news(None, first.next, 0);
        assert!(!rest.more && rest.events.len() == 5 && rest.events[0] == step(PER_ANSWER as u64));
        assert!(hub.news(None, rest.next, 0).events.is_empty() && hub.news(None, u64::MAX, 0).events.is_empty());
        // A log that is too long loses only steps.
        hub.report(WireEvent::Paused(true));
        (0..2 * LOGGED as u64).for_each(|i| hub.report(step(i)));
        let log = lock(&hub.log);
        assert!(log.events.len() <= LOGGED && log.events.iter().any(|(_, e)| *e == WireEvent::Paused(true)));
    }

    #[test]
    fn gaussians_are_copied_when_somebody_asks_and_packed_once() {
        let hub = hub();
        assert!(!hub.wants_cloud(), "nobody has asked");
        assert!(hub.snapshot(0).is_none() && !hub.wants_cloud());
        hub.news(None, 0, 0);
        assert!(hub.wants_cloud());
        hub.publish(cloud(3), 7);
        assert!(!hub.wants_cloud(), "it is there");
        let (a, b) = (hub.snapshot(0).expect("packed"), hub.snapshot(0).expect("packed"));
        assert!(Arc::ptr_eq(&a.bytes, &b.bytes) && (a.generation, a.step) == (1, 7));
        hub.news(None, 0, 1);
        assert!(hub.snapshot(1).is_none() && !hub.wants_cloud(), "wanted, but not this soon");
        hub.publish_packed(vec![1, 2]);
        assert_eq!(*hub.snapshot(1).expect("at rest").bytes, vec![1, 2]);
    }

    #[test]
    fn who_lacks_something_is_known() {
        let hub = hub();
        hub.report(WireEvent::Cancelled);
        hub.publish(cloud(1), 1);
        assert_eq!(hub.watchers(), (0, 0));
        hub.news(Some("a"), 0, 0);
        hub.news(Some("b"), 1, 1);
        assert_eq!(hub.watchers(), (2, 1));
        hub.news(Some("a"), 1, 1);
        assert_eq!(hub.watchers(), (2, 0));
        // A client counts as present while its request is being answered, however long that takes.
        hub.answering("a", true);
        lock(&hub.clients).values_mut().for_each(|c| c.seen = Instant::now().checked_sub(2 * THERE).expect("past"));
        assert_eq!(hub.watchers().0, 1);
        hub.answering("a", false);
        assert_eq!(hub.watchers().0, 1, "and for a while after that");
        (0..200).for_each(|i| drop(hub.news(Some(&i.to_string()), 0, 0)));
        assert_eq!(hub.watchers().0, CLIENTS, "no more are kept");
    }
}
