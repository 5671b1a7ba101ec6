//! Times of a frame and of a training step, stage by stage, for benchmarks.

use std::time::Instant;

use super::ssim::DevicePhoto;
use super::timing::StageTimes;
use super::{Device, GpuError, Renderer, Trainer, TrainerSettings};
use crate::math::stats::median;
use crate::render::cpu::adam::Rates;
use crate::render::{Features, RenderSettings};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// Medians over the repetitions.
#[derive(Clone, Debug, Default)]
pub struct Measurement {
    /// Seconds per stage; empty on a device without timestamps.
    pub stages: StageTimes,
    /// Seconds from the call to the finished result, on the host's clock.
    pub whole_secs: f64,
    /// Gaussians drawn.
    pub visible: u32,
    /// (Splat, tile) pairs blended.
    pub pairs: u32,
}

/// Draws an uploaded cloud `repeats` times, after one that does not count. The whole includes the
/// copy of the picture to the host.
pub fn frame(
    device: &Device,
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
    repeats: usize,
) -> Result<Measurement, GpuError> {
    let mut renderer = Renderer::new(device)?;
    renderer.upload(cloud, Features::NONE)?;
    renderer.draw(camera, settings)?;
    let whole_secs = timed(repeats, || renderer.draw(camera, settings).map(|_| ()))?;
    renderer.measure()?;
    let mut runs = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        renderer.draw(camera, settings)?;
        runs.push(renderer.times().clone());
    }
    let counters = renderer.counters().unwrap_or_default();
    Ok(Measurement { stages: medians(&runs), whole_secs, visible: counters.visible, pairs: counters.pairs })
}

/// Makes `repeats` training steps on one photo, after one that does not count. The whole is the
/// mean over steps that follow each other without waiting.
pub fn training_step(
    device: &Device,
    cloud: &GaussianCloud,
    camera: &Camera,
    photo: &PhotoPixels,
    repeats: usize,
) -> Result<Measurement, GpuError> {
    let mut trainer = Trainer::new(device, cloud, TrainerSettings::default())?;
    let photo: DevicePhoto = trainer.photo(photo)?;
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
    let last = trainer.metrics()?.last().map(|m| m.sums).unwrap_or_default();
    Ok(Measurement { stages: medians(&runs), whole_secs, visible: last.visible, pairs: last.wanted })
}

fn timed(repeats: usize, mut run: impl FnMut() -> Result<(), GpuError>) -> Result<f64, GpuError> {
    let mut secs = Vec::with_capacity(repeats);
    for _ in 0..repeats {
        let start = Instant::now();
        run()?;
        secs.push(start.elapsed().as_secs_f64());
    }
    Ok(median(&secs))
}

/// Medians over runs that had the same stages.
fn medians(runs: &[StageTimes]) -> StageTimes {
    let Some(first) = runs.first() else { return StageTimes::new() };
    let stage = |k: usize| runs.iter().filter_map(|r| r.get(k)).map(|s| s.1).collect::<Vec<_>>();
    first.iter().enumerate().map(|(k, (name, _))| (*name, median(&stage(k)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_stage_by_stage() {
        let runs = [vec![("a", 1.0), ("b", 9.0)], vec![("a", 3.0), ("b", 7.0)], vec![("a", 2.0), ("b", 8.0)]];
        assert_eq!(medians(&runs), vec![("a", 2.0), ("b", 8.0)]);
        assert!(medians(&[]).is_empty());
    }
}
