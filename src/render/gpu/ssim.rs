//! The training loss and its gradient; `shaders/ssim.wgsl`.

use super::kernel::{Access, Kernel, Module, RecordedStage, Recorder};
use super::layout::Loss;
use super::scratch::extent;
use super::shader::ShaderVariant;
use super::{Device, GpuError};
use crate::math::stats::psnr_of;
use crate::render::TILE_PX;
use crate::scene::PhotoPixels;

/// Steps whose sums the device keeps until the host fetches them.
pub(crate) const RING: usize = 64;
/// Bytes of one step's sums.
const SLOT_BYTES: u64 = 32;

/// A photo on the device, 4 bytes a pixel; 8 of a thing that was cut out.
#[derive(Clone, Debug)]
pub struct DevicePhoto {
    pixels: wgpu::Buffer,
    /// True if the alpha of each pixel follows the pixels.
    pub(crate) has_alpha: bool,
    pub(crate) size_px: [u32; 2],
}

impl DevicePhoto {
    pub(crate) fn new(device: &Device, photo: &PhotoPixels) -> Result<Self, GpuError> {
        let size_px = [photo.width_px, photo.height_px];
        let [want, _] = extent(size_px);
        let length = |plane: &Option<Vec<u8>>| plane.as_ref().map_or(want, Vec::len);
        let lengths = [photo.rgb.len(), length(&photo.coverage), length(&photo.alpha)];
        if let Some(&have) = lengths.iter().find(|&&l| l != want) {
            return Err(GpuError::Size { what: "pixels of a photo", have, want });
        }
        let covered = |i: usize| photo.coverage.as_ref().map_or(255, |c| c[i]);
        let colors = photo.rgb.iter().enumerate().map(|(i, &[r, g, b])| [r, g, b, covered(i)]);
        let alpha = photo.alpha.iter().flatten().map(|a| [*a; 4]);
        let packed: Vec<[u8; 4]> = colors.chain(alpha).collect();
        let pixels = device.storage_with("photo", packed.as_flattened())?;
        Ok(Self { pixels, has_alpha: photo.alpha.is_some(), size_px })
    }
}

/// Means over pixels and channels of one comparison, and values of the frame's counters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossSums {
    pub(crate) l1: f64,
    pub(crate) ssim: f64,
    pub(crate) mse: f64,
    /// The frame's (splat, tile) pairs did not fit, so it was not drawn and nothing moved.
    pub overflow: bool,
    /// Pairs that it needed.
    pub wanted: u32,
    pub(crate) visible: u32,
    /// Gaussians left alone because their gradient was not finite.
    pub(crate) bad_gradients: u32,
    /// Gradients that were cut as outliers.
    pub outliers: u32,
}

impl LossSums {
    /// `(1 - lambda) L1 + lambda (1 - SSIM)`.
    pub fn total(&self, lambda: f64) -> f64 {
        (1.0 - lambda) * self.l1 + lambda * (1.0 - self.ssim)
    }

    /// PSNR in dB for a peak of 1.
    pub(crate) fn psnr(&self) -> f64 {
        psnr_of(self.mse)
    }
}

#[derive(Debug)]
pub(crate) struct Ssim {
    moments: Kernel,
    gradient: Kernel,
    reduce: Kernel,
    loss: wgpu::Buffer,
    maps: wgpu::Buffer,
    partials: wgpu::Buffer,
    ring: wgpu::Buffer,
}

impl Ssim {
    /// Compiles the kernels; the buffers grow with the first photo.
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "ssim", ShaderVariant::default())?;
        let kernel = |entry, slots: &[_]| Kernel::new(device, &module, entry, slots);
        Ok(Self {
            moments: kernel("moments", &[(0, Uniform), (1, Read), (2, Read), (3, Write), (5, Write)])?,
            gradient: kernel("gradient", &[(0, Uniform), (1, Read), (2, Read), (3, Write), (4, Write)])?,
            reduce: kernel("reduce", &[(0, Uniform), (5, Write), (6, Write), (7, Read), (8, Read)])?,
            loss: device.uniform("loss", bytemuck::bytes_of(&Loss::default()))?,
            maps: device.storage("derivatives of SSIM", 0)?,
            partials: device.storage("sums of the loss", 0)?,
            ring: device.storage("losses of steps", RING as u64 * SLOT_BYTES)?,
        })
    }

    /// Makes room for pictures of this size and sets the slot for the sums. `lambda` is the weight of D-SSIM in the
    /// loss, `shift` is added where the photo, which then has an alpha, is transparent.
    pub(crate) fn prepare(
        &mut self,
        device: &Device,
        size_px: [u32; 2],
        slot: usize,
        lambda: f64,
        shift: Option<[f32; 3]>,
    ) -> Result<(), GpuError> {
        let [pixels, tiles] = extent(size_px);
        device.grow(&mut self.maps, "derivatives of SSIM", pixels as u64 * 36)?;
        device.grow(&mut self.partials, "sums of the loss", tiles as u64 * 16)?;
        let values = (pixels * 3) as f64;
        let loss = Loss {
            size_px,
            slot: slot as u32,
            tiles: tiles as u32,
            l1: ((1.0 - lambda) / values) as f32,
            dssim: (lambda / values) as f32,
            has_alpha: u32::from(shift.is_some()),
            shift: shift.map_or([0.0; 4], |[r, g, b]| [r, g, b, 0.0]),
            ..Loss::default()
        };
        device.queue().write_buffer(&self.loss, 0, bytemuck::bytes_of(&loss));
        Ok(())
    }

    /// Records the loss of `colors` and its gradient into `pixel_gradient`.
    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        colors: &wgpu::Buffer,
        photo: &DevicePhoto,
        pixel_gradient: &wgpu::Buffer,
    ) {
        let [w, h] = photo.size_px.map(|s| s.div_ceil(TILE_PX as u32));
        stage.run(&self.moments, &[&self.loss, colors, &photo.pixels, &self.maps, &self.partials], [w, h, 1]);
        stage.run(&self.gradient, &[&self.loss, colors, &photo.pixels, &self.maps, pixel_gradient], [w, h, 1]);
    }

    /// Records the last sums into the ring, with the frame's counters and the optimizer's number of
    /// outliers as they then are.
    pub(crate) fn encode_sums(&self, stage: &mut RecordedStage<'_>, counters: &wgpu::Buffer, outliers: &wgpu::Buffer) {
        stage.run(&self.reduce, &[&self.loss, &self.partials, &self.ring, counters, outliers], [1, 1, 1]);
    }

    /// Fetches the sums of slots from 0, one for each of `pixels`, the number of pixels compared.
    pub(crate) fn read(&self, device: &Device, pixels: &[usize]) -> Result<Vec<LossSums>, GpuError> {
        let slots: Vec<[f32; 8]> = device.read(&[(&self.ring, pixels.len() as u64 * SLOT_BYTES)])?.values(0);
        Ok(slots
            .iter()
            .zip(pixels)
            .map(|(s, &n)| {
                let mean = |sum: f32| f64::from(sum) / (3 * n) as f64;
                LossSums {
                    l1: mean(s[0]),
                    ssim: mean(s[1]),
                    mse: mean(s[2]),
                    outliers: s[3] as u32,
                    overflow: s[4] != 0.0,
                    wanted: s[5] as u32,
                    visible: s[6] as u32,
                    bad_gradients: s[7] as u32,
                }
            })
            .collect())
    }
}

/// Loss of a rendered picture (interleaved RGB) against a photo, to which `shift` is added where it is transparent, and
/// its gradient: the loss alone, for tests and measurements.
pub fn photo_loss(
    device: &Device,
    rendered: &[[f32; 3]],
    photo: &PhotoPixels,
    lambda: f64,
    shift: [f32; 3],
) -> Result<(LossSums, Vec<[f32; 3]>), GpuError> {
    let target = DevicePhoto::new(device, photo)?;
    let [pixels, _] = extent(target.size_px);
    if rendered.len() != pixels {
        return Err(GpuError::Size { what: "pixels of a picture", have: rendered.len(), want: pixels });
    }
    let mut ssim = Ssim::new(device)?;
    ssim.prepare(device, target.size_px, 0, lambda, target.has_alpha.then_some(shift))?;
    let wide: Vec<[f32; 4]> = rendered.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
    let colors = device.storage_with("picture", bytemuck::cast_slice(&wide))?;
    let gradient = device.storage("gradient of the picture", pixels as u64 * 16)?;
    let [counters, outliers] = [device.storage("counters", 32)?, device.storage("outliers", 16)?];
    let mut recorder = Recorder::new(device, None);
    recorder.stage("loss", |s| ssim.encode(s, &colors, &target, &gradient));
    recorder.stage("loss", |s| ssim.encode_sums(s, &counters, &outliers));
    recorder.submit();
    let sums = ssim.read(device, &[pixels])?.first().copied().unwrap_or_default();
    let gradient: Vec<[f32; 4]> = device.read(&[(&gradient, pixels as u64 * 16)])?.values(0);
    Ok((sums, gradient.iter().map(|g| [g[0], g[1], g[2]]).collect()))
}
