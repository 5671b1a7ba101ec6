//! Edits of objects and parts, painted ones included, and storing them.

use std::path::Path;
use std::sync::Arc;

use super::JobError;
use crate::io::{SceneFolder, trained};
use crate::pipeline::semantics::edit::{self, Edit};
use crate::pipeline::semantics::propagate::extend;
use crate::pipeline::semantics::votes::Votes;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId, Level, Mask, NOBODY, SemanticMap};

/// What is to be changed.
#[derive(Clone, Debug)]
pub enum EditRequest {
    /// A correction.
    Apply(Edit),
    /// What was painted in a view becomes a new piece.
    Paint {
        /// Whose piece; of nobody, an object.
        of: IdentityId,
        /// What it is called.
        name: String,
        /// The view.
        camera: Box<Camera>,
        /// Its painted pixels, of the view's size.
        mask: Mask,
    },
    /// Another state of the map: undo and redo.
    Restore(Arc<SemanticMap>),
}

/// The map after the change.
///
/// # Errors
/// If the edit makes no sense, or the view cannot be drawn; nothing has changed then.
pub(crate) fn apply(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    settings: &RenderSettings,
    request: &EditRequest,
) -> Result<Arc<SemanticMap>, JobError> {
    Ok(match request {
        EditRequest::Restore(map) => Arc::clone(map),
        EditRequest::Apply(edit) => Arc::new(edit::apply(map, cloud, edit)?),
        EditRequest::Paint { of, name, camera, mask } => {
            let gaussians = painted(cloud, camera, settings, mask)?;
            let edit = Edit::AddPiece { of: *of, name: name.clone(), gaussians };
            Arc::new(edit::apply(map, cloud, &edit)?)
        }
    })
}

/// Stores the map of the scene in `folder`, which is known in the state `known`. Returns its state then; `None`
/// if nothing is stored because there is no scene yet.
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

/// Steps between Gaussians over which those behind the paint belong to it.
const INHERITED_STEPS: f64 = 40.0;

/// Gaussians that the painted pixels show more than the others do, and those behind them that hang
/// together with them rather than with the others.
fn painted(
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
    mask: &Mask,
) -> Result<Vec<u32>, crate::render::RenderError> {
    let mut identities = Identities::default();
    let inside = identities.add(Level::Object, NOBODY, Vec::new());
    let labels: Vec<IdentityId> =
        (0..mask.width_px() * mask.height_px()).map(|i| if mask.contains(i) { inside } else { NOBODY }).collect();
    let mut votes = Votes::new(cloud.len());
    votes.add_view(&mut Renderer::new(), cloud, camera, settings, &labels)?;
    let mut assignments = votes.decide(&identities, 0.05);
    extend(cloud, &mut assignments, INHERITED_STEPS);
    Ok((0..cloud.len() as u32).filter(|&i| assignments[i as usize].identity == inside).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn painting_takes_what_the_paint_covers() {
        let n = 20;
        let cloud = GaussianCloud::isotropic((0..n).map(|i| [i as f32 * 0.1 - 0.95, 0.0, 0.0]).collect(), -3.2, 3.0);
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.9, 64, 64).expect("valid");
        let left = Mask::from_fn(64, 64, |i| i % 64 < 32);
        let settings = RenderSettings::default();
        let found = painted(&cloud, &camera, &settings, &left).expect("drawn");
        assert_eq!(found.len(), n / 2, "{found:?}");
        assert!(painted(&cloud, &camera, &settings, &Mask::empty(64, 64)).expect("drawn").is_empty());

        let map = SemanticMap::from_identities(Identities::default(), vec![NOBODY; n], vec![1.0; n], vec![]);
        let request = EditRequest::Paint { of: NOBODY, name: "left".into(), camera: Box::new(camera), mask: left };
        let Ok(new) = apply(&cloud, &map, &settings, &request) else {
            panic!("not edited");
        };
        assert_eq!((new.identities.name(1), new.sizes()[1]), ("left".into(), n / 2));
        let wrong = EditRequest::Apply(Edit::Split(7));
        assert!(matches!(apply(&cloud, &map, &settings, &wrong), Err(JobError::Edit(_))));
    }
}
