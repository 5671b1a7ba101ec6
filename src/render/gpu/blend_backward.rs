//! Gradient of blending; `shaders/blend_backward.wgsl`.

use std::collections::BTreeMap;

use super::kernel::{Access, FrameBindings, Kernel, Module, Stage};
use super::scratch::{GRADIENT_BASE, PerGaussian, PerPair, PerPicture};
use super::shader::Variant;
use super::{Device, GpuError};

/// The kernel, one pipeline for each number of extra channels in a pass.
#[derive(Debug)]
pub struct BlendBackward {
    kernels: BTreeMap<usize, Kernel>,
    float_atomics: bool,
}

/// Gradients that go into the pass and come out of it.
#[derive(Debug)]
pub struct BlendGradients {
    /// Of the picture's colour and alpha, and, behind those, of its depth.
    pub pixels: wgpu::Buffer,
    /// Of its extra channels.
    pub features: wgpu::Buffer,
    /// Of the splats, `GRADIENT_BASE + channels` floats each.
    pub splats: wgpu::Buffer,
}

impl BlendGradients {
    /// Room for `capacity` Gaussians and a picture of `pixels` pixels; `planes` is 2 if there can be a
    /// gradient with respect to depth, else 1.
    pub fn new(
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
}

impl BlendBackward {
    /// No pipelines yet. Sums use float atomics if `float_atomics`, which the device must have.
    pub fn new(float_atomics: bool) -> Self {
        Self { kernels: BTreeMap::new(), float_atomics }
    }

    /// Compiles what passes of `channels` extra channels need, if that has not been done.
    pub fn prepare(&mut self, device: &Device, channels: usize) -> Result<(), GpuError> {
        use Access::{Read, Uniform, Write};
        if self.kernels.contains_key(&channels) {
            return Ok(());
        }
        let variant = Variant { channels, float_atomics: self.float_atomics };
        let module = Module::new(device, "blend_backward", variant)?;
        let slots = [
            (0, Uniform),
            (1, Uniform),
            (2, Read),
            (3, Read),
            (4, Read),
            (5, Read),
            (6, Read),
            (7, Read),
            (8, Read),
            (9, Write),
        ];
        self.kernels.insert(channels, Kernel::new(device, &module, "main", &slots)?);
        Ok(())
    }

    /// Records the passes. `gradients.splats` must be zero.
    pub fn encode(
        &self,
        stage: &mut Stage<'_>,
        bindings: FrameBindings<'_>,
        scratch: (&PerGaussian, &PerPair, &PerPicture),
        features: &wgpu::Buffer,
        gradients: &BlendGradients,
    ) {
        let (gaussians, pairs, picture) = scratch;
        let list = &pairs.by_tile.values[pairs.by_tile.result()];
        for (channels, chunk) in &picture.chunks {
            let Some(kernel) = self.kernels.get(channels) else { continue };
            let buffers = [
                bindings.view,
                chunk,
                &picture.ranges,
                list,
                &gaussians.splats,
                features,
                &picture.ends,
                &gradients.pixels,
                &gradients.features,
                &gradients.splats,
            ];
            stage.run(kernel, &buffers, [bindings.tiles[0], bindings.tiles[1], 1]);
        }
    }
}
