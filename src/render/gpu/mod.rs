//! The GPU renderer and trainer: wgpu compute, one launcher per WGSL kernel of `shaders/`.
//!
//! Forward: [`project`], [`sort`] by depth, [`bin`] (pairs of tile and splat, sorted by tile),
//! [`blend`]. Backward: [`blend_backward`], [`project_backward`]. Training adds [`ssim`] (loss and
//! its gradient) and [`adam`]. [`GpuRenderer`] answers like the CPU renderer; [`GpuTrainer`] keeps
//! everything on the device from step to step.

pub(crate) mod adam;
pub(crate) mod bin;
pub(crate) mod blend;
pub(crate) mod blend_backward;
pub mod cloud;
pub(crate) mod device;
pub(crate) mod error;
pub(crate) mod kernel;
pub(crate) mod labels;
pub mod layout;
pub(crate) mod pack;
pub(crate) mod project;
pub(crate) mod project_backward;
pub(crate) mod rasterizer;
mod readback;
pub mod renderer;
pub(crate) mod scratch;
pub mod shader;
pub mod sort;
pub mod ssim;
pub(crate) mod timing;
pub(crate) mod trainer;

pub use cloud::Parameters;
pub use device::{Device, real_gpu};
pub use error::GpuError;
pub use pack::DevicePicture;
pub use renderer::GpuRenderer;
pub use ssim::DevicePhoto;
pub use trainer::{GpuTrainer, TrainerSettings};
