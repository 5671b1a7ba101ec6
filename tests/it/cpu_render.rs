//! The f64 CPU renderer against a brute-force one that shares no code with it, and f32 against f64.

use crate::common::{camera, psnr, random_cloud};
use fmlgs::math::{rotation, sh, stats};
use fmlgs::render::cpu::CpuRenderer;
use fmlgs::render::{ALPHA_MAX, ALPHA_MIN, BLUR_PX2, Features, RenderSettings, TRANSMITTANCE_MIN};
use fmlgs::scene::{Camera, GaussianCloud};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Color, alpha, expected depth and median depth of every pixel, one pixel at a time, one Gaussian
/// at a time, with textbook formulas.
fn brute_force(cloud: &GaussianCloud<f64>, camera: &Camera, s: &RenderSettings) -> Vec<[f64; 6]> {
    struct Flat {
        mean: DVec2,
        inverse: DMat2,
        opacity: f64,
        color: DVec3,
        z: f64,
    }
    let mut flats = Vec::new();
    for i in 0..cloud.len() {
        let world = cloud.world_position(i);
        let p = camera.camera_from_world(world);
        if p.z <= s.near {
            continue;
        }
        let rows = rotation::matrix_from_quaternion(cloud.quaternions[i]).expect("valid");
        let r = DMat3::from_cols_array_2d(&rows).transpose();
        let scale = DMat3::from_diagonal(DVec3::from_array(cloud.log_scales[i].map(f64::exp)));
        let covariance = r * scale * scale * r.transpose();
        let w = camera.world_from_camera.transpose();
        let limit = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px)) * 0.65 / camera.focal_px;
        let t = (DVec2::new(p.x, p.y) / p.z).clamp(-limit, limit);
        let j = [
            DVec3::new(camera.focal_px.x / p.z, 0.0, -camera.focal_px.x * t.x / p.z),
            DVec3::new(0.0, camera.focal_px.y / p.z, -camera.focal_px.y * t.y / p.z),
        ];
        let c = w * covariance * w.transpose();
        let sharp =
            DMat2::from_cols_array(&[j[0].dot(c * j[0]), j[0].dot(c * j[1]), j[0].dot(c * j[1]), j[1].dot(c * j[1])]);
        let blurred = sharp + DMat2::from_diagonal(DVec2::splat(BLUR_PX2));
        let mut opacity = 1.0 / (1.0 + (-cloud.opacity_logits[i]).exp());
        if s.antialias {
            opacity *= (sharp.determinant() / blurred.determinant()).sqrt();
        }
        let b = sh::basis(
            s.sh_degree.min(cloud.sh_degree),
            (world - camera.center).try_normalize().expect("apart").to_array(),
        );
        let mut color = DVec3::splat(0.5);
        for (k, coefficient) in cloud.gaussian(i).sh.iter().enumerate() {
            color += b[k] * DVec3::from_array(*coefficient);
        }
        flats.push(Flat {
            mean: camera.project(world).expect("in front"),
            inverse: blurred.inverse(),
            opacity,
            color: color.max(DVec3::ZERO),
            z: p.z,
        });
    }
    flats.sort_by(|a, b| a.z.total_cmp(&b.z));
    let mut out = Vec::new();
    for y in 0..camera.height_px {
        for x in 0..camera.width_px {
            let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (mut left, mut color, mut depth, mut median) = (1.0, DVec3::ZERO, 0.0, 0.0);
            for f in &flats {
                let d = at - f.mean;
                let alpha = (f.opacity * (-0.5 * d.dot(f.inverse * d)).exp()).min(ALPHA_MAX);
                if alpha < ALPHA_MIN {
                    continue;
                }
                let next = left * (1.0 - alpha);
                if next < TRANSMITTANCE_MIN {
                    break;
                }
                if left > 0.5 && next <= 0.5 {
                    median = f.z;
                }
                color += f.color * (alpha * left);
                depth += f.z * alpha * left;
                left = next;
            }
            let background = DVec3::from_array(s.background.map(f64::from));
            let c = color + background * left;
            out.push([c.x, c.y, c.z, 1.0 - left, depth, median]);
        }
    }
    out
}

fn worst_difference(
    cloud: &GaussianCloud<f64>,
    other: &GaussianCloud<f64>,
    camera: &Camera,
    s: &RenderSettings,
) -> f64 {
    let want = brute_force(other, camera, s);
    let frame = CpuRenderer::new().render(cloud, Features::NONE, camera, s).expect("renders");
    let planes = [&frame.color[0], &frame.color[1], &frame.color[2], &frame.alpha, &frame.depth, &frame.median_depth];
    let pixels = want.iter().enumerate();
    stats::worst(pixels.flat_map(|(i, w)| planes.iter().zip(w).map(move |(plane, w)| (plane[i] - w).abs())))
}

#[test]
fn tiles_and_lanes_agree_with_brute_force() {
    let camera = camera(75, 53);
    for (n, scale, antialias) in [(60, 0.15, false), (400, 0.02, false), (400, 0.004, true), (2_000, 0.05, true)] {
        let cloud = random_cloud(n, 3, scale, n as u64);
        let s = RenderSettings { background: [0.2, 0.5, 0.9], antialias, depth: true, ..RenderSettings::default() };
        let worst = worst_difference(&cloud, &cloud, &camera, &s);
        assert!(worst < 1e-9, "{n} Gaussians of size {scale}: differs by {worst:e}");
        // Negative control: a tenth of the Gaussians that move a little fail the same comparison.
        let mut other = cloud.clone();
        other.positions.iter_mut().step_by(10).for_each(|p| p[0] += 1e-3);
        let worst = worst_difference(&cloud, &other, &camera, &s);
        assert!(worst > 1e-7, "the comparison is blind: {worst:e}");
    }
}

#[test]
fn single_precision_follows_the_oracle() {
    let camera = camera(160, 120);
    let cloud = random_cloud(3_000, 3, 0.03, 7);
    let s = RenderSettings::default();
    let a = CpuRenderer::new().render(&cloud, Features::NONE, &camera, &s).expect("renders");
    let b = CpuRenderer::new().render(&cloud.cast::<f32>(), Features::NONE, &camera, &s).expect("renders");
    let db = psnr(&a.color, &b.color);
    assert!(db > 60.0, "{db} dB");
    let mut other = cloud.cast::<f32>();
    other.opacity_logits[1_500] += 3.0;
    other.log_scales[1_500] = [-2.0; 3];
    let c = CpuRenderer::new().render(&other, Features::NONE, &camera, &s).expect("renders");
    assert!(psnr(&a.color, &c.color) < 60.0, "negative control");
}

#[test]
fn far_from_zero_renders_as_at_zero() {
    let near = random_cloud(500, 2, 0.05, 3).cast::<f32>();
    let mut far = near.clone();
    let shift = DVec3::new(1e6, -3e6, 2e6);
    far.origin = shift;
    let here = camera(96, 64);
    let there = Camera { center: here.center + shift, ..here.clone() };
    let s = RenderSettings::default();
    let a = CpuRenderer::new().render(&near, Features::NONE, &here, &s).expect("renders");
    let b = CpuRenderer::new().render(&far, Features::NONE, &there, &s).expect("renders");
    let db = psnr(&a.color, &b.color);
    assert!(db > 100.0, "{db} dB");
}

#[test]
fn threads_do_not_change_the_picture() {
    let cloud = random_cloud(5_000, 1, 0.03, 11).cast::<f32>();
    let camera = camera(200, 150);
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| {
            CpuRenderer::new().render(&cloud, Features::NONE, &camera, &RenderSettings::default()).expect("renders")
        })
    };
    assert_eq!(draw(1), draw(3));
}

#[test]
fn poison_is_left_out_and_counted() {
    let mut cloud = random_cloud(50, 0, 0.1, 5).cast::<f32>();
    cloud.quaternions[3] = [0.0; 4];
    cloud.log_scales[4] = [60.0, -60.0, 0.0];
    cloud.opacity_logits[5] = f32::NAN;
    cloud.positions[6] = [f32::NAN; 3];
    let mut renderer = CpuRenderer::new();
    let frame = renderer.render(&cloud, Features::NONE, &camera(64, 48), &RenderSettings::default()).expect("renders");
    assert!(frame.color.iter().flatten().chain(&frame.alpha).all(|v| v.is_finite()));
    assert!(renderer.stats().degenerate >= 2, "{:?}", renderer.stats());
}

#[test]
fn nothing_to_draw_gives_the_background() {
    let empty = GaussianCloud::<f32>::default();
    let s = RenderSettings { background: [0.1, 0.2, 0.3], ..RenderSettings::default() };
    let f = CpuRenderer::new().render(&empty, Features::NONE, &camera(17, 1), &s).expect("renders");
    assert!(f.color[2].iter().all(|&v| v == 0.3) && f.alpha.iter().all(|&v| v == 0.0));
}
