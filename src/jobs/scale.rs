//! Scale of a scene, as the user measured it.

use std::path::Path;

use super::JobError;
use crate::io::{SceneFolder, trained};

/// Stores the length of a unit with the scene in `folder`, last read in the state `known`. Returns whether there is a
/// scene to store it with.
///
/// # Errors
/// If it cannot be written, or another process has changed the scene.
pub(crate) fn store(folder: &Path, known: Option<&str>, meters_per_unit: f64) -> Result<bool, JobError> {
    if !trained::is_scene(folder) {
        return Ok(false);
    }
    SceneFolder::hold(folder, "storing the scale")?.save_scale(known, meters_per_unit)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::IoError;
    use crate::io::trained::SceneInfo;
    use crate::scene::GaussianCloud;

    #[test]
    fn the_scale_is_kept_and_nothing_else_changes() {
        let folder = tempfile::tempdir().expect("folder");
        let (scene, cloud) = (folder.path().join("scene"), GaussianCloud::default());
        assert!(!store(&scene, None, 0.5).expect("no scene, no file") && !scene.exists());
        let state = trained::save(&scene, &SceneInfo::default(), &cloud, None).expect("saved");
        assert!(store(&scene, Some(&state), 0.25).expect("stored"));
        let loaded = trained::load(&scene).expect("whole");
        assert_eq!((loaded.info.meters_per_unit, loaded.info.state.as_deref()), (Some(0.25), Some(state.as_str())));
        let changed = store(&scene, Some("another"), 0.5).expect_err("refused");
        assert!(matches!(changed, JobError::Io(IoError::Changed { .. })), "{changed}");
        assert_eq!(trained::load(&scene).expect("whole").info.meters_per_unit, Some(0.25));
    }
}
