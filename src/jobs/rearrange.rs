//! Moving, duplicating and recoloring objects and parts, and deleting Gaussians.

use super::{JobError, Scene};
pub(crate) use crate::pipeline::splat_edit::{Placement, SplatEdit, apply};
use crate::scene::{GaussianCloud, SemanticMap};

/// The Gaussians of `scene` and its objects and parts, if it has any, after an edit.
pub(crate) fn applied(scene: &Scene, edit: &SplatEdit) -> Result<(GaussianCloud, Option<SemanticMap>), JobError> {
    let map = match scene.semantics() {
        Err(JobError::NoObjects(_)) => None,
        map => Some(map?),
    };
    Ok(apply(&scene.cloud, map.as_ref(), edit)?)
}
