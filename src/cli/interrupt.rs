//! Ctrl-C, SIGTERM, a lost terminal (SIGHUP) and a scheduler's SIGUSR1: the first asks the work to stop at a consistent
//! state, the second does not wait for that.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

use signal_hook::consts::{SIGINT, TERM_SIGNALS};
use signal_hook::flag;

use super::output;

static ASKED_TO_STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
static TOLD: AtomicBool = AtomicBool::new(false);

/// Starts listening. Where that is not possible, Ctrl-C ends the process at once, which loses at
/// most the time since the last checkpoint. A `patient` process is ended by a second Ctrl-C only: schedulers warn of a
/// time limit by one signal and follow it by others, well before they kill.
pub(crate) fn listen(patient: bool) {
    for signal in TERM_SIGNALS.iter().copied().chain(hang_up()).chain(warning()) {
        // The shutdown is looked at first, so it only acts on a signal after the first. Files are
        // written under a temporary name and renamed, so it leaves none half-written.
        let ends = !patient || signal == SIGINT;
        let shutdown = || flag::register_conditional_shutdown(signal, 130, Arc::clone(&ASKED_TO_STOP)).map(drop);
        let listening = if ends { shutdown() } else { Ok(()) };
        let listening = listening.and_then(|()| flag::register(signal, Arc::clone(&ASKED_TO_STOP)));
        if let Err(error) = listening {
            output::note(&format!("warning: signal {signal} will end the program at once: {error}"));
        }
    }
}

/// The signal by which schedulers warn.
fn warning() -> Option<i32> {
    #[cfg(unix)]
    return Some(libc::SIGUSR1);
    #[cfg(not(unix))]
    None
}

/// The signal of a lost terminal, unless the program was started to outlive it (`nohup`).
#[cfg(unix)]
fn hang_up() -> Option<i32> {
    let signal = libc::SIGHUP;
    // SAFETY: asks for the current action and changes nothing; `action` is plain data for the call to fill.
    #[allow(unsafe_code)]
    let ignored = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &raw mut action) == 0 && action.sa_sigaction == libc::SIG_IGN
    };
    (!ignored).then_some(signal)
}

#[cfg(not(unix))]
fn hang_up() -> Option<i32> {
    None
}

/// Set once the work should stop, for what looks at it by itself.
pub(crate) fn flag() -> &'static AtomicBool {
    &ASKED_TO_STOP
}

/// Returns whether the work should stop. Reports it the first time.
pub(crate) fn asked_to_stop() -> bool {
    let asked = ASKED_TO_STOP.load(Ordering::SeqCst);
    if asked && !TOLD.swap(true, Ordering::SeqCst) {
        output::note("");
        output::note("Stopping at the next safe point (press Ctrl-C again to stop at once) ...");
    }
    asked
}
