//! One compute pipeline with its bindings, and the recording of passes.

use super::shader::{self, ShaderVariant};
use super::timing::Timer;
use super::{Device, GpuError};

/// Access of a kernel to a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Uniform,
    /// A storage buffer that is only read.
    Read,
    /// A storage buffer that is written.
    Write,
}

/// A compiled source, from which kernels are made by entry point.
#[derive(Debug)]
pub(crate) struct Module {
    module: wgpu::ShaderModule,
    name: &'static str,
}

impl Module {
    /// Compiles kernel file `name`.
    pub(crate) fn new(device: &Device, name: &'static str, variant: ShaderVariant) -> Result<Self, GpuError> {
        let source = shader::source(name, variant)?;
        let module = device.scoped(name, 0, || {
            device.wgpu().create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            })
        })?;
        Ok(Self { module, name })
    }
}

#[derive(Debug)]
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    slots: Vec<u32>,
}

impl Kernel {
    /// Makes the pipeline of `entry`, whose bindings in group 0 are `slots`.
    pub(crate) fn new(
        device: &Device,
        module: &Module,
        entry: &str,
        slots: &[(u32, Access)],
    ) -> Result<Self, GpuError> {
        let entries: Vec<_> = slots
            .iter()
            .map(|&(binding, access)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match access {
                        Access::Uniform => wgpu::BufferBindingType::Uniform,
                        Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
                        Access::Write => wgpu::BufferBindingType::Storage { read_only: false },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let label = format!("{}::{entry}", module.name);
        let wgpu = device.wgpu();
        let (pipeline, layout) = device.scoped(&label, 0, || {
            let layout = wgpu
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&label), entries: &entries });
            let pipeline_layout = wgpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(&label),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipeline = wgpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&label),
                layout: Some(&pipeline_layout),
                module: &module.module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
            (pipeline, layout)
        })?;
        Ok(Self { pipeline, layout, slots: slots.iter().map(|s| s.0).collect() })
    }

    /// Records a dispatch. `buffers` are in the order of the slots.
    fn dispatch(&self, device: &Device, pass: &mut wgpu::ComputePass<'_>, buffers: &[&wgpu::Buffer], groups: [u32; 3]) {
        if groups.contains(&0) {
            return;
        }
        let entries: Vec<_> = self
            .slots
            .iter()
            .zip(buffers)
            .map(|(&binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = device.wgpu().create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameBindings<'a> {
    /// The camera and the picture, see [`super::layout::View`].
    pub(crate) view: &'a wgpu::Buffer,
    /// See [`super::layout::Counters`].
    pub(crate) counters: &'a wgpu::Buffer,
    pub(crate) gaussians: u32,
    pub(crate) tiles: [u32; 2],
}

#[derive(Debug)]
pub(crate) struct RecordedStage<'a> {
    device: &'a Device,
    pass: wgpu::ComputePass<'a>,
}

impl RecordedStage<'_> {
    /// Records a dispatch. `buffers` are in the order of the kernel's slots.
    pub(crate) fn run(&mut self, kernel: &Kernel, buffers: &[&wgpu::Buffer], groups: [u32; 3]) {
        kernel.dispatch(self.device, &mut self.pass, buffers, groups);
    }

    /// Records `groups` workgroups that stand in a row; see `shaders/shared/flat.wgsl`.
    pub(crate) fn run_flat(&mut self, kernel: &Kernel, buffers: &[&wgpu::Buffer], groups: u64) {
        // One axis holds 65,535 workgroups everywhere; the rest goes along the second.
        let across = groups.clamp(1, 32_768);
        self.run(kernel, buffers, [across as u32, groups.div_ceil(across) as u32, 1]);
    }
}

/// Commands of one frame or step, with its stages timed if a timer is there.
#[derive(Debug)]
pub(crate) struct Recorder<'a> {
    device: &'a Device,
    encoder: wgpu::CommandEncoder,
    timer: Option<&'a mut Timer>,
}

impl<'a> Recorder<'a> {
    pub(crate) fn new(device: &'a Device, timer: Option<&'a mut Timer>) -> Self {
        let encoder = device.wgpu().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("fmlgs") });
        Self { device, encoder, timer }
    }

    pub(crate) fn stage(&mut self, name: &'static str, record: impl FnOnce(&mut RecordedStage<'_>)) {
        let timestamp_writes = self.timer.as_mut().and_then(|t| t.stage(name));
        let pass =
            self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(name), timestamp_writes });
        record(&mut RecordedStage { device: self.device, pass });
    }

    /// For copies.
    pub(crate) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// Records that a buffer is filled with zeros.
    pub(crate) fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.encoder.clear_buffer(buffer, 0, None);
    }

    pub(crate) fn submit(mut self) -> wgpu::SubmissionIndex {
        if let Some(timer) = self.timer {
            timer.resolve(&mut self.encoder);
        }
        self.device.queue().submit([self.encoder.finish()])
    }
}
