//! Threads for long jobs, which yield to the window: its frames and pictures come first, and what
//! is left over is still nearly everything.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thread_priority::{ThreadPriority, set_current_thread_priority};

/// A pool of its own for long jobs; `None` if the system gives no threads, and they then share
/// those of everything else.
pub(super) fn pool() -> Option<ThreadPool> {
    // Not every system lets a program lower its own priority; then the threads are equal.
    let yielding = |_| drop(set_current_thread_priority(ThreadPriority::Min));
    ThreadPoolBuilder::new().thread_name(|i| format!("long job {i}")).start_handler(yielding).build().ok()
}

#[cfg(test)]
mod tests {
    #[test]
    fn work_in_the_pool_is_parallel() {
        use rayon::prelude::*;
        let pool = super::pool().expect("threads");
        let sum: u64 = pool.install(|| (0..1_000_u64).into_par_iter().sum());
        assert_eq!(sum, 499_500);
        assert_eq!(pool.current_num_threads(), rayon::current_num_threads());
    }
}
