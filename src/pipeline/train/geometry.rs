//! What training asks of the scene's geometry beside its colors: normals that agree with depth,
//! and surfels that lie together along each ray.

use super::{TrainConfig, TrainView};
use crate::render::normals::{self, SurfaceDepth};
use crate::render::{Features, Frame, FrameGradient};
use crate::scene::GaussianCloud;

/// Share of a run after which distortion counts (2DGS: step 3,000 of 30,000).
const DISTORTION_FROM: f64 = 0.1;
/// Share of a run after which normals count (2DGS: step 7,000 of 30,000).
const NORMALS_FROM: f64 = 7.0 / 30.0;
/// Standard deviation of a surfel across its disk, as a share of the scene's extent: drawn as an
/// ordinary Gaussian, by other programs or on a GPU, it is as good as flat.
const THICKNESS: f64 = 1e-7;

#[derive(Debug, Default)]
pub(crate) struct GeometryLoss {
    surfels: bool,
    normal_weight: f64,
    /// Of distortion in inverse depth times the scene's extent, so that units cancel.
    distortion_weight: f64,
    steps: u64,
    values: Vec<f32>,
    d_normals: [Vec<f32>; 3],
}

impl GeometryLoss {
    /// The terms of a run in a scene of this extent.
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

    /// Whether depth must be drawn at `step`.
    pub(crate) fn counts(&self, step: u64) -> bool {
        self.normals_count(step) || self.distortion_counts(step)
    }

    /// Whether Gaussians carry their normals as extra channels at `step`.
    pub(crate) fn draws_normals(&self, step: u64) -> bool {
        !self.surfels && self.normals_count(step)
    }

    /// The extra channels to draw at `step`.
    pub(crate) fn features(&mut self, cloud: &GaussianCloud, view: &TrainView, step: u64) -> Features<'_, f32> {
        if !self.draws_normals(step) {
            return Features::NONE;
        }
        normals::of_gaussians(cloud, &view.camera, &mut self.values);
        Features { channels: 3, values: &self.values }
    }

    /// Sets the gradient of everything but colors for a frame drawn at `step`; returns the loss.
    pub(crate) fn compare(
        &mut self,
        frame: &Frame<f32>,
        view: &TrainView,
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
                loss += normals::consistency(frame, [x, y, z], &view.camera, depth, weight, gradient, own);
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

/// Makes Gaussians that training starts from into surfels: flat, and turned at random by `angle`,
/// which gives numbers around 0.
pub(crate) fn flatten(cloud: &mut GaussianCloud, extent: f64, mut angle: impl FnMut() -> f32) {
    let thin = (THICKNESS * extent).ln() as f32;
    for (scale, quaternion) in cloud.log_scales.iter_mut().zip(&mut cloud.quaternions) {
        scale[2] = thin;
        *quaternion = std::array::from_fn(|_| angle());
    }
}
