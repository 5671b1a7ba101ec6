//! Observer for tests of what is stopped on its way.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::{Observer, Signal};

/// Asks to stop after being asked so many times; 0 = at once.
pub(crate) struct StopsAfter(AtomicUsize);

impl StopsAfter {
    pub(crate) fn new(times: usize) -> Self {
        Self(AtomicUsize::new(times))
    }
}

impl Observer for StopsAfter {
    fn signal(&self) -> Signal {
        let left = self.0.load(Ordering::Relaxed);
        self.0.store(left.saturating_sub(1), Ordering::Relaxed);
        if left > 0 { Signal::Continue } else { Signal::Cancel }
    }
}
