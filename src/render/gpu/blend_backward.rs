//! Gradient of blending; `shaders/blend_backward.wgsl`.

use super::blend::TileKernel;
use super::kernel::Access;
use super::scratch::{GRADIENT_BASE, PerPicture};
use super::{Device, GpuError};

/// Quarters of a tile, each with a workgroup of its own: `PARTS` squared in the shader. On an H100 the pass took 0.3
/// (small pictures) to 0.4 of what it took with one workgroup a tile.
const PARTS: u32 = 4;

/// The kernel; no pipelines yet. Sums use float atomics if `float_atomics`, which the device must have.
pub(crate) fn blend_backward(float_atomics: bool) -> TileKernel {
    use Access::{Read, Write};
    TileKernel::new("blend_backward", float_atomics, [Read, Read, Read, Write], PARTS)
}

/// Gradients that go into the pass and come out of it.
#[derive(Debug)]
pub(crate) struct BlendGradients {
    /// Of the picture's color and alpha, and, behind those, of its depth.
    pub(crate) pixels: wgpu::Buffer,
    pub(crate) features: wgpu::Buffer,
    /// Of the splats, `GRADIENT_BASE + channels` floats each.
    pub(crate) splats: wgpu::Buffer,
}

impl BlendGradients {
    /// Room for `capacity` Gaussians and a picture of `pixels` pixels; `planes` is 2 if there can be a
    /// gradient with respect to depth, else 1.
    pub(crate) fn new(
        device: &Device,
        capacity: usize,
        pixels: usize,
        channels: usize,
        planes: usize,
    ) -> Result<Self, GpuError> {
        Ok(Self {
            pixels: device.storage("gradient of the picture", (pixels * planes * 16) as u64)?,
            features: device.storage("gradient of extra channels", (pixels * channels * 4) as u64)?,
            splats: device.storage("gradient of splats", (capacity * (GRADIENT_BASE + channels) * 4) as u64)?,
        })
    }
    /// Buffers that the kernel reads and writes of a picture; `splats` must be zero.
    pub(crate) fn buffers<'a>(&'a self, picture: &'a PerPicture) -> [&'a wgpu::Buffer; 4] {
        [&picture.ends, &self.pixels, &self.features, &self.splats]
    }
}
