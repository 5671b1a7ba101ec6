//! Small pictures of a scene's objects and parts in its first view, and the appearance of those without a name.

use super::JobError;
use crate::pipeline::semantics::thumbnails::{Thumbnails, draw_thumbnails};
use crate::render::RenderSettings;
use crate::scene::appearance::{self, Appearance};
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{GaussianCloud, HomeView, SemanticMap};

/// Pictures and appearances of objects and parts, by number less one.
#[derive(Clone, Debug)]
pub struct ThumbnailSet {
    pub(crate) pictures: Thumbnails,
    /// Appearance of identities without a name.
    pub(crate) appearances: Vec<Option<Appearance>>,
}

/// Draws every object and part by itself.
pub(crate) fn draw(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    settings: &RenderSettings,
    home: &HomeView,
) -> Result<ThumbnailSet, JobError> {
    let from = home.camera.as_ref().map_or(home.bounds.center() + home.up, |c| c.center);
    resource_log::record(ResourceKind::Thumbnails, "thumbnails of objects and parts", "a list of them is shown", 0);
    let appearances = appearance::of_unnamed(cloud, map);
    Ok(ThumbnailSet { pictures: draw_thumbnails(cloud, map, settings, from, home.up)?, appearances })
}
