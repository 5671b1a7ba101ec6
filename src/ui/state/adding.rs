//! Reasons why no photos can be added to the open scene.

use super::AppState;
use crate::scene::Photo;

impl AppState {
    /// Reason why no photos can be added to the scene, as a sentence; `None` if they can be.
    pub(crate) fn why_no_added_photos(&self) -> Option<String> {
        let Some(scene) = &self.scene else {
            return Some("Open a trained scene first: photos are added to it.".into());
        };
        if let Some(origin) = &scene.remote {
            return Some(format!("The scene is on {}; run 'fmlgs add' there.", origin.host));
        }
        if let Some(job) = &self.job {
            return Some(format!("{} is still running; stop it first (Esc).", job.info.title));
        }
        let has_photos = || scene.dataset.as_ref().is_some_and(|data| data.photos.iter().any(Photo::has_pixels));
        let why = match (self.is_trained(), scene.is_stored()) {
            (false, _) => "Train the scene first: photos are added to a trained one.",
            (true, false) => {
                "The scene has no folder of its own: photos are added to scenes that this program trained."
            }
            (true, true) if !has_photos() => {
                "The scene's own photos are not here: they are trained on beside new ones."
            }
            (true, true) => return None,
        };
        Some(why.into())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::jobs::OpenedScene;
    use crate::jobs::open::Origin;
    use crate::scene::{Camera, Dataset};
    use crate::ui::state::RunningJob;
    use crate::worker::{JobId, JobInfo};

    /// A trained scene in this folder, with a photo of this path.
    fn scene(folder: &Path, photo: &str) -> OpenedScene {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let dataset = Dataset { photos: vec![Photo::new("a.jpg", photo, camera)], ..Dataset::default() };
        OpenedScene { dataset: Some(Arc::new(dataset)), trained: true, out: folder.into(), ..OpenedScene::default() }
    }

    #[test]
    fn photos_are_added_to_a_trained_scene_with_its_folder_and_its_photos() {
        let folder = tempfile::tempdir().expect("a folder");
        let why = |scene: OpenedScene| {
            let mut state = AppState::new(Vec::new());
            state.opened(scene, true);
            state.why_no_added_photos().unwrap_or_default()
        };
        let whole = || scene(folder.path(), "/photos/a.jpg");
        assert!(
            AppState::new(Vec::new()).why_no_added_photos().is_some_and(|why| why.contains("Open a trained scene"))
        );
        assert!(why(whole()).contains("no folder of its own"), "nothing is stored there yet");
        std::fs::write(folder.path().join("scene.json"), "{}").expect("written");
        assert_eq!(why(whole()), "", "the control: now it can be");
        assert!(why(OpenedScene { trained: false, ..whole() }).contains("Train the scene first"));
        assert!(why(OpenedScene { dataset: None, ..whole() }).contains("own photos are not here"));
        assert!(why(scene(folder.path(), "")).contains("own photos are not here"), "of a photo the camera alone");
        let origin = Origin { host: "far".into(), allow_edit: false, photos: true };
        assert!(why(OpenedScene { remote: Some(origin), ..whole() }).contains("is on far"));
    }

    #[test]
    fn a_job_that_runs_is_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("scene.json"), "{}").expect("written");
        let mut state = AppState::new(Vec::new());
        state.opened(scene(folder.path(), "/photos/a.jpg"), true);
        assert_eq!(state.why_no_added_photos(), None, "the control");
        state.job = Some(RunningJob::begun(JobId::Local(1), JobInfo::long("Measuring")));
        assert!(state.why_no_added_photos().is_some_and(|why| why.starts_with("Measuring is still running")));
    }
}
