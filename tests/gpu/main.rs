//! Kernels on the GPU beside the CPU; on a software adapter where there is no GPU.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod day;
#[path = "../gpu_common/mod.rs"]
mod gpu_common;
mod gradients;
mod render;
mod shaders;
mod sort;
mod splats;
mod train;
