//! Log of the resources that this process has loaded or built, with times and reasons.
//!
//! Only rare and large resources are logged: networks, graphs, maps; nothing that happens every frame.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use crate::math::format::bytes;

/// Kind of a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each name says what it is")]
pub enum ResourceKind {
    Gaussians,
    Levels,
    Objects,
    Maps,
    Thumbnails,
    Model,
    Paths,
    Agent,
    Device,
    Window,
    Picture,
}

/// A resource that was loaded or built.
#[derive(Clone, Debug, PartialEq)]
pub struct ResourceEntry {
    /// Seconds since the log began.
    pub(crate) at_secs: f64,
    /// Its kind.
    pub kind: ResourceKind,
    /// Its name, with how it was made.
    pub(crate) what: String,
    pub(crate) why: &'static str,
    /// Bytes that it takes in memory; 0 where that is not known.
    pub(crate) bytes: u64,
}

impl ResourceEntry {
    /// As a line: "2.31 s  loaded the network demo, 1.2 MB: a phrase is compared with looks".
    pub(crate) fn line(&self) -> String {
        format!("{:7.2} s  {}", self.at_secs, self.text())
    }

    /// The same without its time.
    pub(crate) fn text(&self) -> String {
        let size = if self.bytes > 0 { format!(", {}", bytes(self.bytes)) } else { String::new() };
        format!("{}{size}: {}", self.what, self.why)
    }
}

/// Called with everything that is logged from then on.
type Listener = fn(&ResourceEntry);

#[derive(Default)]
struct ResourceLog {
    entries: Vec<ResourceEntry>,
    listener: Option<Listener>,
}

static LOG: Mutex<ResourceLog> = Mutex::new(ResourceLog { entries: Vec::new(), listener: None });
static START: OnceLock<Instant> = OnceLock::new();

// An entry is added in one call, so a panicking holder leaves nothing half done.
fn lock() -> MutexGuard<'static, ResourceLog> {
    LOG.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Seconds since the log began.
pub(crate) fn now_secs() -> f64 {
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Adds to the log.
pub(crate) fn record(kind: ResourceKind, what: impl Into<String>, why: &'static str, bytes: u64) {
    let at_secs = now_secs();
    let entry = ResourceEntry { at_secs, kind, what: what.into(), why, bytes };
    let mut log = lock();
    if let Some(listener) = log.listener {
        listener(&entry);
    }
    log.entries.push(entry);
}

/// Starts the clock, and calls `listener` with every entry from now on.
pub(crate) fn listen(listener: Listener) {
    START.get_or_init(Instant::now);
    lock().listener = Some(listener);
}

/// Entries of the log without the first `from`.
pub fn since(from: usize) -> Vec<ResourceEntry> {
    lock().entries.get(from..).map_or_else(Vec::new, <[ResourceEntry]>::to_vec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_recorded_can_be_read_from_any_point_on() {
        record(ResourceKind::Model, "loaded the network 'x'", "a test of the log", 1_500_000);
        let all = since(0);
        let at = all.iter().rposition(|l| l.why == "a test of the log").expect("recorded");
        assert!(all[at].line().ends_with("loaded the network 'x', 2 MB: a test of the log"));
        assert!(since(all.len() + 1_000).is_empty());
    }
}
