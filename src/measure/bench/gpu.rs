//! Times of a frame on whatever draws it, and of a training step on a GPU, stage by stage.

use std::sync::Arc;
use std::time::{Duration, Instant};

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

/// Time that a GPU at rest may take to wake up.
const WAKING: Duration = Duration::from_millis(300);

/// Medians over the repetitions.
#[derive(Clone, Debug, Default)]
pub struct Measurement {
    /// Seconds per stage; empty on a device without timestamps.
    pub stages: StageTimes,
    /// Seconds from the call to the finished result, on the host's clock.
    pub whole_secs: f64,
    /// Seconds of a frame of which the host gets the bytes of its colors, of one that stays on the GPU, one after
    /// another without a wait, and of one that a window of the same device paints; `None` where no GPU draws.
    pub other_secs: Option<[f64; 3]>,
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
    let other_secs = if renderer.is_gpu() { Some(on_gpu(renderer, cloud, camera, settings, repeats)?) } else { None };
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
    Ok(Measurement { stages: medians(&stages), whole_secs: median(&secs), other_secs })
}

/// Median seconds of a frame of which the host gets bytes, mean seconds of five times as many that stay on the GPU, and
/// median seconds of one that a window of the same device paints; in the mean is a copy of the last one's bytes, which
/// waits for all. First a GPU that rests is given time to wake up.
fn on_gpu(
    renderer: &mut Renderer,
    cloud: &Arc<GaussianCloud>,
    camera: &Camera,
    settings: &RenderSettings,
    repeats: usize,
) -> Result<[f64; 3], DrawError> {
    let mut many = |frames: usize| {
        let start = Instant::now();
        for _ in 1..frames {
            renderer.draw_on_device(camera, settings)?;
        }
        renderer.draw_rgb8(cloud, camera, settings)?;
        Ok::<_, DrawError>(start.elapsed().as_secs_f64() / frames as f64)
    };
    let start = Instant::now();
    while start.elapsed() < WAKING && repeats > 1 {
        many(10)?;
    }
    let staying = many(5 * repeats.max(1))?;
    let bytes = (0..repeats.max(1)).map(|_| many(1)).collect::<Result<Vec<_>, _>>()?;
    let textures = (0..repeats.max(1)).map(|_| {
        let start = Instant::now();
        renderer.draw_texture(cloud, camera, settings)?;
        Ok::<_, DrawError>(start.elapsed().as_secs_f64())
    });
    let textures = textures.collect::<Result<Vec<_>, _>>()?;
    Ok([median(&bytes), staying, median(&textures)])
}

/// Makes `repeats` training steps on one photo, after some that do not count. The whole is the mean over steps
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
    let woken = Instant::now();
    loop {
        trainer.step(camera, &photo, &rates, degree)?;
        if repeats == 1 || woken.elapsed() > WAKING {
            break;
        }
    }
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
    Ok(Measurement { stages: medians(&runs), whole_secs, other_secs: None })
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
    /// Milliseconds of a frame of which the host gets bytes, of one among many that stay on the device, and of one that
    /// a window of the same device paints; `None` for a training step.
    pub(crate) bytes_ms: Option<f64>,
    pub(crate) staying_ms: Option<f64>,
    pub(crate) texture_ms: Option<f64>,
    /// Milliseconds of finding what the pixels of the drawn view belong to, on the device and on the CPU, medians;
    /// `None` for a training step.
    pub(crate) labels_ms: Option<[f64; 2]>,
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
    let settings = RenderSettings::default();
    let (mut views, mut labels) = (Vec::new(), [Vec::new(), Vec::new()]);
    // As many as a scene of things has.
    let groups: Vec<u32> = (0..300).collect();
    let of: Vec<u32> = (0..cloud.len() as u32).map(|i| i % 300).collect();
    for camera in views_of(cloud, size[0], size[1]) {
        views.push(frame(&mut renderer, cloud, &camera, &settings, repeats)?);
        renderer.draw_rgb8(cloud, &camera, &settings)?;
        for (renderer, secs) in [&mut renderer, &mut Renderer::new()].into_iter().zip(&mut labels) {
            for _ in 0..repeats.min(5) {
                let start = Instant::now();
                renderer.label_winners(cloud, (&of, &groups), &camera, &settings)?;
                secs.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    let labels_ms = Some(labels.map(|ms| median(&ms)));
    Ok(Timing { labels_ms, ..timing(name, cloud.len(), size, &views) })
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
    let other: Vec<[f64; 3]> = views.iter().filter_map(|v| v.other_secs).collect();
    let other_ms =
        |k: usize| (!other.is_empty()).then(|| median(&other.iter().map(|s| s[k]).collect::<Vec<_>>()) * 1e3);
    let [bytes_ms, staying_ms, texture_ms] = [0, 1, 2].map(other_ms);
    let stages_ms = medians(&stages).into_iter().map(|(stage, secs)| (stage, secs * 1e3)).collect();
    Timing {
        name: name.into(),
        gaussians,
        size,
        total_ms,
        bytes_ms,
        staying_ms,
        texture_ms,
        labels_ms: None,
        stages_ms,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_stage_by_stage_in_milliseconds() {
        let run = |whole_secs: f64, a: f64, b: f64| {
            let stages = vec![("a", a), ("b", b)];
            Measurement { stages, whole_secs, other_secs: None }
        };
        let t = timing("x", 5, [4, 3], &[run(0.002, 0.5, 9.0), run(0.004, 0.1, 7.0), run(0.003, 0.2, 8.0)]);
        assert_eq!((t.total_ms, t.stages_ms), (3.0, vec![("a", 200.0), ("b", 8000.0)]));
        assert!(timing("x", 0, [1, 1], &[]).stages_ms.is_empty());
    }
}
