//! What jobs and the agent work on, collected from scene, state and viewport in one place.

use std::sync::Arc;

use glam::DVec3;

use super::app::App;
use crate::jobs::OpenedScene;
use crate::jobs::go_to::Explored;
use crate::navigate::Pose;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud, SemanticMap};
use crate::worker::Versioned;

/// The scene as it is now.
pub(super) struct SceneContext {
    pub(super) scene: Arc<OpenedScene>,
    /// The Gaussians on screen, hidden ones too.
    pub(super) cloud: Versioned<GaussianCloud>,
    /// Objects and parts, if they were found.
    pub(super) map: Option<Versioned<SemanticMap>>,
    /// How the Gaussians are drawn.
    pub(super) settings: RenderSettings,
    /// The photos' cameras.
    pub(super) cameras: Vec<Camera>,
    /// Which way is up.
    pub(super) up: DVec3,
    /// Where the eye is.
    pub(super) eye: Pose,
    /// Width by height of the view.
    pub(super) aspect: f64,
    /// What is known of occupied space.
    pub(super) explored: Option<Arc<Explored>>,
}

impl App {
    /// The scene as it is now, if one is open and has Gaussians.
    pub(super) fn context(&self) -> Option<SceneContext> {
        let scene = Arc::clone(self.state.scene.as_ref()?);
        Some(SceneContext {
            cloud: self.viewport.cloud()?.clone(),
            map: self.state.semantics.clone(),
            settings: self.state.render_settings(),
            cameras: scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default(),
            up: self.viewport.up(&scene),
            eye: self.viewport.pose(),
            aspect: self.viewport.aspect(),
            explored: self.state.explored.clone(),
            scene,
        })
    }
}
