//! The files of a trained scene's folder, which nothing but a save of the scene may replace.

use std::path::Path;

use super::IoError;
use super::files::folder_of;

/// The file that makes a folder a trained scene.
pub const SCENE_FILE: &str = "scene.json";
/// The Gaussians.
pub const CLOUD_FILE: &str = "point_cloud.ply";
/// Objects and parts.
pub const MAP_FILE: &str = "semantic_map.safetensors";
/// The state of a training, if it can be resumed.
pub const CHECKPOINT_FILE: &str = "checkpoint.bin";
/// What a save has decided on and not carried out yet.
pub(super) const JOURNAL: &str = ".fmlgs_commit.json";

pub(crate) const FILES: [&str; 4] = [SCENE_FILE, CLOUD_FILE, MAP_FILE, CHECKPOINT_FILE];

/// Whether `folder` is a trained scene.
pub fn is_scene(folder: &Path) -> bool {
    folder.join(SCENE_FILE).is_file()
}

/// Whether a change of this folder was decided and not carried out.
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
