//! What this machine offers.

use crate::io::memory;
use crate::pipeline::train::budget;
use crate::render::real_gpu;
use crate::scene::Machine;

/// Looks at memory, cores and the graphics adapter. Takes some milliseconds: not for the window's
/// thread.
pub fn look() -> Machine {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    Machine { free_memory_bytes: memory::free(), max_gaussians: budget::gaussians(), cores, gpu: real_gpu() }
}
