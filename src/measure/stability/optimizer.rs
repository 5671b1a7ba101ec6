//! The optimizer on stiff problems and after outliers: Adam alone, and in a training.

use super::training::{blob, ends, start, train, trainer};
use super::{Case, Finding};
use crate::math::stats::worst;
use crate::pipeline::train::TrainView;
use crate::render::cpu::CpuRenderer;
use crate::render::cpu::adam::AdamStep;
use crate::render::{Features, RenderSettings};
use crate::scene::GaussianCloud;

/// Disturbance of one Gaussian at one step of a training.
#[derive(Clone, Copy, PartialEq)]
enum Hit {
    Nothing,
    /// Its position has a gradient of about 1e27.
    Outlier,
    /// It has the second moment that plain Adam would keep of that.
    Frozen,
}

/// The same training undisturbed, with an outlier gradient, and with what plain Adam would make of one.
/// For one step the camera has a focal length of 1e30 px, and a Gaussian on its axis is as much smaller.
fn outlier(faulty: bool) -> Finding {
    const WHICH: usize = 3;
    let run = |hit: Hit| {
        let trainer = trainer(start(), 400, false, 1.0);
        let (mut kept, mut at) = (None, [[0.0_f32; 3]; 2]);
        let trained = train(trainer, blob(), 400, |t, view| {
            if t.step == 100 && hit == Hit::Outlier {
                kept = Some((t.cloud.positions[WHICH], t.cloud.log_scales[WHICH], view.camera.focal_px));
                t.cloud.positions[WHICH] = [0.0; 3];
                t.cloud.log_scales[WHICH] = [-69.0; 3];
                view.camera.focal_px = glam::DVec2::splat(1e30);
            } else if let Some((position, scale, focal)) = kept.take() {
                (t.cloud.positions[WHICH], t.cloud.log_scales[WHICH]) = (position, scale);
                view.camera.focal_px = focal;
            }
            if t.step == 101 {
                at[0] = t.cloud.positions[WHICH];
                if hit == Hit::Frozen {
                    t.moments[1].positions[WHICH] = [1e27; 3];
                }
            }
        })?;
        at[1] = trained.trainer.cloud.positions[WHICH];
        let way = at[0].iter().zip(at[1]).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt();
        Ok::<_, Finding>((trained, way))
    };
    // The fault: the optimizer does what plain Adam would.
    let hit = if faulty { Hit::Frozen } else { Hit::Outlier };
    match (run(Hit::Nothing), run(hit), run(Hit::Frozen)) {
        (Ok((calm, way)), Ok((hit, hit_way)), Ok((_, frozen))) => {
            let text = format!(
                "goes {:.2} of its undisturbed way in 300 steps ({:.0e} if frozen); {} left as they were, {} cut",
                hit_way / way,
                frozen / way,
                hit.left[0],
                hit.left[1]
            );
            let finding = Finding::within(text, (hit_way / way - 1.0).abs(), 0.5);
            let told = hit.left[1] > 0 && calm.left == [0, 0];
            finding.and(told && frozen < 0.01 * way)
        }
        (Err(f), ..) | (_, Err(f), _) | (.., Err(f)) => f,
    }
}

/// A scene 1e-4 units large: the loss is 1e8 times as curved along positions as along log-scales.
fn stiff(faulty: bool) -> Finding {
    const SIZE: f64 = 1e-4;
    let mut view = blob();
    // The same image from 1e4 times as far with that focal length: nothing is nearer than the near plane.
    let small = |cloud: &mut GaussianCloud| {
        cloud.positions.iter_mut().flatten().for_each(|v| *v *= SIZE as f32);
        cloud.log_scales.iter_mut().flatten().for_each(|v| *v += SIZE.ln() as f32);
    };
    view.camera.focal_px *= 1.0 / SIZE;
    let mut cloud = start();
    small(&mut cloud);
    let curved = curvatures(&cloud, &view);
    let mut trainer = trainer(cloud, 300, false, SIZE);
    if faulty {
        // Rates of a scene of ordinary size.
        trainer.schedule.damping = 1.0 / SIZE;
    }
    match train(trainer, view, 300, |_, _| {}) {
        Ok(t) => {
            let (first, last) = ends(&t.losses);
            let [position, scale, opacity] = curved;
            let text = format!(
                "curvatures {position:.1e}, {scale:.1e}, {opacity:.1e}; loss {first:.4} to {last:.4}, {} cut",
                t.left[1]
            );
            let finding = Finding::within(text, last / first, 0.5);
            finding.and(position > 1e7 * worst([scale, opacity]))
        }
        Err(finding) => finding,
    }
}

/// Second derivatives of the mean squared error along a position, a log-scale and an opacity logit, the
/// largest of all Gaussians: by central differences in double precision.
fn curvatures(cloud: &GaussianCloud, view: &TrainView) -> [f64; 3] {
    let wide = cloud.cast::<f64>();
    let error = |c: &GaussianCloud<f64>| {
        let frame = CpuRenderer::<f64>::new().render(c, Features::NONE, &view.camera, &RenderSettings::default());
        let Ok(frame) = frame else { return f64::NAN };
        let each = frame.color.iter().enumerate().flat_map(|(k, plane)| {
            plane.iter().zip(&view.pixels.rgb).map(move |(v, p)| (v - f64::from(p[k]) / 255.0).powi(2))
        });
        each.sum::<f64>() / (3 * view.pixels.len()) as f64
    };
    let middle = error(&wide);
    type Move = fn(&mut GaussianCloud<f64>, usize, f64);
    let moves: [(Move, f64); 3] = [
        (|c, i, h| c.positions[i][0] += h, 1e-6),
        (|c, i, h| c.log_scales[i][0] += h, 1e-2),
        (|c, i, h| c.opacity_logits[i] += h, 1e-2),
    ];
    moves.map(|(shift, h)| {
        let at = |i: usize, h: f64| {
            let mut moved = wide.clone();
            shift(&mut moved, i, h);
            error(&moved)
        };
        let curvature = |i: usize| ((at(i, h) + at(i, -h) - 2.0 * middle) / (h * h)).abs();
        worst((0..wide.len()).map(curvature))
    })
}

pub(crate) fn cases() -> Vec<Case> {
    let training = |name: &'static str, run: fn(bool) -> Finding| Case::new("training", name, run);
    vec![
        training("Adam, 100,000 steps of no gradient", |faulty| {
            let (mut p, mut m, mut v) = (1.0, 1.0, 1.0);
            for t in 1..=100_000 {
                let g = if faulty && t == 50_000 { f32::NAN } else { 0.0 };
                AdamStep::new(t).update(&mut p, g, &mut m, &mut v, 1e-3);
            }
            Finding::is(format!("parameter {p:.4}"), p.is_finite() && m >= 0.0 && v >= 0.0)
        }),
        training("Adam after a gradient of 1e30 is back within 300 steps", |faulty| {
            let [calm, hit] = [false, true].map(|hit| {
                let (mut p, mut m, mut v) = (0.0_f32, 0.0, 0.0);
                let (mut longest, mut cut) = (0.0_f32, 0);
                for t in 1..=2_300 {
                    let before = p;
                    // A target that moves, so that it cannot be reached once and for all.
                    let g = p - (t as f32 * 0.01).sin();
                    let g = if hit && t == 2_000 { 1e30 } else { g };
                    cut += usize::from(AdamStep::new(t).update(&mut p, g, &mut m, &mut v, 1e-2));
                    if faulty && hit && t == 2_000 {
                        // As if it had been added whole, squares as large as they fit.
                        v = 1e30;
                    }
                    longest = longest.max((p - before).abs());
                }
                (p, longest, cut)
            });
            let outcome = format!("longest step {:.4} of a rate of 0.01, {} cut", hit.1, hit.2);
            let finding = Finding::within(outcome, f64::from((hit.0 - calm.0).abs()), 0.02);
            finding.and(hit.1 < 0.04 && (calm.2, hit.2) == (0, 1))
        }),
        training("Adam whose gradients grow a million times for good", |faulty| {
            let (mut p, mut m, mut v) = (0.0_f32, 0.0, 0.0);
            let mut at = [0.0; 2];
            for t in 1..=1_200 {
                let g = (p - 1.0).signum() * if t > 1_000 { 1.0 } else { 1e-6 };
                if !faulty || t <= 1_000 {
                    AdamStep::new(t).update(&mut p, g, &mut m, &mut v, 1e-4);
                }
                at = if t == 1_000 { [p, p] } else { [at[0], p] };
            }
            // It goes on as fast as the rate allows, neither stuck nor jumping.
            let way = f64::from(at[1] - at[0]) / (200.0 * 1e-4);
            Finding::is(format!("{way:.2} of the rate over the next 200 steps"), (0.5..4.0).contains(&way))
        }),
        training("an outlier gradient of 1e27 in a real training", outlier),
        training("position, scale and opacity on curvatures 1e8 apart", stiff),
        training("Adam on curvatures 1e8 apart", |faulty| {
            let curvature = [1.0_f32, 1e8];
            let (mut p, mut m, mut v) = ([1.0_f32; 2], [0.0; 2], [0.0; 2]);
            for t in 1..=4_000 {
                let rate = 1e-2 * 0.999_f32.powi(t);
                // The fault: the soft one is left alone.
                for k in usize::from(faulty)..2 {
                    let gradient = curvature[k] * p[k];
                    AdamStep::new(t as u64).update(&mut p[k], gradient, &mut m[k], &mut v[k], rate);
                }
            }
            Finding::within("distance from the minimum, stiff and soft alike", worst(p.map(f32::abs)), 1e-2)
        }),
    ]
}
