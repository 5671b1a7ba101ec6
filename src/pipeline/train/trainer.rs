//! State of a run and its training step: render, loss, backward pass, update; on the CPU or on a device.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::density::{self, DensityReport, DensityRound, DensityStats};
use super::device::{DeviceRun, LAMBDA, StepResult};
use super::geometry::GeometryLoss;
use super::optimizer::{StepStats, Update};
use super::photo_fits::{FitStep, PhotoFits};
use super::refine::{self, Refinement};
use super::schedule::Schedule;
use super::{TrainConfig, TrainView};
use crate::math::finite::{CHECKED, NotFinite, all_finite};
use crate::math::sh;
use crate::math::stats::psnr_of;
use crate::pipeline::metrics;
use crate::render::{
    Device, DifferentiableRenderer, Features, Frame, FrameGradient, GpuError, LossParts, PhotoLoss, RenderError,
    RenderSettings, normals, validate,
};
use crate::scene::{Camera, GaussianCloud};

/// Steps between measurements that are reported.
pub(crate) const REPORT_STEPS: u64 = 10;

/// Reasons for which a step failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum StepError {
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A stage left a value that is not finite; checked under `debug-validation` only.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
}

/// State of a training run. Deterministic on the CPU: the same state and photos give the same next state, whatever
/// the number of threads.
pub struct Trainer {
    /// The Gaussians. While a GPU trains, `cloud`, `moments` and `stats` are those of the last [`Self::fetch`].
    pub cloud: GaussianCloud,
    /// First and second moments of Adam, laid out like the cloud.
    pub moments: [GaussianCloud; 2],
    /// Statistics for density control.
    pub(crate) stats: DensityStats,
    /// Rates and milestones.
    pub schedule: Schedule,
    /// Random number generator.
    pub(crate) rng: Pcg64Mcg,
    /// Photos left in this round, in reverse order.
    pub(crate) round: Vec<u32>,
    /// Number of steps done.
    pub step: u64,
    pub(crate) budget: usize,
    /// Training that this one refines, if it does.
    pub(crate) refinement: Option<Refinement>,
    /// Turns of each photo in a round of a refinement.
    pub(crate) turns: Vec<u32>,
    settings: RenderSettings,
    /// Seed of the background color of each step.
    seed: u64,
    /// True if the background of the photos is unknown, so that each step has a random one. Otherwise black regions
    /// would stay empty, because empty space looks the same.
    unknown_backdrop: bool,
    densify: bool,
    renderer: DifferentiableRenderer,
    losses: [PhotoLoss<f32>; 3],
    gradient: FrameGradient<f32>,
    geometry: GeometryLoss,
    /// Poses and exposures that are learned.
    pub(crate) fits: PhotoFits,
    device: Option<DeviceRun>,
}

impl Trainer {
    /// Initial state of a run.
    pub fn new(cloud: GaussianCloud, config: &TrainConfig, background: [f32; 3], extent: f64, rng: Pcg64Mcg) -> Self {
        let zero = zeros_like(&cloud);
        Self {
            stats: DensityStats::new(cloud.len()),
            moments: [zero.clone(), zero],
            schedule: Schedule::new(config, extent),
            rng,
            round: Vec::new(),
            step: 0,
            budget: config.max_gaussians.unwrap_or(usize::MAX),
            refinement: None,
            turns: Vec::new(),
            settings: config.render_settings(Some(background), extent),
            seed: config.seed,
            unknown_backdrop: false,
            densify: config.densify,
            renderer: DifferentiableRenderer::new(),
            losses: Default::default(),
            gradient: FrameGradient::default(),
            geometry: GeometryLoss::new(config, extent),
            fits: PhotoFits::default(),
            device: None,
            cloud,
        }
    }

    /// Switches to a random background color in each step, determined by the seed and the step.
    pub(crate) fn before_random_colors(&mut self) {
        self.unknown_backdrop = true;
    }

    /// Background color of this step, and its difference to the stored one for a photo with transparency. With one
    /// color alone, fog of that color would be invisible.
    fn backdrop(&self, view: &TrainView) -> ([f32; 3], [f32; 3]) {
        let usual = self.settings.background;
        let cut_out = view.pixels.alpha.is_some();
        if !cut_out && !self.unknown_backdrop {
            return (usual, [0.0; 3]);
        }
        let color: [f32; 3] = Pcg64Mcg::seed_from_u64(self.seed ^ self.step).random();
        (color, if cut_out { std::array::from_fn(|c| color[c] - usual[c]) } else { [0.0; 3] })
    }

    /// Number of Gaussians at the front of the cloud that stay as they are.
    fn frozen(&self) -> usize {
        self.refinement.as_ref().map_or(0, |r| r.frozen)
    }

    pub(crate) fn move_to(&mut self, device: &Device, views: &[TrainView]) -> Result<(), GpuError> {
        let step = self.schedule.done(self.step);
        let mut device = DeviceRun::new(device, &self.cloud, &self.moments, step, self.settings.clone(), views)?;
        device.freeze(self.frozen());
        self.device = Some(device);
        Ok(())
    }

    /// Copies cloud, moments and statistics from the GPU, if one trains.
    pub(crate) fn fetch(&mut self) -> Result<(), GpuError> {
        if let Some(device) = &self.device {
            (self.cloud, self.moments, self.stats) = device.download()?;
        }
        Ok(())
    }

    /// Copies the cloud from the GPU, if one trains.
    pub(crate) fn fetch_cloud(&mut self) -> Result<(), GpuError> {
        if let Some(device) = &self.device {
            self.cloud = GaussianCloud { render_mode: self.cloud.render_mode, ..device.cloud()? };
        }
        Ok(())
    }

    fn send(&mut self) -> Result<(), GpuError> {
        match &mut self.device {
            Some(device) => device.upload(&self.cloud, &self.moments, self.schedule.done(self.step)),
            None => Ok(()),
        }
    }

    /// Settings for rendering the cloud.
    pub(crate) fn render_settings(&self) -> RenderSettings {
        RenderSettings { sh_degree: self.cloud.sh_degree, ..self.settings.clone() }
    }

    /// Renders the present Gaussians on the training device, or on the CPU if the GPU fails to.
    pub(crate) fn draw(&mut self, camera: &Camera) -> Result<Frame<f32>, StepError> {
        let settings = self.render_settings();
        if let Some(device) = &mut self.device {
            match device.draw(camera, &settings) {
                Ok(frame) => return Ok(frame),
                Err(_) => self.fetch_cloud()?,
            }
        }
        Ok(self.renderer.render(&self.cloud, Features::NONE, camera, &settings)?)
    }

    /// Runs one step on the next photo of the round. Returns new results: of this step on the CPU; on a GPU none, or,
    /// every `REPORT_STEPS` steps, those since the last ones.
    pub fn advance(&mut self, views: &[TrainView]) -> Result<Vec<StepResult>, StepError> {
        if self.round.is_empty() {
            self.round = refine::round(views.len(), &self.turns);
            self.round.shuffle(&mut self.rng);
        }
        let next = self.round.pop().map(|i| i as usize);
        let Some((i, view)) = next.and_then(|i| Some((i, views.get(i)?))) else { return Ok(Vec::new()) };
        self.settings.sh_degree = self.schedule.sh_degree(self.step);
        let (background, shift) = self.backdrop(view);
        if let Some(device) = &mut self.device {
            device.step(i, view, &self.schedule.rates(self.step), self.settings.sh_degree, [background, shift])?;
            self.step += 1;
            return Ok(if self.step % REPORT_STEPS == 0 { device.results()? } else { Vec::new() });
        }
        let at = FitStep { photo: i, step: self.step, background };
        let camera = &*self.fits.camera(i, &view.camera);
        let geometry = self.geometry.counts(self.step);
        let settings = RenderSettings { depth: geometry || self.fits.moves(at), background, ..self.settings.clone() };
        let features = self.geometry.features(&self.cloud, camera, self.step);
        let mut frame = self.renderer.render(&self.cloud, features, camera, &settings)?;
        if geometry {
            self.geometry.compare(&frame, camera, self.step, &mut self.gradient);
        } else {
            self.gradient.alpha.clear();
        }
        let colors = self.fits.colors(at, &frame).unwrap_or_else(|| std::mem::take(&mut frame.color));
        let parts = self.compare(colors, view, shift);
        self.fits.learn_exposure(at, &frame, &mut self.gradient);
        self.renderer.backward_tiles(&self.gradient);
        if CHECKED {
            all_finite("the loss", "part", &[parts.l1, parts.ssim, parts.mse])?;
            let mut planes = self.gradient.color.iter();
            planes.try_for_each(|p| all_finite("the loss", "the gradient of pixel", p))?;
            self.renderer.check_backward()?;
        }
        self.fits.learn_pose(at, camera, &frame, &self.renderer, &self.cloud);
        let update = self.update(camera);
        let StepStats { skipped, outliers, first } =
            update.apply(&self.renderer, &mut self.cloud, &mut self.moments, &mut self.stats);
        self.step += 1;
        if CHECKED {
            let bad = |index| NotFinite { stage: "projection backward", field: "the gradient of Gaussian", index };
            first.map_or(Ok(()), |i| Err(bad(i)))?;
            self.check("Adam")?;
        }
        Ok(vec![StepResult { loss: parts.total(LAMBDA), psnr: psnr_of(parts.mse), skipped, outliers }])
    }

    /// Runs density control and the opacity reset when due. Returns a report.
    pub(crate) fn control_density(&mut self) -> Result<Option<DensityReport>, StepError> {
        let (densifies, resets) = (self.schedule.densifies(self.step), self.schedule.resets(self.step));
        if !self.densify || !(densifies || resets) {
            return Ok(None);
        }
        self.fetch()?;
        let mut report = None;
        if densifies {
            let (rounds, frozen) = (self.schedule.rounds_left(self.step), self.frozen());
            let round = DensityRound { budget: self.budget, rounds, frozen };
            let (cloud, moments) = (&mut self.cloud, &mut self.moments);
            report = Some(density::control(cloud, moments, &self.stats, &round, &mut self.rng));
            self.stats = DensityStats::new(self.cloud.len());
        }
        if resets {
            density::reset_opacity(&mut self.cloud, &mut self.moments);
        }
        self.check("densification")?;
        self.send()?;
        Ok(report)
    }

    /// Checks that cloud and moments are finite after a stage, under `debug-validation`.
    fn check(&self, stage: &'static str) -> Result<(), NotFinite> {
        if CHECKED {
            validate::cloud(stage, &self.cloud)?;
            self.moments.iter().try_for_each(|m| validate::cloud(stage, m))?;
        }
        Ok(())
    }

    /// Replaces the cloud with an earlier one, clears the moments and halves the learning rates.
    pub(crate) fn roll_back(&mut self, cloud: GaussianCloud) -> Result<(), GpuError> {
        let zero = zeros_like(&cloud);
        self.stats = DensityStats::new(cloud.len());
        self.moments = [zero.clone(), zero];
        self.cloud = cloud;
        self.schedule.damping *= 0.5;
        self.send()
    }

    /// Fills the image gradient and returns the loss. `shift` changes the background color of a photo with
    /// transparency.
    fn compare(&mut self, mut rendered: [Vec<f32>; 3], view: &TrainView, shift: [f32; 3]) -> LossParts {
        let target = metrics::planes_before::<f32>(&view.pixels, shift);
        let coverage = view.pixels.coverage.as_deref();
        if let Some(coverage) = coverage {
            for (plane, want) in rendered.iter_mut().zip(&target) {
                for ((r, t), c) in plane.iter_mut().zip(want).zip(coverage) {
                    let share = f32::from(*c) / 255.0;
                    *r = *t + share * (*r - *t);
                }
            }
        }
        self.fits.weigh(&rendered, &target, coverage);
        let width = view.camera.width_px as usize;
        let mut sum = LossParts::default();
        for c in 0..3 {
            let gradient = &mut self.gradient.color[c];
            gradient.resize(rendered[c].len(), 0.0);
            let parts = self.losses[c].channel(&rendered[c], &target[c], width, LAMBDA, 3, gradient);
            sum.l1 += parts.l1 / 3.0;
            sum.ssim += parts.ssim / 3.0;
            sum.mse += parts.mse / 3.0;
            if let Some(coverage) = coverage {
                gradient.iter_mut().zip(coverage).for_each(|(g, c)| *g *= f32::from(*c) / 255.0);
            }
        }
        sum
    }

    fn update(&self, camera: &Camera) -> Update {
        Update {
            rates: self.schedule.rates(self.step),
            adam: self.schedule.adam(self.step),
            stride: self.cloud.sh_stride(),
            frozen: self.frozen(),
            active: sh::coefficients(self.settings.sh_degree.min(self.cloud.sh_degree)),
            eye: self.geometry.draws_normals(self.step).then(|| normals::eye(camera, &self.cloud)),
        }
    }
}

/// Cloud of the same shape with every parameter zero.
fn zeros_like(cloud: &GaussianCloud) -> GaussianCloud {
    GaussianCloud {
        origin: cloud.origin,
        positions: vec![[0.0; 3]; cloud.len()],
        log_scales: vec![[0.0; 3]; cloud.len()],
        quaternions: vec![[0.0; 4]; cloud.len()],
        opacity_logits: vec![0.0; cloud.len()],
        sh_degree: cloud.sh_degree,
        sh: vec![[0.0; 3]; cloud.sh.len()],
        ..GaussianCloud::default()
    }
}
