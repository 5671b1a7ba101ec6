//! Start of a server for a scene at rest, or for a training that is about to begin.

use std::path::Path;
use std::sync::Arc;

use super::photos::ServedPhotos;
use super::server::{ServeError, ServeOptions, Server, Shown};
use crate::io::trained::SceneInfo;
use crate::io::{self, Opened, snapshot};
use crate::jobs::JobError;
use crate::jobs::sparse_cloud::sparse_cloud;
use crate::pipeline::train::TrainConfig;
use crate::scene::Dataset;

/// Serves the trained scene or splat at `path`; returns the server and the name of the scene.
///
/// # Errors
/// If the scene cannot be read, or the server cannot be started.
pub(crate) fn scene(path: &Path, options: ServeOptions) -> Result<(Server, String), ServeError> {
    let (info, bytes, editable, photos) = match io::open(path).map_err(JobError::from)? {
        Opened::Dataset(_) => return Err(JobError::NotTrained(path.into()).into()),
        Opened::Trained(scene) => {
            let bytes = snapshot::of_folder(&scene.folder).map_err(JobError::from)?;
            let photos = ServedPhotos::of_scene(&scene.info, scene.dataset_path().as_deref());
            (scene.info, bytes, Some((scene.folder, scene.state)), photos)
        }
        Opened::Cloud(cloud) => {
            let name = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
            (SceneInfo { name, ..SceneInfo::default() }, snapshot::of_cloud(&cloud)?, None, ServedPhotos::default())
        }
    };
    let name = info.name.clone();
    let editable = editable.as_ref().map(|(folder, state)| (folder.as_path(), state.clone()));
    Ok((Server::start(info, editable, photos, Shown::AtRest(bytes), options)?, name))
}

/// Serves a training on this dataset, whose events then come through [`Server::observe`].
///
/// # Errors
/// If the server cannot be started.
pub(crate) fn training(dataset: &Dataset, config: &TrainConfig, options: ServeOptions) -> Result<Server, ServeError> {
    let held_out = dataset.split(config.holdout_every).1;
    let mut info = SceneInfo::of(dataset, &held_out, Path::new("."));
    info.config = serde_json::to_value(config).unwrap_or_default();
    let shown = Shown::Training(format!("Training {}", dataset.name), sparse_cloud(dataset).map(Arc::new));
    Server::start(info, None, ServedPhotos::of(dataset), shown, options)
}
