//! The forward pass on the GPU, stage by stage, against the CPU renderer in f64.

use crate::common::{camera, random_cloud, rng};
use crate::gpu_common::compare::{agree_in_bands, bands};
use crate::gpu_common::with_context;
use fmlgs::math::{Real, stats};
use fmlgs::render::cpu::project::{CameraView, compensation, direction, geometry, raw_color};
use fmlgs::render::gpu::{GpuError, GpuRenderer};
use fmlgs::render::{ALPHA_MIN, Features, Frame, RenderError, RenderSettings, TILE_PX, cpu};
use fmlgs::scene::{Camera, GaussianCloud};
use glam::DVec3;
use rand::RngExt;
use std::sync::Arc;

struct Scene {
    cloud: GaussianCloud<f64>,
    features: Vec<f64>,
    channels: usize,
    camera: Camera,
    settings: RenderSettings,
}

impl Scene {
    /// `n` Gaussians in f32 precision, so that both renderers are given the same numbers.
    fn new(n: usize, degree: u8, channels: usize, size: [u32; 2]) -> Self {
        let cloud = random_cloud(n, degree, 0.12, 7).cast::<f32>().cast::<f64>();
        let mut r = rng(9);
        let features = (0..n * channels).map(|_| f64::from(r.random_range(-1.0_f32..1.0))).collect();
        let settings = RenderSettings { background: [0.2, 0.4, 0.6], depth: true, ..RenderSettings::default() };
        Self { cloud, features, channels, camera: camera(size[0], size[1]), settings }
    }

    fn oracle(&self) -> Frame<f64> {
        let features = Features { channels: self.channels, values: &self.features };
        cpu::CpuRenderer::new().render(&self.cloud, features, &self.camera, &self.settings).unwrap()
    }

    fn gpu(&self, renderer: &mut GpuRenderer) -> Frame<f32> {
        let features: Vec<f32> = self.features.iter().map(|&v| v as f32).collect();
        let features = Features { channels: self.channels, values: &features };
        renderer.render(&self.cloud.cast(), features, &self.camera, &self.settings).unwrap()
    }

    /// Compares a picture with the oracle's; the error names the difference.
    fn compare(&self, ours: &Frame<f32>, oracle: &Frame<f64>) -> Result<(), String> {
        let boundary = bands(&self.cloud, &self.camera, &self.settings, 1e-3).pixels;
        let planes = ours.color.iter().zip(&oracle.color).chain(ours.features.iter().zip(&oracle.features));
        for (c, (a, b)) in planes.enumerate() {
            agree_in_bands(&format!("channel {c}"), a, b, &boundary)?;
        }
        agree_in_bands("alpha", &ours.alpha, &oracle.alpha, &boundary)?;
        agree_in_bands("depth", &ours.depth, &oracle.depth, &boundary)?;
        // The median jumps from splat to splat at its cut, so only the interior means anything.
        let clear: Vec<usize> = (0..boundary.len()).filter(|&i| !boundary[i]).collect();
        let wrong = clear.iter().filter(|&&i| (f64::from(ours.median_depth[i]) - oracle.median_depth[i]).abs() > 1e-4);
        let wrong = wrong.count();
        if wrong > 0 { Err(format!("median depth: {wrong} of {} pixels", clear.len())) } else { Ok(()) }
    }
}

#[test]
fn projection_matches_the_oracle() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        for antialias in [false, true] {
            let mut scene = Scene::new(400, 3, 0, [150, 110]);
            scene.settings.antialias = antialias;
            scene.gpu(&mut renderer);
            let found = renderer.inspect().unwrap().unwrap();
            let mut drawn = 0;
            let mut errors = Vec::new();
            let view = CameraView::<f64>::new(&scene.camera, scene.cloud.origin, &scene.settings);
            for (i, splat) in found.splats.iter().enumerate().filter(|(_, s)| s.radius > 0.0) {
                drawn += 1;
                let gaussian = scene.cloud.gaussian(i);
                let g = geometry(&gaussian, &view).unwrap();
                let opacity = gaussian.opacity_logit.sigmoid() * if antialias { compensation(&g) } else { 1.0 };
                let [xx, xy, yy] = g.covariance;
                let det = g.determinants[1];
                let basis = fmlgs::math::sh::basis(3, direction(g.relative));
                let color = raw_color(gaussian.sh, &basis, 3).map(|c| c.max(0.0));
                let mean = [0, 1].map(|a| view.focal[a] * g.local[a] / g.local[2] + view.principal[a]);
                let [fx, fy, fz] = splat.factor.map(f64::from);
                let pairs = [
                    (f64::from(splat.mean[0]) / mean[0], 1.0),
                    (f64::from(splat.mean[1]) / mean[1], 1.0),
                    (f64::from(splat.depth) / g.local[2], 1.0),
                    (f64::from(splat.opacity) / opacity, 1.0),
                    (f64::from(splat.reach), 2.0 * (opacity / ALPHA_MIN).ln()),
                    (fx * fx * det / yy, 1.0),
                    (fx * fy * det, -xy),
                    ((fy * fy + fz * fz) * det / xx, 1.0),
                    (f64::from(splat.color[0]), color[0]),
                    (f64::from(splat.color[1]), color[1]),
                    (f64::from(splat.color[2]), color[2]),
                ];
                errors.extend(pairs.map(|(a, b)| (a - b).abs() / (1.0 + b.abs())));
            }
            assert!(drawn > 300, "{drawn} drawn");
            let worst = stats::worst(errors);
            assert!(worst < 2e-4, "antialias {antialias}: worst deviation {worst:e}");
        }
    });
}

/// Faults of a tile's list: a Gaussian that a pixel of the tile needs is missing, or the list is
/// not in order of depth.
fn list_faults(scene: &Scene, found: &fmlgs::render::gpu::renderer::Inspection) -> usize {
    let columns = (scene.camera.width_px as usize).div_ceil(TILE_PX);
    let size = [scene.camera.width_px as usize, scene.camera.height_px as usize];
    let mut faults = 0;
    for (t, range) in found.ranges.iter().enumerate() {
        let list = &found.list[range[0] as usize..range[1] as usize];
        faults +=
            list.windows(2).filter(|w| found.splats[w[0] as usize].depth > found.splats[w[1] as usize].depth).count();
        let corner = [(t % columns) * TILE_PX, (t / columns) * TILE_PX];
        for (i, s) in found.splats.iter().enumerate().filter(|(_, s)| s.radius > 0.0) {
            let mut needed = false;
            for y in corner[1]..(corner[1] + TILE_PX).min(size[1]) {
                for x in corner[0]..(corner[0] + TILE_PX).min(size[0]) {
                    let d = [x as f32 + 0.5 - s.mean[0], y as f32 + 0.5 - s.mean[1]];
                    let q = (s.factor[0] * d[0] + s.factor[1] * d[1]).powi(2) + (s.factor[2] * d[1]).powi(2);
                    needed |= q <= s.reach;
                }
            }
            let times = list.iter().filter(|&&j| j as usize == i).count();
            faults += usize::from(times > 1) + usize::from(needed && times == 0);
        }
    }
    faults
}

#[test]
fn every_tile_lists_what_its_pixels_need_in_order_of_depth() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let scene = Scene::new(300, 0, 0, [150, 110]);
        scene.gpu(&mut renderer);
        let mut found = renderer.inspect().unwrap().unwrap();
        assert_eq!(list_faults(&scene, &found), 0);
        // The exact test must leave out most of what the bounding boxes hold at this size.
        let pairs = found.list.len();
        assert!((300..6_000).contains(&pairs), "{pairs} pairs");
        // Negative controls: two neighbors swapped, one dropped.
        let full = found.ranges.iter().position(|r| r[1] - r[0] > 3).unwrap();
        let at = found.ranges[full][0] as usize;
        found.list.swap(at, at + 2);
        assert!(list_faults(&scene, &found) > 0, "swapped");
        found.list.swap(at, at + 2);
        found.list[at] = found.list[at + 1];
        assert!(list_faults(&scene, &found) > 0, "dropped");
    });
}

#[test]
fn pictures_match_the_oracle() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        // Sizes beside multiples of the tile, every degree, channels below, at and over a pass.
        for (degree, channels, antialias, size) in
            [(0, 0, false, [33, 17]), (1, 1, false, [64, 48]), (2, 6, true, [70, 50]), (3, 20, false, [47, 31])]
        {
            let mut scene = Scene::new(250, degree, channels, size);
            scene.settings.antialias = antialias;
            let oracle = scene.oracle();
            let ours = scene.gpu(&mut renderer);
            scene.compare(&ours, &oracle).unwrap();
            assert_eq!(ours.features.len(), channels);
            // Negative controls: some Gaussians moved, another blur.
            let mut other = Scene::new(250, degree, channels, size);
            other.settings.antialias = antialias;
            other.cloud.positions.iter_mut().take(20).for_each(|p| p[0] += 0.05);
            assert!(scene.compare(&other.gpu(&mut renderer), &oracle).is_err(), "some Gaussians moved");
            other.cloud = scene.cloud.clone();
            other.settings.antialias = !antialias;
            assert!(scene.compare(&other.gpu(&mut renderer), &oracle).is_err(), "antialias switched");
        }
    });
}

#[test]
fn lower_degree_than_stored_is_honored() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut scene = Scene::new(150, 3, 0, [48, 40]);
        scene.settings.sh_degree = 1;
        let oracle = scene.oracle();
        scene.compare(&scene.gpu(&mut renderer), &oracle).unwrap();
        scene.settings.sh_degree = 3;
        assert!(scene.compare(&scene.gpu(&mut renderer), &oracle).is_err(), "degree 3 differs");
    });
}

#[test]
fn a_scene_far_from_zero_renders_like_one_at_zero() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut scene = Scene::new(200, 1, 0, [60, 44]);
        let here = scene.gpu(&mut renderer);
        let away = DVec3::new(1e6, -2e6, 3e6 + 0.1);
        scene.cloud.origin += away;
        scene.camera.center += away;
        let there = scene.gpu(&mut renderer);
        let worst = |a: &Frame<f32>, b: &Frame<f32>| {
            stats::worst((0..3).map(|c| stats::worst_difference(&a.color[c], &b.color[c])))
        };
        assert!(worst(&here, &there) < 1e-3, "{}", worst(&here, &there));
        scene.camera.center.x += 0.01;
        assert!(worst(&here, &scene.gpu(&mut renderer)) > 1e-2, "a moved camera shows");
    });
}

#[test]
fn degenerate_gaussians_are_left_out_and_counted() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut scene = Scene::new(60, 0, 0, [40, 30]);
        let clean = scene.gpu(&mut renderer);
        assert_eq!(renderer.counters().unwrap().degenerate, 0);
        for i in 0..4 {
            scene.cloud.positions.push([0.0, 0.1, 0.0]);
            scene.cloud.log_scales.push([-2.0; 3]);
            scene.cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
            scene.cloud.opacity_logits.push(2.0);
            scene.cloud.sh.push([1.0; 3]);
            let last = 60 + i;
            match i {
                0 => scene.cloud.quaternions[last] = [0.0; 4],
                1 => scene.cloud.log_scales[last] = [200.0; 3],
                2 => scene.cloud.log_scales[last][1] = f64::NAN,
                _ => scene.cloud.sh[last][2] = f64::INFINITY,
            }
        }
        let poisoned = scene.gpu(&mut renderer);
        assert_eq!(renderer.counters().unwrap().degenerate, 4);
        assert_eq!(clean, poisoned);
        scene.cloud.quaternions[60] = [1.0, 0.0, 0.0, 0.0];
        assert_ne!(clean, scene.gpu(&mut renderer), "a sane Gaussian there is seen");
    });
}

#[test]
fn nothing_to_draw_gives_the_background() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut scene = Scene::new(3, 0, 0, [20, 10]);
        scene.cloud = GaussianCloud { sh_degree: 0, ..GaussianCloud::default() };
        let empty = scene.gpu(&mut renderer);
        assert!(empty.color[2].iter().all(|&v| v == 0.6) && empty.alpha.iter().all(|&a| a == 0.0));
        assert_eq!(empty.color[0].len(), 200);
    });
}

#[test]
fn a_frame_of_more_pairs_than_fit_is_drawn_in_the_end() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut scene = Scene::new(40, 0, 0, [320, 240]);
        scene.cloud.log_scales.iter_mut().for_each(|s| *s = [0.0; 3]);
        let ours = scene.gpu(&mut renderer);
        let counters = renderer.counters().unwrap();
        assert!(counters.pairs > 40 * 100 && counters.pairs == counters.wanted, "{counters:?}");
        let oracle = scene.oracle();
        let far = ours.alpha.iter().zip(&oracle.alpha).filter(|(a, b)| (f64::from(**a) - **b).abs() > 1e-2).count();
        assert!(far < 40, "{far} pixels");
    });
}

#[test]
fn unusable_input_is_refused_by_name() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let scene = Scene::new(5, 0, 0, [20, 10]);
        let cloud = scene.cloud.cast::<f32>();
        let mut bad = scene.camera.clone();
        bad.focal_px.x = f64::NAN;
        let refused = renderer.render(&cloud, Features::NONE, &bad, &scene.settings);
        assert!(matches!(refused, Err(GpuError::Render(RenderError::Camera(_)))), "{refused:?}");
        let short = Features { channels: 2, values: &[0.0; 3] };
        let refused = renderer.render(&cloud, short, &scene.camera, &scene.settings);
        assert!(matches!(refused, Err(GpuError::Render(RenderError::FeatureLength { have: 3, want: 10 }))));
    });
}

/// A grid of dots.
fn dots(shift: f32) -> Arc<GaussianCloud> {
    let n = 60;
    Arc::new(GaussianCloud {
        sh: (0..n).map(|i| [(i % 3) as f32 * 0.5, 0.2, 0.4]).collect(),
        ..GaussianCloud::isotropic(
            (0..n).map(|i| [(i % 8) as f32 * 0.1 - 0.4 + shift, (i / 8) as f32 * 0.1 - 0.4, 0.0]).collect(),
            -3.0,
            1.0,
        )
    })
}

#[test]
fn both_backends_draw_the_same_view_and_follow_the_cloud() {
    with_context(|context| {
        let mut gpu = fmlgs::render::Renderer::on_gpu(context).unwrap();
        let mut cpu = fmlgs::render::Renderer::new();
        let camera = Camera::look_at(DVec3::new(0.2, 0.1, -2.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 64, 48).unwrap();
        let settings = RenderSettings { depth: true, ..RenderSettings::default() };
        let mut worst = |cloud: &Arc<GaussianCloud>, on_cpu: &Arc<GaussianCloud>| {
            let a = gpu.draw(cloud, &camera, &settings).unwrap();
            let b = cpu.draw(on_cpu, &camera, &settings).unwrap();
            stats::worst_difference(&a.color.concat(), &b.color.concat())
        };
        let (one, other) = (dots(0.0), dots(0.07));
        assert!(worst(&one, &one) < 1e-3);
        assert!(worst(&other, &other) < 1e-3, "the other cloud was sent");
        assert!(worst(&other, &one) > 0.1, "another scene must differ");
        let names: Vec<&str> = cpu.stage_times().iter().map(|s| s.0).collect();
        assert_eq!(names, ["project", "sort", "bin", "blend"]);
        assert!(gpu.stage_times().is_empty(), "nobody asked for them");
        gpu.time_stages(true).unwrap();
        gpu.draw(&one, &camera, &settings).unwrap();
        assert_eq!(gpu.stage_times().is_empty(), !context.has_timestamps());
        gpu.time_stages(false).unwrap();
        assert!(gpu.stage_times().is_empty());
    });
}

#[test]
fn bytes_are_those_of_the_frame() {
    with_context(|context| {
        let scene = Scene::new(300, 2, 0, [51, 37]);
        let cloud = Arc::new(scene.cloud.cast::<f32>());
        let mut gpu = fmlgs::render::Renderer::on_gpu(context).unwrap();
        let frame = gpu.draw(&cloud, &scene.camera, &scene.settings).unwrap().to_rgb8();
        let bytes = gpu.draw_rgb8(&cloud, &scene.camera, &scene.settings).unwrap();
        assert_eq!(bytes.len(), 51 * 37);
        let differ = bytes.iter().flatten().zip(frame.iter().flatten()).filter(|(a, b)| a != b);
        let worst = differ.clone().map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
        assert!(worst <= 1 && differ.count() < 10, "rounding alone");
        let levels: std::collections::BTreeSet<u8> = bytes.iter().flatten().copied().collect();
        assert!(levels.len() > 50, "there is something to see");
    });
}

#[test]
fn a_picture_that_stays_on_the_device_is_the_same() {
    with_context(|context| {
        // Rows that end where those of textures do, and rows that do not.
        for size in [[51, 37], [64, 9], [193, 40]] {
            let scene = Scene::new(300, 2, 0, size);
            let cloud = scene.cloud.cast::<f32>();
            let mut gpu = GpuRenderer::new(context).unwrap();
            gpu.upload(&cloud, Features::NONE).unwrap();
            let bytes = gpu.draw_rgb8(&scene.camera, &scene.settings).unwrap();
            let picture = gpu.draw_texture(&scene.camera, &scene.settings).unwrap();
            // What is drawn later leaves it alone.
            let darker = RenderSettings { sh_degree: 0, background: [0.9; 3], ..scene.settings.clone() };
            let other = gpu.draw_texture(&scene.camera, &darker).unwrap().to_rgb8().unwrap();
            assert_eq!(picture.to_rgb8().unwrap(), bytes, "{size:?}");
            assert_ne!(other, bytes);
        }
    });
}

#[test]
fn labels_win_the_pixels_that_they_win_on_the_cpu() {
    with_context(|context| {
        let scene = Scene::new(600, 0, 0, [150, 110]);
        let cloud = Arc::new(scene.cloud.cast::<f32>());
        // Groups of three, one label without a group and one of which nothing is known.
        let groups: Vec<u32> = (0..37).map(|label| label / 3).collect();
        let label = |i: u32| [i % 37, 99, u32::MAX][usize::from(i % 11 == 3) + usize::from(i % 11 == 5) * 2];
        let of: Vec<u32> = (0..cloud.len() as u32).map(label).collect();
        let asked = (of.as_slice(), groups.as_slice());
        let mut cpu = fmlgs::render::Renderer::new();
        let want = cpu.label_winners(&cloud, asked, &scene.camera, &scene.settings).unwrap();
        let mut gpu = fmlgs::render::Renderer::on_gpu(context).unwrap();
        gpu.draw(&cloud, &camera(64, 48), &scene.settings).unwrap();
        // Of a view that was not drawn before, and of one that was; of another cloud the CPU finds them.
        let first = gpu.label_winners(&cloud, asked, &scene.camera, &scene.settings).unwrap();
        gpu.draw_rgb8(&cloud, &scene.camera, &scene.settings).unwrap();
        let second = gpu.label_winners(&cloud, asked, &scene.camera, &scene.settings).unwrap();
        assert!(first == second && first != want, "the GPU's own");
        let copy = cloud.as_ref().clone();
        assert!(gpu.label_winners(&copy, asked, &scene.camera, &scene.settings).unwrap() == want);
        let boundary = bands(&scene.cloud, &scene.camera, &scene.settings, 1e-3).pixels;
        let clear: Vec<usize> = (0..want.len()).filter(|&i| !boundary[i]).collect();
        let far = |a: f32, b: f32| (a - b).abs() > 1e-3;
        // Where two are equal, or more compete than there is room for, rounding decides.
        let differ = |i: usize| first[i].label != want[i].label || far(first[i].share, want[i].share);
        let wrong = clear.iter().filter(|&&i| differ(i)).count();
        assert!(wrong * 200 < clear.len(), "{wrong} of {}", clear.len());
        assert_eq!(clear.iter().find(|&&i| far(first[i].alpha, want[i].alpha)), None);
        let won: std::collections::BTreeSet<u32> = clear.iter().map(|&i| first[i].label).collect();
        assert!(won.len() > 20 && won.contains(&99) && won.contains(&u32::MAX) && won.contains(&0), "{won:?}");
    });
}
