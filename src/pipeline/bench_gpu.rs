//! The same timings as [`super::bench`], on a GPU.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use super::bench::views_of;
use super::train::{TrainConfig, TrainView, init};
use crate::math::stats::median;
use crate::render::measure::{self, Measurement};
use crate::render::{Device, GpuError, RenderSettings};
use crate::scene::{Dataset, GaussianCloud};

/// Timing of a frame or a training step.
#[derive(Clone, Debug, Serialize)]
pub struct GpuTiming {
    /// The scene or dataset.
    pub name: String,
    /// Gaussians in it.
    pub gaussians: usize,
    /// Width and height, px.
    pub size: [u32; 2],
    /// Milliseconds from the call to the result, median. A frame is copied to the host in it.
    pub total_ms: f64,
    /// Milliseconds on the device per stage, median; empty where the device has no timestamps.
    pub stages_ms: Vec<(&'static str, f64)>,
}

/// Times the GPU renderer on a cloud, from the same views as [`super::bench::render`].
pub fn render(
    device: &Device,
    name: &str,
    cloud: &GaussianCloud,
    size: [u32; 2],
    repeats: usize,
) -> Result<GpuTiming, GpuError> {
    let settings = RenderSettings::default();
    let frame = |camera| measure::frame(device, cloud, camera, &settings, repeats);
    let views = views_of(cloud, size[0], size[1]).iter().map(frame).collect::<Result<Vec<_>, _>>()?;
    Ok(timing(name, cloud.len(), size, &views))
}

/// Times GPU training steps from the dataset's own starting cloud, on a few of its photos.
pub fn train_steps(
    device: &Device,
    dataset: &Dataset,
    views: &[TrainView],
    config: &TrainConfig,
    repeats: usize,
) -> Result<GpuTiming, GpuError> {
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let cloud = init::initial_cloud(dataset, views, config.sh_degree, config.random_points, &mut rng);
    let step = |v: &TrainView| measure::training_step(device, &cloud, &v.camera, &v.pixels, repeats);
    let every = (views.len() / 3).max(1);
    let runs = views.iter().step_by(every).take(3).map(step).collect::<Result<Vec<_>, _>>()?;
    let size = views.first().map_or([0, 0], |v| [v.camera.width_px, v.camera.height_px]);
    Ok(timing(&dataset.name, cloud.len(), size, &runs))
}

/// Medians over views that went through the same stages.
fn timing(name: &str, gaussians: usize, size: [u32; 2], views: &[Measurement]) -> GpuTiming {
    let ms = |secs: Vec<f64>| median(&secs) * 1e3;
    let stage = |k: usize| ms(views.iter().filter_map(|v| v.stages.get(k)).map(|s| s.1).collect());
    let stages = views.first().map(|v| v.stages.as_slice()).unwrap_or_default();
    GpuTiming {
        name: name.into(),
        gaussians,
        size,
        total_ms: ms(views.iter().map(|v| v.whole_secs).collect()),
        stages_ms: stages.iter().enumerate().map(|(k, (stage_name, _))| (*stage_name, stage(k))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_in_milliseconds() {
        let run = |whole_secs: f64, a: f64| Measurement { stages: vec![("a", a)], whole_secs, visible: 1, pairs: 1 };
        let t = timing("x", 5, [4, 3], &[run(0.002, 0.5), run(0.004, 0.1), run(0.003, 0.2)]);
        assert_eq!((t.total_ms, t.stages_ms), (3.0, vec![("a", 200.0)]));
        assert!(timing("x", 0, [1, 1], &[]).stages_ms.is_empty());
    }
}
