//! Front-to-back blending; `shaders/blend.wgsl`.

use std::collections::BTreeMap;

use super::kernel::{Access, FrameBindings, Kernel, Module, Stage};
use super::scratch::{PerGaussian, PerPair, PerPicture};
use super::shader::Variant;
use super::{Device, GpuError};

/// The blending kernel, one pipeline for each number of extra channels in a pass.
#[derive(Debug, Default)]
pub struct Blend {
    kernels: BTreeMap<usize, Kernel>,
}

impl Blend {
    /// Compiles what passes of `channels` extra channels need, if that has not been done.
    pub fn prepare(&mut self, device: &Device, channels: usize) -> Result<(), GpuError> {
        use Access::{Read, Uniform, Write};
        if self.kernels.contains_key(&channels) {
            return Ok(());
        }
        let module = Module::new(device, "blend", Variant { channels, ..Variant::default() })?;
        let slots = [
            (0, Uniform),
            (1, Uniform),
            (2, Read),
            (3, Read),
            (4, Read),
            (5, Read),
            (6, Write),
            (7, Write),
            (8, Write),
            (9, Write),
        ];
        self.kernels.insert(channels, Kernel::new(device, &module, "main", &slots)?);
        Ok(())
    }

    /// Records the passes.
    pub fn encode(
        &self,
        stage: &mut Stage<'_>,
        bindings: FrameBindings<'_>,
        scratch: (&PerGaussian, &PerPair, &PerPicture),
        features: &wgpu::Buffer,
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
                &picture.colors,
                &picture.ends,
                &picture.depths,
                &picture.features,
            ];
            stage.run(kernel, &buffers, [bindings.tiles[0], bindings.tiles[1], 1]);
        }
    }
}
