//! Times of a frame on whatever draws it, and of a training step on a GPU, stage by stage.

use std::sync::Arc;
use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

use super::views_of;
use crate::math::stats::median;
use crate::pipeline::train::{TrainConfig, TrainView, init};
use crate::render::{
    Device, DrawError, GpuError, GpuTrainer, Rates, RenderSettings, Renderer, StageTimes, TrainerSettings,
};
use crate::scene::{Camera, Dataset, GaussianCloud, PhotoPixels};

/// Medians over the repetitions.
#[derive(Clone, Debug, Default)]
pub struct Measurement {
    /// Seconds per stage; empty on a device without timestamps.
    pub stages: StageTimes,
    /// Seconds from the call to the finished result, on the host's clock.
    pub whole_secs: f64,
}

/// Draws a cloud `repeats` times, after one that does not count; the copy of the image to the host is included. On a
/// GPU, where timing the stages is not free, they are timed in as many runs of their own.
pub fn frame(
    renderer: &mut Renderer,
    cloud: &Arc<GaussianCloud>,
    camera: &Camera,
    settings: &RenderSettings,
    repeats: usize,
) -> Result<Measurement, DrawError> {
    let (mut secs, mut stages) = (Vec::with_capacity(repeats), Vec::with_capacity(repeats));
    renderer.draw(cloud, camera, settings)?;
    for timed in if renderer.is_gpu() { &[false, true][..] } else { &[false] } {
        renderer.time_stages(*timed)?;
        for _ in 0..repeats {
            let start = Instant::now();
            renderer.draw(cloud, camera, settings)?;
            if *timed || !renderer.is_gpu() {
                stages.push(renderer.stage_times());
            }
            if !timed {
                secs.push(start.elapsed().as_secs_f64());
            }
        }
    }
    renderer.time_stages(false)?;
    Ok(Measurement { stages: medians(&stages), whole_secs: median(&secs) })
}

/// Makes `repeats` training steps on one photo, after one that does not count. The whole is the mean over steps
/// that follow each other without waiting.
pub fn training_step(
    device: &Device,
    cloud: &GaussianCloud,
    camera: &Camera,
    photo: &PhotoPixels,
    repeats: usize,
) -> Result<Measurement, GpuError> {
    let mut trainer = GpuTrainer::new(device, cloud, TrainerSettings::default())?;
    let photo = trainer.photo(photo)?;
    // Steps of no length, so that every repetition does the same work.
    let still = 1e-30;
    let rates = Rates {
        position: still,
        log_scale: still,
        quaternion: still,
        opacity_logit: still,
        sh_constant: still,
        sh_rest: still,
    };
    let degree = cloud.sh_degree;
    trainer.step(camera, &photo, &rates, degree)?;
    trainer.metrics()?;
    let start = Instant::now();
    for _ in 0..repeats {
        trainer.step(camera, &photo, &rates, degree)?;
    }
    device.wait()?;
    let whole_secs = start.elapsed().as_secs_f64() / repeats.max(1) as f64;
    trainer.measure()?;
    let mut runs = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        trainer.step(camera, &photo, &rates, degree)?;
        runs.push(trainer.times().clone());
    }
    Ok(Measurement { stages: medians(&runs), whole_secs })
}

fn medians(runs: &[StageTimes]) -> StageTimes {
    let stage = |k: usize| median(&runs.iter().filter_map(|r| r.get(k)).map(|s| s.1).collect::<Vec<_>>());
    runs.first().into_iter().flatten().enumerate().map(|(k, (name, _))| (*name, stage(k))).collect()
}

#[derive(Clone, Debug, Serialize)]
pub(crate) struct Timing {
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    /// Width and height, px.
    pub(crate) size: [u32; 2],
    /// Milliseconds from the call to the result, median. A frame is copied to the host in it.
    pub(crate) total_ms: f64,
    /// Milliseconds on the device per stage, median; empty where the device has no timestamps.
    pub(crate) stages_ms: Vec<(&'static str, f64)>,
}

/// Times the GPU renderer on a cloud, from the same views as [`super::cpu::render`].
pub(crate) fn render(
    device: &Device,
    name: &str,
    cloud: &Arc<GaussianCloud>,
    size: [u32; 2],
    repeats: usize,
) -> Result<Timing, DrawError> {
    let mut renderer = Renderer::on_gpu(device)?;
    let mut frame = |camera| frame(&mut renderer, cloud, camera, &RenderSettings::default(), repeats);
    let views = views_of(cloud, size[0], size[1]).iter().map(&mut frame).collect::<Result<Vec<_>, _>>()?;
    Ok(timing(name, cloud.len(), size, &views))
}

/// Times GPU training steps from the dataset's own starting cloud, on a few of its photos.
pub(crate) fn train_steps(
    device: &Device,
    dataset: &Dataset,
    views: &[TrainView],
    config: &TrainConfig,
    repeats: usize,
) -> Result<Timing, GpuError> {
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let cloud = init::initial_cloud(dataset, views, config.sh_degree, config.random_points, &mut rng);
    let step = |v: &TrainView| training_step(device, &cloud, &v.camera, &v.pixels, repeats);
    let every = (views.len() / 3).max(1);
    let runs = views.iter().step_by(every).take(3).map(step).collect::<Result<Vec<_>, _>>()?;
    let size = views.first().map_or([0, 0], |v| [v.camera.width_px, v.camera.height_px]);
    Ok(timing(&dataset.name, cloud.len(), size, &runs))
}

/// Medians over views that went through the same stages.
pub(super) fn timing(name: &str, gaussians: usize, size: [u32; 2], views: &[Measurement]) -> Timing {
    let stages: Vec<StageTimes> = views.iter().map(|v| v.stages.clone()).collect();
    let total_ms = median(&views.iter().map(|v| v.whole_secs).collect::<Vec<_>>()) * 1e3;
    let stages_ms = medians(&stages).into_iter().map(|(stage, secs)| (stage, secs * 1e3)).collect();
    Timing { name: name.into(), gaussians, size, total_ms, stages_ms }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_stage_by_stage_in_milliseconds() {
        let run = |whole_secs: f64, a: f64, b: f64| {
            let stages = vec![("a", a), ("b", b)];
            Measurement { stages, whole_secs }
        };
        let t = timing("x", 5, [4, 3], &[run(0.002, 0.5, 9.0), run(0.004, 0.1, 7.0), run(0.003, 0.2, 8.0)]);
        assert_eq!((t.total_ms, t.stages_ms), (3.0, vec![("a", 200.0), ("b", 8000.0)]));
        assert!(timing("x", 0, [1, 1], &[]).stages_ms.is_empty());
    }
}
