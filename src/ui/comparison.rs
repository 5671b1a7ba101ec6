//! Another scene beside the current one: its Gaussians in the second view, from the same camera.

use std::path::PathBuf;
use std::sync::Arc;

use crate::jobs::{OpenedScene, Scene};
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
        let cloud = Versioned::new(Arc::clone(scene.gaussians()?));
        let Scene { name, path, settings, .. } = scene.scene;
        Some(Self { name, path, cloud, settings })
    }
}
