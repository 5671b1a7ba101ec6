//! Small pictures of a scene's objects and parts, as its first view sees them.

use super::JobError;
use crate::pipeline::semantics::thumbnails::{Thumbnails, portraits};
use crate::render::RenderSettings;
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{GaussianCloud, HomeView, SemanticMap};

/// Draws every object and part alone, by number less one.
pub(crate) fn draw(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    settings: &RenderSettings,
    home: &HomeView,
) -> Result<Thumbnails, JobError> {
    let from = home.camera.as_ref().map_or(home.bounds.center() + home.up, |c| c.center);
    resource_log::record(ResourceKind::Thumbnails, "portraits of objects and parts", "a list of them is shown", 0);
    Ok(portraits(cloud, map, settings, from, home.up)?)
}
