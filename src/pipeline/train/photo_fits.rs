//! Facts that training learns of each photo beside the scene: its pose ([`poses`](super::poses)) and its exposure
//! ([`mod@exposure`](super::exposure)). On the CPU, whose rasterizer has gradients of poses.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::device::LAMBDA;
use super::exposure::{self, ExposureFit};
use super::pose_offset::PoseOffset;
use super::poses::{PoseRefiner, PoseSlope};
use super::{TrainConfig, TrainView};
use crate::pipeline::locate::curvature;
use crate::render::{DifferentiableRenderer, Frame, FrameGradient};
use crate::scene::{Camera, GaussianCloud, PhotoExposure};

/// Smallest error of a color that weighs: below it, the loss is taken for a parabola.
const LEAST_ERROR: f32 = 0.01;
/// Pixels whose errors are alike, and usual error of a color: a photo is as good as so many independent looks.
const CORRELATED_PX: f64 = 25.0;
const USUAL_ERROR: f64 = 0.03;

/// Photo, step and background color of a training step.
#[derive(Clone, Copy)]
pub(super) struct FitStep {
    pub(super) photo: usize,
    pub(super) step: u64,
    pub(super) background: [f32; 3],
}

/// Record of a photo in a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredFit {
    pub(crate) name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) pose: Option<PoseOffset>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) exposure: Option<PhotoExposure>,
}

/// Poses and exposures of the training photos, as far as they are learned.
#[derive(Debug, Default)]
pub(crate) struct PhotoFits {
    pub(super) poses: Option<PoseRefiner>,
    pub(super) exposures: Option<ExposureFit>,
    /// Curvature of the loss with respect to the colors of the step.
    weights: [Vec<f32>; 3],
}

impl PhotoFits {
    /// Returns what a run from step `from` on learns of its photos in a scene of this radius, of those that are `free`; the
    /// others keep what they have.
    pub(crate) fn new(config: &TrainConfig, views: &[TrainView], free: &[bool], (from, extent): (u64, f64)) -> Self {
        let given = || views.iter().map(|v| v.camera.clone()).collect();
        let steps = from..config.steps;
        Self {
            poses: config.refine_poses.then(|| PoseRefiner::new(given(), free.to_vec(), extent, steps)),
            exposures: config.exposure.then(|| ExposureFit::new(free.to_vec())),
            weights: Default::default(),
        }
    }

    /// Returns what a checkpoint keeps of the photos of these views.
    pub(crate) fn stored(&self, views: &[TrainView]) -> Vec<StoredFit> {
        if !self.is_on() {
            return Vec::new();
        }
        let one = |(i, view): (usize, &TrainView)| StoredFit {
            name: view.name.clone(),
            pose: self.poses.as_ref().map(|p| p.offsets[i]),
            exposure: self.exposures.as_ref().map(|e| e.of(i)),
        };
        views.iter().enumerate().map(one).collect()
    }

    /// Goes on with what a checkpoint kept.
    pub(crate) fn restore(&mut self, stored: &[StoredFit], views: &[TrainView]) {
        for (i, view) in views.iter().enumerate() {
            let Some(own) = stored.iter().find(|s| s.name == view.name) else { continue };
            if let (Some(poses), Some(offset)) = (&mut self.poses, own.pose) {
                poses.offsets[i] = offset;
            }
            if let (Some(fit), Some(exposure)) = (&mut self.exposures, own.exposure) {
                fit.exposures[i] = exposure;
            }
        }
    }

    pub(crate) fn is_on(&self) -> bool {
        self.poses.is_some() || self.exposures.is_some()
    }

    /// The camera of photo `i`; `given` is its camera at any size.
    pub(super) fn camera<'a>(&self, i: usize, given: &'a Camera) -> Cow<'a, Camera> {
        match &self.poses {
            Some(poses) => Cow::Owned(poses.camera(i, given)),
            None => Cow::Borrowed(given),
        }
    }

    /// Returns whether the photo's pose moves in this step, for which depth must be rendered.
    pub(super) fn moves(&self, at: FitStep) -> bool {
        self.poses.as_ref().is_some_and(|p| p.moves(at.photo, at.step))
    }

    /// The colors to compare with the photo, if they are not those of the frame alone.
    pub(super) fn colors(&self, at: FitStep, frame: &Frame<f32>) -> Option<[Vec<f32>; 3]> {
        match &self.exposures {
            Some(fit) => Some(exposure::exposed(&fit.of(at.photo), frame, at.background)),
            None => self.is_on().then(|| frame.color.clone()),
        }
    }

    /// Keeps the curvature of the loss with respect to the compared colors: of absolute errors, the inverse of the
    /// error.
    pub(super) fn weigh(&mut self, compared: &[Vec<f32>; 3], target: &[Vec<f32>; 3], coverage: Option<&[u8]>) {
        if !self.is_on() {
            return;
        }
        for c in 0..3 {
            let share = (1.0 - LAMBDA) as f32 / (3 * compared[c].len().max(1)) as f32;
            let weight = |(a, b): (&f32, &f32)| share / (a - b).abs().max(LEAST_ERROR);
            self.weights[c].clear();
            self.weights[c].extend(compared[c].iter().zip(&target[c]).map(weight));
            if let Some(coverage) = coverage {
                self.weights[c].iter_mut().zip(coverage).for_each(|(w, c)| *w *= (f32::from(*c) / 255.0).powi(2));
            }
        }
    }

    /// Learns the exposure, and takes the gradient from the compared colors to those of the frame.
    pub(super) fn learn_exposure(&mut self, at: FitStep, frame: &Frame<f32>, gradient: &mut FrameGradient<f32>) {
        let Some(fit) = &mut self.exposures else { return };
        gradient.alpha.resize(frame.alpha.len(), 0.0);
        let slope = exposure::backward(&fit.of(at.photo), frame, at.background, gradient, &mut self.weights);
        if fit.learns(at.photo, at.step) {
            fit.advance(at.photo, &slope, prior(frame));
        }
    }

    /// Learns the pose, after the backward pass over the tiles of `frame` and before the Gaussians change.
    pub(super) fn learn_pose(
        &mut self,
        at: FitStep,
        camera: &Camera,
        frame: &Frame<f32>,
        renderer: &DifferentiableRenderer,
        cloud: &GaussianCloud,
    ) {
        if !self.moves(at) {
            return;
        }
        let Some(poses) = &mut self.poses else { return };
        let gradient = renderer.pose_gradient_of_tiles(cloud, camera);
        let (curvature, _) = curvature(frame, camera, &self.weights);
        poses.advance(at.photo, at.step, &PoseSlope { gradient, curvature, prior: prior(frame) });
    }
}

/// Weight of one squared deviation of a prior, in the loss's units.
fn prior(frame: &Frame<f32>) -> f64 {
    CORRELATED_PX * USUAL_ERROR / frame.alpha.len().max(1) as f64
}

#[cfg(test)]
mod tests;
