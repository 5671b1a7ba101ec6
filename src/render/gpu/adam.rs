//! The optimizer; `shaders/adam.wgsl`.

use super::cloud::{Parameters, strides};
use super::kernel::{Access, Kernel, Module, RecordedStage};
use super::layout::AdamStep;
use super::shader::ShaderVariant;
use super::{Device, GpuError};
use crate::math::sh;
use crate::render::cpu::adam::{AdamStep as Constants, BETA1, BETA2, CLIP, EPSILON, GROWTH, OUTLIER, Rates};

/// Rates of each float in the records of the three buffers; 0 past degree `active`.
fn records(rates: &Rates, active: u8) -> [[f32; 28]; 3] {
    let mut out = [[0.0; 28]; 3];
    out[0][0..3].fill(rates.position);
    out[0][3..6].fill(rates.log_scale);
    out[0][6..10].fill(rates.quaternion);
    out[0][10] = rates.opacity_logit;
    let floats = 3 * sh::coefficients(active);
    let [_, low, _] = strides(3);
    for k in 0..floats {
        let rate = if k < 3 { rates.sh_constant } else { rates.sh_rest };
        out[if k < low { 1 } else { 2 }][k % low] = rate;
    }
    out
}

/// The kernel with the constants of the three buffers.
#[derive(Debug)]
pub(crate) struct Adam {
    kernel: Kernel,
    steps: [wgpu::Buffer; 3],
    /// Gradients cut as outliers since it was last cleared.
    pub(crate) outliers: wgpu::Buffer,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct AdamBuffers<'a> {
    pub(crate) parameters: &'a Parameters,
    /// Their gradient, with the marks of `project_backward`.
    pub(crate) gradient: &'a Parameters,
    pub(crate) moments: &'a [Parameters; 2],
}

impl Adam {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "adam", ShaderVariant::default())?;
        let slots = [(0, Uniform), (1, Write), (2, Read), (3, Write), (4, Write), (5, Read), (6, Read), (7, Write)];
        let step = || device.uniform("Adam step", bytemuck::bytes_of(&AdamStep::default()));
        Ok(Self {
            kernel: Kernel::new(device, &module, "main", &slots)?,
            steps: [step()?, step()?, step()?],
            outliers: device.storage("outliers", 16)?,
        })
    }

    /// Sets the constants of step `t`, counted from 1, for `gaussians` Gaussians of which the first `frozen` stay, and
    /// of which `stored` degrees are kept and `active` trained.
    pub(crate) fn prepare(
        &self,
        device: &Device,
        [gaussians, frozen]: [u32; 2],
        [stored, active]: [u8; 2],
        rates: &Rates,
        t: u64,
    ) {
        let constants = Constants::new(t);
        for ((buffer, stride), rates) in self.steps.iter().zip(strides(stored)).zip(records(rates, active)) {
            let mut step = AdamStep {
                floats: gaussians * stride as u32,
                stride: stride.max(1) as u32,
                unbias_first: constants.first_correction,
                unbias_second: constants.second_correction,
                beta_first: BETA1,
                beta_second: BETA2,
                epsilon: EPSILON,
                clip: CLIP,
                growth: GROWTH,
                outlier: OUTLIER,
                frozen: frozen * stride as u32,
                ..AdamStep::default()
            };
            step.rates.as_flattened_mut().copy_from_slice(&rates);
            device.queue().write_buffer(buffer, 0, bytemuck::bytes_of(&step));
        }
    }

    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        on: AdamBuffers<'_>,
        counters: &wgpu::Buffer,
        gaussians: u32,
        stored: u8,
    ) {
        let [first, second] = on.moments;
        let marks = &on.gradient.buffers[0];
        for (k, stride) in strides(stored).into_iter().enumerate() {
            let groups = (u64::from(gaussians) * stride as u64).div_ceil(256);
            let buffers = [
                &self.steps[k],
                &on.parameters.buffers[k],
                &on.gradient.buffers[k],
                &first.buffers[k],
                &second.buffers[k],
                marks,
                counters,
                &self.outliers,
            ];
            stage.run_flat(&self.kernel, &buffers, groups);
        }
    }
}
