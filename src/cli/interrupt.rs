//! Ctrl-C and SIGTERM: the first asks the work to stop at a consistent state, the second does
//! not wait for that.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED_TO_STOP: AtomicBool = AtomicBool::new(false);

/// Starts listening. Without a handler (none could be set), Ctrl-C ends the process at once, which
/// loses at most the time since the last checkpoint.
pub fn listen() {
    let handler = || {
        if ASKED_TO_STOP.swap(true, Ordering::SeqCst) {
            // Files are written under a temporary name and renamed, so none is left half-written.
            #[allow(clippy::disallowed_methods)]
            std::process::exit(130);
        }
        eprintln!("\nStopping at the next safe point (press Ctrl-C again to stop at once) ...");
    };
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("warning: Ctrl-C will end the program at once: {error}");
    }
}

/// Whether the work should stop.
pub fn asked_to_stop() -> bool {
    ASKED_TO_STOP.load(Ordering::SeqCst)
}
