//! Splats in depth order to each tile's list; `shaders/bin.wgsl`.

use super::kernel::{Access, FrameBindings, Kernel, Module, RecordedStage};
use super::scratch::{BIN_BLOCK, PerGaussian, PerPair};
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// Workgroups of the kernel that looks for the ends of tiles; they stride over the pairs.
const RANGE_GROUPS: u32 = 256;

#[derive(Debug)]
pub(crate) struct Bin {
    sum_counts: Kernel,
    scan_sums: Kernel,
    emit: Kernel,
    ranges: Kernel,
}

impl Bin {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "bin", ShaderVariant::default())?;
        let kernel = |entry, slots: &[_]| Kernel::new(device, &module, entry, slots);
        Ok(Self {
            sum_counts: kernel("sum_counts", &[(0, Uniform), (1, Read), (2, Read), (3, Write)])?,
            scan_sums: kernel("scan_sums", &[(0, Uniform), (3, Write), (4, Write)])?,
            emit: kernel(
                "emit",
                &[(0, Uniform), (1, Read), (2, Read), (3, Write), (4, Write), (5, Read), (6, Write), (7, Write)],
            )?,
            ranges: kernel("ranges_of_tiles", &[(0, Uniform), (4, Write), (6, Write), (8, Write)])?,
        })
    }

    /// Records the count of pairs, after which the counters say whether they fit.
    pub(crate) fn encode_count(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        scratch: &PerGaussian,
    ) {
        let order = &scratch.by_depth.values[scratch.by_depth.result()];
        let blocks = [bindings.gaussians.div_ceil(BIN_BLOCK), 1, 1];
        stage.run(&self.sum_counts, &[bindings.view, order, &scratch.tile_counts, &scratch.sums], blocks);
        stage.run(&self.scan_sums, &[bindings.view, &scratch.sums, bindings.counters], [1, 1, 1]);
    }

    pub(crate) fn encode_emit(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        scratch: &PerGaussian,
        pairs: &PerPair,
    ) {
        let order = &scratch.by_depth.values[scratch.by_depth.result()];
        let buffers = [
            bindings.view,
            order,
            &scratch.tile_counts,
            &scratch.sums,
            bindings.counters,
            &scratch.splats,
            &pairs.by_tile.keys[0],
            &pairs.by_tile.values[0],
        ];
        stage.run(&self.emit, &buffers, [bindings.gaussians.div_ceil(BIN_BLOCK), 1, 1]);
    }

    /// Records the search for each tile's range, after the sort. `ranges` must be zero.
    pub(crate) fn encode_ranges(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        pairs: &PerPair,
        ranges: &wgpu::Buffer,
    ) {
        let tiles = &pairs.by_tile.keys[pairs.by_tile.result()];
        stage.run(&self.ranges, &[bindings.view, bindings.counters, tiles, ranges], [RANGE_GROUPS, 1, 1]);
    }
}
