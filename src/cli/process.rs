//! What the process asks of the system when it starts: threads, and an allocator that gives freed
//! memory back, so that an idle window holds what it shows.

/// Most threads that share the work on a machine with fewer than half as many cores.
const MOST_THREADS: usize = 64;

/// Blocks of at least so many bytes go back to the system when they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: i32 = 1 << 20;

/// Starts the threads that share the work: as many as there are cores, or as `RAYON_NUM_THREADS` says
/// within reason.
pub(crate) fn start_threads() -> Result<(), String> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let wanted = std::env::var("RAYON_NUM_THREADS").ok().and_then(|v| v.trim().parse().ok()).filter(|n| *n > 0);
    let threads = wanted.unwrap_or(cores).min(MOST_THREADS.max(2 * cores));
    let started = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    started.map_err(|e| {
        format!(
            "{threads} threads cannot be started ({e}); set RAYON_NUM_THREADS to fewer, or lift the limits (ulimit)"
        )
    })
}

/// Fixes the size from which freed blocks are returned.
///
/// glibc returns a freed block to the system at once if it is larger than a threshold, but raises
/// that threshold to the largest block that was ever freed: after one large picture or file, pieces
/// of all later ones stay with the process. A threshold that is set stays as it is.
pub(crate) fn settle() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code)]
    // SAFETY: mallopt takes two numbers and changes a setting of the allocator; other threads of the
    // program, where there are any yet, are idle. Where it fails all works as well, in more memory.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
    }
}
