//! The part of a run's state that lives on a GPU: cloud, moments, statistics and photos stay
//! there from step to step; the host sees them when it asks.

use super::TrainView;
use crate::render::{
    DensityStats, Device, DevicePhoto, Frame, GpuError, GpuTrainer, Rates, RenderSettings, StepLoss, TrainerSettings,
};
use crate::scene::{Camera, GaussianCloud};

/// Weight of D-SSIM in the loss.
pub(crate) const LAMBDA: f64 = 0.2;

/// What one step measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepResult {
    /// Loss of the photo before the step.
    pub(crate) loss: f64,
    /// PSNR of the photo before the step, dB.
    pub(crate) psnr: f64,
    /// Gaussians whose gradient was not finite and that were left as they are.
    pub(crate) skipped: usize,
    /// Gradients that were cut because they were far above what their parameters had seen.
    pub(crate) outliers: usize,
}

pub(crate) struct DeviceRun {
    trainer: GpuTrainer,
    photos: Vec<DevicePhoto>,
}

impl DeviceRun {
    /// Sends a run's state and photos to the device.
    pub(crate) fn new(
        device: &Device,
        cloud: &GaussianCloud,
        moments: &[GaussianCloud; 2],
        step: u64,
        render: RenderSettings,
        views: &[TrainView],
    ) -> Result<Self, GpuError> {
        let settings = TrainerSettings { render, lambda: LAMBDA };
        let mut trainer = GpuTrainer::new(device, cloud, settings)?;
        trainer.upload(cloud, Some([&moments[0], &moments[1]]), step)?;
        let photos = views.iter().map(|v| trainer.photo(&v.pixels)).collect::<Result<_, _>>()?;
        Ok(Self { trainer, photos })
    }

    pub(crate) fn upload(
        &mut self,
        cloud: &GaussianCloud,
        moments: &[GaussianCloud; 2],
        step: u64,
    ) -> Result<(), GpuError> {
        self.trainer.upload(cloud, Some([&moments[0], &moments[1]]), step)
    }

    /// One step on photo `i`, which `view` is of, with harmonics up to a degree, in front of a color, and with what
    /// that changes where the photo is transparent. Does not wait for the device.
    pub(crate) fn step(
        &mut self,
        i: usize,
        view: &TrainView,
        rates: &Rates,
        sh_degree: u8,
        [background, shift]: [[f32; 3]; 2],
    ) -> Result<(), GpuError> {
        let Some(photo) = self.photos.get(i) else { return Ok(()) };
        self.trainer.set_background(background, shift);
        self.trainer.step(&view.camera, photo, rates, sh_degree)
    }

    /// What the steps since the last call measured; steps that did not fit into the device's
    /// buffers, which have been enlarged since, moved nothing and are left out. Waits.
    pub(crate) fn results(&mut self) -> Result<Vec<StepResult>, GpuError> {
        let done = self.trainer.metrics()?;
        let result = |s: &StepLoss| StepResult {
            loss: s.loss,
            psnr: s.sums.psnr(),
            skipped: s.sums.bad_gradients as usize,
            outliers: s.sums.outliers as usize,
        };
        Ok(done.iter().filter(|s| !s.sums.overflow).map(result).collect())
    }

    /// A view of the cloud as it is. Waits.
    pub(crate) fn draw(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<Frame<f32>, GpuError> {
        self.trainer.draw(camera, settings)
    }

    /// The cloud as it is. Waits.
    pub(crate) fn cloud(&self) -> Result<GaussianCloud, GpuError> {
        self.trainer.cloud()
    }

    /// Cloud, moments, and statistics since the last upload. Waits.
    pub(crate) fn download(&self) -> Result<(GaussianCloud, [GaussianCloud; 2], DensityStats), GpuError> {
        let (cloud, moments) = self.trainer.download()?;
        Ok((cloud, moments, self.trainer.stats()?))
    }
}
