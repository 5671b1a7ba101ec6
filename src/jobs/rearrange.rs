//! Moving, duplicating and recoloring objects and parts, and deleting Gaussians.

use std::path::PathBuf;
use std::sync::Arc;

use super::{JobError, Scene, derived, open};
use crate::io::SceneFolder;
pub(crate) use crate::pipeline::splat_edit::{Arrangement, Placement, SplatEdit, apply};
use crate::scene::{Camera, GaussianCloud, SceneFacts, SemanticMap};

/// The Gaussians of `scene` and its objects and parts, if it has any, after an edit.
pub(crate) fn applied(scene: &Scene, edit: &SplatEdit) -> Result<(GaussianCloud, Option<SemanticMap>), JobError> {
    Ok(apply(&scene.cloud, scene.known_semantics()?.as_ref(), edit)?)
}

/// What is to be changed.
#[derive(Clone, Debug)]
pub enum SplatChange {
    /// An edit.
    Apply(SplatEdit),
    /// Other Gaussians, with their objects and parts: undo and redo.
    Restore(Arc<GaussianCloud>, Option<Arc<SemanticMap>>),
}

/// What the window asks for. The scene that was opened stays as it is: the first edit makes another one beside it, in
/// which it is stored with all that follow.
#[derive(Clone, Debug)]
pub struct RearrangeRequest {
    /// Where the scene on screen lies, and what it is called.
    pub(crate) path: PathBuf,
    pub(crate) name: String,
    /// Whether that is one that an edit has made.
    pub(crate) is_edited: bool,
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Option<Arc<SemanticMap>>,
    pub(crate) change: SplatChange,
    /// What is known of the scene, and the photos' cameras.
    pub(crate) facts: SceneFacts,
    pub(crate) cameras: Vec<Camera>,
}

/// An edited scene.
#[derive(Clone, Debug)]
pub struct RearrangedScene {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// Where it is stored, what it is called, and the id of its state.
    pub(crate) folder: PathBuf,
    pub(crate) name: String,
    pub(crate) state: String,
    pub(crate) facts: SceneFacts,
}

/// Carries a change out and stores the result; `known` is the state in which the edited scene is known.
///
/// # Errors
/// If the edit makes no sense or cannot be stored; nothing has changed then.
pub(crate) fn run(request: &RearrangeRequest, known: Option<&str>) -> Result<RearrangedScene, JobError> {
    let RearrangeRequest { path, cloud, map, .. } = request;
    let (cloud, map) = match &request.change {
        SplatChange::Restore(cloud, map) => (Arc::clone(cloud), map.clone()),
        SplatChange::Apply(edit) => {
            let (cloud, map) = apply(cloud, map.as_deref(), edit)?;
            (Arc::new(cloud), map.map(Arc::new))
        }
    };
    let (folder, name, state) = match request.is_edited {
        true => {
            let held = SceneFolder::hold(path, "storing an edit")?;
            (path.clone(), request.name.clone(), held.save_edited(known, map.as_deref(), &cloud)?)
        }
        false => {
            let (scene, folder) = (open::scene(path)?, derived::free_folder(path, derived::EDITED));
            let name = format!("{} edited", request.name);
            let state = derived::store(&scene, (name.clone(), true), &cloud, map.as_deref(), &folder)?;
            (folder, name, state)
        }
    };
    let facts = request.facts.clone().with_edited(&cloud, &request.cameras);
    Ok(RearrangedScene { cloud, map, folder, name, state, facts })
}
