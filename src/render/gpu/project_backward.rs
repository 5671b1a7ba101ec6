//! Gradient of projection, and statistics for density control; `shaders/project_backward.wgsl`.

use super::kernel::{Access, FrameBindings, Kernel, Module, RecordedStage};
use super::shader::ShaderVariant;
use super::{Device, GpuError, Parameters};

#[derive(Debug)]
pub(crate) struct ProjectBackward {
    main: Kernel,
    statistics: Kernel,
}

impl ProjectBackward {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "project_backward", ShaderVariant::default())?;
        let slots =
            [(0, Uniform), (1, Read), (2, Read), (3, Read), (4, Read), (5, Read), (6, Write), (7, Write), (8, Write)];
        let statistics = [(0, Uniform), (4, Read), (6, Write), (9, Write), (10, Write)];
        Ok(Self {
            main: Kernel::new(device, &module, "main", &slots)?,
            statistics: Kernel::new(device, &module, "statistics", &statistics)?,
        })
    }

    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        cloud: &Parameters,
        (splats, splat_gradient): (&wgpu::Buffer, &wgpu::Buffer),
        gradient: &Parameters,
    ) {
        let [geometry, low, high] = &cloud.buffers;
        let [to_geometry, to_low, to_high] = &gradient.buffers;
        let buffers = [bindings.view, geometry, low, high, splats, splat_gradient, to_geometry, to_low, to_high];
        stage.run_flat(&self.main, &buffers, u64::from(bindings.gaussians.div_ceil(64)));
    }

    /// Records the gathering of screen gradients and radii into `statistics`.
    pub(crate) fn encode_statistics(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        splats: &wgpu::Buffer,
        gradient: &Parameters,
        statistics: &wgpu::Buffer,
    ) {
        let buffers = [bindings.view, splats, &gradient.buffers[0], statistics, bindings.counters];
        stage.run_flat(&self.statistics, &buffers, u64::from(bindings.gaussians.div_ceil(256)));
    }
}
