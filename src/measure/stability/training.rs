//! Training under extremes: it improves, or leaves things as they are; it never makes a number that is
//! none.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::drawing::{camera, one};
use super::{Case, Finding};
use crate::io::SceneFolder;
use crate::pipeline::train::checkpoint::{self, Header};
use crate::pipeline::train::density::{self, DensityRound};
use crate::pipeline::train::trainer::Trainer;
use crate::pipeline::train::{TrainConfig, TrainView};
use crate::render::cpu::CpuRenderer;
use crate::render::cpu::ssim::ssim;
use crate::render::{Features, RenderSettings};
use crate::scene::{GaussianCloud, PhotoPixels};

const STEPS: u64 = 60;

/// A photo of one gray level.
pub(crate) fn flat(level: u8) -> TrainView {
    let at = camera(48, 32);
    let rgb = vec![[level; 3]; 48 * 32];
    TrainView {
        name: "flat".into(),
        pixels: PhotoPixels { width_px: at.width_px, height_px: at.height_px, rgb, coverage: None, alpha: None },
        camera: at,
    }
}

pub(super) fn blob() -> TrainView {
    let mut view = flat(0);
    let cloud = one([0.5, 0.3, 0.4], [0.9, 0.1, 0.2, 0.0], 3.0).cast::<f32>();
    let frame = CpuRenderer::new().render(&cloud, Features::NONE, &view.camera, &RenderSettings::default());
    if let Ok(frame) = frame {
        view.pixels.rgb = frame.to_rgb8();
    }
    view
}

pub(super) fn start() -> GaussianCloud {
    let mut cloud = one([0.2; 3], [1.0, 0.0, 0.0, 0.0], -1.0).cast::<f32>();
    cloud = cloud.select(&[0; 24]);
    for (i, p) in cloud.positions.iter_mut().enumerate() {
        let a = i as f32;
        *p = [0.6 * (a * 1.7).sin(), 0.4 * (a * 2.9).cos(), 0.3 * (a * 0.7).sin()];
    }
    cloud
}

pub(crate) fn trainer(cloud: GaussianCloud, steps: u64, densify: bool, extent: f64) -> Trainer {
    let config = TrainConfig { steps, densify, sh_degree: 0, ..TrainConfig::default() };
    Trainer::new(cloud, &config, [0.0; 3], extent, Pcg64Mcg::seed_from_u64(5))
}

pub(super) struct ShortTraining {
    pub(super) trainer: Trainer,
    pub(super) losses: Vec<f64>,
    /// Gaussians left as they were, and gradients cut.
    pub(super) left: [usize; 2],
}

/// Trains for `steps` steps, and calls `before` ahead of each. No case here expects a training to stop: one that does
/// is a broken promise.
pub(super) fn train(
    mut trainer: Trainer,
    view: TrainView,
    steps: u64,
    mut before: impl FnMut(&mut Trainer, &mut TrainView),
) -> Result<ShortTraining, Finding> {
    let mut views = [view];
    let (mut losses, mut left) = (Vec::new(), [0; 2]);
    for _ in 0..steps {
        before(&mut trainer, &mut views[0]);
        let results = trainer.advance(&views);
        let results = results.map_err(|e| Finding::is(format!("it stopped: {e}"), false))?;
        for r in &results {
            losses.push(r.loss);
            left = [left[0] + r.skipped, left[1] + r.outliers];
        }
        trainer.control_density().map_err(|e| Finding::is(format!("it stopped: {e}"), false))?;
    }
    let finite = trainer.moments.iter().try_for_each(GaussianCloud::validate);
    match trainer.cloud.validate().and(finite) {
        Ok(()) => Ok(ShortTraining { trainer, losses, left }),
        Err(e) => Err(Finding::is(format!("after training: {e}"), false)),
    }
}

/// Trains, and the loss has to fall. The fault is an optimizer that does nothing.
fn improves(faulty: bool, cloud: GaussianCloud, view: TrainView, change: impl Fn(&mut Trainer)) -> Finding {
    let mut trainer = trainer(cloud, STEPS, false, 1.0);
    change(&mut trainer);
    improved(faulty, trainer, view)
}

fn improved(faulty: bool, mut trainer: Trainer, view: TrainView) -> Finding {
    if faulty {
        trainer.schedule.damping = 0.0;
    }
    match train(trainer, view, STEPS, |_, _| {}) {
        Ok(ShortTraining { losses, left, .. }) => {
            let (first, last) = ends(&losses);
            let outcome = format!("loss {first:.4} to {last:.4}, {} left as they were, {} cut", left[0], left[1]);
            Finding::within(outcome, last / first, 1.0).and(last < first)
        }
        Err(finding) => finding,
    }
}

/// The first and the last loss; NaN for none.
pub(super) fn ends(losses: &[f64]) -> (f64, f64) {
    let or_nan = |loss: Option<&f64>| loss.copied().unwrap_or(f64::NAN);
    (or_nan(losses.first()), or_nan(losses.last()))
}

/// A training stopped and resumed, through a checkpoint on disk, against one that went through;
/// density control on the way. Without its moments it goes another way.
fn resumed(faulty: bool) -> Finding {
    const STEPS: u64 = 120;
    const STOP: u64 = 55;
    let config = TrainConfig { steps: STEPS, sh_degree: 0, ..TrainConfig::default() };
    let fresh = || trainer(start(), STEPS, true, 1.0);
    let on = |t: Trainer, steps: u64| train(t, blob(), steps, |_, _| {}).map(|t| t.trainer);
    let run = || -> Result<[Trainer; 3], Finding> {
        let broken = |e: String| Finding::is(e, false);
        let (through, half) = (on(fresh(), STEPS)?, on(fresh(), STOP)?);
        let folder = tempfile::tempdir().map_err(|e| broken(e.to_string()))?;
        let scene = SceneFolder::hold(folder.path(), "stability").map_err(|e| broken(e.to_string()))?;
        let path = folder.path().join(checkpoint::FILE);
        let header = Header {
            config: config.clone(),
            photos: Vec::new(),
            inputs: None,
            step: half.step,
            secs: 0.0,
            count: half.cloud.len(),
            sh_degree: half.cloud.sh_degree,
            origin: half.cloud.origin,
            rng: half.rng.clone(),
            round: half.round.clone(),
            budget: half.budget,
            damping: half.schedule.damping,
            refinement: None,
            history: Default::default(),
            unreported: Default::default(),
            fits: Vec::new(),
        };
        checkpoint::save(&scene, &half, &header).map_err(|e| broken(e.to_string()))?;
        let loaded = || -> Result<Trainer, Finding> {
            let saved = checkpoint::load(&path).map_err(|e| broken(e.to_string()))?;
            let saved = saved.ok_or_else(|| broken("the checkpoint is gone".into()))?;
            let mut t = fresh();
            (t.cloud, t.moments, t.stats) = (saved.cloud, saved.moments, saved.stats);
            (t.rng, t.round, t.step) = (saved.header.rng, saved.header.round, saved.header.step);
            Ok(t)
        };
        // The control: without first moments of positions, a training has to end elsewhere.
        let mut forgetful = loaded()?;
        forgetful.moments[0].positions.fill([0.0; 3]);
        let mut again = loaded()?;
        if faulty {
            again.moments[1].positions[0][0] *= 1.01;
        }
        Ok([through, on(again, STEPS - STOP)?, on(forgetful, STEPS - STOP)?])
    };
    match run() {
        Ok([through, resumed, forgetful]) => {
            let same = through.cloud == resumed.cloud && through.moments == resumed.moments;
            let text = format!(
                "{} Gaussians after {STEPS} steps, stopped at {STOP}; other moments end elsewhere: {}",
                through.cloud.len(),
                through.cloud != forgetful.cloud
            );
            Finding::is(text, same && through.cloud != forgetful.cloud && through.cloud.len() > start().len())
        }
        Err(finding) => finding,
    }
}

pub(crate) fn cases() -> Vec<Case> {
    let training = |name: &'static str, run: fn(bool) -> Finding| Case::new("training", name, run);
    vec![
        training("an ordinary start improves", |faulty| improves(faulty, start(), blob(), |_| {})),
        training("a black photo", |faulty| improves(faulty, start(), flat(0), |_| {})),
        training("a white photo", |faulty| improves(faulty, start(), flat(255), |_| {})),
        training("Gaussians under and far beyond a pixel", |faulty| {
            let mut cloud = start();
            cloud.log_scales[0] = [-40.0; 3];
            cloud.log_scales[1] = [12.0; 3];
            cloud.log_scales[2] = [3.0, -30.0, 0.0];
            improves(faulty, cloud, blob(), |_| {})
        }),
        training("opacity logits of +-80", |faulty| {
            let mut cloud = start();
            (cloud.opacity_logits[0], cloud.opacity_logits[1]) = (80.0, -80.0);
            improves(faulty, cloud, blob(), |_| {})
        }),
        training("quaternions of length 0 and 1e30", |faulty| {
            let mut cloud = start();
            (cloud.quaternions[0], cloud.quaternions[1]) = ([0.0; 4], [1e30, 1e30, 0.0, 0.0]);
            improves(faulty, cloud, blob(), |_| {})
        }),
        training("all coincident", |faulty| {
            let mut cloud = start();
            cloud.positions.fill([0.0; 3]);
            improves(faulty, cloud, blob(), |_| {})
        }),
        training("no Gaussian", |faulty| {
            let trainer = trainer(GaussianCloud::default(), STEPS, false, 1.0);
            // The fault: one appears on the way.
            let before = |t: &mut Trainer, _: &mut TrainView| {
                if faulty && t.step == STEPS / 2 {
                    *t = self::trainer(start(), STEPS, false, 1.0);
                    t.step = STEPS / 2;
                }
            };
            match train(trainer, blob(), STEPS, before) {
                Ok(t) => {
                    let (first, last) = ends(&t.losses);
                    Finding::within(format!("nothing to train, loss stays {first:.4}"), (last - first).abs(), 0.0)
                }
                Err(finding) => finding,
            }
        }),
        training("moments of an outlier gradient", |faulty| {
            improves(faulty, start(), blob(), |t| {
                t.moments[0].positions[0] = [1e15; 3];
                t.moments[1].positions[0] = [1e30; 3];
            })
        }),
        training("learning rates times 100", |faulty| {
            improves(faulty, start(), blob(), |t| t.schedule.damping = 100.0)
        }),
        training("resumed in the middle, bit by bit", resumed),
        training("Gaussians of a lower degree than the settings'", |faulty| {
            let config = TrainConfig { steps: STEPS, densify: false, sh_degree: 3, ..TrainConfig::default() };
            let mut t = Trainer::new(start(), &config, [0.0; 3], 1.0, Pcg64Mcg::seed_from_u64(5));
            t.step = STEPS;
            improved(faulty, t, blob())
        }),
        training("density control divides what is as large as numbers get", |faulty| {
            let mut cloud = start();
            cloud.log_scales[0] = [88.7; 3];
            cloud.log_scales[1] = [f32::MAX; 3];
            cloud.positions[1] = [f32::MAX; 3];
            let mut t = trainer(cloud, STEPS, true, 1.0);
            t.stats.gradient.fill(1.0);
            t.stats.gradient[1] = if faulty { 0.0 } else { 1.0 };
            let mut rng = Pcg64Mcg::seed_from_u64(1);
            let round = DensityRound { budget: 100, rounds: 1, frozen: 0 };
            let done = density::control(&mut t.cloud, &mut t.moments, &t.stats, &round, &mut rng);
            let valid = t.cloud.validate();
            Finding::is(format!("{} divided, {valid:?}", done.divided), valid.is_ok() && done.divided == 24)
        }),
        training("SSIM of constant images", |faulty| {
            let plane = |v: f64| vec![vec![v; 32 * 24]; 3];
            let same = ssim(&plane(0.0), &plane(if faulty { 1e-3 } else { 0.0 }), 32);
            let gray = ssim(&plane(0.5), &plane(0.5), 32);
            let apart = ssim(&plane(0.0), &plane(1.0), 32);
            let holds = (same - 1.0).abs() < 1e-9 && (gray - 1.0).abs() < 1e-9 && (0.0..0.01).contains(&apart);
            Finding::is(format!("alike {same:.6}, black and white {apart:.6}"), holds)
        }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::finite::CHECKED;
    use crate::pipeline::train::trainer::StepError;

    #[test]
    fn poisoned_stages_of_training_are_named_under_the_feature() {
        let stage = |poison: fn(&mut Trainer)| {
            let mut t = trainer(start(), STEPS, false, 1.0);
            poison(&mut t);
            match t.advance(&[blob()]) {
                Ok(_) => None,
                Err(StepError::NotFinite(e)) => Some((e.stage, e.field, e.index)),
                Err(e) => panic!("{e}"),
            }
        };
        assert_eq!(stage(|_| {}), None);
        let adam = stage(|t| t.moments[0].positions[3][1] = f32::NAN);
        assert_eq!(adam, CHECKED.then_some(("Adam", "position", 3)));
        // What the renderer leaves out is found no later than after the step.
        let scale = stage(|t| t.cloud.log_scales[2][0] = f32::NAN);
        assert_eq!(scale, CHECKED.then_some(("Adam", "scale", 2)));
    }
}
