//! Cache of open networks: idle ones are closed if memory is short, and opened again when they are used.

use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

use super::open_network::OpenNetwork;
use crate::io::memory;

/// Memory of an open network, as a multiple of its file's size: weights, their packed copies, and activations.
const PER_FILE_BYTE: u64 = 4;
/// Memory that is left for everything else, bytes.
const SPARE: u64 = 512 << 20;

/// Open network, or the place of a closed one.
pub(super) struct CachedSession {
    /// `None` while it is closed.
    pub(crate) session: Option<OpenNetwork>,
    /// Time of its last use.
    pub(crate) used: Instant,
}

impl CachedSession {
    /// Wraps a network that was just opened.
    pub(crate) fn of(session: OpenNetwork) -> Arc<Mutex<Self>> {
        Arc::new(Mutex::new(Self { session: Some(session), used: Instant::now() }))
    }
}

static PLACES: Mutex<Vec<Weak<Mutex<CachedSession>>>> = Mutex::new(Vec::new());

/// Registers a network that can be opened again.
pub(super) fn register(place: &Arc<Mutex<CachedSession>>) {
    if let Ok(mut places) = PLACES.lock() {
        places.retain(|p| p.strong_count() > 0);
        places.push(Arc::downgrade(place));
    }
}

/// Closes networks, the longest idle first, until one of `bytes` bytes fits into memory. Returns the number closed.
pub(super) fn make(bytes: u64) -> usize {
    let wanted = bytes.saturating_mul(PER_FILE_BYTE).saturating_add(SPARE);
    close_until(|| memory::free() >= wanted)
}

/// Closes networks, the longest idle first, until there is room or none is left. Returns the number closed.
fn close_until(there_is_room: impl Fn() -> bool) -> usize {
    let Ok(places) = PLACES.lock() else { return 0 };
    let mut idle: Vec<(Instant, Arc<Mutex<CachedSession>>)> = Vec::new();
    for place in places.iter().filter_map(Weak::upgrade) {
        // A network that cannot be locked is in use.
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

/// Closes all idle networks and returns their number.
pub fn close_idle() -> usize {
    close_until(|| false)
}
