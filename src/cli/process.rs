//! Settings of the process at its start: threads, an allocator that gives freed memory back, so that an idle window
//! holds only what it shows, and libraries that are silent.

/// Most threads that share the work on a machine with fewer than half as many cores.
const MOST_THREADS: usize = 64;

/// Blocks of at least so many bytes go back to the system when they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: i32 = 1 << 20;

/// Leaves out Mesa's layer that chooses among GPUs (its `disable_environment`).
#[cfg(target_os = "linux")]
const LAYER_OFF: &str = "NODEVICE_SELECT";

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

/// Keeps a library from saying "error" where nothing is wrong. Has to be called before there are threads.
///
/// Mesa's layer that chooses among GPUs asks the Wayland compositor at each search for a GPU, and its library complains
/// where there is no compositor. The layer is left out then, by its own variable for that, unless the user chooses a
/// GPU by it.
pub(crate) fn quiet_libraries() {
    #[cfg(target_os = "linux")]
    {
        let is_path = |name: &str| std::env::var_os(name).is_some_and(|v| std::path::Path::new(&v).is_absolute());
        let is_set = |name: &str| std::env::var_os(name).is_some();
        let asked = ["WAYLAND_SOCKET", "MESA_VK_DEVICE_SELECT", "DRI_PRIME", LAYER_OFF].iter().any(|name| is_set(name));
        if is_path("XDG_RUNTIME_DIR") || is_path("WAYLAND_DISPLAY") || asked {
            return;
        }
        #[allow(unsafe_code)]
        // SAFETY: this thread is the only one, so nobody reads the environment meanwhile.
        unsafe {
            std::env::set_var(LAYER_OFF, "1");
        }
    }
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
