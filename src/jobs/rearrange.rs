//! Moving, duplicating and recoloring objects and parts, and deleting Gaussians.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::edit::{self, EditRequest};
use super::{JobError, Scene, derived, measurements, open};
use crate::io::SceneFolder;
pub(crate) use crate::pipeline::splat_edit::{Arrangement, Grade, Placement, SplatEdit, apply};
use crate::scene::measurement::Measurement;
use crate::scene::{Camera, GaussianCloud, SceneFacts, SemanticMap};

/// Returns the Gaussians of `scene` and its objects and parts, if it has any, after an edit.
pub(crate) fn applied(scene: &Scene, edit: &SplatEdit) -> Result<(GaussianCloud, Option<SemanticMap>), JobError> {
    Ok(apply(&scene.cloud, scene.known_semantics()?.as_ref(), edit)?)
}

/// A change of the scene.
#[derive(Clone, Debug)]
pub enum SplatChange {
    /// An edit.
    Apply(SplatEdit),
    /// An edit of objects and parts of a scene that has no folder yet.
    Objects(EditRequest),
    /// Other Gaussians, with their objects and parts, for undo and redo.
    Restore(Arc<GaussianCloud>, Option<Arc<SemanticMap>>),
}

/// Request of the window. The opened scene stays unchanged: the first edit creates another one beside it, in which it
/// and all later edits are stored.
#[derive(Clone, Debug)]
pub struct RearrangeRequest {
    /// Path and name of the scene on screen.
    pub(crate) path: PathBuf,
    pub(crate) name: String,
    /// True if an edit has created that scene.
    pub(crate) is_edited: bool,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Option<Arc<SemanticMap>>,
    pub(crate) change: SplatChange,
    /// Measurements on screen.
    pub(crate) measurements: Vec<Measurement>,
    /// Facts about the scene, and the photos' cameras.
    pub(crate) facts: SceneFacts,
    pub(crate) cameras: Vec<Camera>,
}

/// An edited scene.
#[derive(Clone, Debug)]
pub struct RearrangedScene {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// Its folder, its name, and the id of its state.
    pub(crate) folder: PathBuf,
    pub(crate) name: String,
    pub(crate) state: String,
    pub(crate) facts: SceneFacts,
    /// Ids of the measurements that no longer hold.
    pub(crate) stale: BTreeSet<u32>,
}

/// Applies a change and stores the result; `known` is the state in which the edited scene was last read.
///
/// # Errors
/// If the edit is invalid or cannot be stored; nothing has changed then.
pub(crate) fn run(request: &RearrangeRequest, known: Option<&str>) -> Result<RearrangedScene, JobError> {
    let RearrangeRequest { path, cloud, map, .. } = request;
    // Photos show the scene as it is if only its objects differ.
    let moved = !matches!(request.change, SplatChange::Objects(_));
    let (cloud, map, stale) = match &request.change {
        SplatChange::Objects(change) => {
            let before = map.as_deref().ok_or_else(|| JobError::NoObjects(path.clone()))?;
            (Arc::clone(cloud), Some(edit::apply(cloud, before, change)?), BTreeSet::new())
        }
        // Their measurements are restored, too.
        SplatChange::Restore(cloud, map) => (Arc::clone(cloud), map.clone(), BTreeSet::new()),
        SplatChange::Apply(edit) => {
            let (edited, map) = apply(cloud, map.as_deref(), edit)?;
            let stale = measurements::stale(&request.measurements, cloud, &edited);
            (Arc::new(edited), map.map(Arc::new), stale)
        }
    };
    let (folder, name, state) = match request.is_edited {
        true => {
            let held = SceneFolder::hold(path, "storing an edit")?;
            (path.clone(), request.name.clone(), held.save_edited(known, map.as_deref(), &cloud)?)
        }
        false => {
            let (scene, folder) = (open::scene(path)?, derived::free_folder(path, derived::EDITED));
            let name = derived::name(&request.name, derived::EDITED, &folder);
            let state = derived::store(&scene, (name.clone(), moved), &cloud, map.as_deref(), &folder)?;
            (folder, name, state)
        }
    };
    let facts = request.facts.clone().with_edited(&cloud, &request.cameras);
    Ok(RearrangedScene { cloud, map, folder, name, state, facts, stale })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::{copied, samples};
    use crate::pipeline::semantics::lifting::edit::Edit;

    #[test]
    fn the_first_edit_of_objects_makes_a_scene_of_a_result() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("run");
        copied(&samples().join("gaussian_grouping"), &path);
        let scene = open::scene(&path).expect("opens");
        let map = scene.semantics().expect("its classes");
        let request = |change| RearrangeRequest {
            path: path.clone(),
            name: "run".into(),
            is_edited: false,
            cloud: Arc::clone(&scene.cloud),
            map: Some(Arc::new(map.clone())),
            change: SplatChange::Objects(EditRequest::Apply(change)),
            measurements: Vec::new(),
            facts: SceneFacts::default(),
            cameras: Vec::new(),
        };
        let done = run(&request(Edit::Rename(1, "kettle".into())), None).expect("stored");
        assert_eq!((done.folder.clone(), done.name.as_str()), (folder.path().join("run-edited"), "run edited"));
        assert!(Arc::ptr_eq(&done.cloud, &scene.cloud), "the Gaussians are the same");
        let stored = open::scene(&done.folder).expect("opens");
        assert_eq!((stored.edited, stored.cameras.len()), (false, 2), "photos show it as it is");
        assert_eq!(stored.semantics().expect("objects").identities.name(1), "kettle");
        // The control: an edit that makes no sense stores nothing.
        assert!(run(&request(Edit::Rename(9, "x".into())), None).is_err());
        assert!(!folder.path().join("run-edited-2").exists());
    }
}
