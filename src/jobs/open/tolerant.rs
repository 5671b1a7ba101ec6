//! Parts of a scene that may be broken or missing: they are reported, and the scene opens without them.

use std::path::Path;
use std::sync::Arc;

use super::{OpenedScene, Scene};
use crate::io::trained::TrainedScene;
use crate::io::{self, Opened};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::train::TrainConfig;
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{Dataset, SemanticMap};

/// Returns a note in words if a scene has no objects, and another training run of its photos has some.
pub(super) fn objects_elsewhere(scene: &OpenedScene) -> Option<String> {
    if scene.semantics.is_some() || !scene.trained || scene.runs.iter().all(|run| run.folder != scene.out) {
        return None;
    }
    let other = scene.runs.iter().max_by_key(|run| run.objects).filter(|run| run.objects > 0)?;
    Some(format!(
        "This training has no objects; an earlier one of these photos has ({}). Open it in the Photos pane, or at {}",
        other.text(),
        other.folder.display()
    ))
}

/// Loads the objects and parts stored with a trained scene; broken ones are reported and left out.
pub(crate) fn known_objects(scene: &Scene, observer: &mut dyn Observer) -> Option<Arc<SemanticMap>> {
    match scene.known_semantics() {
        Ok(map) => map.map(|map| {
            let what = map.identities.counted();
            resource_log::record(ResourceKind::Objects, what, "the scene was opened", map.bytes());
            Arc::new(map)
        }),
        Err(e) => {
            observer.note(
                Severity::Warning,
                format!(
                    "The scene's objects cannot be loaded: {e}. Find them again (Find objects and parts, or fmlgs preprocess)"
                ),
            );
            None
        }
    }
}

/// Builds a trained scene; unreadable settings are reported, and it is drawn with the defaults.
pub(super) fn tolerant(path: &Path, scene: TrainedScene, observer: &mut dyn Observer) -> Scene {
    let config = TrainConfig::stored(&scene.folder, scene.info.config.clone()).unwrap_or_else(|e| {
        observer.note(
            Severity::Warning,
            format!("The scene may not look as trained: {e}. Train again, or restore the file"),
        );
        TrainConfig::unknown()
    });
    Scene::trained(path, scene, config)
}

/// Loads the photos of a trained scene, if they still exist.
pub(super) fn photos_of(scene: &Scene, observer: &mut dyn Observer) -> Option<Dataset> {
    let why = match scene.dataset_path.as_deref().map(|p| (io::open(p), p)) {
        Some((Ok(Opened::Dataset(dataset)), _)) => {
            return Some(dataset.with_alpha(scene.config.alpha).into_owned());
        }
        Some((Ok(_), p)) => format!("{} no longer holds photos; the scene opens without them", p.display()),
        Some((Err(e), _)) => format!("The photos cannot be read, the scene opens without them: {e}"),
        None => "The photos were moved or deleted; the scene opens without them".into(),
    };
    observer.note(Severity::Warning, why);
    None
}
