//! Training on the device: a step draws, compares, goes back and moves without the host waiting
//! for its result; sums of the losses are fetched every so many steps.

use std::collections::VecDeque;

use super::adam::{Adam, AdamBuffers};
use super::blend::TileKernel;
use super::blend_backward::{BlendGradients, blend_backward};
use super::cloud::{Packed, Parameters};
use super::kernel::Recorder;
use super::project::CloudShape;
use super::project_backward::ProjectBackward;
use super::rasterizer::GpuRasterizer;
use super::scratch::extent;
use super::ssim::{DevicePhoto, LossSums, RING, Ssim};
use super::timing::{StageTimes, Timer};
use super::{Device, GpuError};
use crate::render::cpu::adam::Rates;
use crate::render::{DensityStats, Frame, RenderSettings};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// Steps queued on the device while it works on one: enough that it never waits for the host, and few enough that other
/// work on it, such as the window's, need not wait for many.
const AHEAD: usize = 2;

/// Settings of a training run.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainerSettings {
    /// Background, near plane and anti-aliasing; degree and depth are set per step.
    pub(crate) render: RenderSettings,
    /// Share of D-SSIM in the loss.
    pub(crate) lambda: f64,
}

impl Default for TrainerSettings {
    fn default() -> Self {
        Self { render: RenderSettings::default(), lambda: 0.2 }
    }
}

/// Measurements of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLoss {
    /// Number of the step, from 1.
    pub step: u64,
    /// Its sums.
    pub sums: LossSums,
    /// The loss.
    pub loss: f64,
}

/// The state of a training run on the device.
#[derive(Debug)]
pub struct GpuTrainer {
    device: Device,
    settings: TrainerSettings,
    /// Color added to photos where they are transparent.
    shift: [f32; 3],
    rasterizer: GpuRasterizer,
    ssim: Ssim,
    blend_backward: TileKernel,
    project_backward: ProjectBackward,
    adam: Adam,
    shape: CloudShape,
    capacity: usize,
    cloud: Parameters,
    gradient: Parameters,
    moments: [Parameters; 2],
    statistics: wgpu::Buffer,
    gradients: BlendGradients,
    gradient_capacity: [usize; 2],
    features: wgpu::Buffer,
    step: u64,
    /// Gaussians at the front of the cloud that stay as they are.
    frozen: u32,
    /// True if a frame of this cloud has counted the pairs it needs.
    sized: bool,
    /// Steps in the ring: number and pixels.
    pending: Vec<(u64, usize)>,
    /// Steps fetched but not asked for yet.
    fetched: Vec<StepLoss>,
    /// Steps submitted to the device and not yet waited for.
    ahead: VecDeque<wgpu::SubmissionIndex>,
    timer: Option<Timer>,
    times: StageTimes,
}

impl GpuTrainer {
    /// Starts a run from `cloud`.
    pub fn new(device: &Device, cloud: &GaussianCloud, settings: TrainerSettings) -> Result<Self, GpuError> {
        let empty = |what| Parameters::new(device, what, 0, 0);
        let mut trainer = Self {
            device: device.clone(),
            settings,
            shift: [0.0; 3],
            rasterizer: GpuRasterizer::new(device)?,
            ssim: Ssim::new(device)?,
            blend_backward: blend_backward(device.has_float_atomics()),
            project_backward: ProjectBackward::new(device)?,
            adam: Adam::new(device)?,
            shape: CloudShape::default(),
            capacity: 0,
            cloud: empty("cloud")?,
            gradient: empty("gradient of the cloud")?,
            moments: [empty("first moments")?, empty("second moments")?],
            statistics: device.storage("density statistics", 0)?,
            gradients: BlendGradients::new(device, 0, 0, 0, 1)?,
            gradient_capacity: [0, 0],
            features: device.storage("features", 0)?,
            step: 0,
            frozen: 0,
            sized: false,
            pending: Vec::new(),
            fetched: Vec::new(),
            ahead: VecDeque::new(),
            timer: None,
            times: StageTimes::new(),
        };
        trainer.blend_backward.prepare(device, 0)?;
        trainer.upload(cloud, None, 0)?;
        Ok(trainer)
    }

    /// Sends a photo to the device.
    pub fn photo(&self, pixels: &PhotoPixels) -> Result<DevicePhoto, GpuError> {
        DevicePhoto::new(&self.device, pixels)
    }

    pub(crate) fn len(&self) -> usize {
        self.shape.gaussians as usize
    }

    /// Keeps the first Gaussians of the cloud as they are.
    pub fn freeze(&mut self, gaussians: usize) {
        self.frozen = gaussians as u32;
    }

    /// Steps done.
    pub fn steps(&self) -> u64 {
        self.step
    }

    /// Replaces the cloud, Adam's first and second moments (laid out like the cloud; `None` =
    /// zero) and the number of steps done. Density statistics start again.
    pub fn upload(
        &mut self,
        cloud: &GaussianCloud,
        moments: Option<[&GaussianCloud; 2]>,
        step: u64,
    ) -> Result<(), GpuError> {
        cloud.validate()?;
        for m in moments.into_iter().flatten() {
            if m.len() != cloud.len() || m.sh_degree != cloud.sh_degree {
                return Err(GpuError::Size { what: "Gaussians of a moment", have: m.len(), want: cloud.len() });
            }
        }
        let (device, n, degree) = (&self.device, cloud.len(), cloud.sh_degree);
        if n > self.capacity || degree != self.shape.degree {
            // Clouds grow a little at a time; room for a quarter more saves most reallocations.
            let make = |capacity: usize| -> Result<_, GpuError> {
                let new = |what| Parameters::new(device, what, capacity, degree);
                let parameters = [new("cloud")?, new("gradient of the cloud")?, new("first moments")?];
                Ok((parameters, new("second moments")?, device.storage("density statistics", capacity as u64 * 8)?))
            };
            let roomy = n + n / 4;
            let (capacity, made) = match make(roomy) {
                Ok(made) => (roomy, made),
                Err(_) => (n, make(n)?),
            };
            let ([cloud, gradient, first], second, statistics) = made;
            (self.cloud, self.gradient, self.moments, self.statistics) = (cloud, gradient, [first, second], statistics);
            self.capacity = capacity;
        }
        self.cloud.write(device, &Packed::of(cloud));
        let mut recorder = Recorder::new(device, None);
        recorder.clear(&self.statistics);
        self.moments.iter().flat_map(|m| &m.buffers).for_each(|b| recorder.clear(b));
        recorder.submit();
        if let Some(moments) = moments {
            for (to, from) in self.moments.iter().zip(moments) {
                to.write(device, &Packed::of(from));
            }
        }
        self.shape = CloudShape { origin: cloud.origin, gaussians: n as u32, degree };
        self.step = step;
        self.sized = false;
        self.device.check()
    }

    /// Sets, from the next step on, the background color, and the color added to photos where they are transparent.
    pub fn set_background(&mut self, background: [f32; 3], shift: [f32; 3]) {
        self.settings.render.background = background;
        self.shift = shift;
    }

    /// One step on one photo, with harmonics up to `sh_degree`. Returns as soon as the work is
    /// handed to the device, except every [`RING`] steps, when losses are fetched.
    pub fn step(&mut self, camera: &Camera, photo: &DevicePhoto, rates: &Rates, sh_degree: u8) -> Result<(), GpuError> {
        let size_px = [camera.width_px, camera.height_px];
        if size_px != photo.size_px {
            let side = |s: [u32; 2]| s[0] as usize * s[1] as usize;
            return Err(GpuError::Size {
                what: "pixels of the photo against its camera",
                have: side(photo.size_px),
                want: side(size_px),
            });
        }
        if self.pending.len() >= RING {
            self.fetch()?;
        }
        let settings = RenderSettings { sh_degree, depth: false, ..self.settings.render.clone() };
        self.make_room(size_px)?;
        self.rasterizer.prepare(&self.device, camera, &settings, self.shape, 0)?;
        if !self.sized {
            self.size_up(camera, &settings)?;
        }
        let shift = photo.has_alpha.then_some(self.shift);
        self.ssim.prepare(&self.device, size_px, self.pending.len(), self.settings.lambda, shift)?;
        let degrees = [self.shape.degree, sh_degree.min(self.shape.degree)];
        let n = self.shape.gaussians;
        self.adam.prepare(&self.device, [n, self.frozen], degrees, rates, self.step + 1);
        let submitted = self.encode_step(photo);
        self.ahead.push_back(submitted);
        if self.ahead.len() > AHEAD {
            self.device.wait_for(self.ahead.pop_front())?;
        }
        if let Some(timer) = &mut self.timer {
            self.times = timer.finish(&self.device)?;
        }
        self.step += 1;
        self.pending.push((self.step, extent(size_px)[0]));
        self.device.check()
    }

    fn encode_step(&mut self, photo: &DevicePhoto) -> wgpu::SubmissionIndex {
        let r = &self.rasterizer;
        let (bindings, splats) = (r.bindings(), &r.gaussians.splats);
        let mut recorder = Recorder::new(&self.device, self.timer.as_mut());
        recorder.clear(&self.gradients.splats);
        recorder.clear(&self.adam.outliers);
        r.encode_count(&mut recorder, &self.cloud);
        r.encode_draw(&mut recorder, &self.features);
        recorder.stage("loss", |s| self.ssim.encode(s, &r.picture.colors, photo, &self.gradients.pixels));
        recorder.stage("blend backward", |s| {
            let scratch = (&r.gaussians, &r.pairs, &r.picture);
            self.blend_backward.encode(s, bindings, scratch, &self.features, self.gradients.buffers(&r.picture));
        });
        recorder.stage("project backward", |s| {
            self.project_backward.encode(s, bindings, &self.cloud, (splats, &self.gradients.splats), &self.gradient);
            self.project_backward.encode_statistics(s, bindings, splats, &self.gradient, &self.statistics);
        });
        recorder.stage("adam", |s| {
            let on = AdamBuffers { parameters: &self.cloud, gradient: &self.gradient, moments: &self.moments };
            self.adam.encode(s, on, bindings.counters, bindings.gaussians, self.shape.degree);
            self.ssim.encode_sums(s, bindings.counters, &self.adam.outliers);
        });
        recorder.submit()
    }

    /// Draws the cloud as it is. Waits for the device.
    pub(crate) fn draw(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<Frame<f32>, GpuError> {
        loop {
            self.rasterizer.prepare(&self.device, camera, settings, self.shape, 0)?;
            let mut recorder = Recorder::new(&self.device, None);
            self.rasterizer.encode_count(&mut recorder, &self.cloud);
            self.rasterizer.encode_draw(&mut recorder, &self.features);
            recorder.submit();
            let (frame, counters) = self.rasterizer.read_frame(&self.device, camera, settings)?;
            if counters.overflow == 0 {
                return Ok(frame);
            }
            self.rasterizer.grow_pairs(&self.device, counters.wanted)?;
        }
    }

    /// Counts the pairs of one frame, so that the first step of a cloud is not lost.
    fn size_up(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<(), GpuError> {
        let mut recorder = Recorder::new(&self.device, None);
        self.rasterizer.encode_count(&mut recorder, &self.cloud);
        recorder.submit();
        let counters = self.rasterizer.read_counters(&self.device)?;
        self.rasterizer.grow_pairs(&self.device, counters.wanted)?;
        self.sized = true;
        self.rasterizer.prepare(&self.device, camera, settings, self.shape, 0)
    }

    fn make_room(&mut self, size_px: [u32; 2]) -> Result<(), GpuError> {
        let [pixels, _] = extent(size_px);
        let [capacity, area] = self.gradient_capacity;
        if capacity < self.capacity || area < pixels {
            let (capacity, area) = (self.capacity, area.max(pixels));
            self.gradients = BlendGradients::new(&self.device, capacity, area, 0, 1)?;
            self.gradient_capacity = [capacity, area];
        }
        Ok(())
    }

    /// Fetches the losses in the ring, and makes room where a frame did not fit.
    fn fetch(&mut self) -> Result<(), GpuError> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let pixels: Vec<usize> = self.pending.iter().map(|p| p.1).collect();
        let sums = self.ssim.read(&self.device, &pixels)?;
        let wanted = sums.iter().filter(|s| s.overflow).map(|s| s.wanted).max();
        let lambda = self.settings.lambda;
        let steps = self.pending.drain(..).zip(sums);
        self.fetched.extend(steps.map(|((step, _), sums)| StepLoss { step, sums, loss: sums.total(lambda) }));
        match wanted {
            Some(wanted) => self.rasterizer.grow_pairs(&self.device, wanted),
            None => Ok(()),
        }
    }

    /// Losses of the steps since the last call, in order. Waits for the device.
    pub fn metrics(&mut self) -> Result<Vec<StepLoss>, GpuError> {
        self.fetch()?;
        Ok(std::mem::take(&mut self.fetched))
    }

    /// Statistics for density control since the cloud was uploaded. Waits for the device.
    pub fn stats(&self) -> Result<DensityStats, GpuError> {
        let rows: Vec<[f32; 2]> = self.device.read(&[(&self.statistics, self.len() as u64 * 8)])?.values(0);
        Ok(DensityStats {
            gradient: rows.iter().map(|r| r[0]).collect(),
            seen: rows.iter().map(|r| r[1] as u32).collect(),
        })
    }

    /// The cloud as it is. Waits for the device.
    pub fn cloud(&self) -> Result<GaussianCloud, GpuError> {
        let packed = self.cloud.read(&self.device, self.len(), self.shape.degree)?;
        Ok(GaussianCloud { origin: self.shape.origin, ..packed.to_cloud() })
    }

    /// The cloud and Adam's first and second moments, laid out like it. Waits for the device.
    pub fn download(&self) -> Result<(GaussianCloud, [GaussianCloud; 2]), GpuError> {
        let moment = |m: &Parameters| -> Result<GaussianCloud, GpuError> {
            let packed = m.read(&self.device, self.len(), self.shape.degree)?;
            Ok(GaussianCloud { origin: self.shape.origin, ..packed.to_cloud() })
        };
        let [first, second] = &self.moments;
        Ok((self.cloud()?, [moment(first)?, moment(second)?]))
    }

    /// Times the stages of every later step, where the device can; steps then wait for it.
    pub(crate) fn measure(&mut self) -> Result<(), GpuError> {
        self.timer = Timer::new(&self.device)?;
        Ok(())
    }

    /// Seconds per stage of the last step; empty unless measured.
    pub(crate) fn times(&self) -> &StageTimes {
        &self.times
    }
}
