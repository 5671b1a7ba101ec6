//! Buffers between kernels, in three groups by the quantity that sets their size. A group grows when it must and never
//! shrinks.

use super::layout::{Chunk, Splat};
use super::sort::SortBuffers;
use super::{Device, GpuError};
use crate::render::TILE_PX;

/// Word of the counters that holds the number of Gaussians.
const COUNT_GAUSSIANS: u32 = 0;
/// Word of the counters that holds the number of pairs.
const COUNT_PAIRS: u32 = 1;
/// Floats of one splat's gradient ahead of its extra channels; `GRADIENT_BASE` in the shaders.
pub(crate) const GRADIENT_BASE: usize = 10;
/// Splats that one workgroup of `bin` handles.
pub(crate) const BIN_BLOCK: u32 = 1024;
/// Extra channels that one blending pass carries at most.
pub(crate) const CHUNK_CHANNELS: usize = 16;

/// Buffers by number of Gaussians.
#[derive(Debug)]
pub(crate) struct PerGaussian {
    pub(crate) capacity: usize,
    /// Splats in the picture.
    pub(crate) splats: wgpu::Buffer,
    /// Tiles that each reaches.
    pub(crate) tile_counts: wgpu::Buffer,
    /// Depth keys with the Gaussians' indices.
    pub(crate) by_depth: SortBuffers,
    /// Pairs of each block of splats.
    pub(crate) sums: wgpu::Buffer,
}

impl PerGaussian {
    /// Room for `capacity` Gaussians.
    pub(crate) fn new(device: &Device, capacity: usize) -> Result<Self, GpuError> {
        let n = capacity as u64;
        Ok(Self {
            capacity,
            splats: device.storage("splats", n * size_of::<Splat>() as u64)?,
            tile_counts: device.storage("tile counts", n * 4)?,
            by_depth: SortBuffers::new(device, n, 32, COUNT_GAUSSIANS)?,
            sums: device.storage("sums of tile counts", n.div_ceil(u64::from(BIN_BLOCK)) * 4)?,
        })
    }
}

/// Buffers by number of (splat, tile) pairs.
#[derive(Debug)]
pub(crate) struct PerPair {
    pub(crate) capacity: u32,
    /// Tiles that the sort's passes can tell apart.
    pub(crate) tiles: u32,
    /// Tile indices with the splats' indices.
    pub(crate) by_tile: SortBuffers,
}

impl PerPair {
    /// Room for `capacity` pairs in a picture of `tiles` tiles.
    pub(crate) fn new(device: &Device, capacity: u32, tiles: u32) -> Result<Self, GpuError> {
        // One value more than there are tiles: pairs that belong nowhere.
        let bits = (32 - tiles.leading_zeros()).next_multiple_of(8);
        let most = if bits >= 32 { u32::MAX } else { (1 << bits) - 1 };
        Ok(Self { capacity, tiles: most, by_tile: SortBuffers::new(device, u64::from(capacity), bits, COUNT_PAIRS)? })
    }
}

/// Buffers by picture size and number of extra channels.
#[derive(Debug)]
pub(crate) struct PerPicture {
    /// Pixels that fit.
    pub(crate) pixels: usize,
    pub(crate) tiles: usize,
    pub(crate) channels: usize,
    /// Each tile's part of the pairs.
    pub(crate) ranges: wgpu::Buffer,
    pub(crate) colors: wgpu::Buffer,
    /// Transmittance and end of each pixel's list.
    pub(crate) ends: wgpu::Buffer,
    /// Expected and median depth.
    pub(crate) depths: wgpu::Buffer,
    pub(crate) features: wgpu::Buffer,
    /// Constants of the blending passes, with the number of channels each carries.
    pub(crate) chunks: Vec<(usize, wgpu::Buffer)>,
}

impl PerPicture {
    pub(crate) fn new(device: &Device, size_px: [u32; 2], channels: usize) -> Result<Self, GpuError> {
        let [pixels, tiles] = extent(size_px);
        let n = pixels as u64;
        let mut chunks = Vec::new();
        for first in (0..channels.max(1)).step_by(CHUNK_CHANNELS) {
            let chunk = Chunk { channels: channels as u32, first: first as u32, ..Chunk::default() };
            let buffer = device.uniform("channels of a pass", bytemuck::bytes_of(&chunk))?;
            chunks.push(((channels - first).min(CHUNK_CHANNELS), buffer));
        }
        Ok(Self {
            pixels,
            tiles,
            channels,
            ranges: device.storage("tile ranges", tiles as u64 * 8)?,
            colors: device.storage("picture", n * 16)?,
            ends: device.storage("ends of lists", n * 8)?,
            depths: device.storage("depths", n * 8)?,
            features: device.storage("extra channels of the picture", n * 4 * channels as u64)?,
            chunks,
        })
    }

    /// Tells the blending passes whether the loss has a gradient with respect to depth.
    pub(crate) fn set_depth_gradient(&self, device: &Device, present: bool) {
        for (i, (_, buffer)) in self.chunks.iter().enumerate() {
            let chunk = Chunk {
                channels: self.channels as u32,
                first: (i * CHUNK_CHANNELS) as u32,
                depth_gradient: u32::from(present),
                ..Chunk::default()
            };
            device.queue().write_buffer(buffer, 0, bytemuck::bytes_of(&chunk));
        }
    }
}

/// Pixels and tiles of a picture.
pub(crate) fn extent(size_px: [u32; 2]) -> [usize; 2] {
    let [w, h] = size_px.map(|s| s as usize);
    [w * h, w.div_ceil(TILE_PX) * h.div_ceil(TILE_PX)]
}
