//! What can go wrong on a GPU, each with its numbers and what to do about it.

use crate::render::RenderError;
use crate::scene::CloudError;

/// Why the GPU could not do what it was asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GpuError {
    /// No adapter at all, not even a software one.
    #[error(
        "no GPU adapter was found ({0}); install a graphics driver or Mesa's software Vulkan driver, or use the CPU backend"
    )]
    NoAdapter(String),
    /// The adapter refused to open a device.
    #[error("adapter '{adapter}' did not open a device: {reason}")]
    Device {
        /// Its name.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// A limit of the adapter that the work at hand exceeds; found before anything is allocated.
    #[error("{what} needs {need} but the adapter's {limit_name} is {limit}; {remedy}")]
    Limit {
        /// What was to be allocated.
        what: String,
        /// How much of it, in the limit's unit.
        need: u64,
        /// The limit's name in WebGPU.
        limit_name: &'static str,
        /// The limit.
        limit: u64,
        /// What to change.
        remedy: &'static str,
    },
    /// The device ran out of memory.
    #[error("the GPU has no memory left for {what} ({bytes} bytes); use fewer Gaussians or smaller pictures")]
    OutOfMemory {
        /// What was to be allocated.
        what: String,
        /// Its size; 0 if not known.
        bytes: u64,
    },
    /// The device is gone: driver reset, unplugged, or destroyed.
    #[error("the GPU device was lost: {0}; start again, or use the CPU backend")]
    Lost(String),
    /// The graphics interface refused a call: a fault of this program or of the driver.
    #[error("the GPU interface refused a call: {0}")]
    Refused(String),
    /// A shader that this build does not contain.
    #[error("shader source '{0}' is not part of this build")]
    Shader(String),
    /// Unusable camera or features.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Unusable cloud.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// Two things that belong together differ in size.
    #[error("{what}: {have} given, {want} expected")]
    Size {
        /// What they are.
        what: &'static str,
        /// Size given.
        have: usize,
        /// Size expected.
        want: usize,
    },
}
