//! Another scene beside the current one: its Gaussians in the second view, from the same camera.

use std::path::PathBuf;

use crate::jobs::OpenedScene;
use crate::render::RenderSettings;
use crate::scene::GaussianCloud;
use crate::worker::Versioned;

/// Another scene in the second view.
#[derive(Clone, Debug)]
pub struct ComparedScene {
    pub name: String,
    /// Path of the scene.
    pub path: PathBuf,
    pub(crate) cloud: Versioned<GaussianCloud>,
    /// Render settings that it was trained with.
    pub(crate) settings: RenderSettings,
}

impl ComparedScene {
    /// Content of a scene for the second view; `None` if it has no Gaussians.
    pub(crate) fn of(scene: OpenedScene) -> Option<Self> {
        let cloud = scene.cloud.map(Versioned::new)?;
        Some(Self { name: scene.name, path: scene.path, cloud, settings: scene.render })
    }
}
