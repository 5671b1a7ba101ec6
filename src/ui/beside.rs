//! Another scene beside the one on screen: its Gaussians in the second view, by the same camera.

use std::path::PathBuf;

use crate::jobs::OpenedScene;
use crate::render::RenderSettings;
use crate::scene::GaussianCloud;
use crate::worker::Versioned;

/// What the second view shows of another scene.
#[derive(Clone, Debug)]
pub struct Beside {
    pub name: String,
    /// Where it lies.
    pub path: PathBuf,
    pub(crate) cloud: Versioned<GaussianCloud>,
    /// How it is drawn: as it was trained.
    pub(crate) settings: RenderSettings,
}

impl Beside {
    /// What there is to see of a scene; `None` if it has no Gaussians.
    pub(crate) fn of(scene: OpenedScene) -> Option<Self> {
        let cloud = scene.cloud.map(Versioned::new)?;
        Some(Self { name: scene.name, path: scene.path, cloud, settings: scene.render })
    }
}
