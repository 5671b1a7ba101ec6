//! Room for networks: those that lie idle are closed where memory is short, and opened again when
//! they are asked.

use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

use super::open_network::OpenNetwork;
use crate::io::memory;

/// Memory that an open network takes, as a multiple of its file's size: weights, their packed copies,
/// and what lies between the layers.
const PER_FILE_BYTE: u64 = 4;
/// Memory that is left to everything else, bytes.
const SPARE: u64 = 512 << 20;

/// An open network, or the place of one that was closed.
pub(super) struct CachedSession {
    /// `None` while it is closed.
    pub(crate) session: Option<OpenNetwork>,
    /// When it was last asked.
    pub(crate) used: Instant,
}

impl CachedSession {
    /// The place of a network that was opened just now.
    pub(crate) fn of(session: OpenNetwork) -> Arc<Mutex<Self>> {
        Arc::new(Mutex::new(Self { session: Some(session), used: Instant::now() }))
    }
}

static PLACES: Mutex<Vec<Weak<Mutex<CachedSession>>>> = Mutex::new(Vec::new());

/// Makes a network known that can be opened again.
pub(super) fn register(place: &Arc<Mutex<CachedSession>>) {
    if let Ok(mut places) = PLACES.lock() {
        places.retain(|p| p.strong_count() > 0);
        places.push(Arc::downgrade(place));
    }
}

/// Closes networks, the one that was idle longest first, until one of `bytes` bytes fits into memory.
/// How many were closed.
pub(super) fn make(bytes: u64) -> usize {
    let wanted = bytes.saturating_mul(PER_FILE_BYTE).saturating_add(SPARE);
    close_until(|| memory::free() >= wanted)
}

/// Closes networks, the one that was idle longest first, until there is room or none is left.
fn close_until(there_is_room: impl Fn() -> bool) -> usize {
    let Ok(places) = PLACES.lock() else { return 0 };
    let mut idle: Vec<(Instant, Arc<Mutex<CachedSession>>)> = Vec::new();
    for place in places.iter().filter_map(Weak::upgrade) {
        // One that cannot be locked is at work.
        let used = place.try_lock().ok().filter(|p| p.session.is_some()).map(|p| p.used);
        idle.extend(used.map(|used| (used, place)));
    }
    idle.sort_by_key(|(used, _)| *used);
    let mut closed = 0;
    for (_, place) in idle {
        if there_is_room() {
            break;
        }
        if let Ok(mut place) = place.try_lock() {
            place.session = None;
            closed += 1;
        }
    }
    closed
}

/// Closes all that lie idle; how many that were.
pub fn close_idle() -> usize {
    close_until(|| false)
}
