//! Surfels against rays cast in world space, and every gradient against central differences.

use crate::common::{camera, random_cloud, rng};
use fmlgs::math::{Real, rotation, stats};
use fmlgs::render::cpu::CpuRenderer;
use fmlgs::render::{
    ALPHA_MAX, ALPHA_MIN, CloudGradient, Features, Frame, FrameGradient, RenderSettings, TRANSMITTANCE_MIN,
};
use fmlgs::scene::{Camera, GaussianCloud};
use glam::{DVec2, DVec3};
use rand::RngExt;

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;
const PIXELS: usize = (WIDTH * HEIGHT) as usize;
const EXTRA: usize = 2;

fn settings() -> RenderSettings {
    RenderSettings {
        background: [0.3, 0.1, 0.8],
        depth: true,
        surfels: true,
        sh_degree: 0,
        ..RenderSettings::default()
    }
}

/// One pixel by the definition: rays meet planes in world space, in the order of the centers.
struct Pixel {
    alpha: f64,
    color: [f64; 3],
    depth: f64,
    median: f64,
    normal: DVec3,
    distortion: f64,
}

fn cast(cloud: &GaussianCloud<f64>, camera: &Camera, settings: &RenderSettings, px: DVec2) -> Pixel {
    let ray = camera.ray(px);
    let mut order: Vec<(f64, usize)> =
        (0..cloud.len()).map(|i| (camera.camera_from_world(cloud.world_position(i)).z, i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = 1.0;
    let mut weights: Vec<(f64, f64)> = Vec::new();
    let mut p = Pixel { alpha: 0.0, color: [0.0; 3], depth: 0.0, median: 0.0, normal: DVec3::ZERO, distortion: 0.0 };
    for (z, i) in order {
        let opacity = cloud.opacity_logits[i].sigmoid();
        if z <= settings.near || opacity < ALPHA_MIN {
            continue;
        }
        let Some(m) = rotation::matrix_from_quaternion(cloud.quaternions[i]) else { continue };
        let axis = |k: usize| DVec3::new(m[0][k], m[1][k], m[2][k]);
        let center = cloud.world_position(i);
        let t = axis(2).dot(center - camera.center) / axis(2).dot(ray);
        let point = camera.center + ray * t - center;
        let at = |k: usize| point.dot(axis(k)) / cloud.log_scales[i][k].exp();
        let plane = at(0).powi(2) + at(1).powi(2);
        let picture = 2.0 * (camera.project(center).unwrap() - px).length_squared();
        let through = t >= settings.near && plane <= picture;
        let (square, depth) = if through { (plane, t) } else { (picture, z) };
        let alpha = (opacity * (-0.5 * square).exp()).min(ALPHA_MAX);
        if alpha < ALPHA_MIN {
            continue;
        }
        if left * (1.0 - alpha) < TRANSMITTANCE_MIN {
            break;
        }
        let weight = alpha * left;
        let after = left - weight;
        if left > 0.5 && after <= 0.5 {
            p.median = depth;
        }
        left = after;
        p.distortion += weights.iter().map(|(w, d)| w * weight * (1.0 / d - 1.0 / depth).powi(2)).sum::<f64>();
        weights.push((weight, depth));
        let facing = if axis(2).dot(center - camera.center) >= 0.0 { -axis(2) } else { axis(2) };
        p.normal += facing * weight;
        p.depth += weight * depth;
        for (sum, sh) in p.color.iter_mut().zip(cloud.sh[i * cloud.sh_stride()]) {
            *sum += weight * (0.5 + 0.282_094_791_773_878_14 * sh).max(0.0);
        }
    }
    for (sum, background) in p.color.iter_mut().zip(settings.background) {
        *sum += left * f64::from(background);
    }
    p.alpha = 1.0 - left;
    p
}

/// Largest deviation of a frame from cast rays.
fn deviation<R: Real>(frame: &Frame<R>, cloud: &GaussianCloud<f64>, camera: &Camera, s: &RenderSettings) -> f64 {
    let mut errors = Vec::new();
    for y in 0..frame.height_px {
        for x in 0..frame.width_px {
            let p = cast(cloud, camera, s, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            let i = y * frame.width_px + x;
            let mut pairs = vec![
                (frame.alpha[i], p.alpha),
                (frame.depth[i], p.depth),
                (frame.median_depth[i], p.median),
                (frame.distortion[i], p.distortion),
            ];
            pairs.extend((0..3).map(|c| (frame.color[c][i], p.color[c])));
            pairs.extend((0..3).map(|c| (frame.normals[c][i], p.normal[c])));
            for (have, want) in pairs {
                assert!(have.is_finite(), "pixel {x}, {y}");
                errors.push((have.f64() - want).abs());
            }
        }
    }
    stats::worst(errors)
}

fn draw(cloud: &GaussianCloud<f64>, camera: &Camera, s: &RenderSettings) -> Frame<f64> {
    CpuRenderer::new().render(cloud, Features::NONE, camera, s).expect("renders")
}

/// The cases that formulas break at, by name.
fn special_cases() -> Vec<(&'static str, GaussianCloud<f64>, Camera)> {
    let ahead = |w, h| Camera::look_at(DVec3::new(0.0, -3.0, 0.0), DVec3::ZERO, DVec3::Z, 0.9, w, h).expect("valid");
    let one = |position: [f64; 3], scales: [f64; 3], quaternion: [f64; 4]| GaussianCloud {
        positions: vec![position],
        log_scales: vec![scales.map(f64::ln)],
        quaternions: vec![quaternion],
        opacity_logits: vec![1.5],
        sh: vec![[0.8, -0.3, 1.1]],
        ..GaussianCloud::default()
    };
    // The third axis is z of the world; the camera looks along y.
    let (lying, standing) = ([1.0, 0.0, 0.0, 0.0], [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0, 0.0]);
    let tilted = [0.9, 0.4, -0.1, 0.3];
    vec![
        ("edge-on", one([0.0; 3], [0.4, 0.4, 0.1], lying), ahead(WIDTH, HEIGHT)),
        ("all but edge-on", one([0.0, 0.0, 1e-9], [0.4, 0.4, 0.1], lying), ahead(WIDTH, HEIGHT)),
        ("facing", one([0.1, 0.2, -0.1], [0.4, 0.2, 0.1], standing), ahead(WIDTH, HEIGHT)),
        ("from behind", one([0.1, 0.2, -0.1], [0.4, 0.2, 0.1], [-0.5, 0.5, 0.1, 0.0]), ahead(WIDTH, HEIGHT)),
        ("behind the camera", one([0.0, -5.0, 0.0], [0.4, 0.4, 0.1], standing), ahead(WIDTH, HEIGHT)),
        ("through the camera's plane", one([0.0, -2.0, -0.3], [1.5, 1.5, 0.1], [1.0, 0.1, 0.0, 0.1]), ahead(70, 50)),
        ("zero scale", one([0.1, 0.0, 0.2], [1e-30, 1e-30, 1.0], tilted), ahead(WIDTH, HEIGHT)),
        ("zero along one axis", one([0.1, 0.0, 0.2], [0.5, 1e-30, 1.0], tilted), ahead(WIDTH, HEIGHT)),
        ("huge scale", one([0.1, 0.5, 0.2], [1e4, 1e4, 1.0], tilted), ahead(WIDTH, HEIGHT)),
        ("zero quaternion", one([0.0; 3], [0.4; 3], [0.0; 4]), ahead(WIDTH, HEIGHT)),
        ("beside the picture", one([2.5, 0.0, 0.0], [0.4, 0.9, 0.1], [0.8, 0.2, 0.5, 0.1]), ahead(WIDTH, HEIGHT)),
        ("smaller than a pixel", one([0.1, 0.0, 0.2], [1e-3, 2e-3, 1.0], tilted), ahead(70, 50)),
    ]
}

#[test]
fn surfels_are_where_rays_meet_them() {
    let camera = camera(WIDTH, HEIGHT);
    for (n, scale) in [(1, 0.3), (60, 0.15), (400, 0.03), (300, 0.5)] {
        let cloud = random_cloud(n, 0, scale, 7);
        let worst = deviation(&draw(&cloud, &camera, &settings()), &cloud, &camera, &settings());
        assert!(worst < 1e-9, "{n} surfels of {scale}: {worst:e}");
    }
    // Negative control: the third scale does not matter, the second does.
    let cloud = random_cloud(60, 0, 0.15, 7);
    let frame = draw(&cloud, &camera, &settings());
    let mut other = cloud.clone();
    other.log_scales.iter_mut().for_each(|s| s[2] += 1.0);
    assert_eq!(draw(&other, &camera, &settings()), frame);
    other.log_scales.iter_mut().for_each(|s| s[1] += 0.1);
    assert!(deviation(&frame, &other, &camera, &settings()) > 1e-3);
}

#[test]
fn special_cases_are_drawn_as_defined_and_stay_finite() {
    for (name, cloud, camera) in special_cases() {
        let frame = draw(&cloud, &camera, &settings());
        let worst = deviation(&frame, &cloud, &camera, &settings());
        let tolerance = if name == "all but edge-on" { 1e-6 } else { 1e-9 };
        assert!(worst < tolerance, "{name}: {worst:e}");
        let drawn = frame.alpha.iter().any(|a| *a > 0.05);
        assert_eq!(drawn, !["behind the camera", "zero quaternion"].contains(&name), "{name}");
        // In single precision, with gradients of everything, nothing may become infinite or NaN.
        let single = cloud.cast::<f32>();
        let mut renderer = CpuRenderer::<f32>::new();
        let frame = renderer.render(&single, Features::NONE, &camera, &settings()).expect("renders");
        assert!(frame.color.iter().flatten().chain(&frame.depth).chain(&frame.distortion).all(|v| v.is_finite()));
        let ones = || vec![1.0_f32; frame.alpha.len()];
        let gradient = FrameGradient {
            color: std::array::from_fn(|_| ones()),
            alpha: ones(),
            depth: ones(),
            median_depth: ones(),
            normals: std::array::from_fn(|_| ones()),
            distortion: ones(),
            ..FrameGradient::default()
        };
        let g = renderer.backward(&single, Features::NONE, &gradient);
        let all =
            g.positions.iter().flatten().chain(g.log_scales.iter().flatten()).chain(g.quaternions.iter().flatten());
        assert!(all.chain(&g.opacity_logits).chain(&g.screen).all(|v| v.is_finite()), "{name}: {g:?}");
    }
}

/// Share of the pixels that agree to 1e-4.
fn share_close(a: &[f32], b: &[f64]) -> f64 {
    assert_eq!((a.len(), a.is_empty()), (b.len(), false));
    a.iter().zip(b).filter(|(a, b)| (a.f64() - **b).abs() < 1e-4).count() as f64 / b.len() as f64
}

#[test]
fn the_fast_path_agrees_with_the_oracle() {
    let camera = camera(133, 97);
    for (n, scale) in [(200, 0.1), (2_000, 0.02)] {
        let cloud = random_cloud(n, 2, scale, 3).cast::<f32>();
        let s = RenderSettings { sh_degree: 2, ..settings() };
        let fast = CpuRenderer::<f32>::new().render(&cloud, Features::NONE, &camera, &s).expect("renders");
        let exact = draw(&cloud.cast(), &camera, &s);
        for c in 0..3 {
            assert!(stats::worst_difference(&fast.color[c], &exact.color[c]) < 2e-3);
        }
        // Alpha next to the least that counts may fall on either side: most pixels, not all.
        let others = [
            ("alpha", &fast.alpha, &exact.alpha),
            ("depth", &fast.depth, &exact.depth),
            ("median depth", &fast.median_depth, &exact.median_depth),
            ("distortion", &fast.distortion, &exact.distortion),
            ("normal x", &fast.normals[0], &exact.normals[0]),
            ("normal y", &fast.normals[1], &exact.normals[1]),
            ("normal z", &fast.normals[2], &exact.normals[2]),
        ];
        let shares = others.map(|(name, a, b)| (name, share_close(a, b)));
        println!("{n} surfels: {shares:?}");
        assert!(shares.iter().all(|(_, share)| *share > 0.99), "{shares:?}");
        // Control: planes exchanged, a surfel's worth of noise.
        assert!(share_close(&fast.normals[0], &exact.normals[1]) < 0.9);
        let noisy: Vec<f32> = fast.depth.iter().map(|d| d * 1.001).collect();
        assert!(share_close(&noisy, &exact.depth) < 0.9);
    }
}

struct Problem {
    cloud: GaussianCloud<f64>,
    features: Vec<f64>,
    camera: Camera,
    settings: RenderSettings,
    weights: FrameGradient<f64>,
}

impl Problem {
    fn new(cloud: GaussianCloud<f64>, camera: Camera, settings: RenderSettings) -> Self {
        let mut r = rng(4);
        let features = (0..cloud.len() * EXTRA).map(|_| r.random_range(-1.0..1.0)).collect();
        let pixels = (camera.width_px * camera.height_px) as usize;
        let mut plane = || (0..pixels).map(|_| r.random_range(-1.0..1.0)).collect::<Vec<f64>>();
        let weights = FrameGradient {
            color: std::array::from_fn(|_| plane()),
            features: (0..EXTRA).map(|_| plane()).collect(),
            alpha: plane(),
            depth: plane(),
            median_depth: plane(),
            normals: std::array::from_fn(|_| plane()),
            distortion: plane().iter().map(|d| d * 20.0).collect(),
        };
        Self { cloud, features, camera, settings, weights }
    }

    fn draw(&self, renderer: &mut CpuRenderer<f64>) -> Frame<f64> {
        let features = Features { channels: EXTRA, values: &self.features };
        renderer.render(&self.cloud, features, &self.camera, &self.settings).expect("renders")
    }

    /// A linear functional of the picture: its gradient is `weights`.
    fn loss(&self) -> f64 {
        let f = self.draw(&mut CpuRenderer::new());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let w = &self.weights;
        (0..3).map(|c| dot(&f.color[c], &w.color[c]) + dot(&f.normals[c], &w.normals[c])).sum::<f64>()
            + (0..EXTRA).map(|c| dot(&f.features[c], &w.features[c])).sum::<f64>()
            + dot(&f.alpha, &w.alpha)
            + dot(&f.depth, &w.depth)
            + dot(&f.median_depth, &w.median_depth)
            + dot(&f.distortion, &w.distortion)
    }

    fn gradient(&self) -> CloudGradient<f64> {
        let mut renderer = CpuRenderer::new();
        self.draw(&mut renderer);
        renderer.backward(&self.cloud, Features { channels: EXTRA, values: &self.features }, &self.weights)
    }

    /// Largest error of a group, relative to the group's largest entry. Every entry counts: in none of the
    /// scenes here does a pixel cross a cut-off within the width of the differences.
    fn check(&mut self, name: &str, analytic: &[f64], at: fn(&mut Self, usize) -> &mut f64) -> f64 {
        let scale = stats::worst(analytic.iter().map(|g| g.abs()));
        // Where all is zero, as for axes smaller than a pixel, differences must be, too.
        let scale = if scale > 1e-3 { scale } else { 1.0 };
        let error = |(i, g): (usize, &f64)| {
            const H: f64 = 1e-6;
            let start = *at(self, i);
            *at(self, i) = start + H;
            let up = self.loss();
            *at(self, i) = start - H;
            let down = self.loss();
            *at(self, i) = start;
            ((up - down) / (2.0 * H) - g).abs() / scale
        };
        let worst = stats::worst(analytic.iter().enumerate().map(error));
        println!("{name}: relative error {worst:.1e}");
        worst
    }

    fn check_all(&mut self, name: &str) {
        let g = self.gradient();
        let degree = self.cloud.sh_degree;
        let in_plane: Vec<f64> = g.log_scales.iter().flat_map(|s| [s[0], s[1]]).collect();
        assert!(g.log_scales.iter().all(|s| s[2] == 0.0));
        let errors = [
            self.check("positions", &flat(&g.positions), |p, i| &mut p.cloud.positions[i / 3][i % 3]),
            self.check("log-scales", &in_plane, |p, i| &mut p.cloud.log_scales[i / 2][i % 2]),
            self.check("quaternions", &flat(&g.quaternions), |p, i| &mut p.cloud.quaternions[i / 4][i % 4]),
            self.check("opacities", &g.opacity_logits, |p, i| &mut p.cloud.opacity_logits[i]),
            self.check("harmonics", &flat(&g.sh), |p, i| &mut p.cloud.sh[i / 3][i % 3]),
            self.check("features", &g.features, |p, i| &mut p.features[i]),
        ];
        assert!(errors.iter().all(|&e| e < 1e-5), "{name}, degree {degree}: {errors:?}");
    }
}

fn flat<const N: usize>(v: &[[f64; N]]) -> Vec<f64> {
    v.iter().flatten().copied().collect()
}

#[test]
fn every_group_matches_central_differences() {
    for (n, degree) in [(14, 0), (7, 1)] {
        let s = RenderSettings { sh_degree: degree, ..settings() };
        let mut problem = Problem::new(random_cloud(n, degree, 0.25, 21), camera(WIDTH, HEIGHT), s);
        let g = problem.gradient();
        let groups = [flat(&g.positions), flat(&g.log_scales), flat(&g.quaternions), g.opacity_logits, flat(&g.sh)];
        let scales = groups.map(|g| stats::worst(g.iter().map(|g| g.abs())));
        assert!(scales.iter().all(|s| *s > 1e-3), "a gradient that is all but zero proves nothing: {scales:?}");
        problem.check_all("random");
    }
}

#[test]
fn special_cases_match_central_differences() {
    let mut compared = 0;
    for (name, cloud, camera) in special_cases() {
        // Seen from the side, or smaller than a pixel, a surfel is drawn as a dot of fixed size, and what is not
        // drawn has no gradient: some groups are all zero there. That they are finite is held above.
        if ["edge-on", "all but edge-on", "behind the camera", "zero quaternion"].contains(&name) {
            continue;
        }
        println!("{name}");
        Problem::new(cloud, camera, settings()).check_all(name);
        compared += 1;
    }
    assert_eq!(compared, 8);
}

#[test]
fn a_wrong_gradient_is_noticed() {
    let mut p = Problem::new(random_cloud(14, 0, 0.25, 21), camera(WIDTH, HEIGHT), settings());
    let mut g = p.gradient();
    // Negative control: swap two surfels' gradients.
    g.positions.swap(0, 1);
    let error = p.check("positions, swapped", &flat(&g.positions), |p, i| &mut p.cloud.positions[i / 3][i % 3]);
    assert!(error > 1e-2, "{error}");
}

#[test]
fn without_depth_the_picture_is_the_same() {
    let cloud = random_cloud(60, 0, 0.15, 7);
    let camera = camera(WIDTH, HEIGHT);
    let (with, without) =
        (draw(&cloud, &camera, &settings()), draw(&cloud, &camera, &RenderSettings { depth: false, ..settings() }));
    assert_eq!((&with.color, &with.alpha), (&without.color, &without.alpha));
    assert!(without.depth.is_empty() && without.distortion.is_empty() && without.normals[0].is_empty());
    assert_eq!(with.distortion.len(), PIXELS);
}
