//! The forward pass: all its kernels and the buffers between them, for the renderer and the trainer.

use super::bin::Bin;
use super::blend::TileKernel;
use super::kernel::{FrameBindings, Recorder};
use super::layout::{Counters, View};
use super::project::{CloudShape, Project, view};
use super::readback::Copies;
use super::scratch::{PerGaussian, PerPair, PerPicture, extent};
use super::sort::Sort;
use super::{Device, GpuError, Parameters};
use crate::render::{Cutoffs, Frame, RenderError, RenderSettings};
use crate::scene::Camera;

/// Pairs per Gaussian that are assumed before the first frame counts them.
const FIRST_GUESS: u32 = 4;
/// Factor of the room over the last frame's need, so that the next one fits too.
const HEADROOM: f64 = 1.5;

/// The kernels of the forward pass with their buffers.
#[derive(Debug)]
pub(crate) struct GpuRasterizer {
    project: Project,
    sort: Sort,
    bin: Bin,
    blend: TileKernel,
    pub(crate) view: wgpu::Buffer,
    pub(crate) counters: wgpu::Buffer,
    pub(crate) gaussians: PerGaussian,
    pub(crate) pairs: PerPair,
    pub(crate) picture: PerPicture,
    extent: (u32, [u32; 2]),
}

impl GpuRasterizer {
    /// Compiles the kernels; the buffers are as small as they can be.
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        Ok(Self {
            project: Project::new(device)?,
            sort: Sort::new(device)?,
            bin: Bin::new(device)?,
            blend: TileKernel::blend(),
            view: device.uniform("view", bytemuck::bytes_of(&View::default()))?,
            counters: device.storage("counters", size_of::<Counters>() as u64)?,
            gaussians: PerGaussian::new(device, 1)?,
            pairs: PerPair::new(device, 1, 1)?,
            picture: PerPicture::new(device, [1, 1], 0)?,
            extent: (0, [0, 0]),
        })
    }

    /// Makes room for a frame, uploads its view, and resets the counters.
    pub(crate) fn prepare(
        &mut self,
        device: &Device,
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
        if self.gaussians.capacity < n {
            self.gaussians = PerGaussian::new(device, n)?;
        }
        let capacity = self.pairs.capacity.max(cloud.gaussians.saturating_mul(FIRST_GUESS)).max(1024);
        if self.pairs.capacity < capacity || (self.pairs.tiles as usize) < tiles {
            self.pairs = PerPair::new(device, capacity, tiles as u32)?;
        }
        let p = &self.picture;
        if p.pixels < pixels || p.tiles < tiles || p.channels != channels {
            self.picture = PerPicture::new(device, size_px, channels)?;
        }
        for (carried, _) in &self.picture.chunks {
            self.blend.prepare(device, *carried)?;
        }
        let view = view(camera, settings, cloud, channels as u32, self.pairs.capacity);
        self.extent = (cloud.gaussians, view.tiles);
        device.queue().write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        let counters = Counters { gaussians: cloud.gaussians, ..Counters::default() };
        device.queue().write_buffer(&self.counters, 0, bytemuck::bytes_of(&counters));
        Ok(())
    }

    /// Bindings of the kernels for the prepared frame.
    pub(crate) fn bindings(&self) -> FrameBindings<'_> {
        FrameBindings { view: &self.view, counters: &self.counters, gaussians: self.extent.0, tiles: self.extent.1 }
    }

    /// Records projection, depth order and the count of pairs.
    pub(crate) fn encode_count(&self, recorder: &mut Recorder<'_>, cloud: &Parameters) {
        let bindings = self.bindings();
        recorder.stage("project", |s| self.project.encode(s, bindings, cloud, &self.gaussians));
        recorder.stage("sort by depth", |s| self.sort.encode(s, &self.gaussians.by_depth, &self.counters));
        recorder.stage("bin", |s| self.bin.encode_count(s, bindings, &self.gaussians));
    }

    /// Records the rest of the forward pass after [`Self::encode_count`].
    pub(crate) fn encode_draw(&self, recorder: &mut Recorder<'_>, features: &wgpu::Buffer) {
        self.encode_lists(recorder);
        self.encode_blend(recorder, features);
    }

    /// Records the lists of the tiles after [`Self::encode_count`].
    pub(crate) fn encode_lists(&self, recorder: &mut Recorder<'_>) {
        let bindings = self.bindings();
        recorder.clear(&self.picture.ranges);
        recorder.stage("bin", |s| self.bin.encode_emit(s, bindings, &self.gaussians, &self.pairs));
        recorder.stage("sort by tile", |s| self.sort.encode(s, &self.pairs.by_tile, &self.counters));
        recorder.stage("bin", |s| self.bin.encode_ranges(s, bindings, &self.pairs, &self.picture.ranges));
    }

    fn encode_blend(&self, recorder: &mut Recorder<'_>, features: &wgpu::Buffer) {
        let bindings = self.bindings();
        recorder.stage("blend", |s| {
            let picture = &self.picture;
            let own = [&picture.colors, &picture.ends, &picture.depths, &picture.features];
            self.blend.encode(s, bindings, (&self.gaussians, &self.pairs, picture), features, own);
        });
    }

    /// Splats of the tiles, tile by tile, front to back.
    pub(crate) fn list(&self) -> &wgpu::Buffer {
        &self.pairs.by_tile.values[self.pairs.by_tile.result()]
    }

    /// Makes room for `wanted` pairs and some more.
    pub(crate) fn grow_pairs(&mut self, device: &Device, wanted: u32) -> Result<(), GpuError> {
        if wanted <= self.pairs.capacity {
            return Ok(());
        }
        let tiles = self.pairs.tiles.min(self.picture.tiles as u32);
        let roomy = (f64::from(wanted) * HEADROOM).min(f64::from(u32::MAX)) as u32;
        let made = PerPair::new(device, roomy, tiles).or_else(|_| PerPair::new(device, wanted, tiles));
        self.pairs = made?;
        Ok(())
    }

    /// Copies the frame that was drawn last, and its counters, to the host.
    pub(crate) fn read_frame(
        &self,
        device: &Device,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<(Frame<f32>, Counters), GpuError> {
        let pixels = extent([camera.width_px, camera.height_px])[0] as u64;
        let (picture, channels) = (&self.picture, self.picture.channels);
        let depth_bytes = if settings.depth { pixels * 8 } else { 0 };
        let copies = device.read(&[
            self.counted(),
            (&picture.colors, pixels * 16),
            (&picture.depths, depth_bytes),
            (&picture.features, pixels * 4 * channels as u64),
        ])?;
        let (colors, depths, features) = (copies.slice::<[f32; 4]>(1), copies.slice::<[f32; 2]>(2), copies.slice(3));
        let plane = |c: usize| colors.iter().map(|p: &[f32; 4]| p[c]).collect::<Vec<f32>>();
        // Memory that is new takes longer to fill than to copy from; every plane is filled by a thread of its own.
        let ((red, green), (blue, alpha)) = rayon::join(
            || rayon::join(|| plane(0), || plane(1)),
            || rayon::join(|| plane(2), || colors.iter().map(|p| 1.0 - p[3]).collect()),
        );
        let frame = Frame {
            width_px: camera.width_px as usize,
            height_px: camera.height_px as usize,
            color: [red, green, blue],
            features: (0..channels).map(|c| features.iter().skip(c).step_by(channels).copied().collect()).collect(),
            alpha,
            depth: depths.iter().map(|d| d[0]).collect(),
            median_depth: depths.iter().map(|d| d[1]).collect(),
            ..Frame::default()
        };
        Ok((frame, counters_of(&copies)))
    }

    pub(crate) fn device_bytes(&self) -> u64 {
        let (g, p) = (&self.gaussians, &self.picture);
        let own = [&self.view, &self.counters, &g.splats, &g.tile_counts, &g.sums];
        let picture = [&p.ranges, &p.colors, &p.ends, &p.depths, &p.features];
        let all = own.into_iter().chain(picture).chain(p.chunks.iter().map(|(_, b)| b));
        let sorts = g.by_depth.device_bytes() + self.pairs.by_tile.device_bytes();
        all.map(wgpu::Buffer::size).sum::<u64>() + sorts
    }

    pub(crate) fn read_counters(&self, device: &Device) -> Result<Counters, GpuError> {
        Ok(counters_of(&device.read(&[self.counted()])?))
    }

    /// Copies the first bytes of a buffer, which come second, and the frame's counters.
    pub(super) fn read_with(
        &self,
        device: &Device,
        source: (&wgpu::Buffer, u64),
    ) -> Result<(Copies, Counters), GpuError> {
        let copies = device.read(&[self.counted(), source])?;
        let counters = counters_of(&copies);
        Ok((copies, counters))
    }

    fn counted(&self) -> (&wgpu::Buffer, u64) {
        (&self.counters, size_of::<Counters>() as u64)
    }
}

/// The counters, which were read first.
fn counters_of(copies: &Copies) -> Counters {
    copies.values(0).first().copied().unwrap_or_default()
}
