//! Packing of a picture's colors as bytes, a quarter of the floats' size, for the host or for a texture that a window
//! paints; `shaders/pack.wgsl`.

use super::kernel::{Access, Kernel, Module, RecordedStage, Recorder};
use super::layout::{PACKED_BYTES, ROW_PX};
use super::rasterizer::GpuRasterizer;
use super::shader::ShaderVariant;
use super::{Device, GpuError};

/// The kernel, and room for its bytes.
#[derive(Debug)]
pub(crate) struct Pack {
    kernel: Kernel,
    pub(crate) bytes: wgpu::Buffer,
}

/// The colors of a picture as a texture on the device that drew it, `Rgba8Unorm`. Clones are the same texture.
#[derive(Clone, Debug)]
pub struct DevicePicture {
    device: Device,
    texture: wgpu::Texture,
}

/// Bytes from one row to the next.
fn row_bytes(width_px: u32) -> u32 {
    width_px.next_multiple_of(ROW_PX) * PACKED_BYTES
}

/// Bytes of a picture with its rows apart.
pub(super) fn packed_bytes([width_px, height_px]: [u32; 2]) -> u64 {
    u64::from(row_bytes(width_px)) * u64::from(height_px)
}

/// The pixels of packed rows, row-major.
pub(super) fn unpacked(rows: &[u8], width_px: u32) -> Vec<[u8; 3]> {
    let rows = rows.chunks_exact(row_bytes(width_px) as usize);
    rows.flat_map(|row| row.as_chunks::<4>().0.iter().take(width_px as usize).map(|[r, g, b, _]| [*r, *g, *b]))
        .collect()
}

fn rows_of(buffer: &wgpu::Buffer, size: wgpu::Extent3d) -> wgpu::TexelCopyBufferInfo<'_> {
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes(size.width)), rows_per_image: None };
    wgpu::TexelCopyBufferInfo { buffer, layout }
}

impl Pack {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "pack", ShaderVariant::default())?;
        let kernel = Kernel::new(device, &module, "main", &[(0, Uniform), (1, Read), (2, Write)])?;
        Ok(Self { kernel, bytes: device.storage("bytes of the picture", 0)? })
    }

    /// Makes room for a picture.
    pub(crate) fn prepare(&mut self, device: &Device, size_px: [u32; 2]) -> Result<(), GpuError> {
        device.grow(&mut self.bytes, "bytes of the picture", packed_bytes(size_px))
    }

    /// Records the packing of a frame of `pixels`.
    pub(crate) fn encode(&self, stage: &mut RecordedStage<'_>, rasterizer: &GpuRasterizer, pixels: u64) {
        let buffers = [rasterizer.bindings().view, &rasterizer.picture.colors, &self.bytes];
        stage.run_flat(&self.kernel, &buffers, pixels.div_ceil(256));
    }

    /// Records the copy of the packed frame into a texture of its size.
    pub(crate) fn encode_copy(&self, recorder: &mut Recorder<'_>, to: &DevicePicture) {
        let size = to.texture.size();
        recorder.encoder().copy_buffer_to_texture(rows_of(&self.bytes, size), to.texture.as_image_copy(), size);
    }
}

impl DevicePicture {
    /// Room for a picture.
    pub(super) fn new(device: &Device, size_px: [u32; 2]) -> Result<Self, GpuError> {
        let usage =
            wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
        let [width, height] = size_px;
        let make = || {
            device.wgpu().create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage,
                view_formats: &[],
            })
        };
        let texture = device.scoped("picture", packed_bytes(size_px), make)?;
        Ok(Self { device: device.clone(), texture })
    }

    /// Returns whether a window of this device can paint it.
    pub(crate) fn lies_on(&self, device: &wgpu::Device) -> bool {
        self.device.wgpu() == device
    }

    /// For a window of the same device.
    pub(crate) fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Its pixels on the host, row-major.
    ///
    /// # Errors
    /// If the device was lost, or has no memory for the copy.
    pub fn to_rgb8(&self) -> Result<Vec<[u8; 3]>, GpuError> {
        let size = self.texture.size();
        let bytes = packed_bytes([size.width, size.height]);
        let buffer = self.device.storage("bytes of the picture", bytes)?;
        let mut recorder = Recorder::new(&self.device, None);
        recorder.encoder().copy_texture_to_buffer(self.texture.as_image_copy(), rows_of(&buffer, size), size);
        recorder.submit();
        let copies = self.device.read(&[(&buffer, bytes)])?;
        Ok(unpacked(copies.bytes(0), size.width))
    }
}
