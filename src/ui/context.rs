//! Inputs of jobs and of the agent, collected from scene, state and viewport.

use std::sync::Arc;

use glam::DVec3;

use super::app::App;
use crate::jobs::OpenedScene;
use crate::jobs::go_to::Explored;
use crate::navigate::Pose;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud, SemanticMap};
use crate::worker::Versioned;

/// The current scene.
pub(super) struct SceneContext {
    pub(super) scene: Arc<OpenedScene>,
    /// The Gaussians on screen, hidden ones included.
    pub(super) cloud: Versioned<GaussianCloud>,
    /// Objects and parts, if they were found.
    pub(super) map: Option<Versioned<SemanticMap>>,
    /// Render settings of the Gaussians.
    pub(super) settings: RenderSettings,
    /// Cameras of the photos.
    pub(super) cameras: Vec<Camera>,
    /// Up direction of the world.
    pub(super) up: DVec3,
    /// Current camera pose.
    pub(super) eye: Pose,
    /// Aspect ratio of the view, width / height.
    pub(super) aspect: f64,
    /// Occupied and free space, if explored.
    pub(super) explored: Option<Arc<Explored>>,
}

impl SceneContext {
    /// The current scene, if one is open and has Gaussians.
    pub(super) fn new(app: &App) -> Option<Self> {
        let (state, viewport) = (&app.state, &app.viewport);
        let scene = Arc::clone(state.scene.as_ref()?);
        Some(Self {
            cloud: viewport.cloud()?.clone(),
            map: state.semantics.clone(),
            settings: state.render_settings(),
            cameras: scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default(),
            up: viewport.up(&scene),
            eye: viewport.pose(),
            aspect: viewport.aspect(),
            explored: state.explored.clone(),
            scene,
        })
    }
}
