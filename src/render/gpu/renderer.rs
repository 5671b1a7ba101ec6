//! The renderer: a cloud in host memory to a frame in host memory, and gradients back.

use super::blend::TileKernel;
use super::blend_backward::{BlendGradients, blend_backward};
use super::cloud::{Packed, Parameters};
use super::kernel::Recorder;
use super::labels::LabelPass;
use super::layout::{Counters, Splat};
use super::pack::{DevicePicture, Pack, packed_bytes, unpacked};
use super::project::CloudShape;
use super::project_backward::ProjectBackward;
use super::rasterizer::GpuRasterizer;
use super::scratch::GRADIENT_BASE;
use super::timing::{StageTimes, Timer};
use super::{Device, GpuError};
use crate::render::{CloudGradient, Features, Frame, FrameGradient, LabelWinner, RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// A renderer with its buffers and the cloud that was uploaded last.
#[derive(Debug)]
pub struct GpuRenderer {
    device: Device,
    rasterizer: GpuRasterizer,
    blend_backward: TileKernel,
    project_backward: ProjectBackward,
    cloud: Parameters,
    shape: CloudShape,
    features: wgpu::Buffer,
    channels: usize,
    drawn: Option<Drawn>,
    labels: LabelPass,
    pack: Pack,
    timer: Option<Timer>,
    times: StageTimes,
}

/// Intermediate results of a frame.
#[derive(Clone, Debug, Default)]
pub struct Inspection {
    /// One splat per Gaussian; radius 0 where it is not drawn.
    pub splats: Vec<Splat>,
    /// Each tile's part of the list, row by row.
    pub ranges: Vec<[u32; 2]>,
    /// Indices of Gaussians, tile by tile, front to back.
    pub list: Vec<u32>,
}

/// State of the last frame for passes over its lists.
#[derive(Debug, Clone)]
struct Drawn {
    camera: Camera,
    settings: RenderSettings,
    counters: Counters,
}

/// Work that follows the blending of a frame.
#[derive(Debug, Clone, Copy)]
enum After<'a> {
    Nothing,
    Pack,
    /// Packing, and a copy of that.
    Texture(&'a DevicePicture),
}

fn size_px(camera: &Camera) -> [u32; 2] {
    [camera.width_px, camera.height_px]
}

fn pixels_of(camera: &Camera) -> u64 {
    u64::from(camera.width_px) * u64::from(camera.height_px)
}

impl GpuRenderer {
    /// A renderer on `device`.
    pub fn new(device: &Device) -> Result<Self, GpuError> {
        Self::with_float_atomics(device, device.has_float_atomics())
    }

    /// A renderer that uses float atomics or not, whatever the device offers. Asking for what it
    /// does not have is an error at the first backward pass.
    pub fn with_float_atomics(device: &Device, float_atomics: bool) -> Result<Self, GpuError> {
        Ok(Self {
            device: device.clone(),
            rasterizer: GpuRasterizer::new(device)?,
            blend_backward: blend_backward(float_atomics),
            project_backward: ProjectBackward::new(device)?,
            cloud: Parameters::new(device, "cloud", 0, 0)?,
            shape: CloudShape::default(),
            features: device.storage("features", 0)?,
            channels: 0,
            drawn: None,
            labels: LabelPass::new(device)?,
            pack: Pack::new(device)?,
            timer: None,
            times: StageTimes::new(),
        })
    }

    /// Times the stages of every later frame, where the device can.
    pub(crate) fn measure(&mut self) -> Result<(), GpuError> {
        self.timer = Timer::new(&self.device)?;
        Ok(())
    }

    pub(crate) fn stop_measuring(&mut self) {
        (self.timer, self.times) = (None, StageTimes::new());
    }

    /// Seconds per stage of the last frame and its backward pass; empty unless measured.
    pub(crate) fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Counters of the last frame.
    pub fn counters(&self) -> Option<Counters> {
        self.drawn.as_ref().map(|d| d.counters)
    }

    /// Sends a cloud to the device, with its extra channels.
    pub fn upload(&mut self, cloud: &GaussianCloud, features: Features<'_, f32>) -> Result<(), GpuError> {
        self.upload_bands(cloud, features, cloud.sh_degree)
    }

    /// Sends a cloud to the device without the bands of its harmonics above `degree`.
    pub(crate) fn upload_bands(
        &mut self,
        cloud: &GaussianCloud,
        features: Features<'_, f32>,
        degree: u8,
    ) -> Result<(), GpuError> {
        let want = cloud.len() * features.channels;
        if features.values.len() != want {
            return Err(RenderError::FeatureLength { have: features.values.len(), want }.into());
        }
        self.drawn = None;
        let degree = degree.min(cloud.sh_degree);
        if self.shape.gaussians as usize != cloud.len() || self.shape.degree != degree {
            self.cloud = Parameters::new(&self.device, "cloud", cloud.len(), degree)?;
        }
        self.cloud.write(&self.device, &Packed::up_to(cloud, degree));
        self.features = self.device.storage_with("features", bytemuck::cast_slice(features.values))?;
        self.shape = CloudShape { origin: cloud.origin, gaussians: cloud.len() as u32, degree };
        self.channels = features.channels;
        Ok(())
    }

    /// Bytes of all buffers that it holds on the device.
    pub(crate) fn device_bytes(&self) -> u64 {
        let sizes = |buffers: &[&wgpu::Buffer]| buffers.iter().map(|b| b.size()).sum::<u64>();
        let [a, b, c] = &self.cloud.buffers;
        sizes(&[a, b, c, &self.features, &self.labels.found, &self.pack.bytes]) + self.rasterizer.device_bytes()
    }

    /// Uploads `cloud` and draws it as `camera` sees it.
    pub fn render(
        &mut self,
        cloud: &GaussianCloud,
        features: Features<'_, f32>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<f32>, GpuError> {
        self.upload(cloud, features)?;
        self.draw(camera, settings)
    }

    /// Draws the uploaded cloud.
    pub fn draw(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<Frame<f32>, GpuError> {
        loop {
            self.submit(camera, settings, After::Nothing)?;
            let (frame, counters) = self.rasterizer.read_frame(&self.device, camera, settings)?;
            if self.settle(camera, settings, counters)? {
                return Ok(frame);
            }
        }
    }

    /// Draws the uploaded cloud and returns the colors alone, as [`Frame::to_rgb8`].
    pub fn draw_rgb8(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<Vec<[u8; 3]>, GpuError> {
        loop {
            self.submit(camera, settings, After::Pack)?;
            let packed = (&self.pack.bytes, packed_bytes(size_px(camera)));
            let (copies, counters) = self.rasterizer.read_with(&self.device, packed)?;
            if self.settle(camera, settings, counters)? {
                return Ok(unpacked(copies.bytes(1), camera.width_px));
            }
        }
    }

    /// As [`Self::draw_rgb8`], but the colors stay on the device, for a window of the same.
    pub fn draw_texture(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<DevicePicture, GpuError> {
        let picture = DevicePicture::new(&self.device, size_px(camera))?;
        loop {
            self.submit(camera, settings, After::Texture(&picture))?;
            let counters = self.rasterizer.read_counters(&self.device)?;
            if self.settle(camera, settings, counters)? {
                return Ok(picture);
            }
        }
    }

    /// Draws the uploaded cloud again from where it was drawn before and leaves the picture on the device: returns
    /// when the work is handed over. For measurements.
    pub(crate) fn draw_on_device(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<(), GpuError> {
        self.submit(camera, settings, After::Nothing)
    }

    /// The label that wins each pixel, row-major; `of` has one for each Gaussian of the uploaded cloud, `groups` the
    /// group of each label. Of the view that was drawn last this is one pass more.
    pub(crate) fn label_winners(
        &mut self,
        (of, groups): (&[u32], &[u32]),
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<LabelWinner>, GpuError> {
        let want = self.shape.gaussians as usize;
        if of.len() != want {
            return Err(GpuError::Size { what: "labels of Gaussians", have: of.len(), want });
        }
        let of = self.device.storage_with("labels of Gaussians", bytemuck::cast_slice(of))?;
        let groups = self.device.storage_with("groups of labels", bytemuck::cast_slice(groups))?;
        let pixels = pixels_of(camera);
        self.labels.prepare(&self.device, pixels)?;
        loop {
            let known = self.drawn.as_ref().is_some_and(|d| d.camera == *camera && d.settings.sees_like(settings));
            if !known {
                self.submit(camera, settings, After::Nothing)?;
            }
            let mut recorder = Recorder::new(&self.device, None);
            recorder.stage("labels", |s| self.labels.encode(s, &self.rasterizer, [&of, &groups]));
            recorder.submit();
            let (copies, counters) = self.rasterizer.read_with(&self.device, (&self.labels.found, pixels * 12))?;
            if known || self.settle(camera, settings, counters)? {
                let winner = |[label, share, alpha]: &[u32; 3]| LabelWinner {
                    label: *label,
                    share: f32::from_bits(*share),
                    alpha: f32::from_bits(*alpha),
                };
                return Ok(copies.slice(1).iter().map(winner).collect());
            }
        }
    }

    /// Hands the work of a frame to the device.
    fn submit(&mut self, camera: &Camera, settings: &RenderSettings, after: After<'_>) -> Result<(), GpuError> {
        self.drawn = None;
        self.rasterizer.prepare(&self.device, camera, settings, self.shape, self.channels)?;
        if !matches!(after, After::Nothing) {
            self.pack.prepare(&self.device, size_px(camera))?;
        }
        let mut recorder = Recorder::new(&self.device, self.timer.as_mut());
        self.rasterizer.encode_count(&mut recorder, &self.cloud);
        self.rasterizer.encode_draw(&mut recorder, &self.features);
        if !matches!(after, After::Nothing) {
            recorder.stage("pack", |s| self.pack.encode(s, &self.rasterizer, pixels_of(camera)));
        }
        if let After::Texture(picture) = after {
            self.pack.encode_copy(&mut recorder, picture);
        }
        recorder.submit();
        Ok(())
    }

    /// Returns whether the submitted frame was drawn; if not, makes room for it.
    fn settle(&mut self, camera: &Camera, settings: &RenderSettings, counters: Counters) -> Result<bool, GpuError> {
        if let Some(timer) = &mut self.timer {
            self.times = timer.finish(&self.device)?;
        }
        if counters.overflow == 0 {
            self.drawn = Some(Drawn { camera: camera.clone(), settings: settings.clone(), counters });
            return Ok(true);
        }
        self.rasterizer.grow_pairs(&self.device, counters.wanted)?;
        Ok(false)
    }

    /// Intermediate results of the last frame, for tests and debugging; `None` before the first frame.
    pub fn inspect(&self) -> Result<Option<Inspection>, GpuError> {
        let Some(drawn) = &self.drawn else { return Ok(None) };
        let r = &self.rasterizer;
        let n = self.shape.gaussians as usize;
        let tiles = r.bindings().tiles.iter().product::<u32>() as u64;
        let copies = self.device.read(&[
            (&r.gaussians.splats, (n * size_of::<Splat>()) as u64),
            (&r.picture.ranges, tiles * 8),
            (r.list(), u64::from(drawn.counters.pairs) * 4),
        ])?;
        Ok(Some(Inspection { splats: copies.values(0), ranges: copies.values(1), list: copies.values(2) }))
    }

    /// Gradient with respect to the whole cloud for the last rendered frame, which must have been
    /// of this cloud and with these features. Zero before the first frame.
    pub fn backward(
        &mut self,
        cloud: &GaussianCloud,
        features: Features<'_, f32>,
        gradient: &FrameGradient<f32>,
    ) -> Result<CloudGradient<f32>, GpuError> {
        let n = self.shape.gaussians as usize;
        if cloud.len() != n {
            return Err(GpuError::Size { what: "Gaussians of the drawn cloud", have: cloud.len(), want: n });
        }
        if features.channels != self.channels {
            let have = features.channels;
            return Err(GpuError::Size { what: "extra channels of the drawn cloud", have, want: self.channels });
        }
        let Some(drawn) = &self.drawn else {
            return Ok(unpack(&Packed { degree: cloud.sh_degree, ..Packed::default() }, &[], 0));
        };
        let depth = drawn.settings.depth;
        let planes = if depth { 2 } else { 1 };
        let pixels = pixels_of(&drawn.camera) as usize;
        let gradients = BlendGradients::new(&self.device, n, pixels, self.channels, planes)?;
        let out = Parameters::new(&self.device, "gradient of the cloud", n, self.shape.degree)?;
        self.write_gradient(gradient, &gradients, pixels, depth)?;
        let r = &self.rasterizer;
        for (carried, _) in &r.picture.chunks {
            self.blend_backward.prepare(&self.device, *carried)?;
        }
        let bindings = r.bindings();
        let splats = &r.gaussians.splats;
        let mut recorder = Recorder::new(&self.device, self.timer.as_mut());
        recorder.stage("blend backward", |s| {
            let scratch = (&r.gaussians, &r.pairs, &r.picture);
            self.blend_backward.encode(s, bindings, scratch, &self.features, gradients.buffers(&r.picture));
        });
        recorder.stage("project backward", |s| {
            self.project_backward.encode(s, bindings, &self.cloud, (splats, &gradients.splats), &out);
        });
        recorder.submit();
        if let Some(timer) = &mut self.timer {
            self.times.extend(timer.finish(&self.device)?);
        }
        // Only the gradients of extra channels are read from the splats.
        let stride = GRADIENT_BASE + self.channels;
        let bytes = if self.channels > 0 { (n * stride * 4) as u64 } else { 0 };
        let splat_gradient: Vec<f32> = self.device.read(&[(&gradients.splats, bytes)])?.values(0);
        let packed = out.read(&self.device, n, self.shape.degree)?;
        Ok(unpack(&packed, &splat_gradient, self.channels))
    }

    fn write_gradient(
        &self,
        gradient: &FrameGradient<f32>,
        to: &BlendGradients,
        pixels: usize,
        depth: bool,
    ) -> Result<(), GpuError> {
        let planes = gradient.color.iter().chain(&gradient.features).chain([&gradient.alpha, &gradient.depth]);
        for plane in planes {
            if !plane.is_empty() && plane.len() != pixels {
                return Err(GpuError::Size { what: "pixels of a gradient", have: plane.len(), want: pixels });
            }
        }
        let at = |plane: &[f32], i: usize| plane.get(i).copied().unwrap_or(0.0);
        let [r, g, b] = &gradient.color;
        let mut values: Vec<[f32; 4]> =
            (0..pixels).map(|i| [at(r, i), at(g, i), at(b, i), at(&gradient.alpha, i)]).collect();
        if depth {
            values.extend((0..pixels).map(|i| [at(&gradient.depth, i), 0.0, 0.0, 0.0]));
        }
        self.rasterizer.picture.set_depth_gradient(&self.device, depth);
        self.device.queue().write_buffer(&to.pixels, 0, bytemuck::cast_slice(&values));
        if self.channels > 0 {
            let none = Vec::new();
            let values: Vec<f32> = (0..pixels * self.channels)
                .map(|k| at(gradient.features.get(k % self.channels).unwrap_or(&none), k / self.channels))
                .collect();
            self.device.queue().write_buffer(&to.features, 0, bytemuck::cast_slice(&values));
        }
        Ok(())
    }
}

fn unpack(packed: &Packed, splat_gradient: &[f32], channels: usize) -> CloudGradient<f32> {
    let cloud = packed.to_cloud();
    CloudGradient {
        positions: cloud.positions,
        log_scales: cloud.log_scales,
        quaternions: cloud.quaternions,
        opacity_logits: cloud.opacity_logits,
        sh: cloud.sh,
        features: splat_gradient
            .chunks_exact(GRADIENT_BASE + channels)
            .flat_map(|g| g[GRADIENT_BASE..].iter().copied())
            .collect(),
        screen: packed.pads().map(|s| s.max(0.0)).collect(),
    }
}
