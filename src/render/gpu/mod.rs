//! The GPU renderer and trainer: wgpu compute, one launcher per WGSL kernel of `shaders/`.
//!
//! Forward: [`project`], [`sort`] by depth, [`bin`] (pairs of tile and splat, sorted by tile),
//! [`blend`]. Backward: [`blend_backward`], [`project_backward`]. Training adds [`ssim`] (loss and
//! its gradient) and [`adam`]. [`Renderer`] answers like the CPU renderer; [`Trainer`] keeps
//! everything on the device from step to step.

pub mod adam;
pub mod bin;
pub mod blend;
pub mod blend_backward;
pub mod cloud;
pub mod device;
pub mod error;
pub mod kernel;
pub mod layout;
pub mod project;
pub mod project_backward;
pub mod rasterizer;
pub mod renderer;
pub mod scratch;
pub mod shader;
pub mod sort;
pub mod ssim;
pub mod timing;
pub mod trainer;

pub use cloud::Parameters;
pub use device::{Device, real_gpu};
pub use error::GpuError;
pub use renderer::Renderer;
pub use ssim::DevicePhoto;
pub use trainer::{Trainer, TrainerSettings};
