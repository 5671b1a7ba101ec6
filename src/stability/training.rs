//! Training under extremes: it improves, or leaves things as they are; it never makes a number that is
//! none.

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::drawing::{camera, one};
use super::{Case, Finding};
use crate::pipeline::train::trainer::Trainer;
use crate::pipeline::train::{TrainConfig, TrainView};
use crate::render::cpu::Renderer;
use crate::render::cpu::adam::AdamStep;
use crate::render::cpu::ssim::ssim;
use crate::render::{Features, RenderSettings};
use crate::scene::{GaussianCloud, PhotoPixels};

/// Steps of a short training.
const STEPS: u64 = 60;

/// A photo of one grey level.
fn flat(level: u8) -> TrainView {
    let at = camera(48, 32);
    let rgb = vec![[level; 3]; 48 * 32];
    TrainView {
        name: "flat".into(),
        pixels: PhotoPixels { width_px: at.width_px, height_px: at.height_px, rgb, coverage: None },
        camera: at,
    }
}

/// A photo of a coloured blob.
fn blob() -> TrainView {
    let mut view = flat(0);
    let cloud = one([0.5, 0.3, 0.4], [0.9, 0.1, 0.2, 0.0], 3.0).cast::<f32>();
    let frame = Renderer::new().render(&cloud, Features::NONE, &view.camera, &RenderSettings::default());
    if let Ok(frame) = frame {
        view.pixels.rgb = frame.to_rgb8();
    }
    view
}

/// Some Gaussians around the middle.
fn start() -> GaussianCloud {
    let mut cloud = one([0.2; 3], [1.0, 0.0, 0.0, 0.0], -1.0).cast::<f32>();
    cloud = cloud.select(&[0; 24]);
    for (i, p) in cloud.positions.iter_mut().enumerate() {
        let a = i as f32;
        *p = [0.6 * (a * 1.7).sin(), 0.4 * (a * 2.9).cos(), 0.3 * (a * 0.7).sin()];
    }
    cloud
}

/// Losses of a short training and how many Gaussians were left as they were; `Err` with what ended it.
fn losses(cloud: GaussianCloud, view: TrainView, change: impl Fn(&mut Trainer)) -> Result<(Vec<f64>, usize), Finding> {
    let config = TrainConfig { steps: STEPS, densify: false, sh_degree: 0, ..TrainConfig::default() };
    let mut trainer = Trainer::new(cloud, &config, [0.0; 3], 1.0, Pcg64Mcg::seed_from_u64(5));
    change(&mut trainer);
    let views = [view];
    let (mut losses, mut skipped) = (Vec::new(), 0);
    for _ in 0..STEPS {
        let results = trainer.advance(&views);
        let results = results.map_err(|e| Finding::is(format!("it stopped with a reason: {e}"), true))?;
        losses.extend(results.iter().map(|r| r.loss));
        skipped += results.iter().map(|r| r.skipped).sum::<usize>();
    }
    match trainer.cloud.validate() {
        Ok(()) => Ok((losses, skipped)),
        Err(e) => Err(Finding::is(format!("after training: {e}"), false)),
    }
}

/// Trains for a while; all that comes out is finite. A run under extremes need not improve.
fn trained(cloud: GaussianCloud, view: TrainView, change: impl Fn(&mut Trainer)) -> Finding {
    match losses(cloud, view, change) {
        Ok((losses, skipped)) => {
            let (first, last) = ends(&losses);
            let outcome = format!("loss {first:.4} to {last:.4}, {skipped} left as they were");
            Finding::is(outcome, first.is_finite() && last.is_finite())
        }
        Err(finding) => finding,
    }
}

/// Trains, and the loss has to fall.
fn improves(cloud: GaussianCloud, view: TrainView, change: impl Fn(&mut Trainer)) -> Finding {
    match losses(cloud, view, change) {
        Ok((losses, _)) => {
            let (first, last) = ends(&losses);
            Finding::within(format!("loss {first:.4} to {last:.4}"), last / first, 1.0)
        }
        Err(finding) => Finding { holds: false, ..finding },
    }
}

/// The first and the last loss; NaN for none.
fn ends(losses: &[f64]) -> (f64, f64) {
    let or_nan = |loss: Option<&f64>| loss.copied().unwrap_or(f64::NAN);
    (or_nan(losses.first()), or_nan(losses.last()))
}

/// The cases of this area.
pub fn cases() -> Vec<Case> {
    let training = |name: &'static str, run: fn() -> Finding| Case::new("training", name, run);
    vec![
        training("an ordinary start improves", || improves(start(), blob(), |_| {})),
        training("a black photo", || trained(start(), flat(0), |_| {})),
        training("a white photo", || trained(start(), flat(255), |_| {})),
        training("Gaussians under and far beyond a pixel", || {
            let mut cloud = start();
            cloud.log_scales[0] = [-40.0; 3];
            cloud.log_scales[1] = [12.0; 3];
            cloud.log_scales[2] = [3.0, -30.0, 0.0];
            trained(cloud, blob(), |_| {})
        }),
        training("opacity logits of +-80", || {
            let mut cloud = start();
            (cloud.opacity_logits[0], cloud.opacity_logits[1]) = (80.0, -80.0);
            trained(cloud, blob(), |_| {})
        }),
        training("quaternions of length 0 and 1e30", || {
            let mut cloud = start();
            (cloud.quaternions[0], cloud.quaternions[1]) = ([0.0; 4], [1e30, 1e30, 0.0, 0.0]);
            trained(cloud, blob(), |_| {})
        }),
        training("all coincident", || {
            let mut cloud = start();
            cloud.positions.fill([0.0; 3]);
            trained(cloud, blob(), |_| {})
        }),
        training("no Gaussian", || trained(GaussianCloud::default(), blob(), |_| {})),
        training("moments of an outlier gradient", || {
            improves(start(), blob(), |t| {
                t.moments[0].positions[0] = [1e15; 3];
                t.moments[1].positions[0] = [1e30; 3];
            })
        }),
        training("Adam, 100,000 steps of no gradient", || {
            let (mut p, mut m, mut v) = (1.0, 1.0, 1.0);
            for t in 1..=100_000 {
                AdamStep::new(t).update(&mut p, 0.0, &mut m, &mut v, 1e-3);
            }
            Finding::is(format!("parameter {p:.4}"), p.is_finite() && m >= 0.0 && v >= 0.0)
        }),
        training("Adam after a gradient of 1e15 rests, and does not jump", || {
            let (mut p, mut m, mut v) = (0.0_f32, 0.0, 0.0);
            let mut longest = 0.0_f32;
            for t in 1..=30_000 {
                let before = p;
                let g = if t == 10 { 1e15 } else { p - 1.0 };
                AdamStep::new(t).update(&mut p, g, &mut m, &mut v, 1e-2);
                longest = longest.max((p - before).abs());
            }
            // What it has seen keeps it still for a long time; it never moves faster than its rate allows.
            Finding::within(format!("at {p:.3} of 1 after 30,000 steps; longest step"), f64::from(longest), 0.04)
        }),
        training("Adam on curvatures 1e8 apart", || {
            let curvature = [1.0_f32, 1e8];
            let (mut p, mut m, mut v) = ([1.0_f32; 2], [0.0; 2], [0.0; 2]);
            for t in 1..=4_000 {
                let rate = 1e-2 * 0.999_f32.powi(t);
                for k in 0..2 {
                    let gradient = curvature[k] * p[k];
                    AdamStep::new(t as u64).update(&mut p[k], gradient, &mut m[k], &mut v[k], rate);
                }
            }
            let worst = f64::from(p[0].abs().max(p[1].abs()));
            Finding::within("distance from the minimum, stiff and soft alike", worst, 1e-2)
        }),
        training("SSIM of constant pictures", || {
            let plane = |v: f64| vec![vec![v; 32 * 24]; 3];
            let same = ssim(&plane(0.0), &plane(0.0), 32);
            let grey = ssim(&plane(0.5), &plane(0.5), 32);
            let apart = ssim(&plane(0.0), &plane(1.0), 32);
            let holds = (same - 1.0).abs() < 1e-9 && (grey - 1.0).abs() < 1e-9 && (0.0..0.01).contains(&apart);
            Finding::is(format!("alike {same:.6}, black and white {apart:.6}"), holds)
        }),
    ]
}
