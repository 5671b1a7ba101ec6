//! Front-to-back blending, `shaders/blend.wgsl`, and the parts that its gradient shares.

use std::collections::BTreeMap;

use super::kernel::{Access, FrameBindings, Kernel, Module, RecordedStage};
use super::scratch::{PerGaussian, PerPair, PerPicture};
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// A kernel over the tiles of a frame, one pipeline for each number of extra channels in a pass.
#[derive(Debug)]
pub(crate) struct TileKernel {
    shader: &'static str,
    float_atomics: bool,
    /// Accesses to the kernel's own buffers, which follow those that every tile kernel reads.
    own: [Access; 4],
    /// Workgroups for each tile.
    parts: u32,
    kernels: BTreeMap<usize, Kernel>,
}

impl TileKernel {
    /// The blending kernel; no pipelines yet.
    pub(crate) fn blend() -> Self {
        Self::new("blend", false, [Access::Write; 4], 1)
    }

    pub(crate) fn new(shader: &'static str, float_atomics: bool, own: [Access; 4], parts: u32) -> Self {
        Self { shader, float_atomics, own, parts, kernels: BTreeMap::new() }
    }

    /// Compiles the pipeline for passes of `channels` extra channels, if it is missing.
    pub(crate) fn prepare(&mut self, device: &Device, channels: usize) -> Result<(), GpuError> {
        use Access::{Read, Uniform};
        if self.kernels.contains_key(&channels) {
            return Ok(());
        }
        let module = Module::new(device, self.shader, ShaderVariant { channels, float_atomics: self.float_atomics })?;
        let accesses = [Uniform, Uniform, Read, Read, Read, Read].into_iter().chain(self.own);
        let slots: Vec<_> = (0..).zip(accesses).collect();
        self.kernels.insert(channels, Kernel::new(device, &module, "main", &slots)?);
        Ok(())
    }

    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        (gaussians, pairs, picture): (&PerGaussian, &PerPair, &PerPicture),
        features: &wgpu::Buffer,
        own: [&wgpu::Buffer; 4],
    ) {
        let list = &pairs.by_tile.values[pairs.by_tile.result()];
        for (channels, chunk) in &picture.chunks {
            let Some(kernel) = self.kernels.get(channels) else { continue };
            let read = [bindings.view, chunk, &picture.ranges, list, &gaussians.splats, features];
            let buffers: Vec<_> = read.into_iter().chain(own).collect();
            stage.run(kernel, &buffers, [bindings.tiles[0], bindings.tiles[1], self.parts]);
        }
    }
}
