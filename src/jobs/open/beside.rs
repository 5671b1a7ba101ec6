//! Files beside a scene: those of the program, and those of 3D Gaussian Splatting with cameras to view it from and the
//! photos if they still exist.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::tolerant::photos_of;
use super::{OpenedScene, Scene};
use crate::io::gs_output::{self, GsOutput};
use crate::io::photo_source::PhotoSource;
use crate::io::results::MethodKind;
use crate::io::scene_files::{SELECTION_FILE, is_scene};
use crate::io::trained::SceneCamera;
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::{Dataset, Photo};

impl OpenedScene {
    /// Returns whether it has a folder of its own, in which all of it is stored.
    pub(crate) fn is_stored(&self) -> bool {
        is_scene(&self.out)
    }

    /// Returns the file that keeps its preparation for selecting by clicks.
    pub(crate) fn selection_file(&self) -> PathBuf {
        let folder = if self.is_stored() { &self.out } else { &self.report_out };
        folder.join(SELECTION_FILE)
    }
}

/// Returns the splat of a folder that 3D Gaussian Splatting wrote, else the path itself.
pub(super) fn splat_of(path: &Path) -> PathBuf {
    let is_dataset = || path.join("transforms.json").is_file() || path.join("scene.json").is_file();
    let latest = path.is_dir().then(|| gs_output::latest(path)).flatten();
    latest.filter(|_| !is_dataset()).unwrap_or_else(|| path.into())
}

/// Adds what belongs to the scene's file: as its training is known, or else from the files beside it.
pub(super) fn add_to(scene: &mut Scene, training: Option<GsOutput>) {
    let Some(found) = training.or_else(|| gs_output::beside(&scene.path)) else { return };
    let GsOutput { folder, cameras, name, source, white_background, warnings, .. } = found;
    scene.warnings.extend(warnings);
    scene.warnings.extend(source.as_ref().and_then(PhotoSource::warning));
    scene.dataset_path = source.as_ref().and_then(|source| source.found.clone());
    scene.photos = source.map(|source| source.stated);
    if let Some(name) = name {
        scene.name = name;
    }
    scene.cameras = cameras;
    scene.cameras_from = Some(folder);
    if white_background {
        scene.settings.background = [1.0; 3];
        scene.says_background = true;
    }
}

/// Opens Gaussians of another program, with their photos or cameras if there are any.
pub(super) fn with_photos(scene: Scene, observer: &mut dyn Observer) -> OpenedScene {
    if let Some(method) = scene.method {
        let so = match method.kind() {
            MethodKind::Classes | MethodKind::Clusters => "its groups of Gaussians are objects",
            MethodKind::Affinities => "'fmlgs import' finds its objects",
            MethodKind::Embeddings if method.encoder().is_none() => "the text encoder of its embeddings is missing",
            MethodKind::Embeddings => "'fmlgs query' asks its embeddings",
        };
        observer.note(Severity::Info, format!("{} is a result of {}: {so}", scene.name, method.name()));
    }
    let seen = scene.dataset_path.is_some().then(|| photos_of(&scene, observer)).flatten();
    let dataset = seen.or_else(|| photos_unseen(&scene)).map(Arc::new);
    OpenedScene::of(scene, dataset, observer)
}

/// Returns the cameras beside a scene as photos without files, if there are any.
fn photos_unseen(scene: &Scene) -> Option<Dataset> {
    let root = scene.cameras_from.clone()?;
    let photo = |c: &SceneCamera| Photo::new(&*c.name, PathBuf::new(), c.camera.clone());
    let photos: Vec<Photo> = scene.cameras.iter().map(photo).collect();
    let (name, format) = (scene.name.clone(), "cameras.json of 3D Gaussian Splatting".into());
    (!photos.is_empty()).then(|| Dataset { name, root, format, photos, ..Dataset::default() })
}
