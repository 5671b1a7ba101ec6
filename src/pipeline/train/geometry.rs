//! Geometry losses: consistency of normals with depth, and distortion of surfels along each ray (2DGS).

use super::TrainConfig;
use crate::render::normals::{self, SurfaceDepth};
use crate::render::{Features, Frame, FrameGradient};
use crate::scene::{Camera, GaussianCloud};

/// Fraction of a run after which the distortion loss is active (2DGS: step 3,000 of 30,000).
const DISTORTION_FROM: f64 = 0.1;
/// Fraction of a run after which the normal loss is active (2DGS: step 7,000 of 30,000).
const NORMALS_FROM: f64 = 7.0 / 30.0;
/// Standard deviation of a surfel along its normal, as a fraction of the scene's extent: rendered as an ordinary
/// Gaussian, by other programs or on a GPU, it is practically flat.
const THICKNESS: f64 = 1e-7;

#[derive(Debug, Default)]
pub(crate) struct GeometryLoss {
    surfels: bool,
    normal_weight: f64,
    /// Weight of distortion in inverse depth times the scene's extent, so that units cancel.
    distortion_weight: f64,
    steps: u64,
    values: Vec<f32>,
    d_normals: [Vec<f32>; 3],
}

impl GeometryLoss {
    /// Losses of a run in a scene of this extent.
    pub(crate) fn new(config: &TrainConfig, extent: f64) -> Self {
        let (normal_weight, distortion) = config.geometry_weights();
        let distortion_weight = distortion * extent * extent;
        Self { surfels: config.surfels, normal_weight, distortion_weight, steps: config.steps, ..Self::default() }
    }

    fn normals_count(&self, step: u64) -> bool {
        self.normal_weight > 0.0 && step as f64 >= NORMALS_FROM * self.steps as f64
    }

    fn distortion_counts(&self, step: u64) -> bool {
        self.surfels && self.distortion_weight > 0.0 && step as f64 >= DISTORTION_FROM * self.steps as f64
    }

    /// Returns whether depth must be rendered at `step`.
    pub(crate) fn counts(&self, step: u64) -> bool {
        self.normals_count(step) || self.distortion_counts(step)
    }

    /// Returns whether Gaussians carry their normals as extra channels at `step`.
    pub(crate) fn draws_normals(&self, step: u64) -> bool {
        !self.surfels && self.normals_count(step)
    }

    /// Extra channels to render at `step`.
    pub(crate) fn features(&mut self, cloud: &GaussianCloud, camera: &Camera, step: u64) -> Features<'_, f32> {
        if !self.draws_normals(step) {
            return Features::NONE;
        }
        normals::of_gaussians(cloud, camera, &mut self.values);
        Features { channels: 3, values: &self.values }
    }

    /// Sets the gradient of everything but colors for a frame rendered at `step`; returns the loss.
    pub(crate) fn compare(
        &mut self,
        frame: &Frame<f32>,
        camera: &Camera,
        step: u64,
        gradient: &mut FrameGradient<f32>,
    ) -> f64 {
        let FrameGradient { color: _, features, alpha, depth, median_depth, normals, distortion } = gradient;
        let planes = features.iter_mut().chain([alpha, depth, median_depth, distortion]).chain(normals);
        planes.for_each(|plane| plane.fill(0.0));
        let mut loss = 0.0;
        if self.distortion_counts(step) {
            let n = frame.distortion.len();
            let share = (self.distortion_weight / n.max(1) as f64) as f32;
            gradient.distortion.clear();
            gradient.distortion.resize(n, share);
            loss += frame.distortion.iter().map(|d| f64::from(d * share)).sum::<f64>();
        }
        if self.normals_count(step) {
            let (drawn, weight) =
                (if self.surfels { &frame.normals[..] } else { &frame.features[..] }, self.normal_weight);
            if let [x, y, z] = drawn {
                let own = &mut self.d_normals;
                let depth = if self.surfels { SurfaceDepth::Median } else { SurfaceDepth::Expected };
                loss += normals::consistency(frame, [x, y, z], camera, depth, weight, gradient, own);
                if self.surfels {
                    std::mem::swap(&mut gradient.normals, own);
                } else {
                    gradient.features.resize(3, Vec::new());
                    gradient.features.iter_mut().zip(own).for_each(|(plane, own)| std::mem::swap(plane, own));
                }
            }
        }
        loss
    }
}

/// Turns initial Gaussians into surfels: flat, with random rotations from `angle`, which returns numbers around 0.
pub(crate) fn flatten(cloud: &mut GaussianCloud, extent: f64, mut angle: impl FnMut() -> f32) {
    let thin = (THICKNESS * extent).ln() as f32;
    for (scale, quaternion) in cloud.log_scales.iter_mut().zip(&mut cloud.quaternions) {
        scale[2] = thin;
        *quaternion = std::array::from_fn(|_| angle());
    }
}
