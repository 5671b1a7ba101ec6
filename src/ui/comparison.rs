//! Other scenes beside the current one: their Gaussians in views of their own, from the same camera.

use std::path::PathBuf;
use std::sync::Arc;

use crate::jobs::compare::MOST_SCENES;
use crate::jobs::compare::subject::AskableScene;
use crate::jobs::{OpenedScene, Scene};
use crate::render::RenderSettings;
use crate::scene::GaussianCloud;
use crate::worker::Versioned;

/// Scenes beside the current one at most.
pub(crate) const MOST_BESIDE: usize = MOST_SCENES - 1;

/// Another scene beside the current one.
#[derive(Clone, Debug)]
pub struct ComparedScene {
    pub name: String,
    /// Path of the scene.
    pub path: PathBuf,
    pub(crate) cloud: Versioned<GaussianCloud>,
    /// Render settings that it was trained with.
    pub(crate) settings: RenderSettings,
    /// The scene as it is asked, if it answers anything.
    pub(crate) asked: Option<Versioned<AskableScene>>,
    /// True if a removal from the current scene made it.
    pub(crate) is_removal: bool,
}

impl ComparedScene {
    /// Content of a scene for a view; `None` if it has no Gaussians.
    pub(crate) fn of(scene: OpenedScene) -> Option<Self> {
        let cloud = Versioned::new(Arc::clone(scene.gaussians()?));
        let asked =
            AskableScene::of(&scene.scene, scene.semantics.as_ref()).map(|asked| Versioned::new(Arc::new(asked)));
        let Scene { name, path, settings, method, .. } = scene.scene;
        let name = method.map_or_else(|| name.clone(), |method| format!("{}: {name}", method.name()));
        Some(Self { name, path, cloud, settings, asked, is_removal: false })
    }
}
