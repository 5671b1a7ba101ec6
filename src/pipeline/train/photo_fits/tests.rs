//! Short trainings on photos rendered of a made-up scene, with errors put into their poses and exposures.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::math::stats::mean;
use crate::pipeline::metrics;
use crate::pipeline::train::pose_offset::{MOVE_DEVIATION, TURN_DEVIATION};
use crate::pipeline::train::trainer::Trainer;
use crate::render::{BackendChoice, Features, RenderSettings, Renderer};
use crate::scene::PhotoPixels;

const PHOTOS: usize = 14;
const EXTENT: f64 = 3.0;
const STEPS: u64 = 700;

/// Colored Gaussians, most of them opaque.
fn scene() -> GaussianCloud {
    let mut rng = Pcg64Mcg::seed_from_u64(8);
    let mut v = |scale: f32| rng.random_range(-scale..scale);
    let n = 160;
    GaussianCloud {
        log_scales: (0..n).map(|_| [0; 3].map(|_| v(0.3) - 1.6)).collect(),
        quaternions: (0..n).map(|_| [0; 4].map(|_| v(1.0))).collect(),
        opacity_logits: (0..n).map(|_| 3.0 + v(1.0)).collect(),
        sh_degree: 0,
        sh: (0..n).map(|_| [0; 3].map(|_| v(1.2))).collect(),
        positions: (0..n).map(|_| [v(1.1), v(1.1), v(0.5)]).collect(),
        ..GaussianCloud::default()
    }
}

fn camera(k: f64) -> Camera {
    let a = k / PHOTOS as f64 * std::f64::consts::TAU;
    let eye = DVec3::new(2.8 * a.cos(), 2.8 * a.sin(), 1.4 + 0.4 * (3.0 * a).sin());
    Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid")
}

/// Photo of the scene from this camera, as an exposure takes it.
fn view(name: String, camera: Camera, by: &PhotoExposure) -> TrainView {
    let frame = Renderer::new().render(&scene(), Features::NONE, &camera, &RenderSettings::default()).expect("renders");
    let colors = exposure::exposed(by, &frame, [0.0; 3]);
    let rgb = Frame { color: colors, ..frame }.to_rgb8();
    TrainView { name, pixels: PhotoPixels { width_px: 64, height_px: 48, rgb, coverage: None, alpha: None }, camera }
}

/// Photos, whose true poses are returned, too.
fn views(off: f64, exposure: impl Fn(usize) -> PhotoExposure) -> (Vec<TrainView>, Vec<Camera>) {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let mut v = |scale: f64| DVec3::from_array([0; 3].map(|_| rng.random_range(-scale..=scale)));
    let deviation = 3.0_f64.sqrt();
    let one = |k: usize| {
        let truth = camera(k as f64);
        let along = v(off * deviation * MOVE_DEVIATION * EXTENT);
        let offset = PoseOffset { along, turn: v(off * deviation * TURN_DEVIATION) };
        let photo = view(format!("{k}"), truth.clone(), &exposure(k));
        (TrainView { camera: offset.applied(&truth), ..photo }, truth)
    };
    (0..PHOTOS).map(one).unzip()
}

fn config(refine_poses: bool, exposure: bool) -> TrainConfig {
    let backend = BackendChoice::Cpu;
    TrainConfig {
        steps: STEPS,
        densify: false,
        sh_degree: 0,
        backend,
        refine_poses,
        exposure,
        ..TrainConfig::default()
    }
}

/// Trainer that begins near the scene's own Gaussians, in gray.
fn trainer(config: &TrainConfig, views: &[TrainView], free: bool) -> Trainer {
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let mut cloud = scene();
    cloud.positions.as_flattened_mut().iter_mut().for_each(|p| *p += rng.random_range(-0.05..0.05));
    cloud.sh.fill([0.0; 3]);
    let mut trainer = Trainer::new(cloud, config, [0.0; 3], EXTENT, rng);
    trainer.fits = PhotoFits::new(config, views, &vec![free; views.len()], (0, EXTENT));
    trainer
}

fn advance(trainer: &mut Trainer, views: &[TrainView], until: u64) {
    while trainer.step < until {
        trainer.advance(views).expect("a step");
    }
}

fn trained(config: &TrainConfig, views: &[TrainView]) -> Trainer {
    let mut trainer = trainer(config, views, true);
    advance(&mut trainer, views, STEPS);
    trainer
}

/// Mean PSNR of photos that were not trained on, at their true poses, in dB.
fn held_out(trainer: &mut Trainer) -> f64 {
    let psnr = |k: usize| {
        let photo = view("held".into(), camera(k as f64 + 0.5), &PhotoExposure::default());
        let frame = trainer.draw(&photo.camera).expect("renders");
        metrics::psnr(&frame.color, (64, 48), &photo.pixels)
    };
    mean(&(0..PHOTOS).step_by(2).map(psnr).collect::<Vec<_>>())
}

fn as_it_is(_: usize) -> PhotoExposure {
    PhotoExposure::default()
}

/// Mean distance and turn from the true poses, in deviations.
fn errors(trainer: &Trainer, views: &[TrainView], truth: &[Camera]) -> f64 {
    let off = |i: usize| {
        let PoseOffset { along, turn } = PoseOffset::between(&truth[i], &trainer.fits.camera(i, &views[i].camera));
        along.length() / (MOVE_DEVIATION * EXTENT) + turn.length() / TURN_DEVIATION
    };
    mean(&(0..views.len()).map(off).collect::<Vec<_>>())
}

#[test]
fn held_photos_train_bit_for_bit_as_without() {
    let (views, _) = views(1.0, as_it_is);
    let run = |config: &TrainConfig, free: bool| {
        let mut trainer = trainer(config, &views, free);
        advance(&mut trainer, &views, 150);
        (trainer.cloud.clone(), trainer.moments.clone())
    };
    let without = run(&config(false, false), true);
    assert!(run(&config(true, true), false) == without, "nothing is learned, so nothing may change");
    assert!(run(&config(true, false), true) != without, "the control: poses move");
    assert!(run(&config(false, true), true) != without, "the control: exposures change");
}

#[test]
fn wrong_poses_are_found_and_right_ones_stay() {
    let (wrong, truth) = views(1.0, as_it_is);
    let (mut plain, mut refined) = (trained(&config(false, false), &wrong), trained(&config(true, false), &wrong));
    let (before, after) = (errors(&plain, &wrong, &truth), errors(&refined, &wrong, &truth));
    assert!(after < 0.5 * before, "{before} {after}");
    let [without, with] = [held_out(&mut plain), held_out(&mut refined)];
    assert!(with > without + 1.0, "{without} dB, {with} dB");
    let (right, truth) = views(0.0, as_it_is);
    let (mut plain, mut refined) = (trained(&config(false, false), &right), trained(&config(true, false), &right));
    assert!(errors(&refined, &right, &truth) < 0.2 * before, "{}", errors(&refined, &right, &truth));
    let [without, with] = [held_out(&mut plain), held_out(&mut refined)];
    assert!(with > without - 0.3, "{without} dB, {with} dB");
}

#[test]
fn exposures_are_learned_and_leave_the_scene_alone() {
    let stops = |k: usize| {
        let gain = 1.0 + 0.25 * (2.4 * k as f64).sin();
        PhotoExposure { gain: [gain * 1.05, gain, gain / 1.05], bias: [0.0; 3] }
    };
    let (views, _) = views(0.0, stops);
    let (mut plain, mut fitted) = (trained(&config(false, false), &views), trained(&config(false, true), &views));
    let [without, with] = [held_out(&mut plain), held_out(&mut fitted)];
    assert!(with > without + 1.0, "{without} dB, {with} dB");
    let found = &fitted.fits.exposures.as_ref().expect("on").exposures;
    let usual = mean(&(0..PHOTOS).map(|k| stops(k).gain[1]).collect::<Vec<_>>());
    let off = |k: usize| (found[k].gain[1] - stops(k).gain[1] / usual).abs();
    assert!(mean(&(0..PHOTOS).map(off).collect::<Vec<_>>()) < 0.05, "{found:?}");
    // The control: the exposures of other photos are further off than none.
    let other = |k: usize| (found[(k + 1) % PHOTOS].gain[1] - stops(k).gain[1] / usual).abs();
    assert!(mean(&(0..PHOTOS).map(other).collect::<Vec<_>>()) > 0.15, "{found:?}");
}

#[test]
fn what_a_checkpoint_keeps_goes_on_bit_for_bit() {
    let (views, _) = views(1.0, |k| PhotoExposure { gain: [0.9 + 0.02 * k as f64; 3], bias: [0.01; 3] });
    let config = config(true, true);
    let mut straight = trainer(&config, &views, true);
    advance(&mut straight, &views, 173);
    let text = serde_json::to_string(&straight.fits.stored(&views)).expect("JSON");
    let stored: Vec<StoredFit> = serde_json::from_str(&text).expect("read");
    let resume = |stored: &[StoredFit]| {
        let mut t = Trainer::new(straight.cloud.clone(), &config, [0.0; 3], EXTENT, straight.rng.clone());
        (t.moments, t.stats, t.step, t.round) =
            (straight.moments.clone(), straight.stats.clone(), straight.step, straight.round.clone());
        t.fits = PhotoFits::new(&config, &views, &[true; PHOTOS], (0, EXTENT));
        t.fits.restore(stored, &views);
        t
    };
    let (mut resumed, mut forgotten) = (resume(&stored), resume(&[]));
    for t in [&mut straight, &mut resumed, &mut forgotten] {
        advance(t, &views, 260);
    }
    assert!(resumed.cloud == straight.cloud && resumed.fits.stored(&views) == straight.fits.stored(&views));
    assert!(forgotten.cloud != straight.cloud, "the control: without what was kept it is another run");
}
