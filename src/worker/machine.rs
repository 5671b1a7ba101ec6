//! What this machine offers.

use crate::pipeline::train::budget;
use crate::render::gpu::real_gpu;
use crate::scene::Machine;

/// Looks at memory, cores and the graphics adapter. Takes some milliseconds: not for the window's
/// thread.
pub fn look() -> Machine {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    Machine { free_memory_bytes: free_memory_bytes(), max_gaussians: budget::gaussians(), cores, gpu: real_gpu() }
}

/// Memory that programs may still use; 0 where the system does not say.
fn free_memory_bytes() -> u64 {
    sysinfo::System::new().map_or(0, |mut system| {
        system.refresh_memory();
        system.available_memory()
    })
}
