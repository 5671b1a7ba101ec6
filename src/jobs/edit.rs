//! Edits of objects and parts, and storing them.

use std::path::Path;
use std::sync::Arc;

use super::JobError;
use crate::io::{SceneFolder, trained};
use crate::pipeline::semantics::lifting::edit::{self, Edit};
use crate::scene::{GaussianCloud, SemanticMap};

/// A change of the map.
#[derive(Clone, Debug)]
pub enum EditRequest {
    /// A correction.
    Apply(Edit),
    /// Another state of the map, for undo and redo.
    Restore(Arc<SemanticMap>),
}

/// Returns the map after the change.
///
/// # Errors
/// If the edit is invalid; nothing has changed then.
pub(crate) fn apply(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    request: &EditRequest,
) -> Result<Arc<SemanticMap>, JobError> {
    Ok(match request {
        EditRequest::Restore(map) => Arc::clone(map),
        EditRequest::Apply(edit) => Arc::new(edit::apply(map, cloud, edit)?),
    })
}

/// Returns full names of identities that lost all their Gaussians by a change, if it changed no numbers.
pub(crate) fn emptied(before: &SemanticMap, after: &SemanticMap) -> Vec<String> {
    edit::emptied(before, after).into_iter().map(|id| before.identities.full_name(id)).collect()
}

/// Stores the map of the scene in `folder`, last read in the state `known`. Returns its new state; `None` if nothing is
/// stored because there is no scene yet.
pub(crate) fn store(
    folder: &Path,
    known: Option<&str>,
    map: &SemanticMap,
    cloud: &GaussianCloud,
) -> Result<Option<String>, JobError> {
    if !trained::is_scene(folder) {
        return Ok(None);
    }
    let scene = SceneFolder::hold(folder, "storing an edit")?;
    Ok(Some(scene.save_map(known, map, cloud)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, NO_IDENTITY};

    #[test]
    fn an_edit_that_makes_no_sense_is_refused() {
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 3], -3.2, 3.0);
        let map = SemanticMap::from_identities(Identities::default(), vec![NO_IDENTITY; 3], vec![1.0; 3], vec![]);
        let add = Edit::AddPiece { of: NO_IDENTITY, name: "left".into(), gaussians: vec![0, 2] };
        let new = apply(&cloud, &map, &EditRequest::Apply(add)).expect("edited");
        assert_eq!((new.identities.name(1), new.sizes()[1]), ("left".into(), 2));
        let wrong = EditRequest::Apply(Edit::Split(7));
        assert!(matches!(apply(&cloud, &map, &wrong), Err(JobError::Edit(_))));
    }
}
