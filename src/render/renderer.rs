//! The renderer that the rest of the program uses: the GPU where there is a real one, else the CPU.

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use super::cpu::labels::{self, LabelWinner, PixelWeights};
use super::cpu::view_weights::ViewWeights;
use super::gpu::{self, Device, DevicePicture, GpuError};
use super::lod::Cut;
use super::{ContributionSink, Features, Frame, RenderError, RenderSettings, RenderStats, StageTimes, cpu};
use crate::scene::{Camera, GaussianCloud};

/// Renderer that is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum BackendChoice {
    /// The GPU if the machine has a real one, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The GPU, even a software one.
    Gpu,
}

impl BackendChoice {
    /// GPU to use; `None` = the CPU. `Auto` takes a GPU only if it is a real one: the CPU renderer is faster than an
    /// emulated GPU. `on_warning` receives the reason if one that exists is not used.
    pub(crate) fn gpu(self, on_warning: impl FnOnce(String)) -> Result<Option<Device>, GpuError> {
        match self {
            Self::Cpu => Ok(None),
            Self::Gpu => Device::shared().map(Some),
            Self::Auto => Ok(or_warn(Device::shared_real(), on_warning).flatten()),
        }
    }
}

/// Result of a GPU; on an error `None`, with the fallback to the CPU reported to `on_warning`.
fn or_warn<T>(given: Result<T, GpuError>, on_warning: impl FnOnce(String)) -> Option<T> {
    given.map_err(|e| on_warning(instead_of_gpu(&e))).ok()
}

/// Warning that the CPU does a GPU's work, with the reason.
pub fn instead_of_gpu(why: &impl std::fmt::Display) -> String {
    format!("The CPU does the work of the GPU, which failed: {why}")
}

/// Error of a view that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum DrawError {
    #[error(transparent)]
    Cpu(#[from] RenderError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Stages of a picture on the CPU, as they are timed.
const STAGES: [&str; 4] = ["project", "sort", "bin", "blend"];

/// Seconds of a picture: the part that every Gaussian has at any size, and that of the pixels.
#[derive(Clone, Copy, Debug)]
pub struct FrameCost {
    /// For every Gaussian, whatever the picture's size.
    pub(crate) fixed_secs: f64,
    /// For the pixels.
    pub(crate) pixels_secs: f64,
}

/// A renderer with its buffers, to be kept from frame to frame: a chosen GPU draws the pictures and finds the labels of
/// their pixels; the CPU does everything else.
pub struct Renderer {
    cpu: cpu::CpuRenderer<f32>,
    gpu: Option<Box<Gpu>>,
}

/// Renderer with a backward pass, for training on the CPU.
pub type DifferentiableRenderer = cpu::CpuRenderer<f32>;

/// The GPU renderer and the cloud that it holds.
struct Gpu {
    renderer: gpu::GpuRenderer,
    name: String,
    uploaded: Weak<GaussianCloud>,
    /// Degree of the harmonics that were sent.
    degree: u8,
    timed: bool,
}

impl Default for Renderer {
    fn default() -> Self {
        Self { cpu: cpu::CpuRenderer::forward_only(), gpu: None }
    }
}

impl Renderer {
    /// Name of the CPU as a renderer.
    pub(crate) const CPU: &str = "CPU";

    /// The CPU.
    pub fn new() -> Self {
        Self::default()
    }

    /// Renderer that `choice` asks for. `on_warning` receives the reason if a GPU that exists is not used.
    pub fn choose(choice: BackendChoice, mut on_warning: impl FnMut(String)) -> Result<Self, GpuError> {
        match choice.gpu(&mut on_warning)? {
            None => Ok(Self::new()),
            Some(device) if choice == BackendChoice::Auto => {
                Ok(or_warn(Self::on_gpu(&device), on_warning).unwrap_or_default())
            }
            Some(device) => Self::on_gpu(&device),
        }
    }

    /// This GPU, whether real or emulated.
    pub fn on_gpu(device: &Device) -> Result<Self, GpuError> {
        let renderer = gpu::GpuRenderer::new(device)?;
        let name = device.info().name.clone();
        let gpu = Gpu { renderer, name, uploaded: Weak::new(), degree: 0, timed: false };
        Ok(Self { cpu: cpu::CpuRenderer::forward_only(), gpu: Some(Box::new(gpu)) })
    }

    /// Returns whether a GPU draws the pictures.
    pub fn is_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// Name of the renderer's device, for display.
    pub(crate) fn name(&self) -> &str {
        self.gpu.as_ref().map_or(Self::CPU, |gpu| &gpu.name)
    }

    /// Draws a cloud; it is sent to the GPU only if it is another one than last time.
    pub fn draw(
        &mut self,
        cloud: &Arc<GaussianCloud>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<f32>, DrawError> {
        match self.holding(cloud, camera, settings)? {
            Some(gpu) => Ok(gpu.renderer.draw(camera, settings)?),
            None => Ok(self.render(cloud, Features::NONE, camera, settings)?),
        }
    }

    /// Redraws the uploaded cloud on a GPU and leaves the picture there; returns before it is drawn. For measurements.
    pub(crate) fn draw_on_device(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<(), DrawError> {
        self.gpu.as_mut().map_or(Ok(()), |gpu| Ok(gpu.renderer.draw_on_device(camera, settings)?))
    }

    /// The GPU, if there is one, with this cloud on it.
    fn holding(
        &mut self,
        cloud: &Arc<GaussianCloud>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Option<&mut Gpu>, DrawError> {
        let Some(gpu) = &mut self.gpu else { return Ok(None) };
        camera.validate().map_err(RenderError::from)?;
        // Bands that are not drawn are not sent.
        let degree = settings.sh_degree.min(cloud.sh_degree);
        if gpu.uploaded.as_ptr() != Arc::as_ptr(cloud) || gpu.degree < degree {
            gpu.uploaded = Weak::new();
            gpu.renderer.upload_bands(cloud, Features::NONE, degree)?;
            // A weak handle keeps the address from being given to another cloud.
            (gpu.uploaded, gpu.degree) = (Arc::downgrade(cloud), degree);
        }
        Ok(Some(gpu))
    }

    /// The colors alone of what [`Self::draw`] draws, as [`Frame::to_rgb8`]: less to copy from a GPU.
    pub fn draw_rgb8(
        &mut self,
        cloud: &Arc<GaussianCloud>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<[u8; 3]>, DrawError> {
        match self.holding(cloud, camera, settings)? {
            Some(gpu) => Ok(gpu.renderer.draw_rgb8(camera, settings)?),
            None => Ok(self.render(cloud, Features::NONE, camera, settings)?.to_rgb8()),
        }
    }

    /// As [`Self::draw_rgb8`] where a GPU draws, but the colors stay there; `None` on the CPU.
    pub(crate) fn draw_texture(
        &mut self,
        cloud: &Arc<GaussianCloud>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Option<DevicePicture>, DrawError> {
        let gpu = self.holding(cloud, camera, settings)?;
        Ok(gpu.map(|gpu| gpu.renderer.draw_texture(camera, settings)).transpose()?)
    }

    /// The label that wins each pixel, row-major: `of` has one for each Gaussian of `cloud`, `groups` the group of each
    /// label. A GPU finds them for the cloud that it drew last.
    ///
    /// # Panics
    /// If there are not as many labels as Gaussians.
    pub fn label_winners(
        &mut self,
        cloud: &GaussianCloud,
        (of, groups): (&[u32], &[u32]),
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<LabelWinner>, DrawError> {
        assert_eq!(of.len(), cloud.len(), "one label for each Gaussian");
        if let Some(gpu) = self.gpu.as_mut().filter(|gpu| std::ptr::eq(gpu.uploaded.as_ptr(), cloud)) {
            return Ok(gpu.renderer.label_winners((of, groups), camera, settings)?);
        }
        Ok(labels::label_winners(&mut self.weights(cloud, camera, settings), (of, groups))?)
    }

    /// The labels of largest weight at each pixel, row-major, on the CPU; `of` has a label for each Gaussian of
    /// `cloud`.
    pub(crate) fn label_weights(
        &mut self,
        cloud: &GaussianCloud,
        of: &[u32],
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<PixelWeights>, RenderError> {
        labels::label_weights(&mut self.weights(cloud, camera, settings), of)
    }

    /// Draws a cloud with values of its Gaussians composited like colors, on the CPU.
    pub fn render(
        &mut self,
        cloud: &GaussianCloud,
        features: Features<'_, f32>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<f32>, RenderError> {
        self.cpu.render(cloud, features, camera, settings)
    }

    /// The weights of Gaussians in a view, on the CPU. Surfels count as flat Gaussians.
    pub(crate) fn weights<'a>(
        &'a mut self,
        cloud: &'a GaussianCloud,
        camera: &'a Camera,
        settings: &'a RenderSettings,
    ) -> ViewWeights<'a> {
        ViewWeights::drawn(&mut self.cpu, cloud, camera, settings, false)
    }

    /// The same of the view that [`Self::render`] has just drawn, seen alike: the first pass, too, projects nothing.
    pub(crate) fn weights_of_picture<'a>(
        &'a mut self,
        cloud: &'a GaussianCloud,
        camera: &'a Camera,
        settings: &'a RenderSettings,
    ) -> ViewWeights<'a> {
        ViewWeights::drawn(&mut self.cpu, cloud, camera, settings, true)
    }

    /// Hands the weight of every Gaussian at every pixel of a view to `sinks`, one for each row of
    /// tiles, which are `height.div_ceil(TILE_PX)`; on the CPU. Surfels count as flat Gaussians.
    pub(crate) fn contributions<S: ContributionSink<f32>>(
        &mut self,
        cloud: &GaussianCloud,
        camera: &Camera,
        settings: &RenderSettings,
        sinks: &mut [S],
    ) -> Result<(), RenderError> {
        self.cpu.contributions(cloud, camera, settings, sinks)
    }

    /// Limits later pictures to the cut, for clouds that it fits and where the CPU draws; `None` draws all.
    pub(crate) fn limit_to(&mut self, cut: Option<Arc<Cut>>) {
        self.cpu.limit_to(cut);
    }

    /// Cost of the last frame of [`Self::render`].
    pub(crate) fn stats(&self) -> RenderStats {
        self.cpu.stats()
    }

    /// Bytes of working memory on the CPU that are kept for the next frame.
    pub fn working_bytes(&self) -> usize {
        self.cpu.working_bytes()
    }

    /// Frees working memory that the next picture can make again: all of it on the CPU; a device keeps its own, which
    /// no other program part needs.
    pub fn release_buffers(&mut self) {
        self.cpu = cpu::CpuRenderer::forward_only();
    }

    /// Bytes of buffers on the device; 0 on the CPU.
    pub fn device_bytes(&self) -> u64 {
        self.gpu.as_ref().map_or(0, |gpu| gpu.renderer.device_bytes())
    }

    /// Sets whether the stages of later pictures are timed. The CPU always times them; a GPU does if asked to and able
    /// to.
    pub fn time_stages(&mut self, timed: bool) -> Result<(), GpuError> {
        let Some(gpu) = &mut self.gpu else { return Ok(()) };
        if std::mem::replace(&mut gpu.timed, timed) != timed {
            match timed {
                true => gpu.renderer.measure()?,
                false => gpu.renderer.stop_measuring(),
            }
        }
        Ok(())
    }

    /// Seconds of the last picture by stage; empty where that is not known.
    pub fn stage_times(&self) -> StageTimes {
        match &self.gpu {
            None => STAGES.into_iter().zip(self.cpu.stats().stage_secs).collect(),
            Some(gpu) => gpu.renderer.times().clone(),
        }
    }

    /// Cost of the last picture, `secs` in all.
    pub(crate) fn cost(&self, secs: f64) -> FrameCost {
        if self.is_gpu() {
            return FrameCost { fixed_secs: 0.0, pixels_secs: secs };
        }
        let [project, sort, bin, blend] = self.cpu.stats().stage_secs;
        FrameCost { fixed_secs: project + sort, pixels_secs: bin + blend }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gpu_that_fails_is_told() {
        let mut heard = Vec::new();
        let lost: Result<(), GpuError> = Err(GpuError::Lost("unplugged".into()));
        assert_eq!(or_warn(lost, |why| heard.push(why)), None);
        assert!(heard[0].contains("CPU") && heard[0].contains("unplugged"), "{heard:?}");
        assert_eq!(or_warn(Ok(3), |why| heard.push(why)), Some(3));
        assert_eq!(heard.len(), 1);
    }
}
