//! Training state on a GPU: cloud, moments, statistics and photos stay there from step to step; the host downloads
//! them on request.

use super::TrainView;
use crate::render::{
    DensityStats, Device, DevicePhoto, Frame, GpuError, GpuTrainer, Rates, RenderSettings, StepLoss, TrainerSettings,
};
use crate::scene::{Camera, GaussianCloud};

/// Weight of D-SSIM in the loss.
pub(crate) const LAMBDA: f64 = 0.2;

/// Measurements of one training step.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepResult {
    /// Loss of the photo before the step.
    pub(crate) loss: f64,
    /// PSNR of the photo before the step, dB.
    pub(crate) psnr: f64,
    /// Gaussians that were not updated, because their gradient was not finite.
    pub(crate) skipped: usize,
    /// Gradients that were clipped because they were far above the earlier ones of their parameter.
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

    /// Keeps the first Gaussians of the cloud as they are.
    pub(crate) fn freeze(&mut self, gaussians: usize) {
        self.trainer.freeze(gaussians);
    }

    pub(crate) fn upload(
        &mut self,
        cloud: &GaussianCloud,
        moments: &[GaussianCloud; 2],
        step: u64,
    ) -> Result<(), GpuError> {
        self.trainer.upload(cloud, Some([&moments[0], &moments[1]]), step)
    }

    /// Runs one step on photo `i` with the camera of `view`, SH up to a degree, a background color, and its difference
    /// to the stored one for a photo with transparency. Does not wait for the device.
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

    /// Results of the steps since the last call. Steps that did not fit into the device's buffers, which have been
    /// enlarged since, updated nothing and are left out. Waits for the device.
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

    /// Renders the present cloud. Waits for the device.
    pub(crate) fn draw(&mut self, camera: &Camera, settings: &RenderSettings) -> Result<Frame<f32>, GpuError> {
        self.trainer.draw(camera, settings)
    }

    /// Downloads the present cloud. Waits for the device.
    pub(crate) fn cloud(&self) -> Result<GaussianCloud, GpuError> {
        self.trainer.cloud()
    }

    /// Downloads cloud, moments, and statistics since the last upload. Waits for the device.
    pub(crate) fn download(&self) -> Result<(GaussianCloud, [GaussianCloud; 2], DensityStats), GpuError> {
        let (cloud, moments) = self.trainer.download()?;
        Ok((cloud, moments, self.trainer.stats()?))
    }
}
