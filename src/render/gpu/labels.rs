//! Label of each pixel; `shaders/labels.wgsl`.

use super::kernel::{Access, Kernel, Module, RecordedStage};
use super::rasterizer::GpuRasterizer;
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// The kernel, and room for its results.
#[derive(Debug)]
pub(crate) struct LabelPass {
    kernel: Kernel,
    pub(crate) found: wgpu::Buffer,
}

impl LabelPass {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "labels", ShaderVariant::default())?;
        let slots = [(0, Uniform), (1, Read), (2, Read), (3, Read), (4, Read), (5, Read), (6, Write)];
        let kernel = Kernel::new(device, &module, "main", &slots)?;
        Ok(Self { kernel, found: device.storage("labels of the picture", 0)? })
    }

    /// Makes room for a picture.
    pub(crate) fn prepare(&mut self, device: &Device, pixels: u64) -> Result<(), GpuError> {
        device.grow(&mut self.found, "labels of the picture", pixels * 12)
    }

    /// Records the pass over the lists of a frame; `of` has a label for each Gaussian, `groups` a group for each label.
    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        rasterizer: &GpuRasterizer,
        [of, groups]: [&wgpu::Buffer; 2],
    ) {
        let (bindings, list) = (rasterizer.bindings(), rasterizer.list());
        let ranges = &rasterizer.picture.ranges;
        let buffers = [bindings.view, ranges, list, &rasterizer.gaussians.splats, of, groups, &self.found];
        stage.run(&self.kernel, &buffers, [bindings.tiles[0], bindings.tiles[1], 1]);
    }
}
