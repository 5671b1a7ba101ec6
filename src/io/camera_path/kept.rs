//! `camera_path.json`: the camera path that is kept with a scene.

use std::path::Path;

use super::{error, open, own};
use crate::io::commit::Commit;
use crate::io::scene_files::CAMERA_PATH_FILE;
use crate::io::{IoError, SceneFolder};
use crate::scene::CameraPath;

/// Reads the camera path of the scene in `folder`; `None` without a file, or without keys.
pub(crate) fn load(folder: &Path) -> Result<Option<CameraPath>, IoError> {
    let path = folder.join(CAMERA_PATH_FILE);
    if !path.exists() {
        return Ok(None);
    }
    Ok(Some(open(&path)?).filter(|known| !known.keys.is_empty()))
}

impl SceneFolder {
    /// Replaces the camera path of the scene, or deletes it.
    pub(crate) fn save_camera_path(&self, camera_path: Option<&CameraPath>) -> Result<(), IoError> {
        let mut commit = Commit::new(self.path());
        match camera_path {
            Some(known) => {
                known.validate().map_err(|e| error(&self.path().join(CAMERA_PATH_FILE), &e))?;
                commit.add(CAMERA_PATH_FILE, |w| own::encode(w, known))?;
            }
            None => commit.remove(CAMERA_PATH_FILE),
        }
        commit.finish()
    }
}
