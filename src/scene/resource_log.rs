//! A trace of what this process has loaded or built, when and why.
//!
//! Only the rare and the large is traced: networks, graphs, maps; nothing that happens every frame.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use serde::Serialize;

use crate::math::format::bytes;

/// What sort of thing was loaded or built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ResourceKind {
    /// Gaussians of a scene.
    Gaussians,
    /// Objects and parts of a scene.
    Objects,
    /// Maps of a view's identities.
    Maps,
    /// Pictures of objects and parts alone.
    Thumbnails,
    /// A neural network.
    Model,
    /// The graph for moving about.
    Paths,
    /// The assistant.
    Agent,
    /// A graphics device.
    Device,
    /// The window.
    Window,
    /// The first picture of a scene.
    Picture,
}

/// Something that was loaded or built.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResourceEntry {
    /// Seconds since the trace began.
    pub(crate) at_secs: f64,
    /// Its sort.
    pub sort: ResourceKind,
    pub(crate) what: String,
    /// What it was needed for.
    pub(crate) why: &'static str,
    /// Bytes that it takes in memory; 0 where that is not known.
    pub(crate) bytes: u64,
}

impl ResourceEntry {
    /// As a line: "2.31 s  loaded the network demo, 1.2 MB: a phrase is compared with looks".
    pub(crate) fn line(&self) -> String {
        let size = if self.bytes > 0 { format!(", {}", bytes(self.bytes)) } else { String::new() };
        format!("{:7.2} s  {}{size}: {}", self.at_secs, self.what, self.why)
    }
}

/// Called with everything that is traced from then on.
type Listener = fn(&ResourceEntry);

#[derive(Default)]
struct ResourceLog {
    loads: Vec<ResourceEntry>,
    listener: Option<Listener>,
}

static TRACE: Mutex<ResourceLog> = Mutex::new(ResourceLog { loads: Vec::new(), listener: None });
static START: OnceLock<Instant> = OnceLock::new();

// A load is added in one call, so a panicking holder leaves nothing half done.
fn lock() -> MutexGuard<'static, ResourceLog> {
    TRACE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds to the trace.
pub(crate) fn record(sort: ResourceKind, what: impl Into<String>, why: &'static str, bytes: u64) {
    let at_secs = START.get_or_init(Instant::now).elapsed().as_secs_f64();
    let load = ResourceEntry { at_secs, sort, what: what.into(), why, bytes };
    let mut trace = lock();
    if let Some(listener) = trace.listener {
        listener(&load);
    }
    trace.loads.push(load);
}

/// Begins the clock, and has `listener` called with everything that is traced.
pub(crate) fn listen(listener: Listener) {
    START.get_or_init(Instant::now);
    lock().listener = Some(listener);
}

/// What was traced, the first `from` left out.
pub fn since(from: usize) -> Vec<ResourceEntry> {
    lock().loads.get(from..).map_or_else(Vec::new, <[ResourceEntry]>::to_vec)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_recorded_can_be_read_from_any_point_on() {
        record(ResourceKind::Model, "loaded the network 'x'", "a test of the trace", 1_500_000);
        let all = since(0);
        let at = all.iter().rposition(|l| l.why == "a test of the trace").expect("recorded");
        assert!(all[at].line().ends_with("loaded the network 'x', 2 MB: a test of the trace"));
        assert!(since(all.len() + 1_000).is_empty());
    }
}
