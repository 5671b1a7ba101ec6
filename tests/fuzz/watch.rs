//! Watches the input that is being tried: one that never ends is saved before the process is ended.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

/// Time after which a hanging input ends the process.
const HANG: Duration = Duration::from_secs(10);

struct Watched {
    until: Option<Instant>,
    target: &'static str,
    input: Vec<u8>,
}

static WATCHED: Mutex<Watched> = Mutex::new(Watched { until: None, target: "", input: Vec::new() });
/// Place and message of the last panic.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// From now on `input` is being tried.
pub fn begin(target: &'static str, input: &[u8]) {
    begin_for(target, input, HANG);
}

/// The same with other patience.
pub fn begin_for(target: &'static str, input: &[u8], patience: Duration) {
    static START: Once = Once::new();
    START.call_once(|| {
        std::thread::Builder::new().name("fuzz-watch".into()).spawn(watch).expect("a thread");
    });
    let mut watched = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
    watched.until = Some(Instant::now() + patience);
    watched.target = target;
    watched.input.clear();
    watched.input.extend_from_slice(input);
}

/// The current input has ended.
pub fn end() {
    WATCHED.lock().unwrap_or_else(PoisonError::into_inner).until = None;
}

fn watch() {
    loop {
        std::thread::sleep(Duration::from_millis(500));
        let watched = WATCHED.lock().unwrap_or_else(PoisonError::into_inner);
        if watched.until.is_some_and(|until| Instant::now() > until) {
            let file = save(watched.target, &watched.input);
            eprintln!("{}: an input never ends; see {}", watched.target, file.display());
            std::process::abort();
        }
    }
}

/// Writes an input to a file of its own.
pub fn save(target: &str, input: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
    std::fs::create_dir_all(&folder).expect("create");
    let sum = input.iter().fold(0_u32, |h, &b| (h ^ u32::from(b)).wrapping_mul(0x0100_0193));
    let file = folder.join(format!("{target}-{sum:08x}.bin"));
    std::fs::write(&file, input).expect("write");
    file
}

/// Runs `work` with panics written down instead of printed.
pub fn quietly<T>(work: impl FnOnce() -> T) -> T {
    // One at a time: memory is counted, and the hook set, for the whole process.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(|info| {
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string().replace('\n', " ");
    }));
    let outcome = work();
    std::panic::set_hook(before);
    outcome
}

/// The last panic.
pub fn last_panic() -> String {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
