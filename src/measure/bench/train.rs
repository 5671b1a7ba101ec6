//! Times of training steps, density control off.

use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::draw::WAKING;
use super::{StageSample, StageValues};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::train::trainer::{StepError, Trainer};
use crate::pipeline::train::{TrainConfig, TrainView, init};
use crate::render::{Device, GpuError, GpuTrainer, Rates, TrainerSettings};
use crate::scene::{Camera, Dataset, GaussianCloud, PhotoPixels};

/// Steps on the CPU that do not count.
const SETTLE: usize = 3;

/// Times steps from the dataset's own starting cloud: on the CPU on all photos, on a GPU on three of them.
pub(crate) fn steps(
    dataset: &Dataset,
    views: &[TrainView],
    config: &TrainConfig,
    repeats: usize,
    device: Option<&Device>,
) -> Result<Vec<StageSample>, StepError> {
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let cloud = init::initial_cloud(dataset, views, config.sh_degree, config.random_points, &mut rng);
    let size = views.first().map_or([0, 0], |v| [v.camera.width_px, v.camera.height_px]);
    let mut values = StageValues::on_scene(&dataset.name, cloud.len(), size);
    if let Some(device) = device {
        for view in views.iter().step_by((views.len() / 3).max(1)).take(3) {
            training_step(device, &cloud, &view.camera, &view.pixels, repeats, &mut values)?;
        }
    }
    let mut trainer = Trainer::new(cloud, config, [0.0; 3], dataset.camera_extent().1, rng);
    for k in 0..SETTLE + repeats {
        let start = Instant::now();
        trainer.advance(views)?;
        let ms = ms_since(start);
        if k >= SETTLE {
            values.add("training step, CPU", "ms", [ms]);
            values.add("training step, CPU: rate", "1/s", [1e3 / ms]);
        }
    }
    Ok(values.samples())
}

/// Makes `repeats` training steps on one photo, after some that do not count. The whole is the mean over steps
/// that follow each other without waiting.
pub fn training_step(
    device: &Device,
    cloud: &GaussianCloud,
    camera: &Camera,
    photo: &PhotoPixels,
    repeats: usize,
    values: &mut StageValues,
) -> Result<(), GpuError> {
    let mut trainer = GpuTrainer::new(device, cloud, TrainerSettings::default())?;
    let photo = trainer.photo(photo)?;
    // Steps of no length, so that every repetition does the same work.
    let r = 1e-30;
    let rates = Rates { position: r, log_scale: r, quaternion: r, opacity_logit: r, sh_constant: r, sh_rest: r };
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
    values.add("training step, GPU", "ms", [ms_since(start) / repeats.max(1) as f64]);
    trainer.measure()?;
    for _ in 0..repeats {
        trainer.step(camera, &photo, &rates, degree)?;
        for (part, secs) in trainer.times() {
            values.add(&format!("training step, GPU: {part}"), "ms", [1e3 * secs]);
        }
    }
    Ok(())
}
