//! The normals' loss through the whole renderer, against central differences in f64.

use crate::common::{camera, random_cloud};
use fmlgs::math::stats;
use fmlgs::render::cpu::CpuRenderer;
use fmlgs::render::cpu::normals::{self, SurfaceDepth};
use fmlgs::render::{CloudGradient, Features, FrameGradient, RenderSettings};
use fmlgs::scene::{Camera, GaussianCloud};

struct Problem {
    cloud: GaussianCloud<f64>,
    camera: Camera,
    surfels: bool,
    depth: SurfaceDepth,
}

impl Problem {
    /// Loss and gradient; normals of Gaussians go through extra channels, those of surfels do not.
    fn run(&self) -> (f64, CloudGradient<f64>) {
        let settings = RenderSettings { depth: true, surfels: self.surfels, sh_degree: 0, ..RenderSettings::default() };
        let mut values = Vec::new();
        let mut features = Features::NONE;
        if !self.surfels {
            normals::of_gaussians(&self.cloud, &self.camera, &mut values);
            features = Features { channels: 3, values: &values };
        }
        let mut renderer = CpuRenderer::new();
        let frame = renderer.render(&self.cloud, features, &self.camera, &settings).expect("renders");
        let drawn = if self.surfels { &frame.normals[..] } else { &frame.features[..] };
        let [x, y, z] = drawn else { panic!("three channels") };
        let (mut gradient, mut d_normals) = (FrameGradient::default(), Default::default());
        let loss =
            normals::consistency(&frame, [x, y, z], &self.camera, self.depth, 30.0, &mut gradient, &mut d_normals);
        if self.surfels {
            gradient.normals = d_normals;
        } else {
            gradient.features = d_normals.into();
        }
        let mut g = renderer.backward(&self.cloud, features, &gradient);
        if !self.surfels {
            let eye = normals::eye(&self.camera, &self.cloud);
            for (i, d) in g.features.as_chunks::<3>().0.iter().enumerate() {
                let turn = normals::backward(&self.cloud.gaussian(i), eye, *d);
                g.quaternions[i].iter_mut().zip(turn).for_each(|(q, t)| *q += t);
            }
        }
        (loss, g)
    }

    /// Largest error of a group, relative to the group's largest entry. Every entry counts: none of the
    /// scenes here has a pixel that begins or ceases to have a depth within the width of the differences.
    fn check(&mut self, name: &str, analytic: &[f64], at: fn(&mut Self, usize) -> &mut f64) -> f64 {
        let scale = stats::worst(analytic.iter().map(|g| g.abs()));
        assert!(scale > 1e-3, "{name}: the gradient is all but zero, which proves nothing");
        let error = |(i, g): (usize, &f64)| {
            const H: f64 = 1e-6;
            let start = *at(self, i);
            *at(self, i) = start + H;
            let up = self.run().0;
            *at(self, i) = start - H;
            let down = self.run().0;
            *at(self, i) = start;
            ((up - down) / (2.0 * H) - g).abs() / scale
        };
        let worst = stats::worst(analytic.iter().enumerate().map(error));
        println!("{name}: relative error {worst:.1e}");
        worst
    }
}

fn flat<const N: usize>(v: &[[f64; N]]) -> Vec<f64> {
    v.iter().flatten().copied().collect()
}

#[test]
fn the_loss_reaches_every_parameter_of_the_shape() {
    let kinds = [(false, SurfaceDepth::Expected), (true, SurfaceDepth::Expected), (true, SurfaceDepth::Median)];
    for (surfels, depth) in kinds {
        let mut cloud = random_cloud(8, 0, 0.4, 5);
        cloud.opacity_logits.iter_mut().for_each(|o| *o += 1.5);
        let mut p = Problem { cloud, camera: camera(24, 18), surfels, depth };
        let (loss, g) = p.run();
        assert!(loss > 0.1, "{loss}");
        let kind = format!("surfels {surfels}, {depth:?}");
        let of = |what: &str| format!("{kind}: {what}");
        let errors = [
            p.check(&of("positions"), &flat(&g.positions), |p, i| &mut p.cloud.positions[i / 3][i % 3]),
            p.check(&of("quaternions"), &flat(&g.quaternions), |p, i| &mut p.cloud.quaternions[i / 4][i % 4]),
            p.check(&of("log-scales"), &flat(&g.log_scales), |p, i| &mut p.cloud.log_scales[i / 3][i % 3]),
            p.check(&of("opacities"), &g.opacity_logits, |p, i| &mut p.cloud.opacity_logits[i]),
        ];
        assert!(errors.iter().all(|e| *e < 1e-4), "{kind}: {errors:?}");
        // Negative control: two Gaussians' turns exchanged.
        let mut swapped = g.quaternions.clone();
        swapped.swap(0, 1);
        let error = p.check(&of("exchanged"), &flat(&swapped), |p, i| &mut p.cloud.quaternions[i / 4][i % 4]);
        assert!(error > 1e-2, "{kind}: {error}");
    }
}

#[test]
fn a_step_against_the_gradient_lowers_the_loss() {
    let mut p = Problem {
        cloud: random_cloud(40, 0, 0.3, 9),
        camera: camera(40, 30),
        surfels: false,
        depth: SurfaceDepth::Expected,
    };
    let (before, g) = p.run();
    let step = |p: &mut Problem, by: f64| {
        for (q, d) in p.cloud.quaternions.iter_mut().zip(&g.quaternions) {
            q.iter_mut().zip(d).for_each(|(q, d)| *q -= by * d);
        }
    };
    step(&mut p, 1e-3);
    let down = p.run().0;
    step(&mut p, -2e-3);
    let up = p.run().0;
    assert!(down < before && before < up, "{down} {before} {up}");
}
