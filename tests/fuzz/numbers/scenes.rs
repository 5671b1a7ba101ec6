//! Scenes to draw, to go back through, and to train.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::source::Numbers;
use super::{Verdict, promise};
use fmlgs::math::Real;
use fmlgs::math::rotation::unit_quaternion;
use fmlgs::math::stats::worst;
use fmlgs::pipeline::train::density::{self, DensityRound, DensityStats};
use fmlgs::pipeline::train::{TrainConfig, TrainView, trainer::Trainer};
use fmlgs::render::cpu::CpuRenderer;
use fmlgs::render::{ALPHA_MIN, COLOR_MAX, CloudGradient, Features, Frame, FrameGradient, RenderSettings};
use fmlgs::scene::{Camera, GaussianCloud, PhotoPixels};

/// Inputs moved by a few roundings, at most, whose spread says what single precision can be held to. So
/// many, because each has an even chance only of exchanging two Gaussians that are equally far.
const MOVED: usize = 24;
/// Size of these moves, in units of a value: four roundings of single precision.
const ROUNDING: f64 = 2.4e-7;
/// One rounding of single precision.
const SINGLE: f64 = f32::EPSILON as f64;
/// Roundings in a sum of spherical harmonics, and in what turns a covariance into a footprint.
const TERMS: f64 = 32.0;
/// Largest deviation of a pixel that needs no excuse, as a share of the brightest.
const BOUND: f64 = 2e-3;
/// Share of pixels that may deviate by more, for what a cut-off decides one way or the other.
const EDGE: f64 = 0.05;

/// All numbers of a gradient, kind by kind.
fn all_numbers<R: Real>(g: &CloudGradient<R>) -> Vec<f64> {
    let all = g.positions.as_flattened().iter().chain(g.log_scales.as_flattened()).chain(g.quaternions.as_flattened());
    all.chain(&g.opacity_logits).chain(g.sh.as_flattened()).map(|v| v.f64()).collect()
}

/// Root of the sum of squares.
fn norm(v: impl Iterator<Item = f64>) -> f64 {
    v.map(|x| x * x).sum::<f64>().sqrt()
}

fn cloud(n: &mut Numbers) -> GaussianCloud {
    let count = n.pick(&[0, 1, 1, 2, 3, 8, 40]);
    let degree = n.pick(&[0, 0, 1, 2, 3]);
    let stride = fmlgs::math::sh::coefficients(degree);
    let mut cloud = GaussianCloud { sh_degree: degree, ..GaussianCloud::default() };
    let ties = n.chance(0.2);
    for i in 0..count {
        if ties && i > 0 && n.chance(0.5) {
            let again = cloud.select(&[i - 1]);
            cloud.positions.push(again.positions[0]);
            cloud.log_scales.push(again.log_scales[0]);
            cloud.quaternions.push(again.quaternions[0]);
            cloud.opacity_logits.push(again.opacity_logits[0]);
            cloud.sh.extend(again.sh);
            continue;
        }
        cloud.positions.push(n.several(-1.5, 1.5));
        cloud.log_scales.push(n.several(-6.0, 1.0));
        cloud.quaternions.push(n.several(-1.0, 1.0));
        cloud.opacity_logits.push(n.around(-4.0, 6.0));
        cloud.sh.extend((0..stride).map(|_| n.several::<3>(-1.0, 1.0)));
    }
    if n.chance(0.2) {
        cloud.origin = DVec3::new(n.wide(-1e6, 1e6), n.wide(-1e6, 1e6), n.wide(-1e6, 1e6));
    }
    cloud
}

fn rotation(n: &mut Numbers) -> DMat3 {
    let q = unit_quaternion(n.several::<4>(-1.0, 1.0).map(f64::from)).unwrap_or([1.0, 0.0, 0.0, 0.0]);
    DMat3::from_quat(DQuat::from_xyzw(q[1], q[2], q[3], q[0]))
}

/// A camera that mostly looks at the middle.
fn camera(n: &mut Numbers, origin: DVec3) -> Camera {
    let size = |n: &mut Numbers| [1 + n.below(40) as u32, n.pick(&[1, 2, 16, 17, 31])];
    let [width, height] = size(n);
    let turn = if n.chance(0.5) { DMat3::IDENTITY } else { rotation(n) };
    let focal = if n.chance(0.8) { n.size(5.0, 100.0) } else { n.size(1e-3, 1e6) };
    let away = if n.chance(0.8) { n.plain(2.0, 5.0) } else { n.wide(0.0, 10.0) };
    Camera {
        width_px: width,
        height_px: height,
        focal_px: DVec2::new(focal, if n.chance(0.9) { focal } else { n.wide(5.0, 100.0) }),
        principal_px: DVec2::new(n.wide(0.0, f64::from(width)), n.wide(0.0, f64::from(height))),
        world_from_camera: turn,
        center: origin - turn.z_axis * away + DVec3::new(n.wide(-0.1, 0.1), n.wide(-0.1, 0.1), 0.0),
    }
}

fn settings(n: &mut Numbers) -> RenderSettings {
    RenderSettings {
        sh_degree: n.below(4) as u8,
        background: std::array::from_fn(|_| n.plain(0.0, 1.0) as f32),
        near: n.size(1e-6, 1.0),
        antialias: n.chance(0.3),
        depth: n.chance(0.3),
        surfels: n.chance(0.3),
        ..RenderSettings::default()
    }
}

/// The scene with every value a few roundings away.
fn moved(cloud: &GaussianCloud<f64>, camera: &Camera, n: &mut Numbers) -> GaussianCloud<f64> {
    let mut moved = cloud.clone();
    for i in 0..cloud.len() {
        // What is rounded is where a Gaussian is relative to the camera.
        let reach = ROUNDING * (cloud.world_position(i) - camera.center).length();
        moved.positions[i].iter_mut().for_each(|v| *v += reach * n.plain(-1.0, 1.0));
        let mut nudge = |v: &mut f64, unit: f64| *v += 4.0 * ROUNDING * (unit + v.abs()) * n.plain(-1.0, 1.0);
        moved.log_scales[i].iter_mut().for_each(|v| nudge(v, 1.0));
        let longest = moved.quaternions[i].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        moved.quaternions[i].iter_mut().for_each(|v| nudge(v, longest));
        nudge(&mut moved.opacity_logits[i], 1.0);
    }
    moved.sh.iter_mut().flatten().for_each(|v| *v *= 1.0 + ROUNDING * n.plain(-1.0, 1.0));
    moved
}

fn planes<R>(frame: &Frame<R>) -> impl Iterator<Item = &Vec<R>> {
    let Frame { color, features, alpha, depth, median_depth, normals, distortion, .. } = frame;
    color.iter().chain(features).chain([alpha, depth, median_depth, distortion]).chain(normals)
}

/// Frames of both precisions, if the input was accepted.
struct Drawn {
    wide: GaussianCloud<f64>,
    single: CpuRenderer<f32>,
    double: CpuRenderer<f64>,
    frames: (Frame<f32>, Frame<f64>),
}

fn draw(cloud: &GaussianCloud, camera: &Camera, settings: &RenderSettings) -> Option<Drawn> {
    cloud.validate().ok()?;
    let (mut single, mut double) = (CpuRenderer::<f32>::new(), CpuRenderer::<f64>::new());
    let wide = cloud.cast::<f64>();
    let frame = single.render(cloud, Features::NONE, camera, settings).ok()?;
    let exact = double.render(&wide, Features::NONE, camera, settings).ok()?;
    Some(Drawn { wide, single, double, frames: (frame, exact) })
}

impl Drawn {
    /// Returns whether both precisions drew the same Gaussians.
    fn comparable(&self) -> bool {
        let (a, b) = (self.single.stats(), self.double.stats());
        (a.visible, a.degenerate) == (b.visible, b.degenerate)
    }

    /// By how much a color may deviate: a sum of spherical harmonics is as exact as its largest term, of
    /// those that are drawn.
    fn color_slack(&self, cloud: &GaussianCloud) -> f64 {
        let stride = fmlgs::math::sh::coefficients(cloud.sh_degree);
        let terms = |i: usize| cloud.sh[i * stride..(i + 1) * stride].iter().flatten();
        let largest = self.double.drawn().flat_map(|(i, _)| terms(i)).fold(0.0_f64, |m, v| m.max(f64::from(v.abs())));
        (TERMS * SINGLE * largest).min(COLOR_MAX)
    }

    /// By how much a gradient may deviate per unit of brightness: what a change of a covariance does to
    /// axes and turn grows with the longest axis on the picture, squared.
    fn shape_slack(&self, camera: &Camera) -> f64 {
        let focal = camera.focal_px.max_element();
        let longest = |i: usize| self.wide.log_scales[i].iter().fold(f64::MIN, |m, v| m.max(*v)).exp();
        let reach = self.double.drawn().map(|(i, depth)| 1.0 + longest(i) * focal / depth);
        TERMS * SINGLE * reach.map(|r| r * r).sum::<f64>()
    }
}

/// Pictures are finite, opacities between 0 and 1, and single precision is where double precision is.
pub fn drawing(n: &mut Numbers) -> Verdict {
    let (cloud, settings) = (cloud(n), settings(n));
    let camera = camera(n, cloud.origin);
    let Some(drawn) = draw(&cloud, &camera, &settings) else { return Verdict::Refused };
    let (frame, exact) = &drawn.frames;
    promise!(planes(frame).flatten().all(|v| v.is_finite()), "a pixel in single precision is not finite");
    promise!(planes(exact).flatten().all(|v| v.is_finite()), "a pixel in double precision is not finite");
    let solid = frame.alpha.iter().map(|a| f64::from(*a)).chain(exact.alpha.iter().copied());
    promise!(solid.into_iter().all(|a| (-1e-6..=1.0 + 1e-6).contains(&a)), "an opacity is not between 0 and 1");
    if !drawn.comparable() {
        return Verdict::NotCompared;
    }
    let (scale, slack) = (brightness(exact), drawn.color_slack(&cloud));
    let mut spread: Vec<[f64; 4]> = vec![[0.0; 4]; exact.alpha.len()];
    let allowed = 3 + (EDGE * spread.len() as f64) as usize;
    let mut off = off(&drawn.frames, &spread, scale, slack);
    for _ in 0..MOVED {
        if off.0 <= allowed {
            break;
        }
        let near = moved(&drawn.wide, &camera, n);
        let Ok(near) = CpuRenderer::<f64>::new().render(&near, Features::NONE, &camera, &settings) else { continue };
        let planes = near.color.iter().chain([&near.alpha]).zip(exact.color.iter().chain([&exact.alpha]));
        for (c, (a, b)) in planes.enumerate() {
            spread.iter_mut().zip(a.iter().zip(b)).for_each(|(s, (a, b))| s[c] = s[c].max((a - b).abs()));
        }
        off = self::off(&drawn.frames, &spread, scale, slack);
    }
    let (wrong, worst) = off;
    promise!(wrong <= allowed, "{wrong} of {} pixels are off, up to {worst:.1} times the bound", spread.len());
    Verdict::Held
}

/// The brightest pixel, at least 1.
fn brightness(exact: &Frame<f64>) -> f64 {
    exact.color.iter().flatten().fold(1.0, |m, v| m.max(*v))
}

/// Number of pixels that deviate by more than their bound, and the largest deviation in units of it.
fn off((frame, exact): &(Frame<f32>, Frame<f64>), spread: &[[f64; 4]], scale: f64, slack: f64) -> (usize, f64) {
    let each = spread.iter().enumerate().map(|(i, spread)| {
        let one = |c: usize| match c {
            3 => (f64::from(frame.alpha[i]) - exact.alpha[i]).abs() / (BOUND + 8.0 * spread[3]),
            c => (f64::from(frame.color[c][i]) - exact.color[c][i]).abs() / (BOUND * scale + slack + 8.0 * spread[c]),
        };
        worst((0..4).map(one))
    });
    let each: Vec<f64> = each.collect();
    // What is no number is off, too.
    (each.iter().filter(|e| !(**e <= 1.0)).count(), worst(each))
}

/// Gradients of single and double precision agree where both are ordinary.
pub fn gradients(n: &mut Numbers) -> Verdict {
    let (cloud, settings) = (cloud(n), settings(n));
    let camera = camera(n, cloud.origin);
    let Some(mut drawn) = draw(&cloud, &camera, &settings) else { return Verdict::Refused };
    let pixels = drawn.frames.0.alpha.len();
    let color: [Vec<f32>; 3] =
        std::array::from_fn(|_| (0..pixels).map(|_| n.plain(-1.0, 1.0) as f32 / pixels as f32).collect());
    let up = FrameGradient { color, ..FrameGradient::default() };
    let up64 = FrameGradient {
        color: up.color.each_ref().map(|p| p.iter().map(|v| f64::from(*v)).collect()),
        ..FrameGradient::default()
    };
    let single = all_numbers(&drawn.single.backward(&cloud, Features::NONE, &up));
    let double = all_numbers(&drawn.double.backward(&drawn.wide, Features::NONE, &up64));
    let ordinary = |v: &[f64]| v.iter().all(|x| x.abs() < 1e3);
    if !drawn.comparable() || !ordinary(&double) {
        return Verdict::NotCompared;
    }
    promise!(single.iter().all(|v| v.is_finite()), "a gradient is not finite though double precision's is ordinary");
    let off = norm(single.iter().zip(&double).map(|(a, b)| a - b));
    // One splat more or less at a pixel, as a cut-off decides it, is 1/255 of what the pixel can give.
    let scale = brightness(&drawn.frames.1);
    let edge = (ALPHA_MIN * cloud.len() as f64 + drawn.shape_slack(&camera)) * scale + drawn.color_slack(&cloud);
    let size = norm(double.iter().copied());
    let mut bound = 0.05 * size + edge;
    for _ in 0..MOVED {
        if off <= bound {
            break;
        }
        let near = moved(&drawn.wide, &camera, n);
        let mut renderer = CpuRenderer::<f64>::new();
        if renderer.render(&near, Features::NONE, &camera, &settings).is_ok() {
            let g = all_numbers(&renderer.backward(&near, Features::NONE, &up64));
            let spread = norm(g.iter().zip(&double).map(|(a, b)| a - b));
            bound = bound.max(0.05 * size + edge + 8.0 * spread);
        }
    }
    promise!(off <= bound, "the gradient is off by {off:.2e} of {size:.2e}, bound {bound:.2e}");
    Verdict::Held
}

/// A few steps of training and a round of density control leave numbers, or stop with a reason.
pub fn training(n: &mut Numbers) -> Verdict {
    let mut gaussians = cloud(n);
    let camera = camera(n, gaussians.origin);
    if gaussians.validate().is_err() || camera.validate().is_err() {
        return Verdict::Refused;
    }
    gaussians.extras.clear();
    let pixels = (camera.width_px * camera.height_px) as usize;
    let pixels = PhotoPixels {
        width_px: camera.width_px,
        height_px: camera.height_px,
        rgb: (0..pixels).map(|_| std::array::from_fn(|_| n.below(256) as u8)).collect(),
        coverage: n.chance(0.3).then(|| (0..pixels).map(|_| n.pick(&[0, 1, 254, 255])).collect()),
        alpha: n.chance(0.3).then(|| (0..pixels).map(|_| n.pick(&[0, 1, 254, 255])).collect()),
    };
    let views = [TrainView { name: "fuzz".into(), camera, pixels }];
    let config = TrainConfig {
        steps: n.pick(&[1, 3, 30_000]),
        densify: false,
        sh_degree: n.below(4) as u8,
        antialias: n.chance(0.3),
        surfels: n.chance(0.3),
        normal_weight: n.chance(0.3).then(|| n.size(1e-3, 10.0)),
        ..TrainConfig::default()
    };
    let extent = n.size(1e-12, 1e12);
    let mut trainer = Trainer::new(gaussians, &config, [0.0; 3], extent, n.rng());
    trainer.schedule.damping = n.size(1e-3, 1e3);
    trainer.step = n.pick(&[0, 0, 20_000]);
    for _ in 0..3 {
        // Gaussians and camera are valid: there is no reason to stop.
        let stopped = trainer.advance(&views).err();
        promise!(stopped.is_none(), "it stopped: {}", stopped.map(|e| e.to_string()).unwrap_or_default());
        let state = trainer.moments.iter().chain([&trainer.cloud]).try_for_each(GaussianCloud::validate);
        promise!(state.is_ok(), "after a step: {}", state.err().map(|e| e.to_string()).unwrap_or_default());
    }
    let count = trainer.cloud.len();
    let stats = DensityStats {
        gradient: (0..count).map(|_| n.around(0.0, 1e-3).abs()).collect(),
        seen: (0..count).map(|_| n.below(5) as u32).collect(),
    };
    let budget = n.below(2 * count + 2);
    let round = DensityRound { budget, rounds: 1 + n.below(5) as u64, frozen: 0 };
    let mut rng = n.rng();
    let Trainer { cloud, moments, .. } = &mut trainer;
    density::control(cloud, moments, &stats, &round, &mut rng);
    let state = moments.iter().chain([&*cloud]).try_for_each(GaussianCloud::validate);
    promise!(state.is_ok(), "after density control: {}", state.err().map(|e| e.to_string()).unwrap_or_default());
    promise!(cloud.len() <= budget.max(count), "{} Gaussians are over the budget", cloud.len());
    Verdict::Held
}
