//! Makes the system's allocator give freed memory back, so that an idle window holds what it shows.

/// The setting of glibc's allocator that is made, unless it is made already.
pub const THRESHOLD: (&str, &str) = ("MALLOC_MMAP_THRESHOLD_", "1048576");

/// Starts this process anew with the setting; does nothing where it is there, or means nothing.
///
/// glibc returns a freed block to the system at once if it is larger than a threshold, but raises
/// that threshold to the largest block that was ever freed: after one large picture or file, pieces
/// of all later ones stay with the process. A threshold that is set stays as it is, and it can be
/// set safely only before the process begins.
pub fn settle() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        use std::os::unix::process::CommandExt;
        let (name, value) = THRESHOLD;
        if std::env::var_os(name).is_some() {
            return;
        }
        if let Ok(program) = std::env::current_exe() {
            // On success it does not return; without it all works as well, in more memory.
            let _ = std::process::Command::new(program).args(std::env::args_os().skip(1)).env(name, value).exec();
        }
    }
}
