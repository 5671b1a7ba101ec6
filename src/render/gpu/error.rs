//! Errors of a GPU, each with its numbers and a remedy.

use crate::render::RenderError;
use crate::scene::CloudError;

/// Error of work on a GPU.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum GpuError {
    #[error(
        "no GPU adapter was found ({0}); install a graphics driver or Mesa's software Vulkan driver, or use the CPU backend"
    )]
    NoAdapter(String),
    #[error("adapter '{adapter}' did not open a device: {reason}")]
    Device { adapter: String, reason: String },
    /// A limit of the adapter that the work at hand exceeds; found before anything is allocated.
    #[error("{what} needs {need} but the adapter's {limit_name} is {limit}; {remedy}")]
    Limit { what: String, need: u64, limit_name: &'static str, limit: u64, remedy: &'static str },
    #[error("the GPU has no memory left for {what} ({bytes} bytes); use fewer Gaussians or smaller pictures")]
    OutOfMemory { what: String, bytes: u64 },
    #[error("the GPU device was lost: {0}; start again, or use the CPU backend")]
    Lost(String),
    #[error("the GPU interface refused a call: {0}")]
    Refused(String),
    #[error("shader source '{0}' is not part of this build")]
    Shader(String),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Cloud(#[from] CloudError),
    #[error("{what}: {have} given, {want} expected")]
    Size { what: &'static str, have: usize, want: usize },
}
