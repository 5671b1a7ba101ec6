//! The forward pass: all its kernels and the buffers between them, for the renderer and the trainer.

use super::bin::Bin;
use super::blend::Blend;
use super::kernel::{Recorder, Shot};
use super::layout::{Counters, View};
use super::project::{CloudShape, Project, view};
use super::scratch::{PerGaussian, PerPair, PerPicture, extent};
use super::sort::Sort;
use super::{Context, GpuError, Parameters};
use crate::render::{Cutoffs, RenderError, RenderSettings};
use crate::scene::Camera;

/// Pairs per Gaussian that are assumed before a frame has told.
const FIRST_GUESS: u32 = 4;
/// Room that is left over what a frame needed, so that the next one fits too.
const HEADROOM: f64 = 1.5;

/// The kernels of the forward pass with their buffers.
#[derive(Debug)]
pub struct Rasterizer {
    project: Project,
    sort: Sort,
    bin: Bin,
    blend: Blend,
    /// Camera and picture.
    pub view: wgpu::Buffer,
    /// Counters of the frame.
    pub counters: wgpu::Buffer,
    /// Buffers by number of Gaussians.
    pub gaussians: PerGaussian,
    /// Buffers by number of pairs.
    pub pairs: PerPair,
    /// Buffers by picture.
    pub picture: PerPicture,
    shot: (u32, [u32; 2]),
}

impl Rasterizer {
    /// Compiles the kernels; the buffers are as small as they can be.
    pub fn new(context: &Context) -> Result<Self, GpuError> {
        Ok(Self {
            project: Project::new(context)?,
            sort: Sort::new(context)?,
            bin: Bin::new(context)?,
            blend: Blend::default(),
            view: context.uniform("view", bytemuck::bytes_of(&View::default()))?,
            counters: context.storage("counters", size_of::<Counters>() as u64)?,
            gaussians: PerGaussian::new(context, 1)?,
            pairs: PerPair::new(context, 1, 1)?,
            picture: PerPicture::new(context, [1, 1], 0)?,
            shot: (0, [0, 0]),
        })
    }

    /// Makes room for a frame, tells the device what to draw, and resets the counters.
    pub fn prepare(
        &mut self,
        context: &Context,
        camera: &Camera,
        settings: &RenderSettings,
        cloud: CloudShape,
        channels: usize,
    ) -> Result<(), GpuError> {
        camera.validate().map_err(RenderError::from)?;
        if settings.cutoffs != Cutoffs::default() {
            return Err(RenderError::Cutoffs.into());
        }
        let size_px = [camera.width_px, camera.height_px];
        let [pixels, tiles] = extent(size_px);
        let n = cloud.gaussians as usize;
        if self.gaussians.room < n {
            self.gaussians = PerGaussian::new(context, n)?;
        }
        let room = self.pairs.room.max(cloud.gaussians.saturating_mul(FIRST_GUESS)).max(1024);
        if self.pairs.room < room || (self.pairs.tiles as usize) < tiles {
            self.pairs = PerPair::new(context, room, tiles as u32)?;
        }
        let p = &self.picture;
        if p.pixels < pixels || p.tiles < tiles || p.channels != channels {
            self.picture = PerPicture::new(context, size_px, channels)?;
        }
        for (carried, _) in &self.picture.chunks {
            self.blend.prepare(context, *carried)?;
        }
        let view = view(camera, settings, cloud, channels as u32, self.pairs.room);
        self.shot = (cloud.gaussians, view.tiles);
        context.queue().write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        let counters = Counters { gaussians: cloud.gaussians, ..Counters::default() };
        context.queue().write_buffer(&self.counters, 0, bytemuck::bytes_of(&counters));
        Ok(())
    }

    /// What the kernels of the prepared frame are told.
    pub fn shot(&self) -> Shot<'_> {
        Shot { view: &self.view, counters: &self.counters, gaussians: self.shot.0, tiles: self.shot.1 }
    }

    /// Records projection, depth order and the count of pairs.
    pub fn encode_count(&self, recorder: &mut Recorder<'_>, cloud: &Parameters) {
        let shot = self.shot();
        recorder.stage("project", |s| self.project.encode(s, shot, cloud, &self.gaussians));
        recorder.stage("sort by depth", |s| self.sort.encode(s, &self.gaussians.by_depth, &self.counters));
        recorder.stage("bin", |s| self.bin.encode_count(s, shot, &self.gaussians));
    }

    /// Records the rest of the forward pass after [`Self::encode_count`].
    pub fn encode_draw(&self, recorder: &mut Recorder<'_>, features: &wgpu::Buffer) {
        let shot = self.shot();
        recorder.clear(&self.picture.ranges);
        recorder.stage("bin", |s| self.bin.encode_emit(s, shot, &self.gaussians, &self.pairs));
        recorder.stage("sort by tile", |s| self.sort.encode(s, &self.pairs.by_tile, &self.counters));
        recorder.stage("bin", |s| self.bin.encode_ranges(s, shot, &self.pairs, &self.picture.ranges));
        recorder.stage("blend", |s| {
            self.blend.encode(s, shot, (&self.gaussians, &self.pairs, &self.picture), features);
        });
    }

    /// Makes room for `wanted` pairs and some more.
    pub fn grow_pairs(&mut self, context: &Context, wanted: u32) -> Result<(), GpuError> {
        if wanted <= self.pairs.room {
            return Ok(());
        }
        let tiles = self.pairs.tiles.min(self.picture.tiles as u32);
        let roomy = (f64::from(wanted) * HEADROOM).min(f64::from(u32::MAX)) as u32;
        let made = PerPair::new(context, roomy, tiles).or_else(|_| PerPair::new(context, wanted, tiles));
        self.pairs = made?;
        Ok(())
    }

    /// Bytes of its buffers on the device.
    pub fn device_bytes(&self) -> u64 {
        let (g, p) = (&self.gaussians, &self.picture);
        let own = [&self.view, &self.counters, &g.splats, &g.tile_counts, &g.sums];
        let picture = [&p.ranges, &p.colors, &p.ends, &p.depths, &p.features];
        let all = own.into_iter().chain(picture).chain(p.chunks.iter().map(|(_, b)| b));
        let sorts = g.by_depth.device_bytes() + self.pairs.by_tile.device_bytes();
        all.map(wgpu::Buffer::size).sum::<u64>() + sorts
    }

    /// Reads the frame's counters.
    pub fn read_counters(&self, context: &Context) -> Result<Counters, GpuError> {
        let bytes = context.read(&[(&self.counters, size_of::<Counters>() as u64)])?;
        Ok(counters_of(&bytes[0]))
    }
}

/// Counters from their bytes.
pub fn counters_of(bytes: &[u8]) -> Counters {
    bytemuck::pod_read_unaligned(&bytes[..size_of::<Counters>()])
}
