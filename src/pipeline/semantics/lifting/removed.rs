//! Pixels of photos that still show things removed from the scene.

use crate::math::grid;
use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Least share of a pixel that shows a removed thing, and margin around such pixels, px.
const TOUCHED: f32 = 0.05;
const RIM_PX: usize = 2;

/// A scene together with the removed things.
#[derive(Clone, Debug)]
pub(crate) struct RemovedThings {
    cloud: GaussianCloud,
    /// 1 for removed Gaussians.
    is_removed: Vec<f32>,
}

impl RemovedThings {
    pub(crate) fn new(scene: &GaussianCloud, removed: &GaussianCloud) -> Self {
        let (n, more) = (scene.len(), removed.len());
        let bare = GaussianCloud { extras: Vec::new(), ..scene.clone() };
        let cloud = GaussianCloud::joined(vec![bare, removed.clone()]);
        Self { cloud, is_removed: [vec![0.0; n], vec![1.0; more]].concat() }
    }

    /// Returns the pixels of a view whose photo shows removed things.
    pub(crate) fn shows(
        &self,
        renderer: &mut Renderer,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<bool>, RenderError> {
        let features = Features { channels: 1, values: &self.is_removed };
        let frame = renderer.render(&self.cloud, features, camera, settings)?;
        let is_seen = frame.features[0].iter().map(|share| *share >= TOUCHED).collect();
        Ok(grid::grown(frame.width_px, is_seen, RIM_PX))
    }
}
