//! The backward pass on the GPU against the CPU renderer in f64, every parameter group, with and
//! without float atomics.

use crate::common::{camera, random_cloud, rng};
use crate::gpu_common::compare::{Bounds, INTERIOR, agree, agree_in_bands, bands, spread};
use crate::gpu_common::with_context;
use fmlgs::render::gpu::{GpuError, GpuRenderer};
use fmlgs::render::{CloudGradient, Features, FrameGradient, RenderSettings, cpu};
use fmlgs::scene::{Camera, GaussianCloud};
use rand::RngExt;

struct Problem {
    cloud: GaussianCloud<f64>,
    features: Vec<f64>,
    channels: usize,
    camera: Camera,
    settings: RenderSettings,
    weights: FrameGradient<f64>,
}

impl Problem {
    fn new(n: usize, degree: u8, channels: usize, antialias: bool, seed: u64) -> Self {
        let camera = camera(52, 38);
        let pixels = 52 * 38;
        let cloud = random_cloud(n, degree, 0.15, seed).cast::<f32>().cast();
        let mut r = rng(seed + 1);
        let features = (0..n * channels).map(|_| f64::from(r.random_range(-1.0_f32..1.0))).collect();
        let mut plane = || (0..pixels).map(|_| f64::from(r.random_range(-1.0_f32..1.0))).collect::<Vec<f64>>();
        let weights = FrameGradient {
            color: std::array::from_fn(|_| plane()),
            features: (0..channels).map(|_| plane()).collect(),
            alpha: plane(),
            depth: plane(),
            ..FrameGradient::default()
        };
        let settings =
            RenderSettings { background: [0.3, 0.1, 0.8], antialias, depth: true, ..RenderSettings::default() };
        Self { cloud, features, channels, camera, settings, weights }
    }

    fn oracle(&self) -> CloudGradient<f64> {
        let features = Features { channels: self.channels, values: &self.features };
        let mut renderer = cpu::CpuRenderer::new();
        renderer.render(&self.cloud, features, &self.camera, &self.settings).unwrap();
        renderer.backward(&self.cloud, features, &self.weights)
    }

    fn gpu(&self, renderer: &mut GpuRenderer) -> CloudGradient<f32> {
        let narrow = |v: &Vec<f64>| v.iter().map(|&x| x as f32).collect::<Vec<f32>>();
        let values = narrow(&self.features);
        let features = Features { channels: self.channels, values: &values };
        let cloud = self.cloud.cast();
        renderer.render(&cloud, features, &self.camera, &self.settings).unwrap();
        let weights = FrameGradient {
            color: self.weights.color.each_ref().map(narrow),
            features: self.weights.features.iter().map(narrow).collect(),
            alpha: narrow(&self.weights.alpha),
            depth: narrow(&self.weights.depth),
            ..FrameGradient::default()
        };
        renderer.backward(&cloud, features, &weights).unwrap()
    }

    /// Complaints, one a group.
    fn compare(&self, ours: &CloudGradient<f32>, oracle: &CloudGradient<f64>) -> Vec<String> {
        let boundary = bands(&self.cloud, &self.camera, &self.settings, 1e-4).gaussians;
        let stride = self.cloud.sh_stride();
        let groups: [(&str, &[f32], &[f64], usize); 7] = [
            ("positions", ours.positions.as_flattened(), oracle.positions.as_flattened(), 3),
            ("log-scales", ours.log_scales.as_flattened(), oracle.log_scales.as_flattened(), 3),
            ("quaternions", ours.quaternions.as_flattened(), oracle.quaternions.as_flattened(), 4),
            ("opacity logits", &ours.opacity_logits, &oracle.opacity_logits, 1),
            ("harmonics", ours.sh.as_flattened(), oracle.sh.as_flattened(), 3 * stride),
            ("features", &ours.features, &oracle.features, self.channels),
            ("screen", &ours.screen, &oracle.screen, 1),
        ];
        let check = |(name, a, b, each): (&str, &[f32], &[f64], usize)| {
            agree_in_bands(name, a, b, &spread(&boundary, each)).err()
        };
        let out: Vec<String> = groups.into_iter().filter(|g| g.3 > 0).filter_map(check).collect();
        assert!(boundary.iter().filter(|b| !**b).count() * 4 > boundary.len(), "too few Gaussians are interior");
        out
    }
}

#[test]
fn gradients_match_the_oracle_in_every_group() {
    with_context(|context| {
        let mut kinds = vec![false];
        if context.has_float_atomics() {
            kinds.push(true);
        }
        for float_atomics in kinds {
            let mut renderer = GpuRenderer::with_float_atomics(context, float_atomics).unwrap();
            for (degree, channels, antialias) in [(0, 0, false), (2, 6, true), (3, 18, false)] {
                let problem = Problem::new(60, degree, channels, antialias, 31);
                let oracle = problem.oracle();
                let complaints = problem.compare(&problem.gpu(&mut renderer), &oracle);
                assert!(complaints.is_empty(), "degree {degree}, {channels} channels: {complaints:#?}");
                // Negative control: a scene whose every parameter is a little different.
                let mut other = Problem::new(60, degree, channels, antialias, 31);
                other.cloud.positions.as_flattened_mut().iter_mut().for_each(|v| *v += 0.01);
                other.cloud.opacity_logits.iter_mut().for_each(|v| *v += 0.05);
                let complaints = problem.compare(&other.gpu(&mut renderer), &oracle);
                let groups = if channels == 0 { 6 } else { 7 };
                assert_eq!(complaints.len(), groups, "every group of the other scene differs: {complaints:#?}");
            }
        }
    });
}

#[test]
fn many_splats_in_few_tiles_match_the_oracle() {
    with_context(|context| {
        // Several batches per tile, so that the walk goes from batch to batch.
        let mut renderer = GpuRenderer::new(context).unwrap();
        let mut problem = Problem::new(900, 0, 0, false, 5);
        problem.cloud.opacity_logits.iter_mut().for_each(|o| *o -= 3.5);
        let complaints = problem.compare_loosely(&problem.gpu(&mut renderer), &problem.oracle());
        assert!(complaints.is_empty(), "{complaints:#?}");
        let pairs = renderer.counters().unwrap().pairs;
        assert!(pairs > 12 * 130, "{pairs} pairs in 12 tiles fill more than two batches each");
        let mut other = Problem::new(900, 0, 0, false, 5);
        other.cloud.opacity_logits.iter_mut().for_each(|o| *o -= 3.4);
        assert!(!problem.compare_loosely(&other.gpu(&mut renderer), &problem.oracle()).is_empty());
    });
}

impl Problem {
    /// As `compare`, but with all Gaussians in one band: where splats are faint, nearly all of them
    /// have a pixel near the cut-off.
    fn compare_loosely(&self, ours: &CloudGradient<f32>, oracle: &CloudGradient<f64>) -> Vec<String> {
        let all = |n: usize| vec![true; n];
        let bounds = Bounds { absolute: 2e-2, relative: 1e-2, mismatches: 5e-2, cosine: 0.9999, bias: 5e-3 };
        let groups: [(&str, &[f32], &[f64]); 3] = [
            ("positions", ours.positions.as_flattened(), oracle.positions.as_flattened()),
            ("opacity logits", &ours.opacity_logits, &oracle.opacity_logits),
            ("harmonics", ours.sh.as_flattened(), oracle.sh.as_flattened()),
        ];
        groups.into_iter().filter_map(|(name, a, b)| agree(name, a, b, &all(b.len()), bounds).err()).collect()
    }
}

#[test]
fn a_gradient_of_the_wrong_size_is_refused() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        let problem = Problem::new(10, 0, 0, false, 3);
        problem.gpu(&mut renderer);
        let cloud = problem.cloud.cast();
        let weights = FrameGradient { alpha: vec![1.0; 7], ..FrameGradient::default() };
        let refused = renderer.backward(&cloud, Features::NONE, &weights);
        assert!(matches!(refused, Err(GpuError::Size { have: 7, .. })), "{refused:?}");
        let refused = renderer.backward(&cloud.select(&[0, 1]), Features::NONE, &FrameGradient::default());
        assert!(matches!(refused, Err(GpuError::Size { have: 2, want: 10, .. })), "{refused:?}");
    });
}

#[test]
fn the_comparison_catches_bias_turning_and_outliers() {
    let oracle: Vec<f64> = (0..1_000).map(|i| (f64::from(i) * 0.37).sin()).collect();
    let ours =
        |f: &dyn Fn(usize, f64) -> f64| oracle.iter().enumerate().map(|(i, &v)| f(i, v) as f32).collect::<Vec<_>>();
    let check = |values: &[f32]| agree("x", values, &oracle, &vec![true; 1_000], INTERIOR);
    check(&ours(&|_, v| v)).unwrap();
    check(&ours(&|i, v| v + if i % 2 == 0 { 3e-4 } else { -3e-4 })).unwrap();
    assert!(check(&ours(&|_, v| v + 5e-4)).is_err(), "bias");
    assert!(check(&ours(&|_, v| v * 1.01)).is_err(), "scale");
    assert!(check(&ours(&|i, v| if i < 3 { v + 0.1 } else { v })).is_err(), "outliers");
    assert!(check(&ours(&|i, v| if i == 9 { f64::NAN } else { v })).is_err(), "NaN");
    let nothing = agree("x", &ours(&|_, v| v), &oracle, &vec![false; 1_000], INTERIOR);
    assert!(nothing.is_err_and(|e| e.contains("nothing was compared")));
    let masked: Vec<bool> = (0..1_000).map(|i| i >= 3).collect();
    agree("x", &ours(&|i, v| if i < 3 { 9.0 } else { v }), &oracle, &masked, INTERIOR).unwrap();
}
