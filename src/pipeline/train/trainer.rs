//! The state of a run and its single step: draw, compare, go back, move; on the CPU, or handed to
//! a device.

use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::density::{self, DensityReport, DensityStats};
use super::device::{DeviceRun, LAMBDA, StepResult};
use super::geometry::Geometry;
use super::schedule::Schedule;
use super::{TrainConfig, TrainView};
use crate::math::finite::{CHECKED, NotFinite, all_finite};
use crate::math::sh;
use crate::math::stats::psnr_of;
use crate::pipeline::metrics;
use crate::render::{
    AdamStep, Device, DifferentiableRenderer, FrameGradient, GpuError, LossParts, PhotoLoss, Rates, RenderError,
    RenderSettings, normals, validate,
};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Steps between measurements that are reported.
pub(crate) const REPORT_STEPS: u64 = 10;
/// Gaussians that one task updates.
const BLOCK: usize = 512;

/// Why a step failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum StepError {
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A stage left a number that is none; looked for under `debug-validation` only.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
}

/// Everything that a step reads and writes. Deterministic on the CPU: the same state and photos
/// give the same next state, whatever the number of threads.
pub struct Trainer {
    /// The Gaussians. While a GPU trains, `cloud`, `moments` and `stats` are those of the last
    /// [`Self::fetch`].
    pub cloud: GaussianCloud,
    /// Adam's first and second moments, laid out like the cloud.
    pub moments: [GaussianCloud; 2],
    /// Input of density control.
    pub(crate) stats: DensityStats,
    /// Rates and milestones.
    pub schedule: Schedule,
    /// Source of all randomness.
    pub(crate) rng: Pcg64Mcg,
    /// Photos left in this round, in reverse order.
    pub(crate) round: Vec<u32>,
    /// Steps done.
    pub step: u64,
    /// Size of the scene that thresholds scale with.
    pub(crate) extent: f64,
    pub(crate) budget: usize,
    settings: RenderSettings,
    densify: bool,
    renderer: DifferentiableRenderer,
    losses: [PhotoLoss<f32>; 3],
    gradient: FrameGradient<f32>,
    geometry: Geometry,
    device: Option<DeviceRun>,
}

impl Trainer {
    /// A run's first state.
    pub fn new(cloud: GaussianCloud, config: &TrainConfig, background: [f32; 3], extent: f64, rng: Pcg64Mcg) -> Self {
        let zero = zeros_like(&cloud);
        Self {
            stats: DensityStats::new(cloud.len()),
            moments: [zero.clone(), zero],
            schedule: Schedule::new(config, extent),
            rng,
            round: Vec::new(),
            step: 0,
            extent,
            budget: config.max_gaussians.unwrap_or(usize::MAX),
            settings: config.render_settings(Some(background)),
            densify: config.densify,
            renderer: DifferentiableRenderer::new(),
            losses: Default::default(),
            gradient: FrameGradient::default(),
            geometry: Geometry::new(config, extent),
            device: None,
            cloud,
        }
    }

    pub(crate) fn move_to(&mut self, device: &Device, views: &[TrainView]) -> Result<(), GpuError> {
        let device = DeviceRun::new(device, &self.cloud, &self.moments, self.step, self.settings.clone(), views)?;
        self.device = Some(device);
        Ok(())
    }

    /// Brings cloud, moments and statistics up to date, where a GPU has them.
    pub(crate) fn fetch(&mut self) -> Result<(), GpuError> {
        if let Some(device) = &self.device {
            (self.cloud, self.moments, self.stats) = device.download()?;
        }
        Ok(())
    }

    /// Brings the cloud up to date, where a GPU has it.
    pub(crate) fn fetch_cloud(&mut self) -> Result<(), GpuError> {
        if let Some(device) = &self.device {
            self.cloud = device.cloud()?;
        }
        Ok(())
    }

    fn send(&mut self) -> Result<(), GpuError> {
        match &mut self.device {
            Some(device) => device.upload(&self.cloud, &self.moments, self.step),
            None => Ok(()),
        }
    }

    /// How the cloud is meant to be drawn.
    pub(crate) fn render_settings(&self) -> RenderSettings {
        RenderSettings { sh_degree: self.cloud.sh_degree, ..self.settings.clone() }
    }

    /// One step on the next photo of the round. Returns what is known by now and was not returned
    /// before: of this step on the CPU; on a GPU of none, or, every `REPORT_STEPS` steps, of
    /// those since.
    pub fn advance(&mut self, views: &[TrainView]) -> Result<Vec<StepResult>, StepError> {
        if self.round.is_empty() {
            self.round = (0..views.len() as u32).collect();
            self.round.shuffle(&mut self.rng);
        }
        let next = self.round.pop().map(|i| i as usize);
        let Some((i, view)) = next.and_then(|i| Some((i, views.get(i)?))) else { return Ok(Vec::new()) };
        self.settings.sh_degree = self.schedule.sh_degree(self.step);
        if let Some(device) = &mut self.device {
            device.step(i, view, &self.schedule.rates(self.step), self.settings.sh_degree)?;
            self.step += 1;
            return Ok(if self.step % REPORT_STEPS == 0 { device.results()? } else { Vec::new() });
        }
        let settings = RenderSettings { depth: self.geometry.counts(self.step), ..self.settings.clone() };
        let features = self.geometry.features(&self.cloud, view, self.step);
        let frame = self.renderer.render(&self.cloud, features, &view.camera, &settings)?;
        if settings.depth {
            self.geometry.compare(&frame, view, self.step, &mut self.gradient);
        }
        let parts = self.compare(frame.color, view);
        self.renderer.backward_tiles(&self.gradient);
        if CHECKED {
            all_finite("the loss", "part", &[parts.l1, parts.ssim, parts.mse])?;
            let mut planes = self.gradient.color.iter();
            planes.try_for_each(|p| all_finite("the loss", "the gradient of pixel", p))?;
            self.renderer.check_backward()?;
        }
        let StepStats { skipped, outliers, first } = self.optimizer_step(&view.camera);
        self.step += 1;
        if CHECKED {
            let bad = |index| NotFinite { stage: "projection backward", field: "the gradient of Gaussian", index };
            first.map_or(Ok(()), |i| Err(bad(i)))?;
            self.check("Adam")?;
        }
        Ok(vec![StepResult { loss: parts.total(LAMBDA), psnr: psnr_of(parts.mse), skipped, outliers }])
    }

    /// Density control and opacity reset where they are due. Returns what was done.
    pub(crate) fn control_density(&mut self) -> Result<Option<DensityReport>, StepError> {
        let (densifies, resets) = (self.schedule.densifies(self.step), self.schedule.resets(self.step));
        if !self.densify || !(densifies || resets) {
            return Ok(None);
        }
        self.fetch()?;
        let mut report = None;
        if densifies {
            let large = self.schedule.prunes_large(self.step);
            report = Some(density::control(
                &mut self.cloud,
                &mut self.moments,
                &self.stats,
                self.extent,
                self.budget,
                large,
                &mut self.rng,
            ));
            self.stats = DensityStats::new(self.cloud.len());
        }
        if resets {
            density::reset_opacity(&mut self.cloud, &mut self.moments);
        }
        self.check("densification")?;
        self.send()?;
        Ok(report)
    }

    /// Under `debug-validation`: whether cloud and moments are finite after a stage.
    fn check(&self, stage: &'static str) -> Result<(), NotFinite> {
        if CHECKED {
            validate::cloud(stage, &self.cloud)?;
            self.moments.iter().try_for_each(|m| validate::cloud(stage, m))?;
        }
        Ok(())
    }

    /// Replaces the cloud by an earlier one and forgets the moments; rates are halved.
    pub(crate) fn roll_back(&mut self, cloud: GaussianCloud) -> Result<(), GpuError> {
        let zero = zeros_like(&cloud);
        self.stats = DensityStats::new(cloud.len());
        self.moments = [zero.clone(), zero];
        self.cloud = cloud;
        self.schedule.damping *= 0.5;
        self.send()
    }

    /// Fills the picture gradient and returns the loss.
    fn compare(&mut self, mut rendered: [Vec<f32>; 3], view: &TrainView) -> LossParts {
        let target = metrics::planes::<f32>(&view.pixels);
        let coverage = view.pixels.coverage.as_deref();
        if let Some(coverage) = coverage {
            for (plane, want) in rendered.iter_mut().zip(&target) {
                for ((r, t), c) in plane.iter_mut().zip(want).zip(coverage) {
                    let share = f32::from(*c) / 255.0;
                    *r = *t + share * (*r - *t);
                }
            }
        }
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

    /// Backward of the projection and Adam, fused per Gaussian: gradients never reach memory, and
    /// Gaussians that were not drawn cost nothing.
    fn optimizer_step(&mut self, camera: &Camera) -> StepStats {
        let update = Update {
            rates: self.schedule.rates(self.step),
            adam: self.schedule.adam(self.step),
            stride: self.cloud.sh_stride(),
            active: sh::coefficients(self.settings.sh_degree.min(self.cloud.sh_degree)),
            radius_scale: 1.0 / camera.width_px.max(camera.height_px) as f32,
            eye: self.geometry.draws_normals(self.step).then(|| normals::eye(camera, &self.cloud)),
        };
        let renderer = &self.renderer;
        let [first, second] = &mut self.moments;
        let blocks: Vec<Block<'_>> = blocks(&mut self.cloud)
            .zip(blocks(first))
            .zip(blocks(second))
            .zip(self.stats.gradient.chunks_mut(BLOCK))
            .zip(self.stats.seen.chunks_mut(BLOCK))
            .zip(self.stats.radius.chunks_mut(BLOCK))
            .enumerate()
            .map(|(b, (((((p, m), v), gradient), seen), radius))| Block {
                first: b * BLOCK,
                p,
                m,
                v,
                gradient,
                seen,
                radius,
            })
            .collect();
        blocks
            .into_par_iter()
            .map(|mut block| step_block(renderer, &mut block, &update))
            .reduce(StepStats::default, StepStats::add)
    }
}

#[derive(Clone, Copy, Default)]
struct StepStats {
    /// Gaussians whose gradient was not finite.
    skipped: usize,
    first: Option<usize>,
    /// Gradients that were cut as outliers.
    outliers: usize,
}

impl StepStats {
    fn add(self, other: Self) -> Self {
        Self {
            skipped: self.skipped + other.skipped,
            first: self.first.into_iter().chain(other.first).min(),
            outliers: self.outliers + other.outliers,
        }
    }
}

/// Constants of a step's update.
struct Update {
    rates: Rates,
    adam: AdamStep,
    stride: usize,
    active: usize,
    radius_scale: f32,
    /// Center of the camera relative to the cloud's origin, where Gaussians carry their normals as
    /// extra channels.
    eye: Option<[f32; 3]>,
}

struct Slices<'a> {
    positions: &'a mut [[f32; 3]],
    log_scales: &'a mut [[f32; 3]],
    quaternions: &'a mut [[f32; 4]],
    opacity_logits: &'a mut [f32],
    sh: &'a mut [[f32; 3]],
}

/// Everything that the update of some consecutive Gaussians touches.
struct Block<'a> {
    first: usize,
    p: Slices<'a>,
    m: Slices<'a>,
    v: Slices<'a>,
    gradient: &'a mut [f32],
    seen: &'a mut [u32],
    radius: &'a mut [f32],
}

fn blocks(cloud: &mut GaussianCloud) -> impl Iterator<Item = Slices<'_>> {
    let stride = cloud.sh_stride();
    cloud
        .positions
        .chunks_mut(BLOCK)
        .zip(cloud.log_scales.chunks_mut(BLOCK))
        .zip(cloud.quaternions.chunks_mut(BLOCK))
        .zip(cloud.opacity_logits.chunks_mut(BLOCK))
        .zip(cloud.sh.chunks_mut(BLOCK * stride))
        .map(|((((positions, log_scales), quaternions), opacity_logits), sh)| Slices {
            positions,
            log_scales,
            quaternions,
            opacity_logits,
            sh,
        })
}

/// A cloud of the same shape with every parameter zero.
fn zeros_like(cloud: &GaussianCloud) -> GaussianCloud {
    GaussianCloud {
        origin: cloud.origin,
        positions: vec![[0.0; 3]; cloud.len()],
        log_scales: vec![[0.0; 3]; cloud.len()],
        quaternions: vec![[0.0; 4]; cloud.len()],
        opacity_logits: vec![0.0; cloud.len()],
        sh_degree: cloud.sh_degree,
        sh: vec![[0.0; 3]; cloud.sh.len()],
        extras: Vec::new(),
    }
}

#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn step_block(renderer: &DifferentiableRenderer, block: &mut Block<'_>, update: &Update) -> StepStats {
    let Update { rates, adam, stride, active, radius_scale, eye } = update;
    let Block { first, p, m, v, gradient, seen, radius } = block;
    let mut left = StepStats::default();
    for i in 0..p.positions.len() {
        let own = i * stride..(i + 1) * stride;
        let gaussian = Gaussian {
            position: p.positions[i],
            log_scale: p.log_scales[i],
            quaternion: p.quaternions[i],
            opacity_logit: p.opacity_logits[i],
            sh: &p.sh[own.clone()],
        };
        let Some(mut g) = renderer.gaussian_gradient(&gaussian, *first + i) else { continue };
        let mut d_normal = [0.0; 3];
        if let Some(eye) = eye
            && renderer.feature_gradient(*first + i, &mut d_normal)
        {
            let turn = normals::backward(&gaussian, *eye, d_normal);
            g.quaternion.iter_mut().zip(turn).for_each(|(q, t)| *q += t);
        }
        let finite = g.position.iter().chain(&g.log_scale).chain(&g.quaternion).chain(&g.color).all(|x| x.is_finite())
            && g.opacity_logit.is_finite();
        if !finite {
            left.skipped += 1;
            left.first = left.first.or(Some(*first + i));
            continue;
        }
        gradient[i] += g.screen;
        seen[i] += 1;
        radius[i] = radius[i].max(g.radius_px * radius_scale);
        let mut step = |p: &mut [f32], m: &mut [f32], v: &mut [f32], g: &[f32], rate: f32| {
            for (((p, m), v), g) in p.iter_mut().zip(m).zip(v).zip(g) {
                left.outliers += usize::from(adam.update(p, *g, m, v, rate));
            }
        };
        step(&mut p.positions[i], &mut m.positions[i], &mut v.positions[i], &g.position, rates.position);
        step(&mut p.log_scales[i], &mut m.log_scales[i], &mut v.log_scales[i], &g.log_scale, rates.log_scale);
        step(&mut p.quaternions[i], &mut m.quaternions[i], &mut v.quaternions[i], &g.quaternion, rates.quaternion);
        let o = i..i + 1;
        step(
            &mut p.opacity_logits[o.clone()],
            &mut m.opacity_logits[o.clone()],
            &mut v.opacity_logits[o],
            &[g.opacity_logit],
            rates.opacity_logit,
        );
        // All SH coefficients in one loop, which then runs in vectors.
        let mut d_sh = [0.0; 48];
        for (d, (k, c)) in d_sh.iter_mut().zip((0..*active).flat_map(|k| (0..3).map(move |c| (k, c)))) {
            *d = g.color[c] * g.basis[k];
        }
        let own = own.start..own.start + active;
        let (p, m, v) = (&mut p.sh[own.clone()], &mut m.sh[own.clone()], &mut v.sh[own]);
        let (p, m, v) = (p.as_flattened_mut(), m.as_flattened_mut(), v.as_flattened_mut());
        let ((p0, p1), (m0, m1), (v0, v1)) = (p.split_at_mut(3), m.split_at_mut(3), v.split_at_mut(3));
        step(p0, m0, v0, &d_sh[..3], rates.sh_constant);
        step(p1, m1, v1, &d_sh[3..3 * active], rates.sh_rest);
    }
    left
}
