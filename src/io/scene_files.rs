//! Files of a trained scene's folder, which only a save of the scene may replace.

use std::path::Path;

use super::IoError;
use super::files::folder_of;

/// File that makes a folder a trained scene.
pub const SCENE_FILE: &str = "scene.json";
/// The Gaussians.
pub const CLOUD_FILE: &str = "point_cloud.ply";
/// Objects and parts.
pub const MAP_FILE: &str = "semantic_map.safetensors";
/// State of a training run, if it can be resumed.
pub const CHECKPOINT_FILE: &str = "checkpoint.bin";
/// Preparation for selections: made anew if it is missing.
pub(crate) const SELECTION_FILE: &str = "selection_tree.safetensors";
/// Measurements of the user.
pub(crate) const MEASUREMENTS_FILE: &str = "measurements.json";
/// Camera path of the user.
pub(crate) const CAMERA_PATH_FILE: &str = "camera_path.json";
/// Journal of a save that is decided and not yet carried out.
pub(super) const JOURNAL: &str = ".fmlgs_commit.json";

pub(crate) const FILES: [&str; 6] =
    [SCENE_FILE, CLOUD_FILE, MAP_FILE, CHECKPOINT_FILE, MEASUREMENTS_FILE, CAMERA_PATH_FILE];

/// Returns whether `folder` is a trained scene.
pub fn is_scene(folder: &Path) -> bool {
    folder.join(SCENE_FILE).is_file()
}

/// Returns whether a decided change of this folder is not yet carried out.
pub(super) fn is_pending(folder: &Path) -> bool {
    folder.join(JOURNAL).exists()
}

/// Refuses `path` if it is a file of a trained scene.
pub(crate) fn refuse_scene_file(path: &Path) -> Result<(), IoError> {
    let folder = folder_of(path);
    let named = path.file_name().is_some_and(|n| FILES.iter().any(|f| n.eq_ignore_ascii_case(f)));
    if named && is_scene(folder) {
        return Err(IoError::Protected { path: path.into(), folder: folder.into() });
    }
    Ok(())
}
