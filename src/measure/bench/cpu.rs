//! Timings of drawing and training on the CPU, with the work they did, and what one core could do at most.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use super::gpu::{Measurement, Timing, frame, timing};
use super::views_of;
use crate::math::lanes::{LANES, LaneOp, Lanes};
use crate::math::stats::{mean, median};
use crate::math::{Real, lanes::Lane};
use crate::pipeline::train::init;
use crate::pipeline::train::trainer::{StepError, Trainer};
use crate::pipeline::train::{TrainConfig, TrainView};
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::{Dataset, GaussianCloud};

#[derive(Clone, Debug, Serialize)]
pub(crate) struct RenderTiming {
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    /// Width and height, px.
    pub(crate) size: [u32; 2],
    /// Milliseconds of the whole frame, median over views and repeats.
    pub(crate) total_ms: f64,
    /// Milliseconds of projection, sorting, binning, blending.
    pub(crate) stages_ms: [f64; 4],
    /// Splat-pixel products evaluated per frame, mean over the views.
    pub(crate) products: f64,
    /// Products per second of blending.
    pub(crate) products_per_sec: f64,
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct StepTiming {
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    /// Width and height of the first photo, px.
    pub(crate) size: [u32; 2],
    /// Milliseconds of a step, median.
    pub(crate) step_ms: f64,
    pub(crate) steps_per_sec: f64,
}

pub(crate) fn render(
    name: &str,
    cloud: &Arc<GaussianCloud>,
    size: [u32; 2],
    repeats: usize,
) -> Result<RenderTiming, DrawError> {
    let mut renderer = Renderer::new();
    let (mut views, mut products) = (Vec::new(), Vec::new());
    for camera in views_of(cloud, size[0], size[1]) {
        views.push(frame(&mut renderer, cloud, &camera, &RenderSettings::default(), repeats)?);
        products.push(renderer.stats().products as f64);
    }
    let blend_secs = |m: &Measurement| m.stages.last().map_or(0.0, |s| s.1).max(1e-9);
    let rates: Vec<f64> = products.iter().zip(&views).map(|(n, m)| n / blend_secs(m)).collect();
    let Timing { total_ms, stages_ms, .. } = timing(name, cloud.len(), size, &views);
    Ok(RenderTiming {
        name: name.into(),
        gaussians: cloud.len(),
        size,
        total_ms,
        stages_ms: std::array::from_fn(|k| stages_ms.get(k).map_or(0.0, |s| s.1)),
        products: mean(&products),
        products_per_sec: median(&rates),
    })
}

/// Times CPU training steps from the dataset's own starting cloud, density control off.
pub(crate) fn train_steps(
    dataset: &Dataset,
    views: &[TrainView],
    config: &TrainConfig,
    repeats: usize,
) -> Result<StepTiming, StepError> {
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let cloud = init::initial_cloud(dataset, views, config.sh_degree, config.random_points, &mut rng);
    let gaussians = cloud.len();
    let mut trainer = Trainer::new(cloud, config, [0.0; 3], dataset.camera_extent().1, rng);
    let mut times = Vec::new();
    for i in 0..repeats + 3 {
        let start = Instant::now();
        trainer.advance(views)?;
        if i >= 3 {
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let step_ms = median(&times);
    let size = views.first().map_or([0, 0], |v| [v.camera.width_px, v.camera.height_px]);
    Ok(StepTiming { name: dataset.name.clone(), gaussians, size, step_ms, steps_per_sec: 1e3 / step_ms })
}

/// Splat-pixel products per second that one core of this machine can evaluate and blend when
/// nothing else is in the way: conic, exponential, transmittance and color on registers alone.
pub(crate) fn one_core_limit() -> f64 {
    const ROUNDS: usize = 2_000_000;
    let start = Instant::now();
    let sum = f32::vectorize(Limit { rounds: ROUNDS });
    let secs = start.elapsed().as_secs_f64();
    std::hint::black_box(sum);
    (ROUNDS * 2 * LANES) as f64 / secs
}

/// The inner loop of blending without its memory.
struct Limit {
    rounds: usize,
}

impl LaneOp<f32> for Limit {
    type Output = f32;
    #[inline(always)]
    fn run<L: Lanes<f32>>(self, l: L) -> f32 {
        let ramp: Lane<f32> = std::array::from_fn(|i| i as f32);
        let ramp = l.load(&ramp);
        let one = l.splat(1.0);
        // Two independent groups hide the latency of each other.
        let mut left = [one; 2];
        let mut color = [[l.splat(0.0); 3]; 2];
        let mut dy = 0.0_f32;
        for _ in 0..self.rounds {
            dy = if dy > 8.0 { -8.0 } else { dy + 0.01 };
            for g in 0..2 {
                let dx = l.add(ramp, l.splat(dy - 8.0 * g as f32));
                let q = l.mul_add(l.mul_add(l.splat(0.05), dx, l.splat(0.01 * dy)), dx, l.splat(0.04 * dy * dy));
                let raw = l.mul(l.splat(0.01), l.exp_neg(l.mul(l.splat(-0.5), q)));
                let alpha = l.keep(l.ge(raw, l.splat(1e-4)), l.min(raw, l.splat(0.999)));
                let weight = l.mul(alpha, left[g]);
                left[g] = l.sub(left[g], l.mul(weight, l.splat(1e-3)));
                for (c, sum) in color[g].iter_mut().enumerate() {
                    *sum = l.mul_add(weight, l.splat(0.3 + c as f32), *sum);
                }
            }
        }
        l.sum(color[0][0]) + l.sum(color[1][2]) + l.sum(left[0])
    }
}

/// A readable name for a path: its last part.
pub(crate) fn label(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
