//! Where photos of a scene still show what was taken out of it for good.

use crate::math::grid;
use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Share of a pixel from which it shows what was removed, and what is left out around that, px.
const TOUCHED: f32 = 0.05;
const RIM_PX: usize = 2;

/// A scene together with what was taken out of it.
#[derive(Clone, Debug)]
pub(crate) struct RemovedThings {
    cloud: GaussianCloud,
    /// 1 for what was taken out.
    is_removed: Vec<f32>,
}

impl RemovedThings {
    pub(crate) fn new(scene: &GaussianCloud, removed: &GaussianCloud) -> Self {
        let (n, more) = (scene.len(), removed.len());
        let bare = GaussianCloud { extras: Vec::new(), ..scene.clone() };
        let cloud = GaussianCloud::joined(vec![bare, removed.clone()]);
        Self { cloud, is_removed: [vec![0.0; n], vec![1.0; more]].concat() }
    }

    /// The pixels of a view in whose photo it is seen.
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
