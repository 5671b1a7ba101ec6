//! A picture's colors as bytes, a quarter of what floats take to copy; `shaders/pack.wgsl`.

use super::kernel::{Access, Kernel, Module, RecordedStage};
use super::rasterizer::GpuRasterizer;
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// The kernel, and room for its bytes.
#[derive(Debug)]
pub(crate) struct Pack {
    kernel: Kernel,
    pub(crate) bytes: wgpu::Buffer,
}

impl Pack {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "pack", ShaderVariant::default())?;
        let kernel = Kernel::new(device, &module, "main", &[(0, Uniform), (1, Read), (2, Write)])?;
        Ok(Self { kernel, bytes: device.storage("bytes of the picture", 0)? })
    }

    /// Makes room for a picture.
    pub(crate) fn prepare(&mut self, device: &Device, pixels: u64) -> Result<(), GpuError> {
        // Four pixels are written together.
        device.grow(&mut self.bytes, "bytes of the picture", pixels.div_ceil(4) * 12)
    }

    /// Records the packing of a frame of `pixels`.
    pub(crate) fn encode(&self, stage: &mut RecordedStage<'_>, rasterizer: &GpuRasterizer, pixels: u64) {
        let buffers = [rasterizer.bindings().view, &rasterizer.picture.colors, &self.bytes];
        stage.run_flat(&self.kernel, &buffers, pixels.div_ceil(4 * 256));
    }
}
