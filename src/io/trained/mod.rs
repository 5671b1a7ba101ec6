//! A trained scene: a folder that any splat viewer can use, with the additional files of this program.
//!
//! | file | what |
//! |---|---|
//! | `scene.json` | [`SceneInfo`]: version, dataset, cameras, settings, history |
//! | `point_cloud.ply` | the Gaussians, see [`splat_ply`] |
//! | `semantic_map.safetensors` | objects and parts, see [`semantic_map`](super::semantic_map) |
//! | `checkpoint.bin` | the state of the training, if it can be resumed; written by the training |
//! | `earlier/` | scenes with objects that later commands replaced |
//!
//! `scene.json` makes the folder a scene. [`SceneFolder`] writes it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::scene_files::is_pending;
use super::{IoError, SceneFolder, splat_ply};
use crate::scene::GaussianCloud;
#[cfg(test)]
use crate::scene::SemanticMap;

pub use super::scene_files::{CLOUD_FILE, SCENE_FILE, is_scene};
pub use super::scene_info::{DatasetReference, History, SceneCamera, SceneInfo, VERSION, load_info};

/// A trained scene with its folder.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedScene {
    pub(crate) folder: PathBuf,
    /// Contents of `scene.json`.
    pub info: SceneInfo,
    /// The Gaussians.
    pub cloud: GaussianCloud,
    /// Id of the save that wrote its files; `None` in folders of the first versions.
    pub state: Option<String>,
}

impl TrainedScene {
    /// Folder of the photos, if the scene has a reference and the folder still exists: the same path from every scene.
    pub(crate) fn dataset_path(&self) -> Option<PathBuf> {
        std::fs::canonicalize(self.folder.join(&self.info.dataset.as_ref()?.path)).ok()
    }
}

/// Writes a scene into `folder`, which is created if need be. All of its files change, or none.
#[cfg(test)]
pub(crate) fn save(
    folder: &Path,
    info: &SceneInfo,
    cloud: &GaussianCloud,
    map: Option<&SemanticMap>,
) -> Result<String, IoError> {
    SceneFolder::hold(folder, "saving")?.save(info, cloud, map)
}

/// Reads a scene. An interrupted save is completed first.
pub fn load(folder: &Path) -> Result<TrainedScene, IoError> {
    // Another process may be saving at this moment, which takes milliseconds once the files are written.
    const TRIES: u32 = 20;
    const PAUSE: Duration = Duration::from_millis(25);
    let mut tries = 0;
    loop {
        tries += 1;
        let result = match is_pending(folder) {
            true => SceneFolder::hold(folder, "finishing a save").and_then(|_| load_once(folder)),
            false => load_once(folder),
        };
        match result {
            Err(IoError::Torn { .. } | IoError::Busy { .. }) if tries < TRIES => std::thread::sleep(PAUSE),
            result => return result,
        }
    }
}

fn load_once(folder: &Path) -> Result<TrainedScene, IoError> {
    let info = load_info(folder)?;
    let path = folder.join(CLOUD_FILE);
    let cloud = splat_ply::read(&path)?;
    let state = splat_ply::state(&path)?;
    if info.state.is_some() && info.state != state {
        let remedy = "put back the file that was; or open it by itself; or, to use it as it is, delete the \
                      line \"state\" from scene.json";
        return Err(IoError::Torn { path, with: SCENE_FILE, remedy });
    }
    Ok(TrainedScene { folder: folder.into(), info, cloud, state })
}

#[cfg(test)]
mod tests;
