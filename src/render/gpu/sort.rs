//! Stable radix sort of (key, value) pairs by the low bits of their keys; `shaders/sort.wgsl`.

use super::kernel::{Access, Kernel, Module, RecordedStage, Recorder};
use super::layout::Pass;
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// Pairs of one workgroup.
const BLOCK: u64 = 4096;
/// Values of a digit.
const DIGITS: u64 = 256;

/// The three kernels of a pass and the passes' constants.
#[derive(Debug)]
pub(crate) struct Sort {
    count: Kernel,
    scan: Kernel,
    scatter: Kernel,
}

/// Two sets of pairs that a sort goes back and forth between, with its scratch memory.
#[derive(Debug)]
pub(crate) struct SortBuffers {
    /// Keys: the input, and the place of every other pass.
    pub(crate) keys: [wgpu::Buffer; 2],
    pub(crate) values: [wgpu::Buffer; 2],
    histogram: wgpu::Buffer,
    totals: wgpu::Buffer,
    passes: Vec<wgpu::Buffer>,
    blocks: u32,
}

impl SortBuffers {
    /// Room for `capacity` pairs, sorted by the low `bits` bits of their keys; how many there are
    /// stands at word `counter` of the counters.
    pub(crate) fn new(device: &Device, capacity: u64, bits: u32, counter: u32) -> Result<Self, GpuError> {
        let blocks = capacity.div_ceil(BLOCK).max(1);
        device.fits_dispatch("sorting", blocks, "use fewer Gaussians or smaller pictures")?;
        let pairs = || device.storage("pairs to sort", capacity * 4);
        let passes = (0..bits.div_ceil(8))
            .map(|p| {
                let pass = Pass { shift: 8 * p, counter, ..Pass::default() };
                device.uniform("radix pass", bytemuck::bytes_of(&pass))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            keys: [pairs()?, pairs()?],
            values: [pairs()?, pairs()?],
            histogram: device.storage("digit counts", blocks * DIGITS * 4)?,
            totals: device.storage("digit totals", DIGITS * 4)?,
            passes,
            blocks: blocks as u32,
        })
    }

    pub(crate) fn device_bytes(&self) -> u64 {
        let all = self.keys.iter().chain(&self.values).chain([&self.histogram, &self.totals]).chain(&self.passes);
        all.map(wgpu::Buffer::size).sum()
    }

    /// Index of the set that holds the result.
    pub(crate) fn result(&self) -> usize {
        self.passes.len() % 2
    }
}

impl Sort {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "sort", ShaderVariant::default())?;
        let kernel = |entry, slots: &[_]| Kernel::new(device, &module, entry, slots);
        Ok(Self {
            count: kernel("count", &[(0, Uniform), (1, Read), (2, Read), (6, Write)])?,
            scan: kernel("scan", &[(0, Uniform), (1, Read), (6, Write), (7, Write)])?,
            scatter: kernel(
                "scatter",
                &[(0, Uniform), (1, Read), (2, Read), (3, Read), (4, Write), (5, Write), (6, Write), (7, Write)],
            )?,
        })
    }

    pub(crate) fn encode(&self, stage: &mut RecordedStage<'_>, on: &SortBuffers, counters: &wgpu::Buffer) {
        let blocks = [on.blocks, 1, 1];
        for (p, digit) in on.passes.iter().enumerate() {
            let (from, to) = (p % 2, (p + 1) % 2);
            stage.run(&self.count, &[digit, counters, &on.keys[from], &on.histogram], blocks);
            stage.run(&self.scan, &[digit, counters, &on.histogram, &on.totals], [DIGITS as u32, 1, 1]);
            stage.run(
                &self.scatter,
                &[
                    digit,
                    counters,
                    &on.keys[from],
                    &on.values[from],
                    &on.keys[to],
                    &on.values[to],
                    &on.histogram,
                    &on.totals,
                ],
                blocks,
            );
        }
    }
}

/// Sorts `(key, value)` pairs by the low `bits` bits of the keys and returns them: the sort alone,
/// for tests and measurements.
pub fn sort_pairs(device: &Device, keys: &[u32], values: &[u32], bits: u32) -> Result<(Vec<u32>, Vec<u32>), GpuError> {
    if keys.len() != values.len() {
        return Err(GpuError::Size { what: "values to sort", have: values.len(), want: keys.len() });
    }
    let sort = Sort::new(device)?;
    let buffers = SortBuffers::new(device, keys.len() as u64, bits, 0)?;
    let counters = device.storage_with("pair count", bytemuck::bytes_of(&[keys.len() as u32; 4]))?;
    device.queue().write_buffer(&buffers.keys[0], 0, bytemuck::cast_slice(keys));
    device.queue().write_buffer(&buffers.values[0], 0, bytemuck::cast_slice(values));
    let mut recorder = Recorder::new(device, None);
    recorder.stage("sort", |stage| sort.encode(stage, &buffers, &counters));
    recorder.submit();
    let bytes = keys.len() as u64 * 4;
    let result = buffers.result();
    let out = device.read(&[(&buffers.keys[result], bytes), (&buffers.values[result], bytes)])?;
    Ok((out.values(0), out.values(1)))
}
