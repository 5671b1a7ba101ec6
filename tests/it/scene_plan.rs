//! Each omission of the scene plan, held both ways: the answer stays within its bound against
//! everything on, and what is saved is counted; beside it a scene that needs what was left out.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::common::alone;

use glam::DVec3;

use fmlgs::math::stats;
use fmlgs::pipeline::semantics::code_map::CodeMap;
use fmlgs::pipeline::semantics::query::matching;
use fmlgs::pipeline::semantics::view_map::ViewMap;
use fmlgs::render::gpu::cloud::Packed;
use fmlgs::render::{BackendChoice, Features, Frame, RenderSettings, Renderer};
use fmlgs::scene::plan::{NOISE_FLOOR, When};
use fmlgs::scene::resource_log::{self, ResourceKind};
use fmlgs::scene::{
    Camera, GaussianCloud, Identities, Level, Limits, Machine, NO_IDENTITY, Overrides, PhotoExposure, SceneFacts,
    ScenePlan, SemanticMap,
};
use fmlgs::worker::view::{QualityBudget, RenderThread, SkipPasses, ViewRequest};
use fmlgs::worker::{Versioned, ViewMode};

const LIMITS: Limits = Limits { train_side_px: 512, object_side_px: 1_024, sh_degree: 3, holdout_every: 8 };

fn camera(width_px: u32) -> Camera {
    Camera::look_at(DVec3::new(0.3, -0.4, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.7, width_px, width_px * 3 / 4)
        .expect("valid")
}

/// A disordered ball of `n` Gaussians with harmonics of degree 3, bands above the first scaled by `shine`.
fn ball(n: usize, log_scale: f32, shine: f32) -> GaussianCloud {
    let mut seed = 9_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1 << 24) as f32 - 0.5
    };
    let mut three = |scale: f32| [random() * scale, random() * scale, random() * scale];
    let positions = (0..n).map(|_| three(2.4)).collect();
    let sh = (0..n * 16).map(|k| three(if k % 16 == 0 { 2.0 } else { shine })).collect();
    GaussianCloud { sh_degree: 3, sh, ..GaussianCloud::isotropic(positions, log_scale, 1.5) }
}

/// Two objects beside each other, the left one with a part if wanted.
fn objects(cloud: &GaussianCloud, with_part: bool) -> SemanticMap {
    let mut all = Identities::default();
    let (left, right) = (all.add(Level::Object, NO_IDENTITY, vec![]), all.add(Level::Object, NO_IDENTITY, vec![]));
    (all.get_mut(left).unwrap().code, all.get_mut(right).unwrap().code) = ([0.1, 0.9, 0.3], [0.9, 0.1, 0.7]);
    let part = if with_part { all.add(Level::Part, left, vec![]) } else { left };
    if with_part {
        all.get_mut(part).unwrap().code = [0.1, 0.1, 0.9];
    }
    let of = cloud.positions.iter().map(|p| match (p[0] < 0.0, p[1] < 0.0) {
        (true, true) => part,
        (true, false) => left,
        _ => right,
    });
    let of = of.collect();
    SemanticMap::from_identities(all, of, vec![1.0; cloud.len()], vec![])
}

fn facts(cloud: &GaussianCloud, map: Option<&SemanticMap>, cameras: &[Camera]) -> SceneFacts {
    let facts = SceneFacts::of(Machine::default(), LIMITS).with_photos(cameras);
    facts.with_cloud(cloud, cloud.sh_degree, cameras).with_semantics(map)
}

fn plan(cloud: &GaussianCloud, map: Option<&SemanticMap>, cameras: &[Camera]) -> ScenePlan {
    ScenePlan::new(facts(cloud, map, cameras), &Overrides::default())
}

fn draw(cloud: &GaussianCloud, camera: &Camera, sh_degree: u8) -> Frame<f32> {
    let settings = RenderSettings { sh_degree, ..RenderSettings::default() };
    Renderer::new().render(cloud, Features::NONE, camera, &settings).expect("drawn")
}

/// The largest difference of two pictures in any channel.
fn worst(a: &Frame<f32>, b: &Frame<f32>) -> f64 {
    stats::worst(a.color.iter().zip(&b.color).map(|(a, b)| stats::worst_difference(a, b)))
}

#[test]
fn a_diffuse_scene_is_drawn_without_its_bands() {
    let (diffuse, shiny) = (ball(400, -2.5, 2e-4), ball(400, -2.5, 0.2));
    let degree = |cloud: &GaussianCloud| plan(cloud, None, &[]).sh_degree;
    let view = camera(160);
    let (full, planned) = (draw(&diffuse, &view, 3), draw(&diffuse, &view, degree(&diffuse)));
    assert!(worst(&full, &planned) < NOISE_FLOOR, "{}", worst(&full, &planned));
    let bytes =
        |cloud: &GaussianCloud| Packed::up_to(cloud, degree(cloud)).floats.iter().map(|f| f.len() * 4).sum::<usize>();
    assert_eq!((degree(&diffuse), bytes(&diffuse)), (0, 400 * (12 + 3) * 4));
    // The control: what can be seen is kept, and would be missed.
    assert_eq!((degree(&shiny), bytes(&shiny)), (3, 400 * (12 + 48) * 4));
    assert!(worst(&draw(&shiny, &view, 3), &draw(&shiny, &view, 0)) > 10.0 * NOISE_FLOOR);
}

#[test]
fn objects_without_parts_are_matched_with_half_the_channels() {
    let cloud = ball(400, -2.5, 0.0);
    let (view, settings) = (camera(160), RenderSettings::default());
    let codes = |map: &SemanticMap, parts: bool| {
        CodeMap::render(&mut Renderer::new(), &cloud, &map.codes, parts, &view, &settings).expect("drawn")
    };
    let mask = |map: &SemanticMap, codes: &CodeMap, id| matching::blend(codes, &map.identities, id, 0.2);
    let whole = objects(&cloud, false);
    let planned = plan(&cloud, Some(&whole), &[]);
    assert!(!planned.parts);
    let (all, half) = (codes(&whole, true), codes(&whole, planned.parts));
    for id in [1, 2] {
        assert!(!mask(&whole, &all, id).is_empty());
        assert_eq!(mask(&whole, &all, id), mask(&whole, &half, id), "the answer is the same");
    }
    let values = |codes: &CodeMap| codes.planes.iter().map(Vec::len).sum::<usize>();
    assert_eq!(values(&all), 2 * values(&half));
    // The control: with a part the level is there, and without it the part would not be found.
    let parted = objects(&cloud, true);
    assert!(plan(&cloud, Some(&parted), &[]).parts);
    assert!(!mask(&parted, &codes(&parted, true), 3).is_empty());
    assert!(mask(&parted, &codes(&parted, false), 3).is_empty());
}

/// Share of the pixels of `large` whose identity is that of the nearest pixel of `small`.
fn agreement(large: &ViewMap, small: &ViewMap) -> f64 {
    let near = |i: usize| {
        let (x, y) = (i % large.width_px, i / large.width_px);
        y * small.height_px / large.height_px * small.width_px + x * small.width_px / large.width_px
    };
    let same = (0..large.identity.len()).filter(|i| large.identity[*i] == small.identity[near(*i)]).count();
    same as f64 / large.identity.len() as f64
}

#[test]
fn a_far_larger_photo_than_the_gaussians_resolve_is_looked_at_smaller() {
    let (coarse, fine) = (ball(60, -1.2, 0.0), ball(20_000, -6.0, 0.0));
    let photo = camera(1_600);
    let side = |cloud: &GaussianCloud| {
        let map = objects(cloud, false);
        plan(cloud, Some(&map), std::slice::from_ref(&photo)).object_side_px
    };
    let maps = |cloud: &GaussianCloud, side_px: u32| {
        let (map, view) = (objects(cloud, false), photo.limited_to(side_px));
        let mut renderer = Renderer::new();
        let settings = RenderSettings::default();
        let drawn = ViewMap::render(&mut renderer, cloud, &map.identity_of, &map.identities, &view, &settings);
        drawn.expect("drawn")
    };
    let small = side(&coarse);
    assert!(small <= 320, "{small}");
    let (all, planned) = (maps(&coarse, LIMITS.object_side_px), maps(&coarse, small));
    let same = agreement(&all, &planned);
    assert!(same > 0.98, "{same}");
    assert!(10 * planned.identity.len() < all.identity.len(), "a tenth of the pixels at most");
    // The control: fine Gaussians keep their pixels, and would lose answers with fewer.
    assert_eq!(side(&fine), LIMITS.object_side_px);
    assert!(agreement(&maps(&fine, LIMITS.object_side_px), &maps(&fine, small)) < 0.98);
}

/// Outputs of the drawing thread for a request: true if there is a median depth, and true if there are maps.
fn looked_at(cloud: &GaussianCloud, map: Option<&SemanticMap>, plan: &ScenePlan, budget: QualityBudget) -> [bool; 2] {
    let render_thread = RenderThread::start(Arc::new(|| {})).expect("a thread");
    let semantics = map.filter(|_| plan.maps.now(false)).map(|m| Versioned::new(Arc::new(m.clone())));
    render_thread.request(ViewRequest {
        cloud: Versioned::new(Arc::new(cloud.clone())),
        camera: camera(160),
        mode: ViewMode::Rgb,
        second: None,
        others: Vec::new(),
        settings: RenderSettings::default(),
        budget,
        photo: None,
        exposure: PhotoExposure::default(),
        semantics,
        follow: false,
        codes: false,
        skip: SkipPasses::of(plan),
        on_device: false,
        timed: false,
        ticket: 1,
    });
    let until = |done: &dyn Fn() -> bool, limit: Duration| {
        let start = Instant::now();
        while !done() && start.elapsed() < limit {
            std::thread::sleep(Duration::from_millis(2));
        }
        done()
    };
    assert!(until(&|| render_thread.pictures().newer_than(0).is_some(), Duration::from_secs(60)), "a picture");
    let (_, picture) = render_thread.pictures().newer_than(0).expect("a picture");
    let depth = picture.as_ref().as_ref().expect("drawn").median_depth.is_some();
    // Maps come after the picture; that none do can only be seen by waiting a little.
    let wanted = map.is_some() && plan.maps == When::Always;
    let patience = if wanted { Duration::from_secs(60) } else { Duration::from_millis(300) };
    [depth, until(&|| render_thread.maps().newer_than(0).is_some(), patience)]
}

#[test]
fn maps_and_depth_are_drawn_only_where_the_plan_says_so() {
    let cloud = ball(200, -2.5, 0.0);
    let map = objects(&cloud, true);
    let of = |map: Option<&SemanticMap>, overrides: &Overrides, budget| {
        looked_at(&cloud, map, &ScenePlan::new(facts(&cloud, map, &[camera(160)]), overrides), budget)
    };
    let (auto, all) = (Overrides::default(), Overrides::everything());
    assert_eq!(of(None, &all, QualityBudget::Full), [true, false], "no semantics, no maps");
    assert_eq!(of(Some(&map), &auto, QualityBudget::Full), [true, false], "nobody has asked");
    assert_eq!(of(Some(&map), &all, QualityBudget::Full), [true, true], "the control: always wanted");
    assert_eq!(of(None, &auto, QualityBudget::Moving), [false, false], "the eye moves");
}

#[test]
fn working_memory_is_given_back_and_the_next_picture_is_the_same() {
    let (cloud, view) = (Arc::new(ball(2_000, -3.0, 0.1)), camera(320));
    let settings = RenderSettings { depth: true, ..RenderSettings::default() };
    let mut backend = Renderer::new();
    let held = Renderer::working_bytes;
    let before = backend.draw(&cloud, &view, &settings).expect("drawn");
    assert!(held(&backend) > cloud.len() * 48, "the control: it does hold something, {}", held(&backend));
    backend.release_buffers();
    assert_eq!(held(&backend), 0);
    assert_eq!(backend.draw(&cloud, &view, &settings).expect("drawn"), before);
}

#[test]
fn without_a_gpu_no_device_is_opened() {
    if !alone(module_path!(), "without_a_gpu_no_device_is_opened") {
        return;
    }
    let devices = || resource_log::since(0).iter().filter(|l| l.kind == ResourceKind::Device).count();
    let before = devices();
    let mut chosen = Renderer::choose(BackendChoice::Auto, |why| panic!("{why}")).expect("one that works");
    let real = fmlgs::render::real_gpu().is_some();
    assert_eq!(devices() > before, real, "a device for a real adapter only");
    assert_eq!(chosen.is_gpu(), real);
    let (cloud, view) = (Arc::new(ball(300, -2.5, 0.1)), camera(96));
    let settings = RenderSettings::default();
    let drawn = chosen.draw(&cloud, &view, &settings).expect("drawn");
    // Everything on is the GPU, emulated if it must be; its buffers are what is saved.
    if crate::gpu_common::adapter::context().is_none() {
        return;
    }
    let before = devices();
    let mut gpu = Renderer::choose(BackendChoice::Gpu, drop).expect("there is an adapter");
    assert!(devices() > before, "the control: asked for, it is opened");
    let other = gpu.draw(&cloud, &view, &settings).expect("drawn");
    assert!(worst(&drawn, &other) < 1e-3, "{}", worst(&drawn, &other));
    assert!(gpu.device_bytes() > (cloud.len() * 60 * 4) as u64);
    assert_eq!(Renderer::new().device_bytes(), 0);
    bands_that_are_sent(gpu);
}

/// Only the bands that are drawn are sent to a GPU.
fn bands_that_are_sent(mut gpu: Renderer) {
    let (cloud, view) = (Arc::new(ball(3_000, -2.5, 2e-4)), camera(96));
    let mut drawn = |sh_degree: u8| {
        let settings = RenderSettings { sh_degree, ..RenderSettings::default() };
        (gpu.draw(&cloud, &view, &settings).expect("drawn"), gpu.device_bytes())
    };
    let ((planned, few), (full, many)) = (drawn(0), drawn(3));
    assert!(worst(&planned, &full) < NOISE_FLOOR + 1e-3);
    // An empty buffer has a few bytes as well.
    assert!((many - few).abs_diff(3_000 * 45 * 4) < 64, "the control: all bands once they are drawn");
}

#[test]
fn rounding_stored_features_keeps_cosines() {
    let vector = |seed: u32| -> Vec<f32> {
        let raw: Vec<f32> = (0..512).map(|i| ((i * 37 + seed * 101) % 997) as f32 / 997.0 - 0.5).collect();
        let length = raw.iter().map(|v| v * v).sum::<f32>().sqrt();
        raw.iter().map(|v| v / length).collect()
    };
    let cosine = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    let rounded = |v: &[f32], bits: u32| -> Vec<f32> {
        let keep = (1_u32 << bits) as f32;
        v.iter().map(|x| if bits == 0 { half::f16::from_f32(*x).to_f32() } else { (x * keep).round() / keep }).collect()
    };
    let worst = |bits: u32| {
        let pairs = (0..40).flat_map(|a| (0..40).map(move |b| (a, b)));
        let change = |(a, b)| (cosine(&vector(a), &vector(b)) - cosine(&rounded(&vector(a), bits), &vector(b))).abs();
        stats::worst(pairs.map(change))
    };
    assert!(worst(0) < 1e-3, "{}", worst(0));
    assert!(worst(4) > 1e-3, "the control: four bits are too few");
}
