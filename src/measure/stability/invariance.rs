//! Changes that must not change the image: the order of Gaussians, the world's place, turn and size,
//! one Gaussian as two halves, where tiles end, the number of threads.

use glam::{DMat3, DQuat, DVec2, DVec3};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::drawing::camera;
use super::{Case, Finding};
use crate::math::stats::worst_difference;
use crate::render::cpu::CpuRenderer;
use crate::render::{Features, RenderSettings, TILE_PX};
use crate::scene::{Camera, GaussianCloud};

/// Gaussians of the scene that is changed.
const COUNT: usize = 400;

fn scene() -> GaussianCloud<f64> {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut cloud = GaussianCloud::default();
    for _ in 0..COUNT {
        let mut uniform = |lo: f64, hi: f64| rng.random_range(lo..hi);
        cloud.positions.push([uniform(-1.0, 1.0), uniform(-0.8, 0.8), uniform(-1.0, 1.0)]);
        cloud.log_scales.push([uniform(-3.5, -1.5), uniform(-3.5, -1.5), uniform(-3.5, -1.5)]);
        cloud.quaternions.push([uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.1, 1.0)]);
        cloud.opacity_logits.push(uniform(-2.0, 3.0));
        cloud.sh.push([uniform(-1.5, 1.5), uniform(-1.5, 1.5), uniform(-1.5, 1.5)]);
    }
    cloud
}

fn image(cloud: &GaussianCloud<f64>, camera: &Camera) -> Option<Vec<f32>> {
    let single = cloud.cast::<f32>();
    let frame = CpuRenderer::<f32>::new().render(&single, Features::NONE, camera, &RenderSettings::default()).ok()?;
    Some(frame.color.concat())
}

/// The changed scene's image compared with the first one's, in single precision.
fn alike(cloud: &GaussianCloud<f64>, at: &Camera, bound: f64) -> Finding {
    compare_images(image(&scene(), &camera(96, 64)), image(cloud, at), bound)
}

/// The images of two scenes from one place.
fn compared(a: &GaussianCloud<f64>, b: &GaussianCloud<f64>, at: &Camera, bound: f64) -> Finding {
    compare_images(image(a, at), image(b, at), bound)
}

fn compare_images(a: Option<Vec<f32>>, b: Option<Vec<f32>>, bound: f64) -> Finding {
    let Some((a, b)) = a.zip(b) else {
        return Finding::is("it could not be drawn", false);
    };
    // An image that shows nothing would be like any other that shows nothing.
    if a.iter().all(|v| *v == 0.0) {
        return Finding::is("nothing was drawn", false);
    }
    Finding::within("largest change of a color", worst_difference(&a, &b), bound)
}

/// The image as part of larger ones, in which it begins 1 to 15 px further right and down: tiles then
/// end at other pixels, as they would if they had another size.
fn tiles(faulty: bool) -> Finding {
    let (cloud, at) = (scene(), camera(96, 64));
    let [width, height] = [at.width_px as usize, at.height_px as usize];
    let whole = image(&cloud, &at);
    let mut worst = Finding::is("it could not be drawn", false);
    for shift in 1..TILE_PX as u32 {
        let (dx, dy) = (shift, (7 * shift) % TILE_PX as u32);
        let mut wider = at.clone();
        (wider.width_px, wider.height_px) = (at.width_px + dx, at.height_px + dy);
        // The fault: the last of them is off by a hundredth of a pixel.
        let off = if faulty && shift + 1 == TILE_PX as u32 { 0.01 } else { 0.0 };
        wider.principal_px += DVec2::new(f64::from(dx) + off, f64::from(dy));
        let stride = width + dx as usize;
        let part = image(&cloud, &wider).map(|all| {
            let row = |plane: &[f32], y: usize| {
                let first = (y + dy as usize) * stride + dx as usize;
                plane[first..first + width].to_vec()
            };
            let planes = all.chunks(stride * (height + dy as usize));
            planes.flat_map(|plane| (0..height).flat_map(move |y| row(plane, y))).collect()
        });
        let finding = compare_images(whole.clone(), part, 1e-5);
        let broken = finding.is_broken();
        if broken || !(finding.error <= worst.error) {
            worst = finding;
        }
        if broken {
            break;
        }
    }
    worst
}

pub(crate) fn cases() -> Vec<Case> {
    let case = |name: &'static str, bound: f64, change: fn(&mut GaussianCloud<f64>, &mut Camera)| {
        Case::new("invariance", name, move |faulty| {
            let (mut cloud, mut at) = (scene(), camera(96, 64));
            change(&mut cloud, &mut at);
            if faulty {
                // One Gaussian of all is forgotten.
                cloud.opacity_logits[COUNT / 2] = -80.0;
            }
            alike(&cloud, &at, bound)
        })
    };
    vec![
        case("the order of Gaussians", 1e-6, |cloud, _| {
            let mut order: Vec<usize> = (0..cloud.len()).collect();
            order.shuffle(&mut Pcg64Mcg::seed_from_u64(3));
            *cloud = cloud.select(&order);
        }),
        case("the world moved by a million", 1e-4, |cloud, at| {
            cloud.origin += DVec3::new(1e6, -1e6, 3e5);
            at.center += DVec3::new(1e6, -1e6, 3e5);
        }),
        case("the world turned", 1e-4, |cloud, at| {
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 2.0);
            for (p, q) in cloud.positions.iter_mut().zip(&mut cloud.quaternions) {
                *p = (turn * DVec3::from_array(*p)).to_array();
                let r = turn * DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
                *q = [r.w, r.x, r.y, r.z];
            }
            at.center = turn * at.center;
            at.world_from_camera = DMat3::from_quat(turn) * at.world_from_camera;
        }),
        case("the world a thousand times as large", 1e-4, |cloud, at| {
            cloud.positions.iter_mut().flatten().for_each(|v| *v *= 1e3);
            cloud.log_scales.iter_mut().flatten().for_each(|v| *v += 1e3_f64.ln());
            at.center *= 1e3;
        }),
        Case::new("invariance", "every thin Gaussian as two halves", |faulty| {
            // Two of opacity 1 - sqrt(1 - a), one behind the other, let through in their middle what one
            // of `a` does; elsewhere nearly, if `a` is small.
            let mut whole = scene();
            whole.opacity_logits.fill(-2.5);
            let order: Vec<usize> = (0..2 * whole.len()).map(|i| i / 2).collect();
            let mut halves = whole.select(&order);
            let opacity = 1.0 / (1.0 + 2.5_f64.exp());
            // The fault: both keep the opacity of the whole.
            let half = if faulty { opacity } else { 1.0 - (1.0 - opacity).sqrt() };
            halves.opacity_logits.fill((half / (1.0 - half)).ln());
            compared(&whole, &halves, &camera(96, 64), 4e-2)
        }),
        Case::new("invariance", "where tiles end", tiles),
        Case::new("invariance", "the number of threads", |faulty| {
            let draw = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()?;
                pool.install(|| image(&scene(), &camera(96, 64)))
            };
            match (draw(1), draw(5)) {
                (Some(a), Some(mut b)) => {
                    if faulty {
                        b[COUNT] = b[COUNT].next_up();
                    }
                    Finding::is("bit by bit", a == b && a.iter().any(|v| *v != 0.0))
                }
                _ => Finding::is("it could not be drawn", false),
            }
        }),
    ]
}
