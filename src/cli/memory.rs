//! Makes the system's allocator give freed memory back, so that an idle window holds what it shows.

/// Blocks of at least so many bytes go back to the system when they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: i32 = 1 << 20;

/// Fixes the size from which freed blocks are returned.
///
/// glibc returns a freed block to the system at once if it is larger than a threshold, but raises
/// that threshold to the largest block that was ever freed: after one large picture or file, pieces
/// of all later ones stay with the process. A threshold that is set stays as it is.
pub fn settle() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code)]
    // SAFETY: mallopt takes two numbers and changes a setting of the allocator; called while no other
    // thread of the program runs yet. Where it fails all works as well, in more memory.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
    }
}
