//! Weights of the Gaussians in a view, in as many passes as are wanted. Only the first projects, bins and sorts.

use super::CpuRenderer;
use super::contributions::ContributionSink;
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// A view of a cloud whose weights are handed out.
pub(crate) struct ViewWeights<'a> {
    pub(crate) cloud: &'a GaussianCloud,
    pub(crate) camera: &'a Camera,
    settings: &'a RenderSettings,
    renderer: &'a mut CpuRenderer<f32>,
    /// True if the renderer's last frame is this view.
    is_ready: bool,
}

impl<'a> ViewWeights<'a> {
    /// The view through `camera`. If it `is_ready`, the renderer's last frame must be of it, seen alike.
    pub(crate) fn new(
        renderer: &'a mut CpuRenderer<f32>,
        cloud: &'a GaussianCloud,
        camera: &'a Camera,
        settings: &'a RenderSettings,
        is_ready: bool,
    ) -> Self {
        Self { cloud, camera, settings, renderer, is_ready }
    }

    /// Hands the weight of every Gaussian at every pixel to `sinks`, one for each row of tiles.
    pub(crate) fn give<S: ContributionSink<f32>>(&mut self, sinks: &mut [S]) -> Result<(), RenderError> {
        match std::mem::replace(&mut self.is_ready, true) {
            true => self.renderer.contributions_again(self.cloud, self.camera, self.settings, sinks),
            false => self.renderer.contributions(self.cloud, self.camera, self.settings, sinks),
        }
    }

    /// Width and height, px.
    pub(crate) fn size_px(&self) -> [usize; 2] {
        [self.camera.width_px as usize, self.camera.height_px as usize]
    }
}
