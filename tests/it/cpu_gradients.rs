//! Every parameter group's gradient against central differences in f64.

use crate::common::{camera, random_cloud, rng};
use fmlgs::math::stats;
use fmlgs::render::cpu::CpuRenderer;
use fmlgs::render::{CloudGradient, Features, Frame, FrameGradient, RenderSettings};
use fmlgs::scene::{Camera, GaussianCloud};
use rand::RngExt;

const EXTRA: usize = 6;

struct Problem {
    cloud: GaussianCloud<f64>,
    features: Vec<f64>,
    camera: Camera,
    settings: RenderSettings,
    weights: FrameGradient<f64>,
}

impl Problem {
    fn new(antialias: bool, degree: u8) -> Self {
        let camera = camera(40, 30);
        let cloud = random_cloud(14, degree, 0.25, 21);
        let mut r = rng(4);
        let features = (0..14 * EXTRA).map(|_| r.random_range(-1.0..1.0)).collect();
        let mut plane = || (0..40 * 30).map(|_| r.random_range(-1.0..1.0)).collect::<Vec<f64>>();
        let weights = FrameGradient {
            color: std::array::from_fn(|_| plane()),
            features: (0..EXTRA).map(|_| plane()).collect(),
            alpha: plane(),
            depth: plane(),
            ..FrameGradient::default()
        };
        let settings =
            RenderSettings { background: [0.3, 0.1, 0.8], antialias, depth: true, ..RenderSettings::default() };
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
        (0..3).map(|c| dot(&f.color[c], &w.color[c])).sum::<f64>()
            + (0..EXTRA).map(|c| dot(&f.features[c], &w.features[c])).sum::<f64>()
            + dot(&f.alpha, &w.alpha)
            + dot(&f.depth, &w.depth)
    }

    fn gradient(&self) -> CloudGradient<f64> {
        let mut renderer = CpuRenderer::new();
        self.draw(&mut renderer);
        let features = Features { channels: EXTRA, values: &self.features };
        renderer.backward(&self.cloud, features, &self.weights)
    }

    /// Largest error of a group, relative to the group's largest entry.
    fn check(&mut self, name: &str, analytic: &[f64], at: fn(&mut Self, usize) -> &mut f64) -> f64 {
        let scale = stats::worst(analytic.iter().map(|g| g.abs()));
        assert!(scale > 1e-3, "{name}: the gradient is all but zero, which proves nothing");
        let mut errors = Vec::new();
        for (i, g) in analytic.iter().enumerate() {
            let h = 1e-6;
            let start = *at(self, i);
            *at(self, i) = start + h;
            let up = self.loss();
            *at(self, i) = start - h;
            let down = self.loss();
            *at(self, i) = start;
            errors.push(((up - down) / (2.0 * h) - g).abs() / scale);
        }
        let worst = stats::worst(errors);
        println!("{name}: relative error {worst:.1e}");
        worst
    }
}

fn flat<const N: usize>(v: &[[f64; N]]) -> Vec<f64> {
    v.iter().flatten().copied().collect()
}

#[test]
fn every_group_matches_central_differences() {
    for (antialias, degree) in [(false, 3), (true, 1)] {
        let mut p = Problem::new(antialias, degree);
        let g = p.gradient();
        let errors = [
            p.check("positions", &flat(&g.positions), |p, i| &mut p.cloud.positions[i / 3][i % 3]),
            p.check("log-scales", &flat(&g.log_scales), |p, i| &mut p.cloud.log_scales[i / 3][i % 3]),
            p.check("quaternions", &flat(&g.quaternions), |p, i| &mut p.cloud.quaternions[i / 4][i % 4]),
            p.check("opacities", &g.opacity_logits, |p, i| &mut p.cloud.opacity_logits[i]),
            p.check("harmonics", &flat(&g.sh), |p, i| &mut p.cloud.sh[i / 3][i % 3]),
            p.check("features", &g.features, |p, i| &mut p.features[i]),
        ];
        assert!(errors.iter().all(|&e| e < 1e-5), "{errors:?}");
    }
}

#[test]
fn a_wrong_gradient_is_noticed() {
    let mut p = Problem::new(false, 1);
    let mut g = p.gradient();
    // Negative control: swap two Gaussians' gradients.
    g.positions.swap(0, 1);
    let error = p.check("positions, swapped", &flat(&g.positions), |p, i| &mut p.cloud.positions[i / 3][i % 3]);
    assert!(error > 1e-2, "{error}");
}
