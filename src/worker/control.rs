//! Pause and cancellation of a running job: two flags that it reads at every step.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::pipeline::observer::Signal;

/// The flags of one job.
#[derive(Debug, Default)]
pub(crate) struct Control {
    cancel: AtomicBool,
    pause: AtomicBool,
}

impl Control {
    /// Asks the job to end. Cannot be taken back.
    pub(crate) fn cancel(&self) {
        self.cancel.store(true, Ordering::Release);
    }

    /// Asks the job to wait, or to go on.
    pub(crate) fn set_paused(&self, paused: bool) {
        self.pause.store(paused, Ordering::Release);
    }

    /// Signal to the job; canceling goes before pausing.
    pub(crate) fn signal(&self) -> Signal {
        if self.cancel.load(Ordering::Acquire) {
            Signal::Cancel
        } else if self.pause.load(Ordering::Acquire) {
            Signal::Pause
        } else {
            Signal::Continue
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn canceling_beats_pausing() {
        let c = Control::default();
        assert_eq!(c.signal(), Signal::Continue);
        c.set_paused(true);
        assert_eq!(c.signal(), Signal::Pause);
        c.cancel();
        assert_eq!(c.signal(), Signal::Cancel);
        c.set_paused(false);
        assert_eq!(c.signal(), Signal::Cancel);
    }
}
