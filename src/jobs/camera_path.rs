//! The camera path of a scene: kept with it, and carried over to scenes that are made of it.

use std::path::Path;

use super::{JobError, measurements};
use crate::io::camera_path::kept::load;
use crate::io::scene_files::CAMERA_PATH_FILE;
use crate::io::{IoError, SceneFolder, trained};
use crate::pipeline::observer::{Observer, Severity};
use crate::scene::CameraPath;

/// Outcome of storing a camera path.
#[derive(Debug, PartialEq)]
pub(crate) enum KeptPath {
    /// It is stored, as it is read again.
    Stored(Option<CameraPath>),
    /// There is no scene to store it with.
    NoScene,
    /// Another job or program writes to the scene.
    Busy,
    /// A file is there that must not be replaced, for this reason.
    Blocked(String),
}

/// Camera path that is kept with the scene in `folder`; none, and a warning, if it cannot be read.
pub(crate) fn known(folder: &Path, observer: &mut dyn Observer) -> Option<CameraPath> {
    load(folder).unwrap_or_else(|e| {
        observer.note(Severity::Warning, format!("The camera path is not shown: {e}"));
        None
    })
}

/// Stores `ours` with the scene in `folder`, in place of `base`. A file that is equal is not written again; one that is
/// damaged, or that another program has changed, stays.
///
/// # Errors
/// If it cannot be written; what is stored is unchanged then.
pub(crate) fn store(folder: &Path, base: Option<&CameraPath>, ours: Option<&CameraPath>) -> Result<KeptPath, JobError> {
    if !trained::is_scene(folder) {
        return Ok(KeptPath::NoScene);
    }
    let held = match measurements::hold_soon(folder, "storing the camera path") {
        Err(IoError::Busy { .. }) => return Ok(KeptPath::Busy),
        held => held?,
    };
    let known = match load(folder) {
        Ok(known) => known,
        Err(e) => return Ok(KeptPath::Blocked(e.to_string())),
    };
    if known.as_ref() != ours {
        if known.is_some() && known.as_ref() != base {
            let file = folder.join(CAMERA_PATH_FILE);
            return Ok(KeptPath::Blocked(format!("another program has changed {}", file.display())));
        }
        held.save_camera_path(ours)?;
    }
    Ok(KeptPath::Stored(load(folder)?))
}

/// Copies the camera path from the scene in `from` into a scene made of it.
pub(super) fn carry_over(from: &Path, into: &SceneFolder) -> Result<(), JobError> {
    // A scene is made of another one even if that one's path is damaged; it stays where it is.
    match load(from) {
        Ok(Some(known)) => Ok(into.save_camera_path(Some(&known))?),
        Ok(None) | Err(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::io::trained::SceneInfo;
    use crate::jobs::{derived, open};
    use crate::scene::{GaussianCloud, PathKey};

    fn path(x: f64) -> CameraPath {
        let mut key = PathKey::of_pose(DVec3::new(x, 1.0 / 3.0, 0.0), DMat3::IDENTITY, 0.8);
        key.name = Some("window".into());
        CameraPath { keys: vec![key], closed: true, fps: 29.97, seconds: 7.0 }
    }

    fn stored(folder: &Path) -> Option<CameraPath> {
        load(folder).expect("read")
    }

    #[test]
    fn a_path_stays_with_its_scene_and_is_written_only_when_it_changes() {
        let folder = tempfile::tempdir().expect("folder");
        let scene = folder.path().join("scene");
        let [a, b] = [path(1.0), path(2.0)];
        assert_eq!(store(&scene, None, Some(&a)).expect("no scene, no file"), KeptPath::NoScene);
        assert!(!scene.exists());
        trained::save(&scene, &SceneInfo::default(), &GaussianCloud::default(), None).expect("saved");
        assert_eq!(store(&scene, None, Some(&a)).expect("stored"), KeptPath::Stored(Some(a.clone())), "bit for bit");
        let file = scene.join(CAMERA_PATH_FILE);
        let other = std::fs::read_to_string(&file).expect("text") + "\n";
        std::fs::write(&file, &other).expect("written");
        store(&scene, Some(&a), Some(&a)).expect("nothing to do");
        assert_eq!(std::fs::read_to_string(&file).expect("text"), other, "not written again");
        store(&scene, Some(&a), Some(&b)).expect("control: it has changed");
        assert_eq!(stored(&scene), Some(b.clone()));
        assert_eq!(store(&scene, Some(&b), None).expect("deleted"), KeptPath::Stored(None));
        assert!(!file.exists());
    }

    #[test]
    fn a_damaged_path_and_that_of_another_window_are_not_replaced() {
        let folder = tempfile::tempdir().expect("folder");
        let scene = folder.path().join("scene");
        trained::save(&scene, &SceneInfo::default(), &GaussianCloud::default(), None).expect("saved");
        let [a, b] = [path(1.0), path(2.0)];
        store(&scene, None, Some(&a)).expect("by another window");
        let is_blocked = |base, ours| match store(&scene, base, ours).expect("no error") {
            KeptPath::Blocked(why) => why.contains(CAMERA_PATH_FILE),
            _ => false,
        };
        assert!(is_blocked(None, Some(&b)));
        assert_eq!(stored(&scene), Some(a.clone()));
        let file = scene.join(CAMERA_PATH_FILE);
        std::fs::write(&file, "{\"format\": ").expect("written");
        assert!(is_blocked(Some(&a), Some(&b)) && is_blocked(Some(&a), None));
        assert_eq!(std::fs::read_to_string(&file).expect("there"), "{\"format\": ");
        std::fs::remove_file(&file).expect("removed");
        assert!(!is_blocked(Some(&a), Some(&b)), "control: nothing is in the way");
    }

    #[test]
    fn a_derived_scene_has_the_path() {
        let folder = tempfile::tempdir().expect("folder");
        let (scene, out) = (folder.path().join("scene"), folder.path().join("out"));
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]], -3.0, 1.0);
        trained::save(&scene, &SceneInfo::default(), &cloud, None).expect("saved");
        let derive = |out: &Path| {
            let from = open::scene(&scene).expect("opened");
            derived::store(&from, ("edited".into(), true), &cloud, None, out).expect("stored");
            stored(out)
        };
        assert_eq!(derive(&folder.path().join("none")), None, "control: there is none");
        store(&scene, None, Some(&path(1.0))).expect("stored");
        assert_eq!(derive(&out), Some(path(1.0)));
    }
}
