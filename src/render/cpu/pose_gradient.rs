//! Gradient of a picture with respect to its camera: moving the camera moves every Gaussian the other way.
//!
//! A rotation of the camera turns centers and shapes but no viewing direction in the world, so colors stay: the share
//! of a position's gradient that came through the viewing direction belongs to the translation alone.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::CpuRenderer;
use crate::math::Real;
use crate::render::FrameGradient;
use crate::scene::{Camera, GaussianCloud};

/// Gaussians whose gradients one task adds up; sums do not depend on the number of threads.
const TASK: usize = 4096;

/// Gradient of a loss with respect to pose and focal lengths of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseGradient {
    /// With respect to the center, along the camera's axes, per scene unit.
    pub translation: DVec3,
    /// With respect to a turn `w` about the camera's own axes, `world_from_camera * exp(w)`, per radian.
    pub rotation: DVec3,
    /// With respect to the focal lengths, per px.
    pub focal: DVec2,
}

impl<R: Real> CpuRenderer<R> {
    /// Gradient with respect to `camera` for the last rendered frame, which must have been of this cloud by this
    /// camera. Gaussians whose gradient is not finite are left out.
    pub fn pose_gradient(
        &mut self,
        cloud: &GaussianCloud<R>,
        camera: &Camera,
        gradient: &FrameGradient<R>,
    ) -> PoseGradient {
        self.backward_tiles(gradient);
        self.pose_gradient_of_tiles(cloud, camera)
    }

    /// The same after [`Self::backward_tiles`], while the cloud is still as it was drawn.
    pub(crate) fn pose_gradient_of_tiles(&self, cloud: &GaussianCloud<R>, camera: &Camera) -> PoseGradient {
        let (renderer, n) = (self, cloud.len());
        let part = |first: usize| {
            let own = (first..(first + TASK).min(n)).filter_map(|i| renderer.share(cloud, camera, i));
            own.fold(PoseGradient::default(), PoseGradient::plus)
        };
        let tasks = (0..n.div_ceil(TASK)).into_par_iter().map(|task| part(task * TASK));
        let sum = tasks.collect::<Vec<_>>().into_iter().fold(PoseGradient::default(), PoseGradient::plus);
        let camera_from_world = camera.world_from_camera.transpose();
        PoseGradient {
            translation: camera_from_world * sum.translation,
            rotation: camera_from_world * sum.rotation,
            focal: sum.focal,
        }
    }

    /// The share of Gaussian `i`, in world axes.
    fn share(&self, cloud: &GaussianCloud<R>, camera: &Camera, i: usize) -> Option<PoseGradient> {
        let gaussian = cloud.gaussian(i);
        let g = self.gaussian_gradient(&gaussian, i)?;
        let vector = |[x, y, z]: [R; 3]| DVec3::new(x.f64(), y.f64(), z.f64());
        let (position, turned) = (vector(g.position), vector(g.turned));
        let relative = cloud.world_position(i) - camera.center;
        let [w, x, y, z] = gaussian.quaternion;
        let [dw, dx, dy, dz] = g.quaternion;
        let (axis, d_axis) = (vector([x, y, z]), vector([dx, dy, dz]));
        // The quaternion changes by half of (0, -turn) times itself.
        let shape = (axis * dw.f64() - d_axis * w.f64() - axis.cross(d_axis)) * 0.5;
        let share = PoseGradient {
            translation: -position,
            rotation: shape - relative.cross(position - turned),
            focal: DVec2::new(g.focal[0].f64(), g.focal[1].f64()),
        };
        (share.translation.is_finite() && share.rotation.is_finite() && share.focal.is_finite()).then_some(share)
    }
}

impl PoseGradient {
    fn plus(self, other: Self) -> Self {
        Self {
            translation: self.translation + other.translation,
            rotation: self.rotation + other.rotation,
            focal: self.focal + other.focal,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat};
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::math::sh::coefficients;
    use crate::render::{Features, RenderSettings};

    /// Gaussians in front of a camera, with colors that depend on the direction, and weights of the picture's pixels.
    fn problem(degree: u8) -> (GaussianCloud<f64>, Camera, FrameGradient<f64>) {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let mut v = |scale: f64| rng.random_range(-scale..scale);
        let (n, stride) = (14, coefficients(degree));
        let cloud = GaussianCloud {
            origin: DVec3::new(3.0, -1.0, 2.0),
            positions: (0..n).map(|_| [v(1.2), v(0.9), v(0.8)]).collect(),
            log_scales: (0..n).map(|_| [0; 3].map(|_| v(0.5) - 1.4)).collect(),
            quaternions: (0..n).map(|_| [0; 4].map(|_| v(1.0))).collect(),
            opacity_logits: (0..n).map(|_| v(1.5)).collect(),
            sh_degree: degree,
            sh: (0..n * stride).map(|_| [0; 3].map(|_| v(0.3))).collect(),
            ..GaussianCloud::default()
        };
        let eye = cloud.origin + DVec3::new(0.4, -3.0, 0.7);
        let mut camera = Camera::look_at(eye, cloud.origin, DVec3::Z, 0.8, 40, 30).expect("valid");
        camera.focal_px.y *= 1.1;
        let mut plane = || (0..40 * 30).map(|_| v(1.0)).collect::<Vec<f64>>();
        let weights = FrameGradient {
            color: std::array::from_fn(|_| plane()),
            alpha: plane(),
            depth: plane(),
            ..FrameGradient::default()
        };
        (cloud, camera, weights)
    }

    /// Largest difference of the pose gradient from central differences, by the largest of each kind.
    fn errors(settings: &RenderSettings, degree: u8, tamper: fn(&mut PoseGradient)) -> [f64; 3] {
        let (cloud, camera, weights) = problem(degree);
        let loss = |camera: &Camera| {
            let frame = CpuRenderer::new().render(&cloud, Features::NONE, camera, settings).expect("renders");
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            (0..3).map(|c| dot(&frame.color[c], &weights.color[c])).sum::<f64>()
                + dot(&frame.alpha, &weights.alpha)
                + dot(&frame.depth, &weights.depth)
        };
        let mut renderer = CpuRenderer::new();
        renderer.render(&cloud, Features::NONE, &camera, settings).expect("renders");
        let mut found = renderer.pose_gradient(&cloud, &camera, &weights);
        tamper(&mut found);
        let changed = |kind: usize, axis: usize, by: f64| {
            let mut c = camera.clone();
            let along = DVec3::from_array(std::array::from_fn(|k| if k == axis { by } else { 0.0 }));
            match kind {
                0 => c.center += camera.world_from_camera * along,
                1 => c.world_from_camera = camera.world_from_camera * DMat3::from_quat(DQuat::from_scaled_axis(along)),
                _ => c.focal_px += along.truncate(),
            }
            c
        };
        let of = |kind: usize, found: &[f64]| {
            // Focal lengths are some tens of px.
            let h = if kind == 2 { 1e-5 } else { 1e-6 };
            let slope = |axis| (loss(&changed(kind, axis, h)) - loss(&changed(kind, axis, -h))) / (2.0 * h);
            let scale = found.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
            assert!(scale > 1e-3, "the gradient is all but zero, which proves nothing");
            found.iter().enumerate().map(|(axis, g)| (slope(axis) - g).abs() / scale).fold(0.0, f64::max)
        };
        [of(0, &found.translation.to_array()), of(1, &found.rotation.to_array()), of(2, &found.focal.to_array())]
    }

    #[test]
    fn pose_and_focal_lengths_match_central_differences() {
        for (antialias, surfels, degree) in [(false, false, 3), (true, false, 1), (false, false, 0), (false, true, 2)] {
            let settings = RenderSettings { antialias, surfels, depth: true, ..RenderSettings::default() };
            let errors = errors(&settings, degree, |_| {});
            assert!(errors.iter().all(|e| *e < 1e-5), "{antialias} {surfels} {degree}: {errors:?}");
        }
    }

    #[test]
    fn a_wrong_pose_gradient_is_noticed() {
        let settings = RenderSettings { depth: true, ..RenderSettings::default() };
        let errors = errors(&settings, 2, |g| {
            (g.translation.x, g.translation.y) = (g.translation.y, g.translation.x);
            g.rotation *= 1.01;
            g.focal.x = -g.focal.x;
        });
        assert!(errors.iter().all(|e| *e > 1e-3), "{errors:?}");
    }
}
